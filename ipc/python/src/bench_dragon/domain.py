"""Domain of an instance: its directory, and the prefix of its names."""

from pathlib import Path

from bench_dragon import _bus


class Domain:
    """iceoryx2 domain of an instance of the user who runs this process. The constructor accesses nothing on disk.

    Raises `DomainError` for a name that is not 1 to 24 characters of a-z, 0-9 and -. Raises it also for a root path that
    is relative, has 60 bytes or more, or has characters that iceoryx2 does not allow.
    """

    root: Path
    """The root path."""
    prefix: str
    """Prefix of all names of the domain in shared memory."""

    def __init__(self, instance: str) -> None:
        self.instance = instance
        """The instance's name."""
        self.root, self.prefix = _bus.domain(instance)

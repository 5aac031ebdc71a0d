"""Errors between a process and the bus. Each text is one line: the problem, the value and the remedy."""

from bench_dragon.codes import Refusal
from bench_dragon.wire import decoded


class BusError(Exception):
    """The bus cannot be joined, read or commanded. Base class of all errors of the bus."""


class NoServer(BusError):
    """No server publishes on this instance. `Show.source` reports whether its run has ended or was cut off."""


class NoAnswer(NoServer):
    """The server has not replied in time. It may have executed the command nevertheless."""


class HalfMade(NoServer):
    """A server was killed while it created a service. The next server removes the unfinished service."""


class DomainError(BusError):
    """The instance's name or its directory cannot be used."""


class VersionMismatch(BusError):
    """A service exists with another layout, or was made by another iceoryx2 version."""


class PermissionDenied(BusError):
    """A service exists, and this user may not open it."""


class TooManyClients(BusError):
    """The service has its greatest allowed number of clients."""


class TooManyFramesHeld(BusError):
    """This reader holds its greatest allowed number of frames, four. Keep copies instead: `frame.copy()`."""


class OutOfResources(BusError):
    """Shared memory or the limit of open files is too small for a client."""


class Refused(BusError):
    """The server refused a command. The text is the reason."""

    def __init__(self, text: str, refusal: int, run_id: int, tick: int, lowest: float, highest: float) -> None:
        super().__init__(text)
        self.refusal = decoded(Refusal, refusal) or Refusal.UNKNOWN
        """The reason."""
        self.run_id = run_id
        """The run of the server that refused it."""
        self.tick = tick
        """The tick at which it was refused."""
        self.lowest, self.highest = lowest, highest
        """Least and greatest allowed value, where the value was out of range; else 0."""

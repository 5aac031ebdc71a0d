"""Errors between a process and the bus. Each text is one line: the problem, the value and the remedy."""


class BusError(Exception):
    """The bus cannot be joined, read or commanded. Base class of all errors of the bus."""


class NoServer(BusError):
    """No server publishes on this instance."""

    def __init__(self, instance: str) -> None:
        super().__init__(f"no server runs on instance {instance!r}: start one with `bench-dragon serve`")


class NoAnswer(NoServer):
    """The server has not replied in time. It may have executed the command nevertheless."""

    def __init__(self, instance: str, waited_s: float) -> None:
        # Skips the text of `NoServer`: a server exists.
        text = f"the server on instance {instance!r} has not answered within {waited_s:g} s: it may have taken the command"
        BusError.__init__(self, text)


class HalfMade(NoServer):
    """A server was killed while it created a service. The next server removes the unfinished service."""


class DomainError(BusError):
    """The instance's name or its directory cannot be used."""


class MissingDirectory(DomainError):
    """The instance's directory does not exist: no server has run yet."""


class VersionMismatch(BusError):
    """A service exists with another layout, or was made by another iceoryx2 version."""

    def __init__(self, service: str) -> None:
        super().__init__(
            f"{service} has another layout than this package's: use the same version of bench-dragon on both sides"
        )


class PermissionDenied(BusError):
    """A service exists, and this user may not open it."""

    def __init__(self, service: str) -> None:
        super().__init__(f"permission denied on {service}: run as the user who runs the server")


class TooManyClients(BusError):
    """The service has its greatest allowed number of clients."""

    def __init__(self, service: str) -> None:
        super().__init__(f"{service} has as many clients as it allows: stop one of them")


class TooManyFramesHeld(BusError):
    """This reader holds its greatest allowed number of frames, four."""

    def __init__(self, limit: int) -> None:
        super().__init__(
            f"{limit} frames are held, the most that a reader may hold: release one, or keep copies instead, "
            "`frame.positions.copy()`"
        )


class OutOfResources(BusError):
    """Shared memory or the limit of open files is too small for a client."""

"""What can go wrong between a process and the bus. Each text is one line: what, the value, what is to be done."""


class BusError(Exception):
    """The bus cannot be joined, read or commanded."""


class NoServer(BusError):
    """Nothing is published on this instance."""

    def __init__(self, instance: str) -> None:
        super().__init__(f"no server runs on instance {instance!r}: start one with `bench-dragon serve`")


class NoAnswer(NoServer):
    """The server has not answered in time. It may have taken the command all the same."""

    def __init__(self, instance: str, waited_s: float) -> None:
        # Not what `NoServer` says: there is a server.
        text = f"the server on instance {instance!r} has not answered within {waited_s:g} s: it may have taken the command"
        BusError.__init__(self, text)


class HalfMade(NoServer):
    """A server was killed while it made a service. The next server clears that away."""


class DomainError(BusError):
    """The instance's name or its directory cannot be used."""


class MissingDirectory(DomainError):
    """The instance's directory is not there: no server has been there yet."""


class VersionMismatch(BusError):
    """A service is there, with another layout or from another iceoryx2 version."""

    def __init__(self, service: str) -> None:
        super().__init__(
            f"{service} has another layout than this package's: use the same version of bench-dragon on both sides"
        )


class PermissionDenied(BusError):
    """A service is there, and this user may not open it."""

    def __init__(self, service: str) -> None:
        super().__init__(f"permission denied on {service}: run as the user who runs the server")


class TooManyClients(BusError):
    """As many clients as the service allows are connected."""

    def __init__(self, service: str) -> None:
        super().__init__(f"{service} has as many clients as it allows: stop one of them")


class TooManyFramesHeld(BusError):
    """This reader holds as many frames as it may."""

    def __init__(self, limit: int) -> None:
        super().__init__(
            f"{limit} frames are held, the most that a reader may hold: let go of one, or keep copies instead, "
            "`frame.positions.copy()`"
        )


class OutOfResources(BusError):
    """The machine or this process's limits leave too little for a client."""

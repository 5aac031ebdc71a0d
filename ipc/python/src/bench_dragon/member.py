"""A process's membership in a domain, and the ports that it opens there."""

import atexit
import ctypes
import weakref
from collections.abc import Callable
from typing import Any, TypeVar

import iceoryx2 as iox2

from bench_dragon.dead_nodes import remove_dead_nodes
from bench_dragon.domain import Domain
from bench_dragon.errors import (
    BusError,
    DomainError,
    HalfMade,
    MissingDirectory,
    NoServer,
    PermissionDenied,
    TooManyClients,
    VersionMismatch,
)
from bench_dragon.inheritance import Heirloom, never_destroy
from bench_dragon.membership import Membership
from bench_dragon.resources import require_open_files, require_shared_memory
from bench_dragon.subscriber import Subscriber

FRAMES = "bench-dragon/frames"
"""Name of the frames: a publish-subscribe service, and an event service of the same name for the wake-up."""
DESCRIPTION = "bench-dragon/description"
"""Name of the description."""
STATUS = "bench-dragon/status"
"""Name of the status."""
ALERTS = "bench-dragon/alerts"
"""Name of the alerts: a publish-subscribe service, and an event service of the same name for the wake-up."""
COMMANDS = "bench-dragon/commands"
"""Name of the commands."""

Opened = TypeVar("Opened")

# If a frame is held at the end of the process, its node finds that the last member to leave has removed the domain.
# This is correct and needs no warning.
atexit.register(iox2.set_log_level, iox2.LogLevel.Fatal)


class Member(Heirloom):
    """A process's membership in a domain. It lasts until its last reference is gone, or until the process ends.

    Only the server creates services; a member opens existing ones. A forked child is no member.
    """

    def __init__(self, domain: Domain, name: str) -> None:
        """Joins under a node name that `iox2 node list` shows.

        Raises `NoServer` if the domain is empty, `DomainError`, `PermissionDenied`, `OutOfResources`, and `BusError`
        for a name that iceoryx2 does not allow.
        """
        self.instance = domain.instance
        """The instance's name."""
        require_open_files()
        try:
            domain.check_directory()
            _require_services(domain)
            require_shared_memory()
            membership = Membership(domain)
        except MissingDirectory as error:
            raise NoServer(domain.instance) from error
        try:
            node = _create_node(domain, name)
        except BaseException:
            membership.leave()
            raise
        self.is_inherited = False
        """Whether this process is a forked child of the one that joined."""
        self._nodes = [node]
        self._ports: list[Any] = []
        self._membership = membership
        # Also called at the end of the process, where Python does not destroy iceoryx2's objects by itself.
        self._leaving = weakref.finalize(self, _leave, self._nodes, membership)
        super().__init__()

    def subscriber(self, service: str, payload: Any, user_header: Any = None) -> Subscriber:
        """Opens a reader of a publish-subscribe service.

        Raises, like every port: `NoServer`, `HalfMade`, `VersionMismatch`, `PermissionDenied`, `TooManyClients`,
        `BusError`.
        """

        def create() -> Any:
            builder = self._service(service).publish_subscribe(payload)
            if user_header is not None:
                builder = builder.user_header(user_header)
            return builder.open().subscriber_builder().create()

        return Subscriber(service, self._open(service, create))

    def listener(self, service: str) -> Any:
        """Opens a listener on an event service."""
        return self._open(service, lambda: self._service(service).event().open().listener_builder().create())

    def client(self, service: str, request: type[ctypes.Structure], response: type[ctypes.Structure]) -> Any:
        """Opens a client that sends requests to a service."""
        return self._open(
            service,
            lambda: self._service(service).request_response(request, response).open().client_builder().create(),
        )

    def close_ports(self) -> None:
        """Closes all ports. Received values and frames stay valid."""
        while self._ports:
            self._ports.pop().delete()

    def disown(self) -> None:
        """Leaves all iceoryx2 objects to the parent process."""
        self.is_inherited = True
        for thing in (*self._nodes, *self._ports):
            never_destroy(thing)
        self._ports.clear()
        if self._leaving.detach():
            self._membership.disown()

    def _service(self, name: str) -> Any:
        return self._nodes[0].service_builder(iox2.ServiceName.new(name))

    def _open(self, service: str, create: Callable[[], Opened]) -> Opened:
        try:
            port = create()
        except _OPEN_ERRORS as error:
            raise self._sorted(service, error) from error
        self._ports.append(port)
        return port

    def _sorted(self, service: str, error: Exception) -> BusError:
        """Converts an error of iceoryx2, by the name of its variant."""
        match str(error):
            # `IsMarkedForDestruction`: another process is removing the service at this moment.
            case "DoesNotExist" | "IsMarkedForDestruction":
                return NoServer(self.instance)
            case "HangsInCreation":
                return HalfMade(self.instance)
            case (
                "IncompatibleTypes"
                | "IncompatibleRequestOrResponseType"
                | "IncompatibleMessagingPattern"
                | "VersionMismatch"
            ):
                return VersionMismatch(service)
            case "InsufficientPermissions":
                return PermissionDenied(service)
            case (
                "ExceedsMaxNumberOfNodes"
                | "ExceedsMaxSupportedSubscribers"
                | "ExceedsMaxSupportedListeners"
                | "ExceedsMaxSupportedClients"
            ):
                return TooManyClients(service)
            case reason:
                return BusError(f"{service}: {reason}")


_OPEN_ERRORS = (
    iox2.PublishSubscribeOpenError,
    iox2.EventOpenError,
    iox2.RequestResponseOpenError,
    iox2.SubscriberCreateError,
    iox2.ListenerCreateError,
    iox2.ClientCreateError,
)


def _require_services(domain: Domain) -> None:
    """Checks that there are services to open. This is cheaper than joining, and a waiting client calls it often."""
    path = domain.root / "services"
    try:
        if any(path.iterdir()):
            return
    except FileNotFoundError:
        pass
    raise MissingDirectory(f"{path} is empty")


def _create_node(domain: Domain, name: str) -> Any:
    try:
        domain.set_fallback_configuration()
        remove_dead_nodes(domain)
        builder = iox2.NodeBuilder.new().name(iox2.NodeName.new(name)).config(domain.iceoryx2_config())
        return builder.signal_handling_mode(iox2.SignalHandlingMode.Disabled).create(iox2.ServiceType.Ipc)
    except iox2.NodeCreationFailure as error:
        if str(error) == "InsufficientPermissions":
            raise PermissionDenied("the domain") from error
        raise BusError(f"the domain: {error}") from error
    except iox2.SemanticStringError as error:
        raise BusError(f"the node's name is {name!r}, must be at most 128 bytes") from error
    except OSError as error:
        raise DomainError(f"{error.filename}: {error.strerror}") from error


def _leave(nodes: list[Any], membership: Membership) -> None:
    # If a frame is held at the end of the process, the node outlives this call.
    nodes.clear()
    membership.leave()

"""The dragon of an instance: its frames, description, status and alerts, and commands to its server."""

import time
import weakref
from collections.abc import Iterator
from types import TracebackType
from typing import Self

from bench_dragon.alert import Alert
from bench_dragon.command import CommandKind, Refusal, Refused
from bench_dragon.continuity import ContinuityTracker
from bench_dragon.deadline import Deadline
from bench_dragon.description import Description
from bench_dragon.domain import Domain
from bench_dragon.errors import NoServer
from bench_dragon.frame import Frame
from bench_dragon.member import Member
from bench_dragon.patience import look
from bench_dragon.ports import Ports
from bench_dragon.status import Status

_TIMEOUT_S = 5.0
_PROOF_PERIOD_S = 0.02


class Dragon:
    """Client of an instance: reads its frames, oldest first, and commands its server.

    No reader ever delays the server. A reader that falls behind loses its own oldest frames, and counts them in `lost`.
    A dragon outlives a server: the frames of the next server follow with `Continuity.RESTARTED`.

    Use it in a `with` block, or call `close`. Only one thread at a time may use a dragon.

    A forked child must open its own dragon. The inherited one does no harm to the parent, even when the child exits.
    In the child, `close` has no effect, and other methods raise `ValueError`. Inherited arrays stay valid only while
    the parent keeps its own.

    Every method raises `BusError` or a subclass if the bus cannot be used.

    >>> with Dragon("dragon") as dragon:  # doctest: +SKIP
    ...     for frame in dragon:
    ...         x, y, _ = frame.positions[0]
    """

    def __init__(self, instance: str = "dragon", *, timeout_s: float | None = None, name: str = "python") -> None:
        """Joins an instance under a node name that `iox2 node list` shows. Frames are received from then on.

        `instance` is 1 to 24 characters of a-z, 0-9 and -. If no server runs yet, waits for one at most `timeout_s`
        seconds: 0 does not wait, `None` waits without a limit.

        Raises `NoServer` if no server appears in time, `DomainError` for a bad name or an unusable directory, and
        `VersionMismatch`, `PermissionDenied`, `TooManyClients` or `OutOfResources`.
        """
        self.instance = instance
        """The instance's name."""
        self._tracker = ContinuityTracker()
        self._open_ports: Ports | None = _join(Domain(instance), name, self._tracker, Deadline(timeout_s))
        self._close_ports = weakref.finalize(self, self._open_ports.member.close_ports)

    def __iter__(self) -> Iterator[Frame]:
        return self.frames()

    def frames(self, timeout_s: float | None = None) -> Iterator[Frame]:
        """Yields frame after frame, oldest first. Waits for each at most `timeout_s` seconds; `None` for no limit.

        A frame that the loop does not keep is released when the loop receives the next one. Raises `NoServer` if no
        frame arrives in time; other errors as `receive`.
        """
        while True:
            # No variable holds the frame, so the caller has the only reference.
            yield self._next_frame(timeout_s)

    def receive(self) -> Frame | None:
        """Returns the oldest unread frame, or `None` if all are read. Never waits.

        Raises `TooManyFramesHeld` if four frames are held, and `VersionMismatch` if the number of handles of a frame
        contradicts its header.
        """
        return self._ports.frames.receive()

    def latest(self) -> Frame | None:
        """Returns the newest unread frame, or `None` if all are read. Never waits. Older frames are dropped unread and
        do not count as lost. Raises as `receive`."""
        return self._ports.frames.latest()

    def wait(self, timeout_s: float | None = None) -> Frame | None:
        """Returns the oldest unread frame. Waits for one at most `timeout_s` seconds; `None` for no limit.

        Other threads run during the wait. Returns `None` if no frame arrives in time. Raises as `receive`.

        From the first wait on, each frame costs the server one system call for this reader. A reader that only polls
        costs none.
        """
        return self._ports.frames.wait(Deadline(timeout_s))

    @property
    def lost(self) -> int:
        """Number of lost frames: published between the first and the last frame that this reader has read, but not
        received by it."""
        return self._tracker.lost

    def description(self, timeout_s: float | None = _TIMEOUT_S) -> Description:
        """Returns the configuration of the latest run.

        Waits only if no description has arrived yet, at most `timeout_s` seconds; `None` for no limit. A running server
        sends the description within a tenth of a second. If none runs, the call also waits for a server. Raises
        `NoServer` if no description arrives in time.

        The description of a server that has ended is returned until the next server publishes its own.
        """
        return look(Deadline(timeout_s), lambda: self._ports.descriptions.read())

    def status(self, timeout_s: float | None = _TIMEOUT_S) -> Status:
        """Returns the server's latest status. The server publishes ten a second.

        Waits only if no status has arrived yet, at most `timeout_s` seconds, as `description` does. Raises `NoServer` if
        no status arrives in time.

        The last status of a server that has ended is returned until the next server publishes one. Its `run_id`
        distinguishes the two.
        """
        return look(Deadline(timeout_s), lambda: self._ports.statuses.read())

    def alerts(self, timeout_s: float | None = 0.0) -> list[Alert]:
        """Returns the alerts since the last call, oldest first. Alerts are received from the first call on.

        If there are none, waits for one at most `timeout_s` seconds: 0 does not wait, `None` waits without a limit.
        Returns an empty list if none arrives in time.

        Raises `NoServer` if the first call finds no server in time. The next call then counts as the first.
        """
        deadline = Deadline(timeout_s)
        return look(deadline, lambda: self._ports.alerts).read(deadline)

    def pause(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Stops the walk until `resume`.

        Returns, like every command, the tick from which it holds: the server replies at the start of its next tick.
        Raises `Refused` with the reason if the server refuses the command. Raises `NoAnswer` if the server does not
        reply within `timeout_s` seconds (`None` for no limit); it may have executed the command nevertheless.

        No command waits for a server: if none runs, `NoServer` is raised at once. If the server was killed while this
        dragon is open, `NoAnswer` is raised after the timeout.
        """
        return self._call(CommandKind.PAUSE, 0.0, timeout_s)

    def resume(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Walks on after `pause`. Returns and raises as `pause`."""
        return self._call(CommandKind.RESUME, 0.0, timeout_s)

    def speed(self, speed_mps: float, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Walks at this speed of the head, in metres per show second, 0 to 10. Returns and raises as `pause`."""
        return self._call(CommandKind.SPEED, speed_mps, timeout_s)

    def seek(self, sim_time_s: float, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Seeks to this show time, in seconds. Returns and raises as `pause`.

        If the guard of a guarded server has not yet proved that the benches are apart there, sends the command again
        until it has. All attempts together take at most `timeout_s` seconds.
        """
        deadline = Deadline(timeout_s)
        slowest_s = 0.0
        while True:
            asked_s = time.monotonic()
            try:
                return self._ports.commands.call(CommandKind.SEEK, sim_time_s, deadline)
            except Refused as refused:
                slowest_s = max(slowest_s, time.monotonic() - asked_s)
                # A reply that arrives after the deadline would leave open whether the seek was executed.
                if refused.refusal is not Refusal.NOT_PROVED or deadline.left_s() <= _PROOF_PERIOD_S + slowest_s:
                    raise
            deadline.sleep(_PROOF_PERIOD_S)

    def hold(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Stops for safety. Only `release` lifts the hold. Returns and raises as `pause`."""
        return self._call(CommandKind.HOLD, 0.0, timeout_s)

    def release(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Lifts a `hold`. Returns and raises as `pause`."""
        return self._call(CommandKind.RELEASE, 0.0, timeout_s)

    def stop(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Ends the server: the head comes to rest first. Returns and raises as `pause`."""
        return self._call(CommandKind.STOP, 0.0, timeout_s)

    def close(self) -> None:
        """Leaves the instance. `lost` can still be read. Arrays that are kept stay valid, and the process remains in
        the instance until it has released the last one."""
        self._close_ports()
        self._open_ports = None

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    @property
    def _ports(self) -> Ports:
        if self._open_ports is None:
            raise ValueError(f"the dragon of instance {self.instance!r} is closed")
        if self._open_ports.member.is_inherited:
            raise ValueError(f"the dragon of instance {self.instance!r} was opened in another process: open one here")
        return self._open_ports

    def _next_frame(self, timeout_s: float | None) -> Frame:
        frame = self.wait(timeout_s)
        if frame is None:
            raise NoServer(self.instance)
        return frame

    def _call(self, kind: CommandKind, value: float, timeout_s: float | None) -> int:
        return self._ports.commands.call(kind, value, Deadline(timeout_s))


def _join(domain: Domain, name: str, tracker: ContinuityTracker, deadline: Deadline) -> Ports:
    """Opens the frames of a domain as soon as they exist, until the deadline."""
    return look(deadline, lambda: Ports(Member(domain, name), tracker))

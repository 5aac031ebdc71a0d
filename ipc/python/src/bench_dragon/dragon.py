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

_PATIENCE_S = 5.0
_PROOF_PERIOD_S = 0.02


class Dragon:
    """Reads the frames of an instance, oldest first, and commands its server.

    No reader ever delays the server: one that falls behind loses its own oldest frames, and counts them in `lost`. A
    dragon outlives a server; the frames of the next one follow as `Continuity.RESTARTED`.

    Use it in a `with` block, or call `close`. One thread uses a dragon at a time, in the process that opened it. A
    forked child opens one of its own: whatever it does with this one, exits with it included, does nothing to its
    parent. `close` does nothing there, other methods raise `ValueError`, and arrays stay as they are only for as long
    as the parent keeps its own.

    Every method raises `BusError`, or what is made of it, where the bus cannot be used.

    >>> with Dragon("dragon") as dragon:  # doctest: +SKIP
    ...     for frame in dragon:
    ...         x, y, _ = frame.positions[0]
    """

    def __init__(self, instance: str = "dragon", *, timeout_s: float | None = None, name: str = "python") -> None:
        """Joins an instance under a name that `iox2 node list` shows. Its frames are received from then on.

        Where there is no server yet, waits for one at most `timeout_s` seconds: 0 not at all, `None` for as long as it
        takes. Raises `NoServer` where none has come, and `DomainError`, `VersionMismatch`, `PermissionDenied`,
        `TooManyClients`, `OutOfResources`.
        """
        self.instance = instance
        """The instance's name."""
        self._tracker = ContinuityTracker()
        self._open_ports: Ports | None = _join(Domain(instance), name, self._tracker, Deadline(timeout_s))
        self._close_ports = weakref.finalize(self, self._open_ports.member.close_ports)

    def __iter__(self) -> Iterator[Frame]:
        return self.frames()

    def frames(self, timeout_s: float | None = None) -> Iterator[Frame]:
        """Frame after frame, oldest first, waiting for each at most `timeout_s` seconds: `None` for as long as it
        takes.

        A frame that is not kept is let go of when the loop has the next one. Raises `NoServer` where none has come in
        time; the others as `receive`.
        """
        while True:
            # Not by a variable: the frame is the caller's alone.
            yield self._next_frame(timeout_s)

    def receive(self) -> Frame | None:
        """The oldest frame that has not been read yet, or `None` where all are read. Never waits.

        Raises `TooManyFramesHeld`, and `VersionMismatch` for a frame whose number of handles is not its header's.
        """
        return self._ports.frames.receive()

    def latest(self) -> Frame | None:
        """The newest frame, or `None` where all are read. Never waits. Those before it are dropped unread, and do not
        count as lost. Raises as `receive`."""
        return self._ports.frames.latest()

    def wait(self, timeout_s: float | None = None) -> Frame | None:
        """The oldest frame that has not been read yet, waiting for it at most `timeout_s` seconds: `None` for as long
        as it takes. Other threads run meanwhile. `None` where none has come in time. Raises as `receive`.

        From the first wait on, each frame costs the server a system call for this reader; one that only polls costs
        none.
        """
        return self._ports.frames.wait(Deadline(timeout_s))

    @property
    def lost(self) -> int:
        """Frames that were published between the first one read and the last, and that this reader never got."""
        return self._tracker.lost

    def description(self, timeout_s: float | None = _PATIENCE_S) -> Description:
        """The latest run's configuration. Waits for the first one alone, at most `timeout_s` seconds: `None` for as
        long as it takes. That is a tenth of a second with a server there; where there is none yet, it is waited for as
        well. Raises `NoServer` where none has come.

        That of a server that has ended stays the latest until the next one publishes its own.
        """
        return look(Deadline(timeout_s), lambda: self._ports.descriptions.read())

    def status(self, timeout_s: float | None = _PATIENCE_S) -> Status:
        """The server's latest report: there are ten a second, and the same one is returned until the next has come.
        Waits for the first one alone, at most `timeout_s` seconds, as `description` does. Raises `NoServer` where none
        has come.

        The last report of a server that has ended stays the latest until the next one's: `run_id` tells them apart.
        """
        return look(Deadline(timeout_s), lambda: self._ports.statuses.read())

    def alerts(self, timeout_s: float | None = 0.0) -> list[Alert]:
        """The alerts since the last call, oldest first, and since the first call those that came after it. Where there
        are none, waits for one at most `timeout_s` seconds: 0 not at all, `None` for as long as it takes.

        Raises `NoServer` where the first call has found no server in that time: it does not count as the first then.
        """
        deadline = Deadline(timeout_s)
        return look(deadline, lambda: self._ports.alerts).read(deadline)

    def pause(self, timeout_s: float | None = _PATIENCE_S) -> int:
        """Stops walking until `resume`.

        Returns, as every command, the tick from which it holds: a server answers at the start of its next tick. Raises
        `Refused` where the server has a reason against it, and `NoAnswer` where it has not answered within `timeout_s`
        seconds: it may have taken the command. No command waits for a server: where there is none, `NoServer` is raised
        at once. That one was killed an open dragon learns by its silence, `NoAnswer`.
        """
        return self._call(CommandKind.PAUSE, 0.0, timeout_s)

    def resume(self, timeout_s: float | None = _PATIENCE_S) -> int:
        """Goes on after `pause`."""
        return self._call(CommandKind.RESUME, 0.0, timeout_s)

    def speed(self, speed_mps: float, timeout_s: float | None = _PATIENCE_S) -> int:
        """Walks at this speed of the head, in metres per show second, 0 to 10."""
        return self._call(CommandKind.SPEED, speed_mps, timeout_s)

    def seek(self, sim_time_s: float, timeout_s: float | None = _PATIENCE_S) -> int:
        """Goes to this show time, in seconds. A server whose guard has still to prove that the benches are apart there
        is asked again until it has, for as long as there is time for another answer: `timeout_s` seconds in all."""
        deadline = Deadline(timeout_s)
        slowest_s = 0.0
        while True:
            asked_s = time.monotonic()
            try:
                return self._ports.commands.call(CommandKind.SEEK, sim_time_s, deadline)
            except Refused as refused:
                slowest_s = max(slowest_s, time.monotonic() - asked_s)
                # An answer that time cuts off would leave open whether the seek was taken.
                if refused.refusal is not Refusal.NOT_PROVED or deadline.left_s() <= _PROOF_PERIOD_S + slowest_s:
                    raise
            deadline.sleep(_PROOF_PERIOD_S)

    def hold(self, timeout_s: float | None = _PATIENCE_S) -> int:
        """Stops for safety; only `release` lifts it."""
        return self._call(CommandKind.HOLD, 0.0, timeout_s)

    def release(self, timeout_s: float | None = _PATIENCE_S) -> int:
        """Lifts a `hold`."""
        return self._call(CommandKind.RELEASE, 0.0, timeout_s)

    def stop(self, timeout_s: float | None = _PATIENCE_S) -> int:
        """Ends the server."""
        return self._call(CommandKind.STOP, 0.0, timeout_s)

    def close(self) -> None:
        """Leaves the instance; `lost` can still be read. Arrays that are kept stay valid, and the process stays in the
        instance until the last one is let go of."""
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
    """Opens the frames of a domain as soon as there are any."""
    return look(deadline, lambda: Ports(Member(domain, name), tracker))

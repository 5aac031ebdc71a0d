"""The client of an instance: its frames, description, status and alerts, and commands to its server."""

import asyncio
import atexit
import logging
import math
import os
import time
import weakref
from collections.abc import AsyncIterator, Iterator
from types import TracebackType
from typing import Self

from bench_dragon import _bus
from bench_dragon.alert import Alert
from bench_dragon.codes import CommandKind, Refusal
from bench_dragon.command_event import CommandEvent
from bench_dragon.description import Description
from bench_dragon.dragons import Dragons
from bench_dragon.errors import NoServer, Refused
from bench_dragon.frame import Frame
from bench_dragon.source import SourceState
from bench_dragon.status import Status

_LOG = logging.getLogger("bench_dragon")
_TIMEOUT_S = 5.0
_LIMIT_S = 1.0
_PROOF_PERIOD_S = 0.02


class Show:
    """Client of an instance: reads its frames, oldest first, and commands its server.

    No reader ever delays the server. A reader that falls behind loses its own oldest frames, and counts them in `lost`.
    A client outlives a server: the frames of the next server follow with `Continuity.RESTARTED`.

    Use it in a `with` block, or call `close`. Any thread may use a client, also while other threads wait; each frame
    goes to one of the threads that read. A client lends four frames in all, and a loop holds two. `close` from any
    thread ends every wait with `ValueError`. For asyncio, use `async for frame in show`; for other event loops,
    `fileno`.

    A forked child must open its own client. The inherited one does no harm to the parent, even when the child exits.
    In the child, `close` has no effect, and other methods raise `ValueError`. Inherited arrays stay valid only while
    the parent keeps its own.

    Every method raises `BusError` or a subclass if the bus cannot be used.

    >>> with Show("dragon") as show:  # doctest: +SKIP
    ...     for frame in show:
    ...         x, y, _ = frame.positions[0]
    """

    def __init__(self, instance: str = "dragon", *, timeout_s: float | None = None, name: str = "python") -> None:
        """Joins an instance under a node name that `iox2 node list` shows. Frames are received from then on.

        `instance` is 1 to 24 characters of a-z, 0-9 and -. If no server runs yet, waits for one at most `timeout_s`
        seconds: 0 does not wait, `None` waits without a limit.

        While it waits, one warning of the logger `bench_dragon` says so. Raises `NoServer` if no server appears in time,
        `DomainError` for a bad name or an unusable directory, and `VersionMismatch`, `PermissionDenied`,
        `TooManyClients` or `OutOfResources`.
        """
        self.instance = instance
        """The instance's name."""
        self._bus = _opened(instance, name, _ns(timeout_s))
        self._newest: Frame | None = None
        self._run_names: tuple[int, tuple[str, ...]] = (0, ())
        _OPEN.add(self)

    def __iter__(self) -> Iterator[Frame]:
        return self.frames()

    def frames(self, timeout_s: float | None = None) -> Iterator[Frame]:
        """Yields frame after frame, oldest first. Waits for each at most `timeout_s` seconds; `None` for no limit.

        The loop goes on with the next server after a restart. It does not stop at the end of a run, whose last frame
        has the state `ShowState.ENDED`. A frame that the loop does not keep is released when the loop receives the next
        one. Raises `NoServer` if no frame arrives in time; `source` then has the reason. Other errors as `receive`.
        """
        while True:
            # No variable holds the frame, so the caller has the only reference.
            yield self._next_frame(timeout_s)

    async def __aiter__(self) -> AsyncIterator[Frame]:
        """Yields frame after frame, oldest first, in an asyncio task. Cancelling the task ends the wait. After `close`,
        raises `ValueError`."""
        # Readable when a frame may be unread. This copy stays open when another thread closes the client.
        descriptor = self._bus.descriptor_copy()
        try:
            while True:
                while (frame := self.receive()) is not None:
                    yield frame
                await _readable(descriptor)
        finally:
            os.close(descriptor)

    def receive(self) -> Frame | None:
        """Returns the oldest unread frame, or `None` if all are read. Never waits.

        Raises `TooManyFramesHeld` if four frames are held, and `VersionMismatch` if the number of handles of a frame
        contradicts its header.
        """
        return self._frame(self._bus.receive())

    def latest(self) -> Frame | None:
        """Returns the newest unread frame, or `None` if all are read. Never waits. Older frames are dropped unread and
        do not count as lost. Raises as `receive`."""
        return self._frame(self._bus.latest())

    def wait(self, timeout_s: float | None = None) -> Frame | None:
        """Returns the oldest unread frame. Waits for one at most `timeout_s` seconds; `None` for no limit.

        Other threads run during the wait. Returns `None` if no frame arrives in time; `source` then has the reason.
        Raises as `receive`.

        One system call of the server wakes all readers that wait. A reader that only polls costs the server nothing.
        """
        return self._frame(self._bus.wait(_ns(timeout_s)))

    def wait_until_due(self, timeout_s: float | None = None, *, spin_us: float = 100.0) -> Frame | None:
        """Does the same as `wait`, but sleeps by the clock until `spin_us` microseconds before the next frame is due.

        Then it looks for the frame in a busy loop, at most until `spin_us` after that instant. So the frame is read without
        a wake-up of the kernel. The busy loop takes up to twice `spin_us` in each period of one processor. A reader whose
        processor is too busy is woken as by `wait`. Raises `ValueError` for a `spin_us` that is not from 0 to 1,000,000.
        """
        if not 0 <= spin_us <= 1e6:
            raise ValueError(f"spin_us is {spin_us}, must be from 0 to 1000000")
        return self._frame(self._bus.wait_until_due(_ns(timeout_s), round(spin_us * 1000)))

    @property
    def dragons(self) -> Dragons:
        """The dragons of the newest frame, by name or number: `show.dragons["gold"].benches`.

        Takes the newest frame as `latest` does; where all frames are read, the dragons are those of the last call. Waits
        only for the first frame, and for the names of a run, each at most 5 s; raises `NoServer` without one. The arrays
        are copies, and hold no frame. In a loop over frames, use `frame.dragons`.
        """
        newest = self.latest()
        if newest is not None:
            self._newest = newest.copy()
        elif self._newest is None:
            self._newest = self._next_frame(_TIMEOUT_S).copy()
        return self._newest.dragons

    def fileno(self) -> int:
        """Returns a file descriptor that is readable when a frame may be unread, or when the client is closed: for
        `select` and event loops. Call `receive` until it returns `None`: that makes the descriptor unreadable again. Do
        not read or close it. The first call starts a thread; the server is not affected."""
        return self._bus.descriptor()

    def source(self, limit_s: float = _LIMIT_S) -> SourceState:
        """Returns whether the server publishes, and if not, why. Call it after a wait without a frame: frames that were
        not read yet do not count. `limit_s` is the age in seconds from which the newest frame is too old."""
        return SourceState(self._bus.source(_LONGEST_NS if (limit_ns := _ns(limit_s)) is None else limit_ns))

    @property
    def lost(self) -> int:
        """Number of lost frames: published between the first and the last frame that this reader has read, but not
        received by it."""
        return self._bus.lost

    def description(self, timeout_s: float | None = _TIMEOUT_S) -> Description:
        """Returns the configuration of the latest run.

        Waits only if no description has arrived yet, at most `timeout_s` seconds; `None` for no limit. A running server
        sends the description within a tenth of a second. If none runs, the call also waits for a server. Raises
        `NoServer` if no description arrives in time.

        The description of a server that has ended is returned until the next server publishes its own.
        """
        latest = self._bus.description(_ns(timeout_s))
        if latest is None:
            raise NoServer(f'the server on instance "{self.instance}" has published no description in time')
        return Description(*latest)

    def status(self, timeout_s: float | None = _TIMEOUT_S) -> Status:
        """Returns the server's latest status. The server publishes ten a second.

        Waits only if no status has arrived yet, at most `timeout_s` seconds, as `description` does. Raises `NoServer` if
        no status arrives in time.

        The last status of a server that has ended or was killed is returned until the next server publishes one. Its
        `run_id` distinguishes the two.
        """
        latest = self._bus.status(_ns(timeout_s))
        if latest is None:
            raise NoServer(f'the server on instance "{self.instance}" has published no status in time')
        return Status.from_buffer_copy(latest)

    def alerts(self, timeout_s: float | None = 0.0) -> list[Alert]:
        """Returns the alerts since the last call, oldest first. Alerts are received from the first call on.

        If there are none, waits for one at most `timeout_s` seconds: 0 does not wait, `None` waits without a limit.
        Returns an empty list if none arrives in time.

        Raises `NoServer` if the first call finds no server in time. The next call then counts as the first.
        """
        alerts = []
        alert = self._bus.alert(_ns(timeout_s))
        while alert is not None:
            alerts.append(Alert.from_buffer_copy(alert))
            alert = self._bus.alert(0)
        return alerts

    def command_events(self, timeout_s: float | None = 0.0) -> list[CommandEvent]:
        """Returns the events of commands to the server since the last call, oldest first: who sent which command when, and
        whether the server accepted it. The first call also returns up to 128 earlier events of the run; it waits for
        these at least half a second.

        If there are none, waits for one at most `timeout_s` seconds, as `alerts` does, and raises as it. A server
        publishes events ten times a second.
        """
        events = []
        event = self._bus.command_event(_ns(timeout_s))
        while event is not None:
            events.append(CommandEvent.from_buffer_copy(event))
            event = self._bus.command_event(0)
        return events

    def pause(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Stops the walk until `resume`.

        Returns, like every command, the tick from which it holds: the server replies at the start of its next tick.
        Raises `Refused` with the reason if the server refuses the command. Raises `NoAnswer` if the server does not
        reply within `timeout_s` seconds (`None` for no limit); it may have executed the command nevertheless.

        No command waits for a server: if none runs, or if it was killed, `NoServer` is raised at once.
        """
        return self._call(CommandKind.PAUSE, 0.0, timeout_s)

    def resume(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Walks on after `pause`. Returns and raises as `pause`."""
        return self._call(CommandKind.RESUME, 0.0, timeout_s)

    def speed(self, speed_mps: float, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Walks at this speed of the head, in metres per show second, 0 to 10. Returns and raises as `pause`."""
        return self._call(CommandKind.SPEED, speed_mps, timeout_s)

    def seek(self, show_time_s: float, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Seeks to this show time, in seconds. Returns and raises as `pause`.

        If the guard of a guarded server has not yet proved that the benches are apart there, sends the command again
        until it has. All attempts together take at most `timeout_s` seconds.
        """
        _ns(timeout_s)
        deadline_s = math.inf if timeout_s is None else time.monotonic() + timeout_s
        slowest_s = 0.0
        while True:
            asked_s = time.monotonic()
            try:
                left_s = max(0.0, deadline_s - asked_s)
                return self._call(CommandKind.SEEK, show_time_s, None if timeout_s is None else left_s)
            except Refused as refused:
                slowest_s = max(slowest_s, time.monotonic() - asked_s)
                # A reply that arrives after the deadline would leave open whether the seek was executed.
                left_s = deadline_s - time.monotonic()
                if refused.refusal is not Refusal.NOT_PROVED or left_s <= _PROOF_PERIOD_S + slowest_s:
                    raise
            time.sleep(_PROOF_PERIOD_S)

    def hold(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Stops for safety. Only `release` lifts the hold. Returns and raises as `pause`."""
        return self._call(CommandKind.HOLD, 0.0, timeout_s)

    def release(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Lifts a `hold`. Returns and raises as `pause`."""
        return self._call(CommandKind.RELEASE, 0.0, timeout_s)

    def go(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Walks on from a cue that waits. Two of them within 0.3 s count as one. Returns and raises as `pause`."""
        return self._call(CommandKind.GO, 0.0, timeout_s)

    def pace(self, factor: float, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Plays at this pace: planned seconds per show second; on a replay, recorded seconds per second. Returns and
        raises as `pause`."""
        return self._call(CommandKind.PACE, factor, timeout_s)

    def stop(self, timeout_s: float | None = _TIMEOUT_S) -> int:
        """Ends the server: the head comes to rest first. Returns and raises as `pause`."""
        return self._call(CommandKind.STOP, 0.0, timeout_s)

    def close(self) -> None:
        """Leaves the instance, and ends every wait of other threads with `ValueError`. `lost` can still be read. Arrays
        that are kept stay valid, and the process remains in the instance until it has released the last one."""
        self._bus.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()

    def _next_frame(self, timeout_s: float | None) -> Frame:
        while (frame := self.wait(timeout_s)) is None:
            if timeout_s is not None:
                raise NoServer(self._silence(timeout_s))
        return frame

    def _frame(self, lent: _bus.Frame | None) -> Frame | None:
        return None if lent is None else Frame(lent, self._names)

    def _names(self, run_id: int) -> tuple[str, ...]:
        """Returns the names of the dragons of a run, whose description may follow its first frames."""
        if self._run_names[0] != run_id:
            deadline_s = time.monotonic() + _TIMEOUT_S
            while (description := self.description()).run_id != run_id:
                if time.monotonic() > deadline_s:
                    raise NoServer(f'instance "{self.instance}" has published no description of the run {run_id}')
                time.sleep(_PROOF_PERIOD_S)
            self._run_names = (run_id, description.dragon_names)
        return self._run_names[1]

    def _silence(self, timeout_s: float) -> str:
        """Returns the text for a wait without a frame."""
        match self.source(timeout_s):
            case SourceState.ENDED:
                return f'no server runs on instance "{self.instance}": the run has ended'
            case SourceState.LOST:
                return f'no server runs on instance "{self.instance}": the run was cut off'
            case _:
                return f'the server on instance "{self.instance}" has sent no frame for {timeout_s:g} s'

    def _call(self, kind: CommandKind, value: float, timeout_s: float | None) -> int:
        return self._bus.call(kind, value, _ns(timeout_s))


_OPEN: weakref.WeakSet[Show] = weakref.WeakSet()


@atexit.register
def _close_all() -> None:
    """Leaves every instance at the end of the process, where Python does not destroy all objects."""
    for show in list(_OPEN):
        show.close()


def _opened(instance: str, name: str, timeout_ns: int | None) -> _bus.Show:
    try:
        return _bus.Show(instance, name, 0)
    except NoServer as error:
        if timeout_ns == 0:
            raise
        _LOG.warning("waiting: %s", error)
    return _bus.Show(instance, name, timeout_ns)


def _ns(timeout_s: float | None) -> int | None:
    """Returns a timeout in nanoseconds; `None` for no limit. Raises `ValueError` for a negative one and for NaN."""
    if timeout_s is None or timeout_s > _LONGEST_S:
        return None
    if not timeout_s >= 0:
        raise ValueError(f"timeout_s is {timeout_s}, must be at least 0")
    return round(timeout_s * 1e9)


_LONGEST_S = 1e9
"""Timeout in seconds from which a wait has no limit: thirty years."""
_LONGEST_NS = 2**64 - 1


async def _readable(descriptor: int) -> None:
    """Waits until a descriptor is readable."""
    loop = asyncio.get_running_loop()
    is_readable = loop.create_future()

    def wake() -> None:
        if not is_readable.done():
            is_readable.set_result(None)

    loop.add_reader(descriptor, wake)
    try:
        await is_readable
    finally:
        loop.remove_reader(descriptor)

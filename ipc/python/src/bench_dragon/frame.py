"""A frame: the state of all dragons at one tick, in its shared-memory layout.

A dragon of N benches has N + 1 handles. Its handle i is the front hinge of its bench i, and its handle N the rear hinge
of its last bench. A frame has the handles of all dragons, dragon after dragon.
"""

import copy
import ctypes
from collections.abc import Callable
from functools import cached_property
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from bench_dragon import _bus
from bench_dragon.bench import Benches
from bench_dragon.codes import DragonState, ShowState
from bench_dragon.continuity import Continuity
from bench_dragon.dragons import Dragons
from bench_dragon.wire import WireType, decoded


class DragonMotion(WireType):
    """A dragon of a frame."""

    TYPE_NAME = "bench_dragon.DragonMotion.v1"

    travel_m: float
    """Signed arc length that its head has walked since t = 0, in metres."""
    speed_mps: float
    """Speed of its head in metres per show second; 0 while it stands."""
    first_handle: int
    """Index of its first handle in the frame."""
    bench_count: int
    """Number of its benches; it has one handle more."""
    state: int
    """A `DragonState` as its number. Read it with `dragon_state`."""
    reserved: int
    """0."""

    _fields_ = [
        ("travel_m", ctypes.c_double),
        ("speed_mps", ctypes.c_double),
        ("first_handle", ctypes.c_uint32),
        ("bench_count", ctypes.c_uint32),
        ("state", ctypes.c_uint32),
        ("reserved", ctypes.c_uint32),
    ]

    @property
    def dragon_state(self) -> DragonState | None:
        """What the dragon does; `None` for a number that this version does not support."""
        return decoded(DragonState, self.state)

    @property
    def handles(self) -> slice:
        """Its handles among those of the frame."""
        return slice(self.first_handle, self.first_handle + self.bench_count + 1)


class FrameHeader(WireType):
    """Values of a frame that concern the whole show, and one entry for each dragon."""

    TYPE_NAME = "bench_dragon.FrameHeader.v2"

    run_id: int
    """Random number of the run, under 2^53. It changes when the server is restarted."""
    tick: int
    """Number of the frame in its run, from 0, without a gap. A jump means that this reader lost frames."""
    show_time_ns: int
    """Show time in nanoseconds."""
    scheduled_ns: int
    """`CLOCK_MONOTONIC` instant at which the tick was due, in nanoseconds."""
    published_ns: int
    """`CLOCK_MONOTONIC` instant at which the frame was sent, in nanoseconds."""
    head_travel_m: float
    """Signed arc length that the head of the leading dragon has walked since t = 0, in metres."""
    head_speed_mps: float
    """Speed of that head in metres per show second; 0 while it stands."""
    time_scale: float
    """Show seconds per wall-clock second."""
    bench_count: int
    """Number of benches of all dragons; the frame has one handle more for each dragon."""
    state: int
    """A `ShowState` as its number. Read it with `show_state`."""
    course_m: float
    """Place of the show on its course, in metres: the one number on which the poses of all dragons depend. Of several
    dragons it is plan time × the planned speed of the leading dragon. Of one dragon it is the travel of its head."""
    course_mps: float
    """Speed along the course, in metres per show second; 0 while the show stands."""
    dragon_count: int
    """Number of dragons."""
    is_plan: int
    """1 where the course is a plan, 0 where it is the travel of the only head."""
    dragons: ctypes.Array[DragonMotion]
    """The dragons, the leading one first; entries beyond their number are 0. Read them with `motions`."""

    _fields_ = [
        ("run_id", ctypes.c_uint64),
        ("tick", ctypes.c_uint64),
        ("show_time_ns", ctypes.c_int64),
        ("scheduled_ns", ctypes.c_uint64),
        ("published_ns", ctypes.c_uint64),
        ("head_travel_m", ctypes.c_double),
        ("head_speed_mps", ctypes.c_double),
        ("time_scale", ctypes.c_double),
        ("bench_count", ctypes.c_uint32),
        ("state", ctypes.c_uint32),
        ("course_m", ctypes.c_double),
        ("course_mps", ctypes.c_double),
        ("dragon_count", ctypes.c_uint32),
        ("is_plan", ctypes.c_uint32),
        ("dragons", DragonMotion * 32),
    ]

    @property
    def motions(self) -> list[DragonMotion]:
        """The dragons, the leading one first."""
        return self.dragons[: self.dragon_count]

    def fields(self) -> dict[str, Any]:
        """Returns the values by name; of `dragons` only those that the show has."""
        return super().fields() | {"dragons": self.motions}

    @property
    def show_state(self) -> ShowState | None:
        """The state of the show; `None` for a number that this version does not support."""
        return decoded(ShowState, self.state)

    @property
    def show_time_s(self) -> float:
        """Show time in seconds."""
        return self.show_time_ns / 1e9

    @property
    def lateness_ns(self) -> int:
        """Time between the due instant and the sending of the frame, in nanoseconds."""
        return max(0, self.published_ns - self.scheduled_ns)


class HandleState(WireType):
    """Position and velocity of one handle. x right, y away, z up; z is 0 on a flat stage."""

    TYPE_NAME = "bench_dragon.HandleState.v1"

    position_m: ctypes.Array[ctypes.c_double]
    """Position in metres."""
    velocity_mps: ctypes.Array[ctypes.c_double]
    """Velocity in metres per show second; 0 while the head stands."""

    _fields_ = [("position_m", ctypes.c_double * 3), ("velocity_mps", ctypes.c_double * 3)]


def _vector(values: NDArray[np.float64]) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z


class Frame:
    """One frame, in place in shared memory. No process writes to it while it is held.

    A frame is held while a reference to it, or to one of its arrays, exists. A reader may hold four frames. A loop
    needs two of them: the current frame and the next one. To keep more, keep copies: `frame.copy()`.
    """

    def __init__(self, lent: _bus.Frame, names: Callable[[int], tuple[str, ...]]) -> None:
        # Everything is read when it is asked for: a loop that reads positions pays for nothing more.
        self._lent: _bus.Frame | None = lent
        self._names = names

    @cached_property
    def _handles(self) -> NDArray[np.float64]:
        return np.asarray(self._lent)

    @cached_property
    def header(self) -> FrameHeader:
        """Values of the frame that concern the whole show, and one entry for each dragon."""
        assert self._lent is not None, "a copy has its header"
        return FrameHeader.from_buffer_copy(self._lent.header())

    @property
    def continuity(self) -> Continuity:
        """Relation of the frame to the previously received one."""
        return Continuity(self._relation[0])

    @property
    def lost(self) -> int:
        """Number of frames lost between the previously received one and this one."""
        return self._relation[1]

    @cached_property
    def _relation(self) -> tuple[int, int]:
        assert self._lent is not None, "a copy has its relation"
        return self._lent.continuity()

    def position(self, handle: int) -> tuple[float, float, float]:
        """Position of one handle in metres, without an array: the quickest way to one place. Raises `IndexError` for a
        handle that the frame does not have; a negative number counts from the last one."""
        if self._lent is not None:
            return self._lent.position(handle)
        return _vector(self._handles[handle, 0])

    def velocity(self, handle: int) -> tuple[float, float, float]:
        """Velocity of one handle in metres per show second, as `position`."""
        if self._lent is not None:
            return self._lent.velocity(handle)
        return _vector(self._handles[handle, 1])

    @property
    def positions(self) -> NDArray[np.float64]:
        """Positions of the handles in metres, dragon after dragon, head first: shape (N + 1, 3) for one dragon, read-only,
        on shared memory. Row 0 is the front hinge of the head."""
        return self._handles[:, 0]

    @property
    def velocities(self) -> NDArray[np.float64]:
        """Velocities of the handles in metres per show second, in the order of `positions`, read-only, on shared memory.
        They are 0 while the head stands."""
        return self._handles[:, 1]

    @cached_property
    def benches(self) -> Benches:
        """Centres, headings, velocities and turn rates of the benches, dragon after dragon, head first. The arrays are new
        ones and do not hold the frame."""
        heads = [motion.first_handle for motion in self.header.motions[1:]]
        return Benches.between(self.positions, self.velocities, heads)

    @cached_property
    def dragons(self) -> Dragons:
        """The dragons, the leading one first: `frame.dragons["gold"].benches`, or by number, `frame.dragons[0]`.

        A name waits for the description of the frame's run, at most 5 s, and raises `NoServer` without one. Names are
        those of `[[dragons]]`; the dragon of a show of one has none.
        """
        run_id, names = self.header.run_id, self._names
        return Dragons(self.positions, self.velocities, self.header.motions, lambda: names(run_id))

    def copy(self) -> Self:
        """Returns the same frame with arrays of its own. Any number of copies may be kept."""
        # Both are kept by the copy, which does not hold the frame.
        _ = self.header, self._relation
        copied = copy.copy(self)
        copied._handles = self._handles.copy()
        copied.__dict__.pop("dragons", None)
        copied._lent = None
        return copied

    def __repr__(self) -> str:
        return f"Frame({self.header!r}, continuity={self.continuity.name}, lost={self.lost})"

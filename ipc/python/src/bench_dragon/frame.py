"""A frame: the dragon at one tick, as it lies in shared memory.

A dragon of N benches has N + 1 handles: handle i is the front hinge of bench i, handle N the rear hinge of the last
bench.
"""

import ctypes
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from bench_dragon.bench import Benches
from bench_dragon.continuity import Continuity
from bench_dragon.inheritance import Heirloom, never_destroy
from bench_dragon.wire import WireCode, WireType, decoded


class ShowState(WireCode):
    """What the show is doing."""

    RUNNING = 0
    """The head walks."""
    PAUSED = 1
    """The operator's pause: `resume` goes on."""
    HELD = 2
    """A safety stop: only `release` lifts it."""
    FINISHED = 3
    """The end of the route, of the run, or of the time asked for is reached."""
    STOPPING = 4
    """A pause, a hold, a stop or the timecode has the head come to rest: it still walks, and brakes."""
    ENDED = 5
    """The run has ended in order: this is its last frame."""


class FrameHeader(WireType):
    """What a frame says about the whole dragon."""

    TYPE_NAME = "bench_dragon.FrameHeader.v1"

    run_id: int
    """Number of the run; another value means that the server was started again."""
    tick: int
    """Number of the frame in its run, from 0, without a hole."""
    sim_time_ns: int
    """Show time in nanoseconds."""
    scheduled_ns: int
    """`CLOCK_MONOTONIC` instant at which the tick was due, in nanoseconds."""
    published_ns: int
    """`CLOCK_MONOTONIC` instant at which the frame was sent, in nanoseconds."""
    head_travel_m: float
    """Signed arc length that the head has walked since t = 0, in metres."""
    head_speed_mps: float
    """Speed of the head in metres per show second; 0 while paused, held or finished."""
    time_scale: float
    """Show seconds per wall-clock second."""
    bench_count: int
    """Number of benches; the frame has one handle more."""
    state: int
    """A `ShowState` as its number. Read it with `show_state`."""

    _fields_ = [
        ("run_id", ctypes.c_uint64),
        ("tick", ctypes.c_uint64),
        ("sim_time_ns", ctypes.c_int64),
        ("scheduled_ns", ctypes.c_uint64),
        ("published_ns", ctypes.c_uint64),
        ("head_travel_m", ctypes.c_double),
        ("head_speed_mps", ctypes.c_double),
        ("time_scale", ctypes.c_double),
        ("bench_count", ctypes.c_uint32),
        ("state", ctypes.c_uint32),
    ]

    @property
    def show_state(self) -> ShowState | None:
        """The state of the show; `None` for a number that this version does not know."""
        return decoded(ShowState, self.state)

    @property
    def sim_time_s(self) -> float:
        """Show time in seconds."""
        return self.sim_time_ns * 1e-9

    @property
    def lateness_ns(self) -> int:
        """How long after its due instant the frame was sent, in nanoseconds."""
        return max(0, self.published_ns - self.scheduled_ns)


class HandleState(WireType):
    """Where one handle is and how it moves. x right, y away, z up."""

    TYPE_NAME = "bench_dragon.HandleState.v1"

    position_m: ctypes.Array[ctypes.c_double]
    """Position in metres."""
    velocity_mps: ctypes.Array[ctypes.c_double]
    """Velocity in metres per show second; 0 while paused, held or finished."""

    _fields_ = [("position_m", ctypes.c_double * 3), ("velocity_mps", ctypes.c_double * 3)]


class Frame:
    """One frame. Nothing of it is copied but its header, and nobody writes to it while it is held.

    It is held for as long as the frame, or an array that came from it, is referred to. A reader may hold four, of which
    a loop takes two: the frame in hand, and the next one.
    """

    header: FrameHeader
    """What the frame says about the whole dragon."""
    continuity: Continuity
    """How the frame stands to the one that was received before it."""
    lost: int
    """Frames between the one that was received before and this one that never reached this reader."""

    def __init__(self, header: FrameHeader, memory: "SharedMemory", continuity: Continuity, lost: int) -> None:
        self.header = header
        self.continuity = continuity
        self.lost = lost
        self._handles: NDArray[np.float64] = np.asarray(memory)

    @property
    def positions(self) -> NDArray[np.float64]:
        """Positions of the handles in metres, head first: shape (N + 1, 3), read-only, on shared memory."""
        return self._handles[:, 0]

    @property
    def velocities(self) -> NDArray[np.float64]:
        """Velocities of the handles in metres per show second, head first: shape (N + 1, 3), read-only, on shared
        memory. They are 0 while paused, held or finished."""
        return self._handles[:, 1]

    @cached_property
    def benches(self) -> Benches:
        """Centres, headings and velocities of the benches, head first; arrays of their own, which hold no frame."""
        return Benches.between(self.positions, self.velocities)

    def __repr__(self) -> str:
        return f"Frame({self.header!r}, continuity={self.continuity.name}, lost={self.lost})"


class SharedMemory(Heirloom):
    """The handles of a frame in shared memory: what is at the bottom of each array on them, and keeps them there."""

    def __init__(self, sample: Any, member: object, handle_count: int) -> None:
        self._sample = sample
        self._member = member
        # numpy's own protocol, https://numpy.org/doc/stable/reference/arrays.interface.html: `True` is read-only.
        self.__array_interface__ = {
            "version": 3,
            "typestr": "<f8",
            "shape": (handle_count, 2, 3),
            "data": (sample.payload_ptr, True),
        }
        super().__init__()

    def disown(self) -> None:
        """Leaves the frame to the parent."""
        never_destroy(self._sample)

    def __del__(self) -> None:
        # In this order: the last one to leave a domain clears it away, and is not the last while a sample is held.
        del self._sample
        del self._member

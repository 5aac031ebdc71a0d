"""The server's account of itself."""

import ctypes

from bench_dragon.frame import ShowState
from bench_dragon.wire import WireType, decoded


class TimeHistogram(WireType):
    """Times, each counted in the bucket that it lies in: below 64 ns a bucket a nanosecond, from there 32 an octave."""

    TYPE_NAME = "bench_dragon.TimeHistogram.v1"

    max_ns: int
    """The longest time, exactly, in nanoseconds; 0 where there is none."""
    counts: ctypes.Array[ctypes.c_uint64]
    """How many times lie in each bucket."""

    _fields_ = [("max_ns", ctypes.c_uint64), ("counts", ctypes.c_uint64 * 1024)]


class Status(WireType):
    """How the server keeps its schedule. Published ten times a second and once more at the end.

    Lateness is from when a release was due to the start of its tick, `tick` times are until the loop was ready for the
    next one; both since the start of the run. Percentiles are those of the histograms, so at most 1/32 too much.
    """

    TYPE_NAME = "bench_dragon.Status.v3"

    run_id: int
    """Run that this is about."""
    tick: int
    """Last tick published."""
    sim_time_ns: int
    """Show time of that tick in nanoseconds."""
    overruns: int
    """Releases that were missed since the start of the run. The show jumps a few of them; it is behind by those of a longer
    standstill."""
    behind_ns: int
    """How far the show is behind the clock, in nanoseconds of wall time: what is left of standstills, which the show makes up
    for."""
    most_behind_ns: int
    """The furthest that the show has been behind since the start of the run, in nanoseconds of wall time."""
    lateness_p50_ns: int
    """Median of the lateness, in nanoseconds."""
    lateness_p99_ns: int
    """99th percentile of the lateness, in nanoseconds."""
    lateness_p999_ns: int
    """99.9th percentile of the lateness, in nanoseconds."""
    lateness_max_ns: int
    """Greatest lateness, in nanoseconds."""
    tick_p50_ns: int
    """Median of the ticks' duration, in nanoseconds."""
    tick_p99_ns: int
    """99th percentile of the duration, in nanoseconds."""
    tick_p999_ns: int
    """99.9th percentile of the duration, in nanoseconds."""
    tick_max_ns: int
    """Greatest duration, in nanoseconds."""
    granted_to_m: float
    """Travel up to which a guarded server may move the head, in metres; not a number for one that is not guarded."""
    asked_m: float
    """Travel that a refused seek asked a guarded server for, in metres, or not a number: its guard proves it."""
    rate_hz: int
    """Ticks a second of wall time."""
    state: int
    """A `ShowState` as its number. Read it with `show_state`."""
    pid: int
    """Process id of the server."""
    reserved: int
    """Always 0."""
    lateness: TimeHistogram
    """Lateness of every release since the start of the run."""
    tick_time: TimeHistogram
    """Duration of every tick since the start of the run."""

    _fields_ = [
        ("run_id", ctypes.c_uint64),
        ("tick", ctypes.c_uint64),
        ("sim_time_ns", ctypes.c_int64),
        ("overruns", ctypes.c_uint64),
        ("behind_ns", ctypes.c_uint64),
        ("most_behind_ns", ctypes.c_uint64),
        ("lateness_p50_ns", ctypes.c_uint64),
        ("lateness_p99_ns", ctypes.c_uint64),
        ("lateness_p999_ns", ctypes.c_uint64),
        ("lateness_max_ns", ctypes.c_uint64),
        ("tick_p50_ns", ctypes.c_uint64),
        ("tick_p99_ns", ctypes.c_uint64),
        ("tick_p999_ns", ctypes.c_uint64),
        ("tick_max_ns", ctypes.c_uint64),
        ("granted_to_m", ctypes.c_double),
        ("asked_m", ctypes.c_double),
        ("rate_hz", ctypes.c_uint32),
        ("state", ctypes.c_uint32),
        ("pid", ctypes.c_uint32),
        ("reserved", ctypes.c_uint32),
        ("lateness", TimeHistogram),
        ("tick_time", TimeHistogram),
    ]

    @property
    def show_state(self) -> ShowState | None:
        """The state of the show; `None` for a number that this version does not know."""
        return decoded(ShowState, self.state)

    @property
    def sim_time_s(self) -> float:
        """Show time of the last tick in seconds."""
        return self.sim_time_ns * 1e-9

"""Status of the server."""

import ctypes

from bench_dragon.codes import GuardState, ShowState, SourceKind, TimecodeKind, TimecodeState
from bench_dragon.wire import WireType, decoded


class TimeHistogram(WireType):
    """Counts of times per bucket. Below 64 ns each bucket is 1 ns wide; from there on, every octave has 32 buckets."""

    TYPE_NAME = "bench_dragon.TimeHistogram.v1"

    max_ns: int
    """The longest time, exact, in nanoseconds; 0 without any time."""
    counts: ctypes.Array[ctypes.c_uint64]
    """Number of times in each bucket."""

    _fields_ = [("max_ns", ctypes.c_uint64), ("counts", ctypes.c_uint64 * 1024)]







class Status(WireType):
    """State and timing of the server. Published ten times a second and once more at the end.

    Lateness is the time from the due instant of a tick to its start. A tick's duration lasts until the loop is ready
    for the next tick. Both are counted since the start of the run. Percentiles are from the histograms, so they are at
    most 1/32 too large.
    """

    TYPE_NAME = "bench_dragon.Status.v4"

    run_id: int
    """Run of the server."""
    tick: int
    """Last tick published."""
    show_time_ns: int
    """Show time of that tick in nanoseconds."""
    overruns: int
    """Number of periods that were missed since the start of the run. After a few missed periods show time jumps
    forward. After a longer standstill the show is behind; see `behind_ns`."""
    behind_ns: int
    """Time by which the show is behind the clock, in nanoseconds of wall time: the rest of standstills, for which the
    show makes up."""
    most_behind_ns: int
    """Greatest value of `behind_ns` since the start of the run."""
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
    """Travel up to which a guarded server may move the head, in metres; NaN for a server that is not guarded."""
    asked_m: float
    """Travel of a refused seek on a guarded server, in metres, or NaN. The guard is asked to prove it."""
    guard_end_m: float
    """Travel at which the proven travel ends permanently, in metres; NaN where the guard has not reached it."""
    rate_hz: int
    """Ticks per second of wall time."""
    state: int
    """A `ShowState` as its number. Read it with `show_state`."""
    pid: int
    """Process id of the server."""
    source: int
    """A `SourceKind` as its number."""
    guard: int
    """A `GuardState` as its number."""
    timecode: int
    """A `TimecodeState` as its number."""
    timecode_kind: int
    """A `TimecodeKind` as its number."""
    stops: int
    """Reasons for which the head stands or brakes, as bits: see `Stops`."""
    lateness: TimeHistogram
    """Lateness of every tick since the start of the run."""
    tick_time: TimeHistogram
    """Duration of every tick since the start of the run."""

    _fields_ = [
        ("run_id", ctypes.c_uint64),
        ("tick", ctypes.c_uint64),
        ("show_time_ns", ctypes.c_int64),
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
        ("guard_end_m", ctypes.c_double),
        ("rate_hz", ctypes.c_uint32),
        ("state", ctypes.c_uint32),
        ("pid", ctypes.c_uint32),
        ("source", ctypes.c_uint32),
        ("guard", ctypes.c_uint32),
        ("timecode", ctypes.c_uint32),
        ("timecode_kind", ctypes.c_uint32),
        ("stops", ctypes.c_uint32),
        ("lateness", TimeHistogram),
        ("tick_time", TimeHistogram),
    ]

    @property
    def show_state(self) -> ShowState | None:
        """The state of the show; `None` for a number that this version does not support."""
        return decoded(ShowState, self.state)

    @property
    def show_time_s(self) -> float:
        """Show time of the last tick in seconds."""
        return self.show_time_ns / 1e9

    @property
    def source_kind(self) -> SourceKind | None:
        """The kind of source; `None` for a number that this version does not support."""
        return decoded(SourceKind, self.source)

    @property
    def guard_state(self) -> GuardState | None:
        """The state of the guard; `None` for a number that this version does not support."""
        return decoded(GuardState, self.guard)

    @property
    def timecode_state(self) -> TimecodeState | None:
        """The state of the timecode; `None` for a number that this version does not support."""
        return decoded(TimecodeState, self.timecode)

    @property
    def timecode_protocol(self) -> TimecodeKind | None:
        """The protocol of the timecode; `None` for a number that this version does not support."""
        return decoded(TimecodeKind, self.timecode_kind)

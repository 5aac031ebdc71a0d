"""Alerts: events that a monitor detects."""

import ctypes

from bench_dragon.codes import AlertKind
from bench_dragon.wire import WireType, decoded

_NO_FORECAST = -(2**63)
_NO_BENCH = 2**32 - 1



class Alert(WireType):
    """One event. Use `alert_kind`, `pair`, `bench` and `forecast_s` to read the coded fields."""

    TYPE_NAME = "bench_dragon.Alert.v1"

    run_id: int
    """Run in which it happened."""
    tick: int
    """First tick at which the event held."""
    show_time_ns: int
    """Show time of the event in nanoseconds: exact for pairs that touch or part and boards at borders of the stage, if
    the head walked; the frame's show time for the other kinds.
    """
    forecast_ns: int
    """Show time of the forecast contact in nanoseconds, coded. Read it with `forecast_s`."""
    clearance_m: float
    """Clearance of the two benches in metres, negative where they overlap. For one bench: distance of its board from the
    border of the stage, 0 beyond it. 0 for an alert without benches.
    """
    point_m: ctypes.Array[ctypes.c_double]
    """Point midway between the nearest points of the two boards, in metres. For one bench: a point of its board
    beyond the border of the stage, or nearest to it, or of the border in the board. 0 for an alert without benches.
    """
    kind: int
    """An `AlertKind` as its number. Read it with `alert_kind`."""
    bench_a: int
    """The lower bench index, or the only one, coded. Read it with `pair` or `bench`."""
    bench_b: int
    """The higher bench index, coded. Read it with `pair`."""
    reserved: int
    """Always 0."""

    _fields_ = [
        ("run_id", ctypes.c_uint64),
        ("tick", ctypes.c_uint64),
        ("show_time_ns", ctypes.c_int64),
        ("forecast_ns", ctypes.c_int64),
        ("clearance_m", ctypes.c_double),
        ("point_m", ctypes.c_double * 2),
        ("kind", ctypes.c_uint32),
        ("bench_a", ctypes.c_uint32),
        ("bench_b", ctypes.c_uint32),
        ("reserved", ctypes.c_uint32),
    ]

    @property
    def alert_kind(self) -> AlertKind | None:
        """The kind; `None` for a number that this version does not support."""
        return decoded(AlertKind, self.kind)

    @property
    def pair(self) -> tuple[int, int] | None:
        """The two benches, the lower index first; `None` for an alert without a pair."""
        return None if self.bench_b == _NO_BENCH else (self.bench_a, self.bench_b)

    @property
    def bench(self) -> int | None:
        """The bench of an alert about one bench; `None` for any other."""
        return self.bench_a if self.bench_b == _NO_BENCH != self.bench_a else None

    @property
    def show_time_s(self) -> float:
        """Show time of the event in seconds."""
        return self.show_time_ns / 1e9

    @property
    def forecast_s(self) -> float | None:
        """Show time of the forecast contact in seconds; `None` where no contact lies ahead, or none is known yet."""
        return None if self.forecast_ns == _NO_FORECAST else self.forecast_ns / 1e9

"""Events of commands: what the server was asked for, by whom, and whether it did it."""

import ctypes

from bench_dragon.codes import EventKind, Refusal, Sender
from bench_dragon.wire import WireType, decoded




class CommandEvent(WireType):
    """One event: a command and its outcome, or the start or the end of the run. Use `event_kind`, `sent_by`,
    `is_accepted` and `reason` to read the coded fields."""

    TYPE_NAME = "bench_dragon.CommandEvent.v1"

    run_id: int
    """Run of the source."""
    number: int
    """Number of the event in its run, from 0, without a gap. A jump means that this reader lost events."""
    tick: int
    """Tick from which an accepted command holds; for a refused command, the tick at which it was refused."""
    show_time_ns: int
    """Show time of the event, at the start of its tick, in nanoseconds."""
    wall_ns: int
    """Wall-clock time of the event: nanoseconds since 1970-01-01 00:00 UTC."""
    overruns: int
    """Number of periods that the run missed before this tick."""
    values: ctypes.Array[ctypes.c_double]
    """Values of the command in their order; 0 for unused ones. For a start: show time in seconds, travel in metres, speed
    in metres per show second, and the show time at which the run ends, or NaN."""
    lowest: float
    """Least allowed value, where a value was out of range; else 0."""
    highest: float
    """Greatest allowed value, where a value was out of range; else 0."""
    kind: int
    """An `EventKind` as its number. Read it with `event_kind`."""
    sender: int
    """A `Sender` as its number. Read it with `sent_by`."""
    pid: int
    """Process id of the sender; 0 if unknown."""
    refusal: int
    """0 if the command was accepted, else a `Refusal` as its number. Read it with `reason`."""
    flags: int
    """Bits. For a grant, 1: it is final. For a start, 1: held, 2: paused, 4: guarded, 8: follows timecode, 16: ready, 32:
    restarted, 64: stays at its end. Else 0."""
    reserved: int
    """Always 0."""

    _fields_ = [
        ("run_id", ctypes.c_uint64),
        ("number", ctypes.c_uint64),
        ("tick", ctypes.c_uint64),
        ("show_time_ns", ctypes.c_int64),
        ("wall_ns", ctypes.c_int64),
        ("overruns", ctypes.c_uint64),
        ("values", ctypes.c_double * 4),
        ("lowest", ctypes.c_double),
        ("highest", ctypes.c_double),
        ("kind", ctypes.c_uint32),
        ("sender", ctypes.c_uint32),
        ("pid", ctypes.c_uint32),
        ("refusal", ctypes.c_uint32),
        ("flags", ctypes.c_uint32),
        ("reserved", ctypes.c_uint32),
    ]

    @property
    def event_kind(self) -> EventKind | None:
        """The kind; `None` for a command or a number that this version does not support."""
        return decoded(EventKind, self.kind)

    @property
    def sent_by(self) -> Sender | None:
        """The kind of sender; `None` for a number that this version does not support."""
        return decoded(Sender, self.sender)

    @property
    def is_accepted(self) -> bool:
        """Whether the server accepted the command."""
        return self.refusal == 0

    @property
    def reason(self) -> Refusal | None:
        """The reason of a refusal; `None` if the command was accepted."""
        return None if self.is_accepted else decoded(Refusal, self.refusal) or Refusal.UNKNOWN

    @property
    def show_time_s(self) -> float:
        """Show time of the event in seconds."""
        return self.show_time_ns / 1e9

"""Events of commands: what the server was asked for, by whom, and whether it did it."""

import ctypes

from bench_dragon.command import Refusal
from bench_dragon.wire import WireCode, WireType, decoded


class EventKind(WireCode):
    """Kind of an event."""

    PAUSE = 0
    """`Show.pause`."""
    RESUME = 1
    """`Show.resume`."""
    SPEED = 2
    """`Show.speed`."""
    SEEK = 3
    """`Show.seek`."""
    HOLD = 4
    """`Show.hold`."""
    RELEASE = 5
    """`Show.release`."""
    STOP = 6
    """`Show.stop`."""
    GRANT = 7
    """The guard has proved a travel, from the first to the second value in metres."""
    STAND = 8
    """The timecode that the server follows makes the show stand still. First value: 1 if the timecode determines the show
    time, else 0. Second value: the time scale."""
    FOLLOW = 9
    """The timecode makes the show run on. Values as for `STAND`."""
    START = 10
    """The run begins. This is always the first event."""
    END = 11
    """The run has ended in order. This is the last event, at the last tick of the run."""
    PACE = 12
    """A change of a replay's pace. A server refuses it, and a replay does not record the commands that it takes."""


class Sender(WireCode):
    """The kind of program that sent a command."""

    CLIENT = 0
    """A client of the library, in Rust, C or Python."""
    CTL = 1
    """`bench-dragon ctl`."""
    PAGE = 2
    """A browser page of `bench-dragon view`."""
    WATCH = 3
    """`bench-dragon watch`."""
    ZENOH = 4
    """A program on another host, through `bench-dragon bridge zenoh`."""
    TIMECODE = 5
    """The timecode that the server follows."""
    GUARD = 6
    """The guard, `bench-dragon monitor --guard`."""
    SIGNAL = 7
    """A signal to the server's process, such as Ctrl-C."""
    SERVER = 8
    """The server itself."""


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
    sim_time_ns: int
    """Show time of the event, at the start of its tick, in nanoseconds."""
    wall_ns: int
    """Wall-clock time of the event: nanoseconds since 1970-01-01 00:00 UTC."""
    overruns: int
    """Number of releases that the run missed before this tick."""
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
        ("sim_time_ns", ctypes.c_int64),
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
    def sim_time_s(self) -> float:
        """Show time of the event in seconds."""
        return self.sim_time_ns / 1e9

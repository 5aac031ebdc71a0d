"""Commands to the server, and the reasons for which it refuses one."""

import ctypes

from bench_dragon.wire import WireCode, WireType


class CommandKind(WireCode):
    """Kind of a command to the server."""

    PAUSE = 0
    """Stop walking until `RESUME`."""
    RESUME = 1
    """Walk on after `PAUSE`."""
    SPEED = 2
    """Walk at this speed of the head, in metres per show second, 0 to 10."""
    SEEK = 3
    """Seek to this show time, in seconds."""
    HOLD = 4
    """Stop for safety. Only `RELEASE` lifts the hold."""
    RELEASE = 5
    """Lift a `HOLD`."""
    STOP = 6
    """End the server. The head comes to rest first, and the last frame of the run has the state `ENDED`."""


class Command(WireType):
    """A command in its shared-memory layout."""

    TYPE_NAME = "bench_dragon.Command.v3"

    kind: int
    """A `CommandKind` as its number."""
    sender: int
    """The kind of program that sends the command: 0 for a client of the library."""
    run_id: int
    """Run for which the command is meant; 0 for any run."""
    values: ctypes.Array[ctypes.c_double]
    """Values of the command in their order; 0 for unused ones."""
    pid: int
    """Process id of the sender."""
    flags: int
    """Always 0: only the grants of a guard have flags."""

    _fields_ = [
        ("kind", ctypes.c_uint32),
        ("sender", ctypes.c_uint32),
        ("run_id", ctypes.c_uint64),
        ("values", ctypes.c_double * 2),
        ("pid", ctypes.c_uint32),
        ("flags", ctypes.c_uint32),
    ]


class CommandReply(WireType):
    """The server's reply in its shared-memory layout."""

    TYPE_NAME = "bench_dragon.CommandReply.v1"

    run_id: int
    """Run of the server that replies."""
    tick: int
    """Tick from which an accepted command holds; for a refused command, the tick at which it was refused."""
    lowest: float
    """Least allowed value, where a value was out of range; else 0."""
    highest: float
    """Greatest allowed value, where a value was out of range; else 0."""
    refusal: int
    """0 if the command was accepted, else a `Refusal` as its number."""
    reserved: int
    """Always 0."""

    _fields_ = [
        ("run_id", ctypes.c_uint64),
        ("tick", ctypes.c_uint64),
        ("lowest", ctypes.c_double),
        ("highest", ctypes.c_double),
        ("refusal", ctypes.c_uint32),
        ("reserved", ctypes.c_uint32),
    ]


class Refusal(WireCode):
    """Reason for which a server refuses a command."""

    UNKNOWN = 1
    """The server does not support this kind of command, or this version does not support the server's reason."""
    OUT_OF_RANGE = 2
    """The value is outside the range from `Refused.lowest` to `Refused.highest`, or NaN."""
    HELD = 3
    """The show is held. Only `release` lifts the hold."""
    NOT_HELD = 4
    """There is no hold to release."""
    FINISHED = 5
    """The show is finished. A `seek` starts it again."""
    NOT_GUARDED = 6
    """The server accepts no grants, because it was started without `--guarded`."""
    NOT_PROVED = 7
    """The server is guarded, and its guard has not yet proved that the benches are apart at the sought show time."""
    OTHER_RUN = 8
    """The grant is for another run."""
    HELD_BY_GUARD = 9
    """The guard holds the dragon. It walks on with the next grant; where the proven travel has ended, only a seek moves it."""
    REPLAYED = 10
    """The source replays a recording, which commands cannot change."""
    UNREACHABLE = 11
    """The source is on another host, which does not answer."""
    NOT_TAKEN = 12
    """The source is on another host, and its bridge accepts no commands: it was started without `--allow-commands`."""
    TOO_MANY = 13
    """More commands at a time than a bridge forwards to another host."""
    FOLLOWED = 14
    """The show follows timecode, which determines the show time. The timecode would undo a seek immediately."""
    READY = 15
    """The show waits at its start. Only `release` starts it."""

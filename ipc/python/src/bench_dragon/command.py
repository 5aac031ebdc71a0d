"""Commands to the server, and its replies."""

import ctypes

from bench_dragon.wire import WireType



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

"""Commands to the server, which replies to each once."""

import ctypes
import math
import os
from typing import Any

import iceoryx2 as iox2
import numpy as np

from bench_dragon.deadline import Deadline
from bench_dragon.errors import BusError, NoAnswer, NoServer
from bench_dragon.member import COMMANDS, Member
from bench_dragon.wire import WireCode, WireType, decoded

_POLL_PERIOD_S = 0.0002


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
    """The guard holds the dragon. It walks on with the guard's next grant."""
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


REASONS = {
    Refusal.UNKNOWN: "the server does not support this command",
    Refusal.HELD: "the show is held: release it first",
    Refusal.NOT_HELD: "the show is not held",
    Refusal.FINISHED: "the show is finished: seek to start it again",
    Refusal.NOT_GUARDED: "the server is not guarded: start it with --guarded",
    Refusal.NOT_PROVED: "no guard has proved that the benches are apart there",
    Refusal.OTHER_RUN: "the grant is for another run",
    Refusal.HELD_BY_GUARD: "the guard holds the dragon: it walks on when the guard has proved the travel ahead",
    Refusal.REPLAYED: "the source replays a recording: it accepts only stop",
    Refusal.UNREACHABLE: "the server is on another host, which does not answer",
    Refusal.NOT_TAKEN: "the server is on another host: start its bridge with --allow-commands to send commands",
    Refusal.TOO_MANY: "more commands at a time than the bridge forwards to another host: try again",
    Refusal.FOLLOWED: "the show follows timecode: seek on the device that sends it",
}


class Refused(BusError):
    """The server refused a command. The text is the reason."""

    def __init__(self, command: Command, reply: CommandReply) -> None:
        self.refusal = decoded(Refusal, reply.refusal) or Refusal.UNKNOWN
        """The reason."""
        self.tick = reply.tick
        """The tick at which it was refused."""
        self.run_id = reply.run_id
        """The run of the server that refused it."""
        self.lowest, self.highest = reply.lowest, reply.highest
        """Least and greatest allowed value, where the value was out of range; else 0."""
        if self.refusal is Refusal.OUT_OF_RANGE:
            super().__init__(_out_of_range(command, self.lowest, self.highest))
        else:
            super().__init__(REASONS[self.refusal])


class CommandClient:
    """Sends commands to the server of an instance."""

    def __init__(self, member: Member) -> None:
        self._instance = member.instance
        self._client = member.client(COMMANDS, Command, CommandReply)

    def call(self, kind: CommandKind, value: float, deadline: Deadline) -> int:
        """Sends one command and waits for its reply until the deadline. Returns the tick from which the command holds.

        Raises `Refused` with the server's reason. Raises `NoServer` at once if no server is connected, or if the server
        ends before it replies. Raises `NoAnswer` if no reply arrives in time.
        """
        command = Command(kind, 0, 0, (ctypes.c_double * 2)(value), os.getpid(), 0)
        reply = self._reply(command, deadline)
        if reply.refusal:
            raise Refused(command, reply)
        return reply.tick

    def _reply(self, command: Command, deadline: Deadline) -> CommandReply:
        pending = self._send(command)
        if pending.number_of_server_connections == 0:
            raise NoServer(self._instance)
        while True:
            # Read before the reply is received: a server disconnects from a command as soon as it has replied.
            is_gone, is_late = not pending.is_connected, not deadline.left_s()
            response = _received(pending)
            if response is not None:
                return CommandReply.copy_from(response.payload_ptr)
            if is_gone:
                raise NoServer(self._instance)
            if is_late:
                raise NoAnswer(self._instance, deadline.timeout_s)
            deadline.sleep(_POLL_PERIOD_S)

    def _send(self, command: Command) -> Any:
        try:
            return self._client.send_copy(command)
        except (iox2.RequestSendError, iox2.LoanError) as error:
            raise BusError(f"{COMMANDS}: {error}") from error


def _received(pending: Any) -> Any | None:
    try:
        return pending.receive()
    except iox2.ReceiveError as error:
        raise BusError(f"{COMMANDS}: {error}") from error


_VALUES: dict[int, tuple[str, str]] = {CommandKind.SPEED: ("speed", "m/s"), CommandKind.SEEK: ("show time", "s")}
"""Name and unit of a command's value."""


def _out_of_range(command: Command, lowest: float, highest: float) -> str:
    """Returns the text for a refused value: the value and the allowed range. Limits have three decimals and are rounded
    towards the inside of the range."""
    name, unit = _VALUES.get(command.kind, ("value", ""))
    least, most = math.ceil(lowest * 1e3) / 1e3, math.floor(highest * 1e3) / 1e3
    text = f"the {name} is {_plain(command.values[0])} {unit}, must be from {_plain(least)} to {_plain(most)} {unit}"
    return text.strip()


def _plain(number: float) -> str:
    """Returns the shortest text that parses to the same number, without an exponent."""
    return np.format_float_positional(number, trim="-")

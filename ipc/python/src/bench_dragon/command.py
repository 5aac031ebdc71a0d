"""Commands to the server, each answered once."""

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
    """What a client asks of the server."""

    PAUSE = 0
    """Stop walking until `RESUME`."""
    RESUME = 1
    """Go on after `PAUSE`."""
    SPEED = 2
    """Walk at this speed of the head, in metres per show second, 0 to 10."""
    SEEK = 3
    """Go to this show time, in seconds."""
    HOLD = 4
    """Stop for safety; only `RELEASE` lifts it."""
    RELEASE = 5
    """Lift a `HOLD`."""
    STOP = 6
    """End the server: the head comes to rest first, and the last frame of the run says `ENDED`."""


class Command(WireType):
    """A command as it lies in shared memory."""

    TYPE_NAME = "bench_dragon.Command.v3"

    kind: int
    """A `CommandKind` as its number."""
    sender: int
    """The kind of program that sends it: 0 for a client of the library."""
    run_id: int
    """The run that it is for; 0 where it is for any."""
    values: ctypes.Array[ctypes.c_double]
    """The command's values, the first ones first; 0 where it has fewer."""
    pid: int
    """Process id of the sender."""
    flags: int
    """Always 0: only a guard's grants have flags."""

    _fields_ = [
        ("kind", ctypes.c_uint32),
        ("sender", ctypes.c_uint32),
        ("run_id", ctypes.c_uint64),
        ("values", ctypes.c_double * 2),
        ("pid", ctypes.c_uint32),
        ("flags", ctypes.c_uint32),
    ]


class CommandReply(WireType):
    """The server's answer as it lies in shared memory."""

    TYPE_NAME = "bench_dragon.CommandReply.v1"

    run_id: int
    """Run of the server that answers."""
    tick: int
    """Tick from which an accepted command holds; the tick at which it was refused otherwise."""
    lowest: float
    """Least value that a refused value may have."""
    highest: float
    """Greatest value that a refused value may have."""
    refusal: int
    """0 where the command was accepted, else a `Refusal` as its number."""
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
    """Why a command was refused."""

    UNKNOWN = 1
    """The server does not know this kind of command, or this version does not know the reason."""
    OUT_OF_RANGE = 2
    """The value is not a number between the two that `Refused` names."""
    HELD = 3
    """The show is held, and only `release` lifts that."""
    NOT_HELD = 4
    """There is no hold to release."""
    FINISHED = 5
    """The show is over; a `seek` starts it again."""
    NOT_GUARDED = 6
    """The server takes no grants: it was not started with `--guarded`."""
    NOT_PROVED = 7
    """The server is guarded, and its guard has not proved that the benches are apart where the seek goes."""
    OTHER_RUN = 8
    """The grant is for another run."""
    HELD_BY_GUARD = 9
    """The guard holds the dragon, and only its next grant moves it on."""
    REPLAYED = 10
    """The source replays a recording, which is as it is."""
    UNREACHABLE = 11
    """The source is on another host, which does not answer."""
    NOT_TAKEN = 12
    """The source is on another host, whose bridge takes no commands: it was not started with `--allow-commands`."""
    TOO_MANY = 13
    """More commands at a time than a bridge to another host passes on."""
    FOLLOWED = 14
    """The show follows timecode, which says where it is: a seek would be undone at once."""


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
    """The server has refused a command. The text is its reason."""

    def __init__(self, command: Command, reply: CommandReply) -> None:
        self.refusal = decoded(Refusal, reply.refusal) or Refusal.UNKNOWN
        """The reason."""
        self.tick = reply.tick
        """The tick at which it was refused."""
        self.run_id = reply.run_id
        """The run of the server that refused it."""
        self.lowest, self.highest = reply.lowest, reply.highest
        """What the value must be from and to, where it was out of range; else 0."""
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
        """Sends one command and waits for its reply. Returns the tick from which it holds.

        Raises `Refused`; at once `NoServer` where no server took the command, or it ended before it answered; and
        `NoAnswer` where it has not answered in time.
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
            # Asked before the reply is looked for: a server lets go of a command as soon as it has answered.
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
"""What the value of a command is, and its unit."""


def _out_of_range(command: Command, lowest: float, highest: float) -> str:
    """Which value was refused, and what is allowed: to three decimals, rounded to the side that is."""
    name, unit = _VALUES.get(command.kind, ("value", ""))
    least, most = math.ceil(lowest * 1e3) / 1e3, math.floor(highest * 1e3) / 1e3
    text = f"the {name} is {_plain(command.values[0])} {unit}, must be from {_plain(least)} to {_plain(most)} {unit}"
    return text.strip()


def _plain(number: float) -> str:
    """The shortest form that reads back the same, never with an exponent."""
    return np.format_float_positional(number, trim="-")

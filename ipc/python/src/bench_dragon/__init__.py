"""The bench dragon's poses as numpy arrays on shared memory, and commands to its server.

A bench dragon is a chain of N benches, hinged end to end, that walks along a route. Its N + 1 hinges are called
handles. A server publishes the state of every handle of one dragon or of several at a fixed rate into iceoryx2 shared
memory. A `Show` reads it in place, without a copy.

- *Waiting:* no reader ever delays the server. A reader that falls behind by more than its buffer loses its own oldest
  frames, and counts them.
- *Changes by other processes:* a frame does not change while it is held. Between two frames the server may be
  restarted.
- *Units:* metres, seconds, radians; x right, y away, z up. Times with `_ns` are integers in nanoseconds, clocks are
  `CLOCK_MONOTONIC`. Speeds are metres per show second; multiply them by `FrameHeader.time_scale` for wall time.
"""

from bench_dragon._bus import __version__
from bench_dragon.alert import Alert
from bench_dragon.bench import Benches
from bench_dragon.codes import (
    AlertKind,
    DragonState,
    EventKind,
    GuardState,
    Refusal,
    Sender,
    ShowState,
    SourceKind,
    Stops,
    TimecodeKind,
    TimecodeState,
)
from bench_dragon.command_event import CommandEvent
from bench_dragon.continuity import Continuity
from bench_dragon.description import Description
from bench_dragon.domain import Domain
from bench_dragon.dragons import DragonFrame, Dragons
from bench_dragon.errors import (
    BusError,
    DomainError,
    HalfMade,
    NoAnswer,
    NoServer,
    OutOfResources,
    PermissionDenied,
    Refused,
    TooManyClients,
    TooManyFramesHeld,
    VersionMismatch,
)
from bench_dragon.frame import DragonMotion, Frame, FrameHeader, HandleState
from bench_dragon.show import Show
from bench_dragon.source import SourceState
from bench_dragon.status import Status, TimeHistogram

__all__ = [
    "Alert",
    "AlertKind",
    "Benches",
    "BusError",
    "CommandEvent",
    "Continuity",
    "Description",
    "Domain",
    "DomainError",
    "DragonFrame",
    "DragonMotion",
    "DragonState",
    "Dragons",
    "EventKind",
    "Frame",
    "FrameHeader",
    "GuardState",
    "HalfMade",
    "HandleState",
    "NoAnswer",
    "NoServer",
    "OutOfResources",
    "PermissionDenied",
    "Refusal",
    "Refused",
    "Sender",
    "Show",
    "ShowState",
    "SourceKind",
    "SourceState",
    "Status",
    "Stops",
    "TimecodeKind",
    "TimecodeState",
    "TimeHistogram",
    "TooManyClients",
    "TooManyFramesHeld",
    "VersionMismatch",
    "__version__",
]

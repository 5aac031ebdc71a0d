"""The bench dragon's poses as numpy arrays on shared memory, and commands to its server.

A server publishes the state of every bench at a fixed rate into iceoryx2 shared memory; a `Dragon` reads it in place.

- *Who waits:* no reader ever delays the server. One that falls behind by more than its buffer loses its own oldest
  frames, and counts them.
- *What another process may change:* nothing in a frame that is held. Between two frames the server may be restarted.
- *Units:* metres, seconds, radians; x right, y away, z up. Times with `_ns` are nanoseconds, clocks are
  `CLOCK_MONOTONIC`. Speeds are metres per show second.
"""

from bench_dragon.alert import Alert, AlertKind
from bench_dragon.bench import Benches
from bench_dragon.command import Refusal, Refused
from bench_dragon.continuity import Continuity
from bench_dragon.description import Description
from bench_dragon.domain import Domain
from bench_dragon.dragon import Dragon
from bench_dragon.errors import (
    BusError,
    DomainError,
    HalfMade,
    NoAnswer,
    NoServer,
    OutOfResources,
    PermissionDenied,
    TooManyClients,
    TooManyFramesHeld,
    VersionMismatch,
)
from bench_dragon.frame import Frame, FrameHeader, HandleState, ShowState
from bench_dragon.status import GuardState, SourceKind, Status, Stops, TimecodeState, TimeHistogram

__all__ = [
    "Alert",
    "AlertKind",
    "Benches",
    "BusError",
    "Continuity",
    "Description",
    "Domain",
    "DomainError",
    "Dragon",
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
    "ShowState",
    "SourceKind",
    "Status",
    "Stops",
    "TimecodeState",
    "TimeHistogram",
    "TooManyClients",
    "TooManyFramesHeld",
    "VersionMismatch",
]

"""Numeric codes of the bus. Generated from the Rust crate by its test `wire`; not changed by hand."""

from enum import IntFlag

from bench_dragon.wire import WireCode


class AlertKind(WireCode):
    """Kind of an alert."""

    NEAR = 0
    """Two benches came nearer than the configured `near_m`."""
    CONTACT = 1
    """Two benches touched."""
    PARTED = 2
    """Two benches that had touched are apart again."""
    HELD = 3
    """The show is held."""
    FAULT = 4
    """The frames do not agree with the published description."""
    RESTARTED = 5
    """The source of the frames was restarted."""
    OUTSIDE = 6
    """A board left the outline of the stage, while the bench before it is inside."""
    INSIDE = 7
    """A board that was outside is inside the outline of the stage, and so is the bench behind it."""
    KEEP_OUT = 8
    """A board entered an area to keep out of, while the bench before it is not in one."""
    TOO_NEAR = 9
    """A board came nearer to a border of the stage than the configured `clear_m`, while the bench before it is clear.
    The line of the crowd counts without a `clear_m` too."""
    CLEAR = 10
    """A board is clear again of an area or a border, and so is the bench behind it."""


class CommandKind(WireCode):
    """Kind of a command to the server."""

    PAUSE = 0
    """Stop walking until `resume`."""
    RESUME = 1
    """Walk on after `pause`."""
    SPEED = 2
    """Walk at this speed of the head, in metres per show second, 0 to 10."""
    SEEK = 3
    """Seek to this show time, in seconds."""
    HOLD = 4
    """Stop for safety. Only `release` lifts the hold."""
    RELEASE = 5
    """Lift a hold, or start a show that is ready."""
    STOP = 6
    """End the server. The head comes to rest first, and the last frame of the run has the state `ended`."""
    PACE = 12
    """Play at this pace: plan time per show time. A replay does not record the commands that it takes."""
    GO = 13
    """Walk on from a cue that waits."""


class DragonState(WireCode):
    """What one dragon does."""

    STANDING = 0
    """It stands: it has not left yet, or the whole show stands."""
    WALKING = 1
    """It walks."""
    ENDED = 2
    """It has reached its end."""


class EventKind(WireCode):
    """Kind of an event."""

    PAUSE = 0
    """Stop walking until `resume`."""
    RESUME = 1
    """Walk on after `pause`."""
    SPEED = 2
    """Walk at this speed of the head, in metres per show second, 0 to 10."""
    SEEK = 3
    """Seek to this show time, in seconds."""
    HOLD = 4
    """Stop for safety. Only `release` lifts the hold."""
    RELEASE = 5
    """Lift a hold, or start a show that is ready."""
    STOP = 6
    """End the server. The head comes to rest first, and the last frame of the run has the state `ended`."""
    GRANT = 7
    """The guard has proved a travel, from the first to the second value in metres."""
    STAND = 8
    """The timecode that the server follows makes the show stand still. First value: 1 if the timecode determines the
    show time, else 0. Second value: the time scale."""
    FOLLOW = 9
    """The timecode makes the show run on. Values as for `stand`."""
    START = 10
    """The run begins. This is always the first event."""
    END = 11
    """The run has ended in order. This is the last event, at the last tick of the run."""
    PACE = 12
    """Play at this pace: plan time per show time. A replay does not record the commands that it takes."""
    GO = 13
    """Walk on from a cue that waits."""
    CUE = 14
    """The show has reached a cue, by walking or by a seek to it. First value: its number in the configuration, from 0.
    Second value: its plan time in seconds."""


class GuardState(WireCode):
    """State of the guard."""

    NONE = 0
    """The server is not guarded."""
    MISSING = 1
    """The server waits for grants, and no guard runs."""
    RUNNING = 2
    """A guard runs."""


class Refusal(WireCode):
    """Reason for which a server refuses a command."""

    UNKNOWN = 1
    """The server does not support this kind of command."""
    OUT_OF_RANGE = 2
    """The value is outside the allowed range, or NaN."""
    HELD = 3
    """The show is held. Only `release` lifts the hold."""
    NOT_HELD = 4
    """There is no hold to release, and the show does not wait at its start."""
    FINISHED = 5
    """The show is finished. A `seek` starts it again."""
    NOT_GUARDED = 6
    """The server accepts no grants, because it was started without `--guarded`."""
    NOT_PROVED = 7
    """The server is guarded, and the guard has not yet proved that the benches are apart at the sought travel. The
    refused seek asks the guard to prove it. The same seek is accepted a little later, unless the benches are not apart
    there."""
    OTHER_RUN = 8
    """The grant is for another run."""
    HELD_BY_GUARD = 9
    """The guard holds the dragon. It walks on with the guard's next grant; where the proven travel has ended, only a
    seek moves it."""
    REPLAYED = 10
    """The source replays a recording. It can be paused, sought, played at another pace and stopped, but not changed."""
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
    NOTHING_WAITS = 16
    """The show does not stand at a cue that waits."""
    PAUSED = 17
    """The show is paused. `resume` continues."""


class Sender(WireCode):
    """The kind of program that sends a command."""

    CLIENT = 0
    """A client of the library, in Rust, C or Python, without a more specific kind."""
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
    SHOW = 9
    """`bench-dragon show --auto-go`."""
    OSC = 10
    """A desk or controller, through `bench-dragon bridge osc --listen`."""
    FOXGLOVE = 11
    """A viewer, through `bench-dragon bridge foxglove --steer`."""


class ShowState(WireCode):
    """State of the show."""

    RUNNING = 0
    """The head walks."""
    PAUSED = 1
    """Paused by the operator, or by a timecode that stands. `resume` continues."""
    HELD = 2
    """Stopped for safety: by a hold, which only `release` lifts, or at the end of the guard's grant."""
    FINISHED = 3
    """The show has reached the end of the route, of the feasible travel or of the requested time."""
    STOPPING = 4
    """The head still walks and brakes, because of a pause, a hold, a stop or the timecode."""
    ENDED = 5
    """The run has ended in order. This is its last frame."""
    READY = 6
    """The show waits at its start for its first `release`. It is calm: no safety stop."""
    WAITING = 7
    """The show waits at a cue for GO. It is calm: no safety stop."""


class SourceKind(WireCode):
    """The kind of source that publishes the frames."""

    SERVER = 0
    """A server, which simulates the show."""
    REPLAY = 1
    """A replay of a recording."""
    REMOTE = 2
    """A bridge that receives the frames of another host."""


class Stops(IntFlag):
    """Reasons for which the head stands or brakes. Several may hold at once."""

    PAUSED = 1
    """The operator's pause."""
    HELD = 2
    """A safety hold. `release` lifts it."""
    GUARD_LIMIT = 4
    """The head is at the end of the granted travel."""
    TIMECODE = 8
    """The timecode stands, or has not arrived yet."""
    ENDING = 16
    """The server is ending."""
    RUN_END = 32
    """The end of the route, of the feasible travel or of the requested time."""
    READY = 64
    """The show waits at its start. `release` starts it."""
    RESTARTED = 128
    """The server was restarted, and has held the show since. The show is held too."""
    WAITING = 256
    """The show waits at a cue. `go` lets it walk on."""


class TimecodeKind(WireCode):
    """The protocol of the timecode."""

    NONE = 0
    """The server follows no timecode."""
    ART_NET = 1
    """Art-Net (`ArtTimeCode`)."""
    OSC = 2
    """Open Sound Control."""
    LTC = 3
    """Linear timecode, as sound."""


class TimecodeState(WireCode):
    """State of the timecode that the server follows."""

    NONE = 0
    """The server follows no timecode."""
    WAITING = 1
    """No timecode has arrived yet; the show stands."""
    LOCKED = 2
    """The timecode runs, and the show follows."""
    STANDING = 3
    """The timecode stands, and so does the show."""
    LOST = 4
    """The timecode is lost. The show runs on at its own speed, unless it was standing."""

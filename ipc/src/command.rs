//! Commands to the server and its replies: the `bench-dragon/commands` service.

use core::fmt;

use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use crate::error::BusError;

/// A command in its shared-memory layout. Build it with [`Request::to_wire`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.Command.v3")]
pub struct Command {
    /// Number of the [`Request`] variant, see [`Request::to_wire`].
    pub kind: u32,
    /// A [`Sender`] as its number: the kind of program that sends it.
    pub sender: u32,
    /// Run for which the request is meant; 0 for any run.
    pub run_id: u64,
    /// Values of the request in their order; 0 for unused ones.
    pub values: [f64; 2],
    /// Process id of the sender.
    pub pid: u32,
    /// 1 for a grant whose proven travel ends permanently, else 0.
    pub flags: u32,
}

const _: () = assert!(size_of::<Command>() == 40 && align_of::<Command>() == 8);

/// The kind of program that sends a command.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Sender {
    /// A client of the library, in Rust, C or Python, without a more specific kind.
    #[default]
    Client = 0,
    /// `bench-dragon ctl`.
    Ctl = 1,
    /// A browser page of `bench-dragon view`.
    Page = 2,
    /// `bench-dragon watch`.
    Watch = 3,
    /// A program on another host, through `bench-dragon bridge zenoh`.
    Zenoh = 4,
    /// The timecode that the server follows.
    Timecode = 5,
    /// The guard, `bench-dragon monitor --guard`.
    Guard = 6,
    /// A signal to the server's process, such as Ctrl-C.
    Signal = 7,
    /// The server itself.
    Server = 8,
}

impl Sender {
    /// The kind of a number on the wire, or `None` for a number that this version does not support.
    pub fn from_wire(sender: u32) -> Option<Self> {
        [
            Self::Client,
            Self::Ctl,
            Self::Page,
            Self::Watch,
            Self::Zenoh,
            Self::Timecode,
            Self::Guard,
            Self::Signal,
            Self::Server,
        ]
        .into_iter()
        .find(|known| known.to_wire() == sender)
    }

    /// The number on the wire.
    pub fn to_wire(self) -> u32 {
        self as u32
    }

    /// Lower-case name, as the commands print it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Client => "client",
            Self::Ctl => "ctl",
            Self::Page => "page",
            Self::Watch => "watch",
            Self::Zenoh => "zenoh",
            Self::Timecode => "timecode",
            Self::Guard => "guard",
            Self::Signal => "signal",
            Self::Server => "server",
        }
    }
}

impl fmt::Display for Sender {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(self.name())
    }
}

/// The server's reply in its shared-memory layout. Read it with [`CommandReply::outcome`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend, FromBytes, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.CommandReply.v1")]
pub struct CommandReply {
    /// Run of the server that replies.
    pub run_id: u64,
    /// Tick from which an accepted command holds; for a refused command, the tick at which it was refused.
    pub tick: u64,
    /// Least allowed value, where a value was out of range.
    pub lowest: f64,
    /// Greatest allowed value, where a value was out of range.
    pub highest: f64,
    /// 0 where the command was accepted, else a [`Refusal`] as its number.
    pub refusal: u32,
    /// Always 0.
    pub reserved: u32,
}

const _: () = assert!(size_of::<CommandReply>() == 40 && align_of::<CommandReply>() == 8);

/// A request to the server.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// Stop walking until `Resume`.
    Pause,
    /// Walk on after `Pause`.
    Resume,
    /// Walk at this speed of the head, in metres per show second, 0 to 10.
    Speed {
        /// The speed.
        speed_mps: f64,
    },
    /// Seek to this show time in seconds. The travel becomes the configured speed times the show time. On a replay: to this
    /// position in the recording, see [`ReplayStatus`](crate::ReplayStatus); a position beyond the end is the end.
    Seek {
        /// The show time.
        sim_time_s: f64,
    },
    /// Stop for safety. Only `Release` lifts the hold.
    Hold,
    /// Lift a `Hold`, or start a show that is [ready](crate::ShowState::Ready).
    Release,
    /// End the server. The head comes to rest first, and the last frame of the run has the state
    /// [`ShowState::Ended`](crate::ShowState::Ended).
    Stop,
    /// The guard's proof that on an interval of travel all benches keep their distance from each other. The proof depends
    /// only on the run's geometry, not on how the head walks there, so it is never withdrawn. A guarded server moves the
    /// head only within granted travel, and `Seek` may jump into it.
    ///
    /// For the guard alone: a client that sends a grant lets the dragon walk where nobody has proved anything.
    #[doc(hidden)]
    Grant {
        /// Run whose description the guard used for the proof.
        run_id: u64,
        /// Start of the proven interval, in metres of travel.
        from_m: f64,
        /// End of the proven interval, in metres of travel.
        to_m: f64,
        /// Whether the proven travel ends there permanently: no later grant reaches further.
        is_final: bool,
    },
    /// Replay at this pace, in recorded seconds per second, 0.01 to 100. Only a replay accepts it.
    Pace {
        /// The pace.
        factor: f64,
    },
}

impl Request {
    /// Greatest allowed speed of the head, in metres per show second.
    pub const MAX_SPEED_MPS: f64 = 10.0;

    /// Returns the wire form with [`Sender::Client`] as the sender.
    pub fn to_wire(self) -> Command {
        let plain = |kind| Command { kind, ..Command::default() };
        match self {
            Self::Pause => plain(0),
            Self::Resume => plain(1),
            Self::Speed { speed_mps } => Command { values: [speed_mps, 0.0], ..plain(2) },
            Self::Seek { sim_time_s } => Command { values: [sim_time_s, 0.0], ..plain(3) },
            Self::Hold => plain(4),
            Self::Release => plain(5),
            Self::Stop => plain(6),
            Self::Grant { run_id, from_m, to_m, is_final } => {
                Command { run_id, values: [from_m, to_m], flags: is_final.into(), ..plain(7) }
            }
            // The kinds of command events have the numbers from 8 to 11.
            Self::Pace { factor } => Command { values: [factor, 0.0], ..plain(12) },
        }
    }

    /// Returns the request of a wire form, or `None` for a kind that this version does not support.
    ///
    /// Values are not checked and may be NaN: the server refuses values that are out of range.
    pub fn from_wire(command: &Command) -> Option<Self> {
        let [value, second] = command.values;
        Some(match command.kind {
            0 => Self::Pause,
            1 => Self::Resume,
            2 => Self::Speed { speed_mps: value },
            3 => Self::Seek { sim_time_s: value },
            4 => Self::Hold,
            5 => Self::Release,
            6 => Self::Stop,
            7 => Self::Grant { run_id: command.run_id, from_m: value, to_m: second, is_final: command.flags & 1 != 0 },
            12 => Self::Pace { factor: value },
            _ => return None,
        })
    }
}

/// Reason for which a server refuses a command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Refusal {
    /// The server does not support this kind of command.
    Unknown,
    /// The value is outside this range, or NaN.
    OutOfRange {
        /// Least allowed value.
        lowest: f64,
        /// Greatest allowed value.
        highest: f64,
    },
    /// The show is held. Only `release` lifts the hold.
    Held,
    /// There is no hold to release, and the show does not wait at its start.
    NotHeld,
    /// The show is finished. A `seek` starts it again.
    Finished,
    /// The server accepts no grants, because it was started without `--guarded`.
    NotGuarded,
    /// The server is guarded, and the guard has not yet proved that the benches are apart at the sought travel. The
    /// refused seek asks the guard to prove it. The same seek is accepted a little later, unless the benches are not
    /// apart there.
    NotProved,
    /// The grant is for another run.
    OtherRun,
    /// The guard holds the dragon. It walks on with the guard's next grant; where the proven travel has ended, only a seek
    /// moves it.
    HeldByGuard,
    /// The source replays a recording. It can be paused, sought, played at another pace and stopped, but not changed.
    Replayed,
    /// The source is on another host, which does not answer.
    Unreachable,
    /// The source is on another host, and its bridge accepts no commands: it was started without `--allow-commands`.
    NotTaken,
    /// More commands at a time than a bridge forwards to another host.
    TooMany,
    /// The show follows timecode, which determines the show time. The timecode would undo a seek immediately.
    Followed,
    /// The show waits at its start. Only `release` starts it.
    Ready,
}

impl fmt::Display for Refusal {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unknown => formatter.write_str("the server does not support this command"),
            Self::OutOfRange { lowest, highest } => {
                write!(formatter, "the value must be from {lowest} to {highest}")
            }
            Self::Held => formatter.write_str("the show is held: release it first"),
            Self::NotHeld => formatter.write_str("the show is not held"),
            Self::Finished => formatter.write_str("the show is finished: seek to start it again"),
            Self::NotGuarded => formatter.write_str("the server is not guarded: start it with --guarded"),
            Self::NotProved => formatter.write_str("no guard has proved that the benches are apart there"),
            Self::OtherRun => formatter.write_str("the grant is for another run"),
            Self::HeldByGuard => formatter.write_str(
                "the guard holds the dragon: it walks on by itself if the guard proves the travel ahead, else only a seek moves it",
            ),
            Self::Replayed => formatter
                .write_str("the source replays a recording: it accepts only pause, resume, seek, pace and stop"),
            Self::Unreachable => formatter.write_str("the server is on another host, which does not answer"),
            Self::NotTaken => formatter
                .write_str("the server is on another host: start its bridge with --allow-commands to send commands"),
            Self::TooMany => {
                formatter.write_str("more commands at a time than the bridge forwards to another host: try again")
            }
            Self::Followed => formatter.write_str("the show follows timecode: seek on the device that sends it"),
            Self::Ready => formatter.write_str("the show waits at its start: release it first"),
        }
    }
}

impl Refusal {
    /// Returns the reason in words for the refused request. For a value out of range, the text has the value, its unit
    /// and the allowed range.
    ///
    /// ```
    /// use bench_dragon_ipc::{Refusal, Request};
    ///
    /// let refusal = Refusal::OutOfRange { lowest: 0.0, highest: 432.758_716 };
    /// let text = refusal.explain(&Request::Seek { sim_time_s: 500.0 });
    /// assert_eq!(text, "the show time is 500 s, must be from 0 to 432.758 s");
    /// assert!(refusal.explain(&Request::Seek { sim_time_s: 1e300 }).starts_with("the show time is 1e300 s, must"));
    /// ```
    pub fn explain(&self, request: &Request) -> String {
        let (lowest, highest) = match *self {
            Self::OutOfRange { lowest, highest } => (within(lowest, f64::ceil), within(highest, f64::floor)),
            _ => return self.to_string(),
        };
        let (name, value, unit) = match *request {
            Request::Speed { speed_mps } => ("speed", speed_mps, "m/s"),
            Request::Seek { sim_time_s } => ("show time", sim_time_s, "s"),
            Request::Grant { to_m, .. } => ("granted travel", to_m, "m"),
            Request::Pace { factor } => ("pace", factor, "times the recorded one"),
            _ => return self.to_string(),
        };
        // Without an exponent, 1e300 would have 301 digits.
        let value = if value.abs() < LONG_NUMBER { value.to_string() } else { format!("{value:e}") };
        format!("the {name} is {value} {unit}, must be from {lowest} to {highest} {unit}")
    }
}

/// A number from which on messages have an exponent.
const LONG_NUMBER: f64 = 1e15;

/// Rounds a limit to three decimals, towards the inside of the range.
fn within(limit: f64, round: fn(f64) -> f64) -> f64 {
    // Adding 0 removes the sign of a negative zero.
    round(limit * 1e3) / 1e3 + 0.0
}

impl CommandReply {
    /// Returns the reply to a command that holds from `tick` on.
    pub fn accepted(run_id: u64, tick: u64) -> Self {
        Self { run_id, tick, ..Self::default() }
    }

    /// Returns the reply to a command that was refused at `tick`.
    pub fn refused(run_id: u64, tick: u64, refusal: Refusal) -> Self {
        let reply = Self { run_id, tick, ..Self::default() };
        match refusal {
            Refusal::Unknown => Self { refusal: 1, ..reply },
            Refusal::OutOfRange { lowest, highest } => Self { refusal: 2, lowest, highest, ..reply },
            Refusal::Held => Self { refusal: 3, ..reply },
            Refusal::NotHeld => Self { refusal: 4, ..reply },
            Refusal::Finished => Self { refusal: 5, ..reply },
            Refusal::NotGuarded => Self { refusal: 6, ..reply },
            Refusal::NotProved => Self { refusal: 7, ..reply },
            Refusal::OtherRun => Self { refusal: 8, ..reply },
            Refusal::HeldByGuard => Self { refusal: 9, ..reply },
            Refusal::Replayed => Self { refusal: 10, ..reply },
            Refusal::Unreachable => Self { refusal: 11, ..reply },
            Refusal::NotTaken => Self { refusal: 12, ..reply },
            Refusal::TooMany => Self { refusal: 13, ..reply },
            Refusal::Followed => Self { refusal: 14, ..reply },
            Refusal::Ready => Self { refusal: 15, ..reply },
        }
    }

    /// Returns an accepted reply to a request.
    ///
    /// # Errors
    /// [`BusError::Refused`] where the server has refused the request.
    pub(crate) fn to(self, request: Request) -> Result<Self, BusError> {
        match self.outcome() {
            Ok(_tick) => Ok(self),
            Err(refusal) => Err(BusError::Refused { request, refusal, reply: self }),
        }
    }

    /// Returns the tick from which the command holds.
    ///
    /// # Errors
    /// The reason of the refusal; [`Refusal::Unknown`] for a number that this version does not support.
    pub fn outcome(&self) -> Result<u64, Refusal> {
        match self.refusal {
            0 => Ok(self.tick),
            2 => Err(Refusal::OutOfRange { lowest: self.lowest, highest: self.highest }),
            3 => Err(Refusal::Held),
            4 => Err(Refusal::NotHeld),
            5 => Err(Refusal::Finished),
            6 => Err(Refusal::NotGuarded),
            7 => Err(Refusal::NotProved),
            8 => Err(Refusal::OtherRun),
            9 => Err(Refusal::HeldByGuard),
            10 => Err(Refusal::Replayed),
            11 => Err(Refusal::Unreachable),
            12 => Err(Refusal::NotTaken),
            13 => Err(Refusal::TooMany),
            14 => Err(Refusal::Followed),
            15 => Err(Refusal::Ready),
            _ => Err(Refusal::Unknown),
        }
    }
}

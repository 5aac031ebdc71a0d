//! Commands to the server and its replies: the `bench-dragon/commands` service.

use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{FromBytes, Immutable, IntoBytes, KnownLayout};

use super::wire_enum::wire_enum;

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

wire_enum! {
    /// The kind of program that sends a command.
    #[derive(Default, Eq, Hash)]
    Sender {
        /// A client of the library, in Rust, C or Python, without a more specific kind.
        Client = 0, "client", default;
        /// `bench-dragon ctl`.
        Ctl = 1, "ctl";
        /// A browser page of `bench-dragon view`.
        Page = 2, "page";
        /// `bench-dragon watch`.
        Watch = 3, "watch";
        /// A program on another host, through `bench-dragon bridge zenoh`.
        Zenoh = 4, "zenoh";
        /// The timecode that the server follows.
        Timecode = 5, "timecode";
        /// The guard, `bench-dragon monitor --guard`.
        Guard = 6, "guard";
        /// A signal to the server's process, such as Ctrl-C.
        Signal = 7, "signal";
        /// The server itself.
        Server = 8, "server";
        /// `bench-dragon show --auto-go`.
        Show = 9, "show";
        /// A desk or controller, through `bench-dragon bridge osc --listen`.
        Osc = 10, "osc";
        /// A viewer, through `bench-dragon bridge foxglove --steer`.
        Foxglove = 11, "foxglove";
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
    /// Walk at this speed of the leading head, in metres per show second, 0 to 10: play at the pace at which its planned speed
    /// becomes this speed.
    Speed {
        /// The speed.
        speed_mps: f64,
    },
    /// Seek to this show time in seconds. The travel becomes the configured speed times the show time. On a replay: to this
    /// position in the recording, see [`ReplayStatus`](crate::ReplayStatus); a position beyond the end is the end.
    Seek {
        /// The show time.
        show_time_s: f64,
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
    /// Play at this pace: plan time per show time, from 0 to 10 m/s ÷ the planned speed. On a replay: recorded seconds per second,
    /// 0.01 to 100.
    Pace {
        /// The pace.
        factor: f64,
    },
    /// Walk on from a cue that waits.
    Go,
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
            Self::Seek { show_time_s } => Command { values: [show_time_s, 0.0], ..plain(3) },
            Self::Hold => plain(4),
            Self::Release => plain(5),
            Self::Stop => plain(6),
            Self::Grant { run_id, from_m, to_m, is_final } => {
                Command { run_id, values: [from_m, to_m], flags: is_final.into(), ..plain(7) }
            }
            // The kinds of command events have the numbers from 8 to 11, and 14.
            Self::Pace { factor } => Command { values: [factor, 0.0], ..plain(12) },
            Self::Go => plain(13),
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
            3 => Self::Seek { show_time_s: value },
            4 => Self::Hold,
            5 => Self::Release,
            6 => Self::Stop,
            7 => Self::Grant { run_id: command.run_id, from_m: value, to_m: second, is_final: command.flags & 1 != 0 },
            12 => Self::Pace { factor: value },
            13 => Self::Go,
            _ => return None,
        })
    }
}

wire_enum! {
    /// Reason for which a server refuses a command.
    Refusal {
        /// The server does not support this kind of command.
        Unknown = 1, "the server does not support this command";
        /// The value is outside the allowed range, or NaN.
        OutOfRange {
            /// Least allowed value.
            lowest,
            /// Greatest allowed value.
            highest
        } = 2, "the value is out of range";
        /// The show is held. Only `release` lifts the hold.
        Held = 3, "the show is held: release it first";
        /// There is no hold to release, and the show does not wait at its start.
        NotHeld = 4, "the show is not held";
        /// The show is finished. A `seek` starts it again.
        Finished = 5, "the show is finished: seek to start it again";
        /// The server accepts no grants, because it was started without `--guarded`.
        NotGuarded = 6, "the server is not guarded: start it with --guarded";
        /// The server is guarded, and the guard has not yet proved that the benches are apart at the sought travel. The
        /// refused seek asks the guard to prove it. The same seek is accepted a little later, unless the benches are not
        /// apart there.
        NotProved = 7, "no guard has proved that the benches are apart there";
        /// The grant is for another run.
        OtherRun = 8, "the grant is for another run";
        /// The guard holds the dragon. It walks on with the guard's next grant; where the proven travel has ended, only a
        /// seek moves it.
        HeldByGuard = 9,
            "the guard holds the dragon: it walks on by itself if the guard proves the travel ahead, else only a seek moves it";
        /// The source replays a recording. It can be paused, sought, played at another pace and stopped, but not changed.
        Replayed = 10, "the source replays a recording: it accepts only pause, resume, seek, pace and stop";
        /// The source is on another host, which does not answer.
        Unreachable = 11, "the server is on another host, which does not answer";
        /// The source is on another host, and its bridge accepts no commands: it was started without `--allow-commands`.
        NotTaken = 12,
            "the server is on another host: start its bridge with --allow-commands to send commands";
        /// More commands at a time than a bridge forwards to another host.
        TooMany = 13, "more commands at a time than the bridge forwards to another host: try again";
        /// The show follows timecode, which determines the show time. The timecode would undo a seek immediately.
        Followed = 14, "the show follows timecode: seek on the device that sends it";
        /// The show waits at its start. Only `release` starts it.
        Ready = 15, "the show waits at its start: release it first";
        /// The show does not stand at a cue that waits.
        NothingWaits = 16, "no cue waits for GO";
        /// The show is paused. `resume` continues.
        Paused = 17, "the show is paused: resume it first";
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
    /// let text = refusal.explain(&Request::Seek { show_time_s: 500.0 });
    /// assert_eq!(text, "the show time is 500 s, must be from 0 to 432.758 s");
    /// assert!(refusal.explain(&Request::Seek { show_time_s: 1e300 }).starts_with("the show time is 1e300 s, must"));
    /// ```
    pub fn explain(&self, request: &Request) -> String {
        let (lowest, highest) = match *self {
            Self::OutOfRange { lowest, highest } => (within(lowest, f64::ceil), within(highest, f64::floor)),
            _ => return self.to_string(),
        };
        let (name, value, unit) = match *request {
            Request::Speed { speed_mps } => ("speed", speed_mps, "m/s"),
            Request::Seek { show_time_s } => ("show time", show_time_s, "s"),
            Request::Grant { to_m, .. } => ("granted travel", to_m, "m"),
            Request::Pace { factor } => ("pace", factor, "times the planned one"),
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
        let (lowest, highest) = match refusal {
            Refusal::OutOfRange { lowest, highest } => (lowest, highest),
            _ => (0.0, 0.0),
        };
        Self { run_id, tick, lowest, highest, refusal: refusal.to_wire(), reserved: 0 }
    }

    /// Returns the tick from which the command holds.
    ///
    /// # Errors
    /// The reason of the refusal; [`Refusal::Unknown`] for a number that this version does not support.
    pub fn outcome(&self) -> Result<u64, Refusal> {
        if self.refusal == 0 {
            return Ok(self.tick);
        }
        Err(match Refusal::from_wire(self.refusal) {
            Some(Refusal::OutOfRange { .. }) => Refusal::OutOfRange { lowest: self.lowest, highest: self.highest },
            known => known.unwrap_or(Refusal::Unknown),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_refusal_is_the_same_after_its_way_over_the_wire() {
        for (number, refusal) in (1..).zip(Refusal::ALL) {
            let reply = CommandReply::refused(7, 41, refusal);
            assert_eq!((reply.refusal, reply.outcome()), (number, Err(refusal)));
        }
        let limited = Refusal::OutOfRange { lowest: -0.5, highest: 2.5 };
        assert_eq!(CommandReply::refused(7, 41, limited).outcome(), Err(limited));
        let newer = CommandReply { refusal: 18, ..CommandReply::accepted(7, 41) };
        assert_eq!((newer.outcome(), CommandReply::accepted(7, 41).outcome()), (Err(Refusal::Unknown), Ok(41)));
    }
}

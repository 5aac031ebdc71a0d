//! Status of the server: the latest value on the `bench-dragon/status` service.

use core::fmt;

use iceoryx2::prelude::ZeroCopySend;
use zerocopy::{Immutable, IntoBytes, KnownLayout};

use super::frame::ShowState;
use super::time_histogram::TimeHistogram;
use super::wire_enum::wire_enum;

/// State and timing of the server. Published ten times a second and once more at the end.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, ZeroCopySend, IntoBytes, Immutable, KnownLayout)]
#[type_name("bench_dragon.Status.v4")]
pub struct Status {
    /// Run of the server.
    pub run_id: u64,
    /// Last tick published.
    pub tick: u64,
    /// Show time of that tick in nanoseconds.
    pub show_time_ns: i64,
    /// Number of periods that were missed since the start of the run. After a few missed periods show time jumps
    /// forward. After a longer standstill the show is behind; see `behind_ns`.
    pub overruns: u64,
    /// Time by which the show is behind the clock, in nanoseconds of wall time: the rest of standstills, for which the
    /// show makes up.
    pub behind_ns: u64,
    /// Greatest value of `behind_ns` since the start of the run.
    pub most_behind_ns: u64,
    /// Median of the lateness of all ticks since the start of the run, in nanoseconds. Lateness is the time from the
    /// due instant to the start of the tick. Percentiles are from the histogram, so they are at most 1/32 too large.
    pub lateness_p50_ns: u64,
    /// 99th percentile of the lateness, in nanoseconds.
    pub lateness_p99_ns: u64,
    /// 99.9th percentile of the lateness, in nanoseconds.
    pub lateness_p999_ns: u64,
    /// Greatest lateness, in nanoseconds.
    pub lateness_max_ns: u64,
    /// Median of the duration of all ticks since the start of the run, in nanoseconds. A tick lasts until the loop is
    /// ready for the next one.
    pub tick_p50_ns: u64,
    /// 99th percentile of the duration, in nanoseconds.
    pub tick_p99_ns: u64,
    /// 99.9th percentile of the duration, in nanoseconds.
    pub tick_p999_ns: u64,
    /// Greatest duration, in nanoseconds.
    pub tick_max_ns: u64,
    /// Travel up to which a guarded server may move the head, in metres; [`Status::NONE`] for a server that is not guarded.
    pub granted_to_m: f64,
    /// Travel of a refused seek on a guarded server, in metres, until a grant contains it; else [`Status::NONE`]. The guard is asked to
    /// prove it.
    pub asked_m: f64,
    /// Travel at which the proven travel ends permanently, in metres; [`Status::NONE`] where the guard has not reached
    /// it.
    pub guard_end_m: f64,
    /// Ticks per second of wall time.
    pub rate_hz: u32,
    /// A [`ShowState`] as its number.
    pub state: u32,
    /// Process id of the server.
    pub pid: u32,
    /// A [`SourceKind`] as its number.
    pub source: u32,
    /// A [`GuardState`] as its number.
    pub guard: u32,
    /// A [`TimecodeState`] as its number.
    pub timecode: u32,
    /// A [`TimecodeKind`] as its number.
    pub timecode_kind: u32,
    /// The [`Stops`] that make the head stand or brake, as bits.
    pub stops: u32,
    /// Lateness of every tick since the start of the run.
    pub lateness: TimeHistogram,
    /// Duration of every tick since the start of the run.
    pub tick_time: TimeHistogram,
}

const _: () = assert!(size_of::<Status>() == 168 + 2 * size_of::<TimeHistogram>() && align_of::<Status>() == 8);

impl Status {
    /// Sentinel for *no travel*: NaN.
    pub const NONE: f64 = f64::NAN;

    /// Travel of a refused seek in metres, if there is one.
    pub fn asked(&self) -> Option<f64> {
        (!self.asked_m.is_nan()).then_some(self.asked_m)
    }

    /// The state of the show, or `None` for a number that this version does not support.
    pub fn show_state(&self) -> Option<ShowState> {
        ShowState::from_wire(self.state)
    }
}

impl Status {
    /// Travel at which the proven travel ends permanently, in metres; `None` where the guard has not reached it.
    pub fn guard_end(&self) -> Option<f64> {
        (!self.guard_end_m.is_nan()).then_some(self.guard_end_m)
    }

    /// The kind of source, or `None` for a number that this version does not support.
    pub fn source_kind(&self) -> Option<SourceKind> {
        SourceKind::from_wire(self.source)
    }

    /// The state of the guard, or `None` for a number that this version does not support.
    pub fn guard_state(&self) -> Option<GuardState> {
        GuardState::from_wire(self.guard)
    }

    /// The state of the timecode, or `None` for a number that this version does not support.
    pub fn timecode_state(&self) -> Option<TimecodeState> {
        TimecodeState::from_wire(self.timecode)
    }

    /// The protocol of the timecode, or `None` for a number that this version does not support.
    pub fn timecode_protocol(&self) -> Option<TimecodeKind> {
        TimecodeKind::from_wire(self.timecode_kind)
    }

    /// Reasons for which the head stands or brakes.
    pub fn stops(&self) -> Stops {
        Stops::from_wire(self.stops)
    }
}

wire_enum! {
    /// The kind of source that publishes the frames.
    #[derive(Default, Eq, Hash)]
    SourceKind {
        /// A server, which simulates the show.
        Server = 0, "server", default;
        /// A replay of a recording.
        Replay = 1, "replay";
        /// A bridge that receives the frames of another host.
        Remote = 2, "remote";
    }
}

wire_enum! {
    /// State of the guard.
    #[derive(Default, Eq, Hash)]
    GuardState {
        /// The server is not guarded.
        None = 0, "none", default;
        /// The server waits for grants, and no guard runs.
        Missing = 1, "missing";
        /// A guard runs.
        Running = 2, "running";
    }
}

wire_enum! {
    /// State of the timecode that the server follows.
    #[derive(Default, Eq, Hash)]
    TimecodeState {
        /// The server follows no timecode.
        None = 0, "none", default;
        /// No timecode has arrived yet; the show stands.
        Waiting = 1, "waiting";
        /// The timecode runs, and the show follows.
        Locked = 2, "locked";
        /// The timecode stands, and so does the show.
        Standing = 3, "standing";
        /// The timecode is lost. The show runs on at its own speed, unless it was standing.
        Lost = 4, "lost";
    }
}

wire_enum! {
    /// The protocol of the timecode.
    #[derive(Default, Eq, Hash)]
    TimecodeKind {
        /// The server follows no timecode.
        None = 0, "none", default;
        /// Art-Net (`ArtTimeCode`).
        ArtNet = 1, "Art-Net";
        /// Open Sound Control.
        Osc = 2, "OSC";
        /// Linear timecode, as sound.
        Ltc = 3, "LTC";
    }
}

wire_enum! {
    /// Reason for which the head stands or brakes.
    #[derive(Eq, Hash)]
    Stop {
        /// The operator's pause.
        Paused = 0, "paused";
        /// A safety hold. `release` lifts it.
        Held = 1, "held";
        /// The head is at the end of the granted travel.
        GuardLimit = 2, "guard_limit";
        /// The timecode stands, or has not arrived yet.
        Timecode = 3, "timecode";
        /// The server is ending.
        Ending = 4, "ending";
        /// The end of the route, of the feasible travel or of the requested time.
        RunEnd = 5, "run_end";
        /// The show waits at its start. `release` starts it.
        Ready = 6, "ready";
        /// The server was restarted, and has held the show since. The show is held too.
        Restarted = 7, "restarted";
        /// The show waits at a cue. `go` lets it walk on.
        Waiting = 8, "waiting";
    }
}

/// The reasons for which the head stands or brakes. Several may hold at once. A [`Stop`]'s number is that of its bit.
#[derive(Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct Stops(u32);

impl Stops {
    /// The bits on the wire.
    pub fn to_wire(self) -> u32 {
        self.0
    }

    /// The stops of the bits on the wire. Bits that this version does not support are ignored.
    pub fn from_wire(bits: u32) -> Self {
        Self(bits).iter().collect()
    }

    /// Whether the head stands or brakes for this reason.
    pub fn has(self, stop: Stop) -> bool {
        self.0 >> stop.to_wire() & 1 == 1
    }

    /// The reasons, by their numbers.
    pub fn iter(self) -> impl Iterator<Item = Stop> {
        Stop::ALL.into_iter().filter(move |&stop| self.has(stop))
    }
}

impl FromIterator<Stop> for Stops {
    fn from_iter<T: IntoIterator<Item = Stop>>(stops: T) -> Self {
        Self(stops.into_iter().fold(0, |bits, stop| bits | 1 << stop.to_wire()))
    }
}

impl<const N: usize> From<[Stop; N]> for Stops {
    fn from(stops: [Stop; N]) -> Self {
        stops.into_iter().collect()
    }
}

impl fmt::Debug for Stops {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.debug_set().entries(self.iter()).finish()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_set_of_stops_is_the_same_after_its_way_over_the_wire() {
        for bits in 0..1 << 9 {
            assert_eq!(Stops::from_wire(bits).to_wire(), bits);
        }
        assert_eq!(Stops::from_wire(1 << 9 | 1 << 31), Stops::default());
    }

    #[test]
    fn a_number_of_a_newer_server_is_unknown() {
        assert_eq!(GuardState::from_wire(GuardState::Running.to_wire()), Some(GuardState::Running));
        assert_eq!((GuardState::from_wire(3), TimecodeState::from_wire(9)), (None, None));
    }
}

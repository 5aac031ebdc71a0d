//! The snapshot: all that an observer shows at one instant.

use std::ops::Range;
use std::sync::Arc;
use std::time::Duration;

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::{DragonMotion, FrameHeader, HandleState, ReplayStatus, ShowState, Status};
use serde::{Deserialize, Serialize};

use super::contact::PastContact;
use super::described_run::{ClearanceChart, DescribedRun};
use super::event_logs::{AlertLog, CommandHistory};
use super::frame_statistics::FrameStatistics;
use super::guard_situation::GuardSituation;
use super::head_motion::{Arrival, TravelClock};
use super::members::Members;
use super::planned_clearance::PlannedClearance;
use super::reader_log::ReaderLog;
use super::recent_overruns::RecentOverruns;
use super::several::of_formation;
use super::show_forecast::ShowForecast;
use crate::config::{Config, Cue, NamedBenches};

/// A copy of a frame. A display can keep it without holding a sample of the server's shared memory.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameCopy {
    /// The frame's header.
    pub header: FrameHeader,
    /// The handles, head first; one more than the number of benches.
    pub handles: Vec<HandleState>,
}

impl FrameCopy {
    /// The indices of each dragon's handles, the leading dragon first, as far as the frame has them.
    pub fn dragons(&self) -> Vec<Range<usize>> {
        let count = self.handles.len();
        if self.header.is_plan == 0 {
            return std::iter::once(0..count).collect();
        }
        let handles = self.header.dragons().iter().map(DragonMotion::handles);
        handles.map(|Range { start, end }| start.min(count)..end.min(count)).collect()
    }
}

/// A least clearance and its show time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LeastClearance {
    /// Clearance in metres, negative if the benches overlap.
    pub clearance_m: f64,
    /// Show time in seconds.
    pub time_s: f64,
}

/// Greatest age of a current snapshot, in nanoseconds. The observer makes several per second, also without frames.
const FRESH_NS: u64 = 1_000_000_000;

/// Longest wait for the first frame or status of a source whose process exists, in nanoseconds.
const FIRST_FRAME_NS: u64 = 2_000_000_000;

/// All that an observer shows at one instant.
#[derive(Clone, Debug, Default)]
#[expect(clippy::struct_excessive_bools, reason = "each is a fact of its own")]
#[expect(missing_docs, reason = "the types of the fields describe them")]
pub struct Snapshot {
    /// Instant of the snapshot, in nanoseconds of `CLOCK_MONOTONIC`.
    pub seen_ns: u64,
    /// The source's presence at that instant; [`Snapshot::presence_at`] judges a later one.
    pub presence: SourcePresence,
    /// Name of the bus's instance.
    pub instance: String,
    /// Whether the process of a source exists.
    pub has_source: bool,
    /// Whether a `show` supervises the server, also while there is none.
    pub is_supervised: bool,
    /// Whether the server was restarted for this run.
    pub is_restarted: bool,
    /// Whether the `show` was killed, its server has ended, and no source has started since.
    pub has_lost_show: bool,
    /// Process id of the guard; `None` without one, or in another PID namespace.
    pub guard_pid: Option<u32>,
    /// Instant since which frames have arrived while the guard was this process.
    pub guarded_since_ns: u64,
    /// Whether a status of a source has arrived, also without a frame.
    pub hears_source: bool,
    /// The processes on the bus when the observer joined it; empty for an observer that reads the bus all the time.
    pub members: Arc<Members>,
    /// Instant since which the bus is read, in nanoseconds of `CLOCK_MONOTONIC`; `None` while it cannot be read.
    pub reading_since_ns: Option<u64>,
    /// The newest frame; after the source's end, its last frame.
    pub frame: Option<Arc<FrameCopy>>,
    /// The run of the frame. `None` until its description has arrived.
    pub run: Option<Arc<DescribedRun>>,
    /// The nearest pair of benches in the frame, without neighbours.
    pub nearest: Option<PairClearance>,
    /// The least clearance of all snapshots of this run.
    pub least: Option<LeastClearance>,
    pub forecast: ShowForecast,
    /// The head's arrival where a pose that the play of the hinges allows may touch first; `None` without play, or if none is known
    /// ahead.
    pub possible_contact: Option<Arrival>,
    pub guard: GuardSituation,
    pub chart: Option<Arc<ClearanceChart>>,
    /// The planned clearance of the whole run, as far as it is computed. `None` if the observer computes no plan.
    pub plan: Option<Arc<PlannedClearance>>,
    /// Converts travel to show time.
    pub clock: Option<TravelClock>,
    /// The server's status, of the same run as the frame.
    pub status: Option<Arc<Status>>,
    /// The position of a replay, of the same run as the frame. `None` for any other source.
    pub replay: Option<ReplayStatus>,
    pub statistics: FrameStatistics,
    /// Overruns of the last minute.
    pub recent_overruns: RecentOverruns,
    /// The last contact, also one of a minute ago and longer; [`Contact::of`](super::Contact::of) judges it.
    pub past_contact: Option<PastContact>,
    pub alerts: Arc<AlertLog>,
    pub readers: Arc<ReaderLog>,
    /// The newest commands: of operators, of the timecode, and refused commands of the guard.
    pub commands: Arc<CommandHistory>,
}

impl Snapshot {
    /// Returns a snapshot of a live source, whose frame has no handles.
    #[cfg(test)]
    pub(crate) fn live(header: FrameHeader) -> Self {
        let frame = Some(Arc::new(FrameCopy { header, handles: Vec::new() }));
        Self { presence: SourcePresence::Live, frame, ..Self::default() }
    }

    /// The configuration of the frame's run, if it is known.
    pub fn config(&self) -> Option<&Config> {
        self.run.as_ref().map(|run| &run.config)
    }

    /// The wait at which the show stands.
    pub fn cue_here(&self) -> Option<&Cue> {
        let (config, header) = (self.config()?, self.header()?);
        config.cues().iter().find(|cue| cue.waits && config.formation().course_m(cue.at_s) == header.course_m)
    }

    /// Whether the frame is one of a formation, whose place is plan time.
    pub fn is_formation(&self) -> bool {
        self.header().is_some_and(|header| header.is_plan != 0)
    }

    /// The dragons of two benches, and the indices within them, if there are several.
    pub fn named_benches(&self, benches: Option<[usize; 2]>) -> Option<NamedBenches> {
        self.config()?.named_benches(benches?)
    }

    /// A sentence about one dragon, in the words for the snapshot's number of dragons.
    pub fn spoken(&self, sentence: &str) -> String {
        if self.is_formation() { of_formation(sentence) } else { sentence.to_owned() }
    }

    /// A place on the course in words, with this number of digits.
    pub fn place_words<const DIGITS: usize>(&self, course_m: f64) -> String {
        match self.config() {
            Some(config) => config.place_words::<DIGITS>(course_m),
            None => format!("{} m of travel", Fixed::<DIGITS>(course_m)),
        }
    }

    /// Two benches in words.
    pub fn pair_words(&self, benches: [usize; 2]) -> String {
        NamedBenches::pair_words(self.named_benches(Some(benches)).as_ref(), benches)
    }

    /// The header of the frame.
    pub fn header(&self) -> Option<&FrameHeader> {
        self.frame.as_ref().map(|frame| &frame.header)
    }

    /// Whether a source's process exists that has sent neither a frame nor a status while the bus was read: it hangs, or was
    /// suspended before.
    pub(super) fn is_silent_from_the_start(&self, now_ns: u64) -> bool {
        let read_ns = self.reading_since_ns.map_or(0, |since_ns| now_ns.saturating_sub(since_ns));
        let is_waiting = self.presence == SourcePresence::Waiting && self.has_source;
        is_waiting && !self.hears_source && read_ns >= FIRST_FRAME_NS
    }

    /// The state of the show according to the newest frame; `Ended` if the last status reports the end.
    pub fn state(&self) -> Option<ShowState> {
        let has_ended = self.status.as_ref().is_some_and(|status| status.show_state() == Some(ShowState::Ended));
        if has_ended { Some(ShowState::Ended) } else { self.header()?.show_state() }
    }

    /// Returns the source's presence at an instant, if no newer snapshot has arrived. An old snapshot means that the observer
    /// hangs or has died, so its own presence no longer counts.
    ///
    /// ```
    /// use bench_dragon::display::observe::{SourcePresence, Snapshot};
    ///
    /// let snapshot = Snapshot { presence: SourcePresence::Live, seen_ns: 5_000_000_000, ..Snapshot::default() };
    /// assert_eq!(snapshot.presence_at(6_000_000_000), SourcePresence::Live);
    /// assert_eq!(snapshot.presence_at(6_000_000_001).name(), "failed");
    /// ```
    pub fn presence_at(&self, now_ns: u64) -> SourcePresence {
        if now_ns.saturating_sub(self.seen_ns) > FRESH_NS {
            return SourcePresence::Failed { reason: "the observer no longer reads the bus".to_owned() };
        }
        self.presence.clone()
    }
}

/// Whether the source of the frames is present. `age_ns` is the age of the last frame.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[expect(missing_docs, reason = "the type describes the fields")]
pub enum SourcePresence {
    /// No frame has been received yet.
    #[default]
    Waiting,
    /// Frames arrive.
    Live,
    /// The source's process exists, but publishes nothing: it hangs, or was suspended.
    Silent { age_ns: u64 },
    /// The run has ended in order.
    Ended { age_ns: u64 },
    /// The source's process is gone, but the run has not ended in order.
    Gone { age_ns: u64 },
    /// The bus cannot be read. The reason is one line.
    Failed { reason: String },
}

/// Greatest age of the last frame of a live source whose process exists: this duration, or this many periods if longer.
const SILENT: (Duration, u32) = (Duration::from_millis(500), 3);
/// The same for a source whose process is not found. In a process namespace of its own it is never found.
const GONE: (Duration, u32) = (Duration::from_millis(200), 2);

impl SourcePresence {
    /// Lower-case name, as clients print it.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Waiting => "waiting",
            Self::Live => "live",
            Self::Silent { .. } => "silent",
            Self::Ended { .. } => "ended",
            Self::Gone { .. } => "gone",
            Self::Failed { .. } => "failed",
        }
    }

    /// Age of the last frame in seconds, if the source is silent or gone, or the run has ended.
    pub fn age_s(&self) -> Option<f64> {
        match self {
            Self::Silent { age_ns } | Self::Gone { age_ns } | Self::Ended { age_ns } => Some(*age_ns as f64 * 1e-9),
            Self::Waiting | Self::Live | Self::Failed { .. } => None,
        }
    }

    /// Derives the presence from the age of the last frame in nanoseconds, the frame rate, and whether the source's process
    /// exists.
    ///
    /// ```
    /// use bench_dragon::display::observe::SourcePresence;
    ///
    /// let ms = 1_000_000;
    /// assert_eq!(SourcePresence::judge(500 * ms, 1_000, true), SourcePresence::Live);
    /// assert_eq!(SourcePresence::judge(501 * ms, 1_000, true), SourcePresence::Silent { age_ns: 501 * ms });
    /// assert_eq!(SourcePresence::judge(501 * ms, 2, true), SourcePresence::Live);
    /// assert_eq!(SourcePresence::judge(201 * ms, 1_000, false), SourcePresence::Gone { age_ns: 201 * ms });
    /// ```
    pub fn judge(age_ns: u64, rate_hz: u32, has_source: bool) -> Self {
        let (least, periods) = if has_source { SILENT } else { GONE };
        let limit = Duration::from_secs(periods.into()).checked_div(rate_hz).unwrap_or_default().max(least);
        match (u128::from(age_ns) <= limit.as_nanos(), has_source) {
            (true, _) => Self::Live,
            (false, true) => Self::Silent { age_ns },
            (false, false) => Self::Gone { age_ns },
        }
    }
}

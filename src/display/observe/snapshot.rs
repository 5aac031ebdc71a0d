//! Everything that there is to see at one instant.

use std::sync::Arc;
use std::time::Duration;

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_ipc::{FrameHeader, HandleState, ShowState, Status};
use serde::Serialize;

use super::described_run::{ClearanceChart, DescribedRun};
use super::event_logs::{AlertLog, CommandHistory};
use super::frame_statistics::FrameStatistics;
use super::guard_situation::GuardSituation;
use super::head_motion::TravelClock;
use super::planned_clearance::PlannedClearance;
use super::reader_log::ReaderLog;
use super::show_forecast::ShowForecast;

/// A frame, copied out of shared memory, so that whoever draws holds on to nothing of the server's.
#[derive(Clone, Debug, PartialEq)]
pub struct FrameCopy {
    /// The frame's header.
    pub header: FrameHeader,
    /// The handles, head first, one more than there are benches.
    pub handles: Vec<HandleState>,
}

/// A least clearance, and when it was.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct LeastClearance {
    /// Negative where the benches overlap.
    pub clearance_m: f64,
    /// Show time in seconds.
    pub time_s: f64,
}

/// Beyond this age a snapshot is no longer of now: others follow several times a second, also where nothing comes.
const FRESH_NS: u64 = 1_000_000_000;

/// What an observer shows.
#[derive(Clone, Debug, Default)]
#[expect(missing_docs, reason = "the types of the fields say what they are")]
pub struct Snapshot {
    /// When it was seen, in nanoseconds of `CLOCK_MONOTONIC`.
    pub seen_ns: u64,
    /// The source's presence at that instant; [`Snapshot::presence_at`] judges a later one.
    pub presence: SourcePresence,
    /// Whether the process of a source is there.
    pub has_source: bool,
    /// Since when the bus is read, in nanoseconds of `CLOCK_MONOTONIC`; `None` while it is not.
    pub reading_since_ns: Option<u64>,
    /// The newest frame; after the source's end its last one.
    pub frame: Option<Arc<FrameCopy>>,
    /// The run that the frame is of. `None` until its description has come.
    pub run: Option<Arc<DescribedRun>>,
    /// The pair of benches that are nearest to each other in the frame, neighbours left out.
    pub nearest: Option<PairClearance>,
    /// The least clearance of all snapshots of this run.
    pub least: Option<LeastClearance>,
    pub forecast: ShowForecast,
    pub guard: GuardSituation,
    pub chart: Option<Arc<ClearanceChart>>,
    /// The clearance over the whole run as far as the planner has worked it out; for an observer that plans.
    pub plan: Option<Arc<PlannedClearance>>,
    /// When the head comes to a travel.
    pub clock: Option<TravelClock>,
    /// The server's account of itself; of the run that the frame is of.
    pub status: Option<Arc<Status>>,
    pub statistics: FrameStatistics,
    pub alerts: Arc<AlertLog>,
    pub readers: Arc<ReaderLog>,
    /// The newest commands, the operators', the timecode's and refused ones of the guard.
    pub commands: Arc<CommandHistory>,
}

impl Snapshot {
    /// With a frame that has no handles, from a source that lives.
    #[cfg(test)]
    pub(crate) fn live(header: FrameHeader) -> Self {
        let frame = Some(Arc::new(FrameCopy { header, handles: Vec::new() }));
        Self { presence: SourcePresence::Live, frame, ..Self::default() }
    }

    /// The header of the frame.
    pub fn header(&self) -> Option<&FrameHeader> {
        self.frame.as_ref().map(|frame| &frame.header)
    }

    /// What the show is doing by the newest frame, or that it has ended by the last status.
    pub fn state(&self) -> Option<ShowState> {
        let has_ended = self.status.as_ref().is_some_and(|status| status.show_state() == Some(ShowState::Ended));
        if has_ended { Some(ShowState::Ended) } else { self.header()?.show_state() }
    }

    /// How things stand at an instant, for one who has got no newer snapshot: whoever shows it must not take the word of an
    /// observer that hangs or has died.
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
            return SourcePresence::Failed { reason: "the view's observer stands still".to_owned() };
        }
        self.presence.clone()
    }
}

/// Whether the source of the frames is present to an observer. `age_ns` is how long ago the last frame was sent.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[expect(missing_docs, reason = "the type says what the fields are")]
pub enum SourcePresence {
    /// No frame has been seen yet.
    #[default]
    Waiting,
    /// Frames come.
    Live,
    /// The source's process is there, and says nothing: it hangs, or was suspended.
    Silent { age_ns: u64 },
    /// The run has ended in order.
    Ended { age_ns: u64 },
    /// The source's process is gone, and the run has not ended in order.
    Gone { age_ns: u64 },
    /// The bus cannot be read, for this reason in one line.
    Failed { reason: String },
}

/// Beyond this age, and this many periods where frames come seldom, a source that is there is silent.
const SILENT: (Duration, u32) = (Duration::from_millis(500), 3);
/// The same of a source whose process is not to be found. In a process namespace of its own it would never be.
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

    /// How long ago the last frame was sent, in seconds, where that is too long or the run has ended.
    pub fn age_s(&self) -> Option<f64> {
        match self {
            Self::Silent { age_ns } | Self::Gone { age_ns } | Self::Ended { age_ns } => Some(*age_ns as f64 * 1e-9),
            Self::Waiting | Self::Live | Self::Failed { .. } => None,
        }
    }

    /// Judges the last frame by its age, in nanoseconds, the rate at which frames come, and whether the source's process is
    /// there.
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
    pub fn judge(age_ns: u64, rate_hz: u32, source_is_there: bool) -> Self {
        let (least, periods) = if source_is_there { SILENT } else { GONE };
        let limit = Duration::from_secs(periods.into()).checked_div(rate_hz).unwrap_or_default().max(least);
        match (u128::from(age_ns) <= limit.as_nanos(), source_is_there) {
            (true, _) => Self::Live,
            (false, true) => Self::Silent { age_ns },
            (false, false) => Self::Gone { age_ns },
        }
    }
}

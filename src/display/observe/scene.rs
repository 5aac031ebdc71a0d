//! Everything that is to be seen at one instant.

use std::sync::Arc;

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_ipc::{FrameHeader, HandleState, ShowState, Status};

use super::alert_log::AlertLog;
use super::clearance_chart::ClearanceChart;
use super::command_history::CommandHistory;
use super::guard_situation::GuardSituation;
use super::link::Link;
use super::outlook::Outlook;
use super::planned_clearance::PlannedClearance;
use super::reader_log::ReaderLog;
use super::run::Run;
use super::traffic::Traffic;
use super::travel_clock::TravelClock;

/// A frame, copied out of shared memory, so that whoever draws holds on to nothing of the server's.
#[derive(Clone, Debug, PartialEq)]
pub struct Still {
    /// The frame's header.
    pub header: FrameHeader,
    /// The handles, head first, one more than there are benches.
    pub handles: Vec<HandleState>,
}

/// Beyond this age a scene is no longer of now: others follow several times a second, also where nothing comes.
const FRESH_NS: u64 = 1_000_000_000;

/// What an observer shows.
#[derive(Clone, Debug, Default)]
pub struct Scene {
    /// When it was seen, in nanoseconds of `CLOCK_MONOTONIC`.
    pub seen_ns: u64,
    /// Whether there was a source then, and whether it said anything. How that is to be taken later tells [`Scene::link_at`].
    pub link: Link,
    /// Whether the process of a source is there.
    pub has_source: bool,
    /// Since when the bus is read, in nanoseconds of `CLOCK_MONOTONIC`; `None` while it is not.
    pub reading_since_ns: Option<u64>,
    /// The newest frame; after the source's end its last one.
    pub frame: Option<Arc<Still>>,
    /// The run that the frame is of. `None` until its description has come.
    pub run: Option<Arc<Run>>,
    /// The pair of benches that are nearest to each other in the frame, neighbours left out.
    pub nearest: Option<PairClearance>,
    /// The least clearance of all scenes of this run, and its show time, both in metres and seconds.
    pub least: Option<(f64, f64)>,
    /// What lies ahead.
    pub outlook: Outlook,
    /// How it stands with the guard.
    pub guard: GuardSituation,
    /// The clearance so far.
    pub chart: Option<Arc<ClearanceChart>>,
    /// The clearance over the whole run as far as the planner has worked it out; for an observer that plans.
    pub plan: Option<Arc<PlannedClearance>>,
    /// When the head comes to a travel.
    pub clock: Option<TravelClock>,
    /// The server's account of itself; of the run that the frame is of.
    pub status: Option<Arc<Status>>,
    /// The frames that arrive.
    pub traffic: Traffic,
    /// The alerts that have come.
    pub alerts: Arc<AlertLog>,
    /// What the readers have reported of themselves.
    pub readers: Arc<ReaderLog>,
    /// The newest commands, the operators', the timecode's and refused ones of the guard.
    pub commands: Arc<CommandHistory>,
}

impl Scene {
    /// Before anything has been looked at.
    pub fn of_nothing(seen_ns: u64) -> Self {
        Self { seen_ns, ..Self::default() }
    }

    /// What the show is doing by the newest frame, or that it has ended by the last status.
    pub fn state(&self) -> Option<ShowState> {
        let has_ended = self.status.as_ref().is_some_and(|status| status.show_state() == Some(ShowState::Ended));
        if has_ended { Some(ShowState::Ended) } else { self.frame.as_ref()?.header.show_state() }
    }

    /// How things stand at an instant, for one who has got no newer scene: whoever shows it must not take the word of an
    /// observer that hangs or has died.
    ///
    /// ```
    /// use bench_dragon::display::observe::{Link, Scene};
    ///
    /// let scene = Scene { link: Link::Live, ..Scene::of_nothing(5_000_000_000) };
    /// assert_eq!(scene.link_at(6_000_000_000), Link::Live);
    /// assert_eq!(scene.link_at(6_000_000_001).name(), "failed");
    /// ```
    pub fn link_at(&self, now_ns: u64) -> Link {
        if now_ns.saturating_sub(self.seen_ns) > FRESH_NS {
            return Link::Failed { reason: "the view's observer stands still".to_owned() };
        }
        self.link.clone()
    }
}

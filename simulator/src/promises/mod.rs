//! The promises: what must hold at every step, each with the sentence of the documents that gives it.

use bench_dragon::safety::guard::ClearanceCheck;
use bench_dragon_geometry::clearance::ClearanceSearch;
use bench_dragon_geometry::dragon::Board;
use bench_dragon_ipc::{FrameHeader, HandleState, RunStart};

use crate::guard::ReadFrame;
use crate::scenario::Scenario;
use crate::server::Ticked;

mod cues;
mod queue;
mod recording;
mod run;

pub(crate) use queue::QueueBook;
pub(crate) use recording::{FrameHash, RecordingBook, frame_hash};
use run::RunBook;

/// Rounding of a clearance or a travel, in metres.
const ROUNDING_M: f64 = 1e-9;
/// Overlap that is surely a contact, in metres.
const OVERLAP_M: f64 = 1e-6;
/// Distance of the travels at which the clearances of a grant are checked, in metres.
const GRID_M: f64 = 0.05;

macro_rules! promises {
    ($($(#[doc = $doc:literal])+ $name:ident = $page:literal, $sentence:literal;)+) => {
        /// Something that must hold.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Promise {
            $($(#[doc = $doc])+ $name,)+
        }

        impl Promise {
            /// All promises, in the order of their numbers.
            pub const ALL: &[Self] = &[$(Self::$name),+];

            /// The document that gives the promise, and its sentence there.
            pub fn source(self) -> (&'static str, &'static str) {
                match self {
                    $(Self::$name => ($page, $sentence),)+
                }
            }
        }
    };
}

promises! {
    /// The ticks of a run count from 0 without a hole.
    TicksWithoutHole = "docs/reference/bus.md", "counts from 0 without a hole";
    /// The head of a guarded show is on granted travel, or stands where the run began.
    OnGrantedTravel = "docs/how-it-works/guard.md", "The server moves the head only within the granted interval";
    /// No clearance on a granted interval is below the margin.
    GrantIsProved = "docs/how-it-works/guard.md", "It states a fact: a run, and an interval of travel on which no clearance falls below the margin.";
    /// No clearance of a published frame is below the margin, where it was not so before.
    MarginKept = "docs/how-it-works/guard.md", "prevents benches from touching";
    /// A head that is held, paused or ready rests within its braking distance, and stands until it may walk on.
    StandsUntilRelease = "docs/guide/run.md", "A hold is a safety stop: only `release` lifts it";
    /// A reply states what happened: an accepted command takes effect, and a refusal gives a reason that is true.
    RepliesAreTrue = "docs/reference/bus.md", "The reply has the tick from which the command holds, or the reason of the refusal";
    /// The published state and the reasons of a stop are those of the accepted commands.
    StopsAreTrue = "docs/reference/bus.md", "a safety stop, which only `release` lifts; or the end of the guard's grant";
    /// Show time equals the clock, or is behind it by the reported lag.
    TimeIsKept = "docs/how-it-works/real-time.md", "and catches up a tenth faster, at `time_scale` × 1.1, until it is on time";
    /// The head neither jumps nor goes back, but by a seek.
    NoJump = "docs/how-it-works/guard.md", "The state of a dragon follows from its travel alone";
    /// A restarted server continues where the last one stood, and holds the show.
    ResumesWhereItStood = "docs/how-it-works/guard.md", "the new run has no grant, and stands held by an ordinary hold as well.";
    /// A frame that is right is never a fault.
    NoFalseFault = "docs/how-it-works/guard.md", "the published frames differ from the proof by over 10⁻⁸ m";
    /// A guard's final rest is where the clearance reaches the margin.
    RestsAtMargin = "docs/how-it-works/guard.md", "Where the guard can prove no more, the head stands there permanently";
    /// After all faults, a show that may walk walks, or has reached its end.
    WalksOn = "docs/how-it-works/guard.md", "The next guard lets it walk on";
    /// A show that is told to end ends.
    EndsWhenTold = "docs/guide/run.md", "the dragon comes to rest, recordings are finished, the summary is written";
    /// A period that has passed is skipped, and no tick is sent late for it.
    PeriodsAreSkipped = "docs/reference/bus.md", "Missed periods are skipped, ticks are not.";
    /// A seek to travel that keeps the margin is proved and accepted.
    SeekIsProved = "docs/how-it-works/guard.md", "The guard proves travel there and grants it; `ctl seek` then sends the seek again.";
    /// The monitor reports a contact in the frames that it reads, and on the travel between them.
    ContactIsReported = "docs/how-it-works/contact.md", "So no contact is stepped over, however short.";
    /// A child that is stopped for over five seconds is killed.
    HungChildEnds = "docs/how-it-works/processes.md", "not stopped, as the kernel reports";
    /// A show that follows a steady timecode is at most the jump of the follower away from it.
    FollowsTimecode = "docs/reference/timecode.md", "is more than half a second elsewhere";
    /// The speed of a head with ramps changes no faster than they allow, unless a guard or the end of the run is near.
    RampsAreKept = "docs/reference/configuration.md", "every start and stop is a ramp with this acceleration.";
    /// No part panics.
    NothingPanics = "docs/how-it-is-tested/reliability.md", "No configuration causes a panic";
    /// A child that gives signs of life is not killed.
    HealthyChildLives = "docs/how-it-works/processes.md", "`show` kills a child that overruns a limit";
    /// A child that has ended starts again.
    DeadChildReturns = "docs/how-it-works/processes.md", "starts it again as after any other end";
    /// A queue answers each command once, and the answer is true.
    CommandIsAnsweredOnce = "src/command_queue/mod.rs", "The queue calls `answer` once";
    /// A command takes effect at most once, and a hold at most twice.
    CommandTakesEffectOnce = "docs/how-it-works/design-questions.md", "`CommandQueue` sends commands one at a time";
    /// Commands of a queue take effect in their order. A hold overtakes those that are not sent, and none before it undoes it.
    CommandsKeepTheirOrder = "docs/how-it-works/design-questions.md", "so the hold is sent once more behind it.";
    /// A queue of commands is bounded.
    QueueIsBounded = "docs/how-it-works/processes.md", "Every channel, ring, queue and list has a bound";
    /// A recording has the frames that its recorder read, in their order and bit for bit, without a hole.
    RecordingIsPrefix = "docs/how-it-is-tested/reliability.md", "has every frame up to one second before the kill";
    /// A killed recorder loses half a second, and a power loss a few seconds, unless the disk is slow.
    KillLosesLittle = "docs/guide/after-the-show.md", "A recorder that is killed loses at most the last second.";
    /// A repair, also one that is killed and repeated, keeps all that the disk has.
    RepairLosesNothing = "docs/how-it-is-tested/reliability.md", "each was repeated with all frames, and no byte of the data had changed";
    /// A recorder ends by itself only because its disk is full, and then with a finished file.
    FullDiskIsReported = "docs/how-it-is-tested/reliability.md", "After a full disk, or a file that may not grow, a recording is whole, or reported as not whole.";
    /// A lamp of a part that is dead, stopped or silent is not good.
    LampsAreTrue = "docs/how-it-is-tested/reliability.md", "Each cause of a lamp, and each cause for which a show stands, is shown with its level and remedy";
    /// A lamp of a part that works is not red.
    LampsAreCalm = "docs/how-it-is-tested/reliability.md", "each lamp as documented, with the exit status of `ctl status`";
    /// A bridge sends a frame as stale once its server is silent, and only then.
    StaleIsTrue = "docs/how-it-is-tested/reliability.md", "A silent server is reported, also to the desk";
    /// No recorded frame differs from its simulation.
    RecordingIsVerified = "docs/reference/recordings.md", "simulates each recorded run again and compares every frame bit for bit";
    /// A show leaves and passes no wait without GO.
    WaitsForGo = "docs/how-it-works/cues.md", "The show goes along its course, and stops where a cue waits.";
    /// GO at a wait moves the next frame.
    GoMovesNextFrame = "docs/how-it-works/cues.md", "sends GO. The next frame moves.";
    /// Each reached cue is an event, in its order and once.
    CueIsAnEvent = "docs/how-it-works/cues.md", "Each cue that the show reaches, by walking or by a seek to it, is an event of the run";
    /// Each dragon of a plan is where its timetable has it, and none goes back.
    PlacesFollowPlan = "docs/how-it-works/cues.md", "the place of every dragon still depends on plan time alone";
}

impl Promise {
    /// The number of the promise, from 1.
    pub fn number(self) -> usize {
        Self::ALL.iter().position(|&promise| promise == self).expect("the list has all promises") + 1
    }
}

/// A broken promise.
#[derive(Clone, Debug, PartialEq)]
pub struct Broken {
    /// The promise.
    pub promise: Promise,
    /// Instant of the simulated clock, in nanoseconds.
    pub at_ns: u64,
    /// What was seen.
    pub what: String,
}

/// Checks the promises at every step, and keeps the first broken one.
#[derive(Debug)]
pub(crate) struct Promises<'a> {
    scenario: &'a Scenario,
    pub(crate) broken: Option<Broken>,
    run: Option<RunBook>,
    last: Option<FrameHeader>,
    clearances: ClearanceSearch,
    boards: Vec<Board>,
    check: ClearanceCheck,
    /// Where the guard's final rest was checked last.
    rested_m: Option<f64>,
    /// Clearance at the travels of the grid, as far as they were asked for.
    grid: Vec<Option<f64>>,
}

impl<'a> Promises<'a> {
    pub(crate) fn new(scenario: &'a Scenario) -> Self {
        Self {
            scenario,
            broken: None,
            run: None,
            last: None,
            clearances: ClearanceSearch::of(scenario.config.formation().layout()),
            boards: Vec::new(),
            check: ClearanceCheck::new(scenario.config.formation().clone()),
            rested_m: None,
            grid: Vec::new(),
        }
    }

    /// Fails a promise unless it holds. Only the first broken promise counts.
    pub(crate) fn require(&mut self, promise: Promise, at_ns: u64, holds: bool, what: impl FnOnce() -> String) {
        if !holds && self.broken.is_none() {
            self.broken = Some(Broken { promise, at_ns, what: what() });
        }
    }

    /// Begins a show: the next run continues nothing.
    pub(crate) fn begin_show(&mut self) {
        (self.run, self.last) = (None, None);
    }

    /// Begins a run of the server. `told` has the run and the tick of the last status.
    pub(crate) fn begin_run(&mut self, run_id: u64, start: RunStart, told: Option<(u64, u64)>, now_ns: u64) {
        if let Some(last) = self.last {
            let is_same = start.travel_m == last.course_m && start.start_s == last.show_time_s();
            self.require(Promise::ResumesWhereItStood, now_ns, is_same, || {
                format!("the run begins at {} m, {} s after {last:?}", start.travel_m, start.start_s)
            });
            let keeps = |run: &RunBook| run.is_kept_by(&start, told, self.scenario.flags.auto_resume);
            let is_kept = self.run.as_ref().is_none_or(keeps);
            let before = format!("{:?}", self.run);
            self.require(Promise::ResumesWhereItStood, now_ns, is_kept, || {
                format!("the restarted server begins with {start:?} after {before}, the last status is of {told:?}")
            });
        }
        self.run = Some(RunBook::new(self.scenario, run_id, start));
    }

    /// Checks a tick of the server.
    pub(crate) fn take_tick(&mut self, ticked: &Ticked<'_>, now_ns: u64) {
        let clearance_m = if self.scenario.is_guarded() { self.clearance_m(ticked.handles) } else { f64::INFINITY };
        let Some(run) = &mut self.run else { return };
        let mut broken = Vec::new();
        run.take(ticked, clearance_m, &mut |promise, what| broken.push((promise, what)));
        if let Some((promise, what)) = broken.into_iter().next() {
            self.require(promise, now_ns, false, || format!("{what}; tick {:?}", ticked.header));
        }
        for [from_m, to_m] in self.run.iter_mut().flat_map(RunBook::new_grants).collect::<Vec<_>>() {
            self.check_grant(from_m, to_m, now_ns);
        }
        self.last = Some(ticked.header);
    }

    /// Checks that the guard rests the head where the clearance reaches the margin.
    pub(crate) fn take_final_rest(&mut self, header: &FrameHeader, now_ns: u64) {
        // The clearances depend on the course alone.
        if self.rested_m.replace(header.course_m) == Some(header.course_m) {
            return;
        }
        let margin_m = self.scenario.config.tables().monitor.margin_m;
        // Further on, the clearance must fall below the margin, at once or after the resolution of the proof.
        let beyond_m = (1..=20).map(|step| header.course_m + f64::from(step) * 1e-4);
        let least_m = beyond_m.filter_map(|travel_m| self.check.nearest(travel_m)).map(|pair| pair.clearance_m);
        let least_m = least_m.fold(f64::INFINITY, f64::min);
        self.require(Promise::RestsAtMargin, now_ns, least_m <= margin_m + 1e-5, || {
            format!("the head rests at {} m, and further on the clearance is {least_m} m", header.course_m)
        });
    }

    /// Checks that a monitor has reported a contact, if there is one in a frame or on the walked travel up to it.
    pub(crate) fn take_read(&mut self, read: &ReadFrame, now_ns: u64) {
        if read.has_reported {
            return;
        }
        let begin_m = self.scenario.config.formation().begin_m();
        let cell = |travel_m: f64| (travel_m - begin_m) / GRID_M;
        let mut least_m = self.clearance_m(&read.frame.handles);
        if let Some(from_m) = read.walked_from_m {
            for number in cell(from_m).ceil() as usize..=cell(read.frame.header.course_m).floor().max(0.0) as usize {
                least_m = least_m.min(self.clearance_on_grid_m(number, begin_m + number as f64 * GRID_M));
            }
        }
        self.require(Promise::ContactIsReported, now_ns, least_m > -OVERLAP_M, || {
            format!(
                "the clearance is {least_m} m on the way from {:?} m to {:?}",
                read.walked_from_m, read.frame.header
            )
        });
    }

    /// Whether the margin is kept at a travel, and around it.
    pub(crate) fn is_clear_at(&mut self, travel_m: f64) -> bool {
        let margin_m = self.scenario.config.tables().monitor.margin_m;
        let near_m = [-0.01, -0.001, 0.0, 0.001, 0.01].map(|off_m| travel_m + off_m);
        let clearances_m =
            near_m.iter().filter_map(|&travel_m| self.check.nearest(travel_m)).map(|pair| pair.clearance_m);
        clearances_m.fold(f64::INFINITY, f64::min) > 1.1 * margin_m
    }

    fn clearance_m(&mut self, handles: &[HandleState]) -> f64 {
        let formation = self.scenario.config.formation();
        formation.place_boards(handles, |handle| handle.position_m.into(), &mut self.boards);
        self.clearances.nearest(&self.boards).map_or(f64::INFINITY, |pair| pair.clearance_m)
    }

    fn check_grant(&mut self, from_m: f64, to_m: f64, now_ns: u64) {
        let margin_m = self.scenario.config.tables().monitor.margin_m;
        let begin_m = self.scenario.config.formation().begin_m();
        let cell = |travel_m: f64| (travel_m - begin_m) / GRID_M;
        for number in cell(from_m).ceil() as usize..=cell(to_m).floor().max(0.0) as usize {
            let travel_m = begin_m + number as f64 * GRID_M;
            if travel_m < from_m || travel_m > to_m {
                continue;
            }
            let clearance_m = self.clearance_on_grid_m(number, travel_m);
            self.require(Promise::GrantIsProved, now_ns, clearance_m >= margin_m - ROUNDING_M, || {
                format!("the grant from {from_m} to {to_m} m has a clearance of {clearance_m} m at {travel_m} m")
            });
        }
    }

    fn clearance_on_grid_m(&mut self, number: usize, travel_m: f64) -> f64 {
        if self.grid.len() <= number {
            self.grid.resize(number + 1, None);
        }
        let check = &mut self.check;
        *self.grid[number].get_or_insert_with(|| check.nearest(travel_m).map_or(f64::INFINITY, |pair| pair.clearance_m))
    }
}

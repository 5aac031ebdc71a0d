//! The promises of cues: a book of the waits that GO has ended, and of the cues that must be reached.

use std::sync::Arc;

use bench_dragon_ipc::{Refusal, ShowState};

use crate::scenario::Scenario;

/// The cues of a run, and what GO has done.
#[derive(Debug)]
pub(super) struct CueBook {
    /// Places of all cues on the course, and of those that wait.
    cues_m: Vec<f64>,
    waits_m: Arc<[f64]>,
    rate_hz: u64,
    /// The wait that the last GO has ended.
    ended_m: Option<f64>,
    /// Periods since the last GO that counts.
    since_go: Option<u64>,
}

/// Where a request finds the show.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a stop of its own")]
pub(super) struct Place {
    pub(super) travel_m: f64,
    pub(super) is_held: bool,
    pub(super) is_ready: bool,
    pub(super) is_paused: bool,
    pub(super) is_ending: bool,
    /// Whether the show is over, or may be after a seek at this tick.
    pub(super) may_be_over: bool,
}

impl CueBook {
    pub(super) fn new(scenario: &Scenario) -> Self {
        let config = &scenario.config;
        Self {
            cues_m: config.cues().iter().map(|cue| config.formation().course_m(cue.at_s)).collect(),
            waits_m: config.waits_m(),
            rate_hz: config.tables().serve.rate_hz.into(),
            ended_m: None,
            since_go: None,
        }
    }

    pub(super) fn begin_tick(&mut self, missed: u64) {
        self.since_go = self.since_go.map(|periods| periods + missed + 1);
    }

    /// Whether a show that stands here waits for GO.
    pub(super) fn waits_at(&self, travel_m: f64) -> bool {
        self.waits_m.contains(&travel_m) && self.ended_m != Some(travel_m)
    }

    /// Whether the plan itself rests here.
    pub(super) fn is_wait(&self, travel_m: f64) -> bool {
        self.waits_m.contains(&travel_m)
    }

    /// Whether a GO now is the second press of the last one.
    fn is_second_press(&self) -> bool {
        self.since_go.is_some_and(|periods| periods * 10 < 3 * self.rate_hz)
    }

    /// Whether the reply to a GO is true.
    pub(super) fn is_true(&self, outcome: Result<(), Refusal>, place: Place) -> bool {
        let Place { travel_m, is_held, is_ready, is_paused, is_ending, may_be_over } = place;
        let waits = self.waits_at(travel_m);
        match outcome {
            Ok(()) if self.is_second_press() => true,
            Ok(()) => waits && !is_held && !is_ready && !is_paused && !is_ending,
            Err(_) if self.is_second_press() => false,
            Err(Refusal::Held) => is_held,
            Err(Refusal::Ready) => is_ready,
            Err(Refusal::Paused) => waits && is_paused && !is_held && !is_ready,
            Err(Refusal::Finished) => is_ending || may_be_over && !is_held && !is_ready,
            Err(Refusal::NothingWaits) => !waits && !is_held && !is_ready,
            Err(_) => false,
        }
    }

    /// Takes an accepted GO.
    pub(super) fn go(&mut self, travel_m: f64) {
        if !self.is_second_press() {
            (self.ended_m, self.since_go) = (Some(travel_m), Some(0));
        }
    }

    /// Whether a GO at this tick has ended a wait.
    pub(super) fn has_gone(&self) -> bool {
        self.since_go == Some(0)
    }

    /// A seek moves the show: a wait there waits again.
    pub(super) fn seek(&mut self) {
        self.ended_m = None;
    }

    /// The first wait that the show has left or passed without GO on its walk.
    pub(super) fn passed(&self, from_m: f64, to_m: f64) -> Option<f64> {
        let is_passed =
            |&&wait_m: &&f64| wait_m < to_m && (wait_m > from_m || wait_m == from_m && self.waits_at(wait_m));
        // GO may end a wait that the missed periods have reached.
        self.waits_m.iter().filter(|wait_m| Some(**wait_m) != self.ended_m).find(is_passed).copied()
    }

    /// Checks the numbers of the cues that a tick has reached. It has walked from `from_m` to `before_m`, and after a seek or the
    /// start on from `put_m`.
    pub(super) fn check_reached(&self, reached: &[usize], walk: &Walked) -> Result<(), String> {
        let Walked { from_m, before_m, put_m, to_m } = *walk;
        let is_walked = |cue_m: f64, from_m: f64, to_m: f64| from_m < cue_m && cue_m <= to_m;
        let must = |cue_m: f64| match put_m {
            Some(put_m) => (put_m..=to_m).contains(&cue_m) && (put_m != before_m || cue_m != put_m),
            None => is_walked(cue_m, from_m.unwrap_or(before_m), to_m) || from_m.is_none() && cue_m == before_m,
        };
        // A seek at the tick that reaches a cue may hide it.
        let may = |cue_m: f64| {
            must(cue_m)
                || put_m == Some(cue_m)
                || from_m.map_or(cue_m == before_m, |from_m| is_walked(cue_m, from_m, before_m))
        };
        let is_in_order = reached.is_sorted_by(|one, other| one < other);
        let all_may = reached.iter().all(|&number| self.cues_m.get(number).is_some_and(|&cue_m| may(cue_m)));
        let missing = (0..self.cues_m.len()).find(|number| must(self.cues_m[*number]) && !reached.contains(number));
        if is_in_order && all_may && missing.is_none() {
            return Ok(());
        }
        Err(format!("the reached cues are {reached:?}, of those at {:?} m, after {walk:?}", self.cues_m))
    }
}

/// Where a tick has walked.
#[derive(Clone, Copy, Debug)]
#[expect(clippy::struct_field_names, reason = "each is a place in metres")]
pub(super) struct Walked {
    /// Where the last frame stood; `None` at the start.
    pub(super) from_m: Option<f64>,
    /// Where the show stood before the requests, after the missed periods.
    pub(super) before_m: f64,
    /// Where a seek has put it.
    pub(super) put_m: Option<f64>,
    pub(super) to_m: f64,
}

/// Whether a state says that the show is over.
pub(super) fn is_over(state: ShowState) -> bool {
    matches!(state, ShowState::Finished | ShowState::Ended)
}

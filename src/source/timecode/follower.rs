//! Follower of a timecode: decides from tick to tick how the show responds. Pure: instants are arguments.
//!
//! While the timecode runs, a proportional-integral controller sets the time scale. Its input is the timecode's show
//! time minus the show's. The proportional part, within a limit, corrects the difference. Its integral estimates the
//! timecode's pace. The controller is critically damped, so that the difference decays without oscillation.
//!
//! A position that does not continue the earlier ones has no effect until the next one agrees with it. So a single
//! stray packet causes no jump. Readers of linear timecode do the same.

use bench_dragon_ipc::TimecodeState;
use serde::{Deserialize, Serialize};

use super::{Position, TimecodeSample};

/// Proportional gain, per second: differences decay within some seconds.
const GAIN_PER_S: f64 = 1.0;
/// Integral gain of the correction, per second, of the critically damped controller.
const INTEGRAL_GAIN_PER_S: f64 = GAIN_PER_S / 4.0;
/// Greatest deviation of the timecode's pace from one second per second.
const PACE_RANGE: f64 = 0.05;
/// Greatest change of the time scale for the correction of a difference.
const CORRECTION_RANGE: f64 = 0.05;
/// Time after which a timecode that repeats a position stands: more than two frames of the slowest timecode.
const STANDS_AFTER_NS: u64 = 100_000_000;
/// Greatest difference between a standing show and its timecode: show time has nanoseconds.
const SAME_PLACE_S: f64 = 2e-9;
/// Period at which a refused seek is retried.
const SEEK_PERIOD_NS: u64 = 100_000_000;
/// Longest step between two positions that the estimate of the pace uses, in seconds.
const LONGEST_STEP_S: f64 = 0.5;

/// Settings of a follower.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowerSettings {
    /// Show time minus the timecode's position, in seconds.
    pub offset_s: f64,
    /// Silence after which a timecode is lost, in nanoseconds.
    pub timeout_ns: u64,
    /// Period of the show's ticks, in seconds.
    pub period_s: f64,
    /// Show time at which the run starts, in seconds.
    pub first_s: f64,
    /// Show time at which the run ends, in seconds.
    pub last_s: f64,
}

/// The show at the tick that is about to begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShowPosition {
    /// Show time of the tick if the show continues as before, in seconds.
    pub show_time_s: f64,
    /// Whether the operator has paused or held the show.
    pub is_stopped: bool,
    /// Whether the operator has resumed it at this tick.
    pub is_resumed: bool,
}

/// Response of the show from this tick on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowerOrder {
    /// Show seconds per second.
    pub time_scale: f64,
    /// Whether the show stands.
    pub stands: bool,
    /// Show time to seek, in seconds. The caller passes the outcome to [`Follower::note_seek`].
    pub seek_s: Option<f64>,
}

/// Change of the timecode's state.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum FollowerEvent {
    /// The timecode runs, and the show follows it.
    Follows {
        /// Position of the timecode in seconds.
        position_s: f64,
    },
    /// The timecode stands, and the show stands with it.
    Stands {
        /// Position of the timecode in seconds.
        position_s: f64,
    },
    /// The timecode is lost. The show continues at its own pace, unless the timecode stood before.
    Lost {
        /// Last position of the timecode in seconds.
        position_s: f64,
    },
}

/// Follows a timecode.
#[derive(Clone, Copy, Debug)]
pub struct Follower {
    settings: FollowerSettings,
    /// [`TimecodeState::Waiting`] before the first timecode.
    state: TimecodeState,
    /// Whether a lost timecode stood before.
    was_standing: bool,
    /// First sample with the newest position.
    newest: Option<TimecodeSample>,
    /// Arrival of the newest sample, of any position.
    heard_ns: u64,
    /// Sample that does not continue the earlier ones, and that no later sample has confirmed yet.
    suspect: Option<TimecodeSample>,
    /// Estimated pace of the timecode, in seconds per second.
    pace: f64,
    correction: f64,
    /// Arrival of the sample that last updated the pace.
    learned_ns: Option<u64>,
    /// Whether the show has reached the timecode since the first sample.
    has_met: bool,
    sought_ns: Option<u64>,
    /// Upper bound of the show's lead in seconds: show time that passed while the head braked.
    braked_s: f64,
    /// Show time at the last tick, if the show was ordered to stand there.
    stood_s: Option<f64>,
    /// Whether an operator has let the show walk on by itself until the timecode leads again.
    goes_alone: bool,
}

impl Follower {
    /// Difference in seconds above which the show seeks the timecode.
    pub const JUMP_S: f64 = 0.5;
    /// Least time scale of a show that follows timecode.
    pub const LEAST_TIME_SCALE: f64 = 1.0 - PACE_RANGE - CORRECTION_RANGE;
    /// Greatest time scale of a show that follows timecode.
    pub const GREATEST_TIME_SCALE: f64 = 1.0 + PACE_RANGE + CORRECTION_RANGE;

    /// Creates a follower that has received no sample.
    pub fn new(settings: FollowerSettings) -> Self {
        Self {
            settings,
            state: TimecodeState::Waiting,
            was_standing: false,
            newest: None,
            heard_ns: 0,
            suspect: None,
            pace: 1.0,
            correction: 0.0,
            learned_ns: None,
            has_met: false,
            sought_ns: None,
            braked_s: 0.0,
            stood_s: None,
            goes_alone: false,
        }
    }

    /// Takes a sample. Samples come in the order of their arrival.
    pub fn hear(&mut self, sample: TimecodeSample) {
        let heard = self.newest.map(|newest| TimecodeSample { arrived_ns: self.heard_ns, ..newest });
        let suspect = self.suspect.take();
        if !heard.is_some_and(|heard| self.agree(heard, sample)) {
            let Some(suspect) = suspect.filter(|&suspect| self.agree(suspect, sample)) else {
                self.suspect = Some(sample);
                return;
            };
            self.newest = Some(suspect);
        }
        self.heard_ns = sample.arrived_ns;
        if self.newest.is_none_or(|newest| newest.position != sample.position) {
            self.newest = Some(sample);
        }
    }

    /// Returns the response of the show from the tick that is due now, and a change of the timecode's state.
    pub fn steer(&mut self, now_ns: u64, show: ShowPosition) -> (FollowerOrder, Option<FollowerEvent>) {
        // A timecode that leads stays the master.
        self.goes_alone |= show.is_resumed && !self.leads();
        let Some(newest) = self.newest else {
            return (FollowerOrder { time_scale: 1.0, stands: !self.goes_alone, seek_s: None }, None);
        };
        self.note_braking(show);
        let event = self.look(newest, now_ns);
        self.goes_alone &= !self.leads();
        let order = match self.state {
            TimecodeState::Locked => self.follow(newest, now_ns, show),
            TimecodeState::Standing => self.stand(newest, now_ns, show),
            _ => self.go_on(newest, now_ns, show),
        };
        self.stood_s = order.stands.then_some(show.show_time_s);
        (order, event)
    }

    /// Takes the outcome of the last order's seek.
    pub fn note_seek(&mut self, is_there: bool) {
        if is_there {
            self.has_met = true;
            (self.sought_ns, self.stood_s, self.braked_s) = (None, None, 0.0);
        }
    }

    /// State of the timecode, for the status.
    pub fn timecode_state(&self) -> TimecodeState {
        self.state
    }

    /// Whether the timecode determines the show time: one has arrived and is not lost.
    pub fn leads(&self) -> bool {
        matches!(self.state, TimecodeState::Locked | TimecodeState::Standing)
    }

    /// Whether the later sample has the position that follows from the earlier one, for a running or a standing
    /// timecode.
    fn agree(&self, earlier: TimecodeSample, later: TimecodeSample) -> bool {
        let elapsed_ns = later.arrived_ns.saturating_sub(earlier.arrived_ns);
        let elapsed_s = elapsed_ns as f64 * 1e-9;
        let step_s = earlier.position.step_to_s(later.position);
        let runs = (step_s - elapsed_s).abs() <= Self::JUMP_S + PACE_RANGE * elapsed_s;
        elapsed_ns <= self.settings.timeout_ns && (runs || step_s.abs() <= Self::JUMP_S)
    }

    fn look(&mut self, newest: TimecodeSample, now_ns: u64) -> Option<FollowerEvent> {
        let position_s = newest.position.since_midnight_s;
        let (state, event) = if now_ns.saturating_sub(self.heard_ns) > self.settings.timeout_ns {
            (TimecodeState::Lost, FollowerEvent::Lost { position_s })
        } else if self.heard_ns.saturating_sub(newest.arrived_ns) > STANDS_AFTER_NS {
            (TimecodeState::Standing, FollowerEvent::Stands { position_s })
        } else {
            (TimecodeState::Locked, FollowerEvent::Follows { position_s })
        };
        let before = std::mem::replace(&mut self.state, state);
        if before == state {
            return None;
        }
        self.was_standing = before == TimecodeState::Standing;
        // The estimate of the pace belongs to the earlier state.
        (self.pace, self.correction, self.learned_ns) = (1.0, 0.0, None);
        Some(event)
    }

    fn follow(&mut self, newest: TimecodeSample, now_ns: u64, show: ShowPosition) -> FollowerOrder {
        let target_s = self.running_target_s(newest, now_ns, show);
        let is_before = target_s < self.settings.first_s;
        let target_s = self.within_run_s(target_s);
        let difference_s = target_s - show.show_time_s;
        if show.is_stopped {
            return self.order(!self.has_met, None);
        }
        if !self.has_met || self.is_jump(difference_s) {
            (self.pace, self.correction, self.learned_ns) = (1.0, 0.0, None);
            let seek_s = self.seek(target_s, now_ns);
            return self.order(!self.has_met || is_before, seek_s);
        }
        if !is_before {
            self.learn(newest, difference_s);
            if difference_s.abs() < 0.5 * Self::JUMP_S {
                self.braked_s = 0.0;
            }
        }
        self.order(is_before, None)
    }

    /// Stands exactly at the timecode's position. A head that braked to a point less than a jump past that
    /// position stays at that point.
    fn stand(&mut self, newest: TimecodeSample, now_ns: u64, show: ShowPosition) -> FollowerOrder {
        let target_s = self.within_run_s(self.target_s(newest.position, show));
        let difference_s = target_s - show.show_time_s;
        let has_stood_at_once = self.stood_s.is_some() && self.braked_s == 0.0;
        let is_beside = has_stood_at_once && difference_s.abs() > SAME_PLACE_S;
        let is_away = !self.has_met || self.is_jump(difference_s) || is_beside;
        let seek_s = if is_away && !show.is_stopped { self.seek(target_s, now_ns) } else { None };
        self.order(true, seek_s)
    }

    /// Continues without the timecode, unless the timecode stood and no operator lets the show walk on. A show that waits for the start
    /// of its run still starts on time.
    fn go_on(&self, newest: TimecodeSample, now_ns: u64, show: ShowPosition) -> FollowerOrder {
        let is_before = self.running_target_s(newest, now_ns, show) < self.settings.first_s;
        self.order(!self.goes_alone && (self.was_standing || !self.has_met || is_before), None)
    }

    /// Show time of a running timecode now, in seconds.
    fn running_target_s(&self, newest: TimecodeSample, now_ns: u64, show: ShowPosition) -> f64 {
        let age_s = now_ns.saturating_sub(newest.arrived_ns) as f64 * 1e-9;
        self.target_s(newest.position, show) + self.pace * age_s
    }

    /// Show time of a position. Candidates are a day apart. The result is the candidate nearest to the run; for a run
    /// longer than a day, the one nearest to the show.
    fn target_s(&self, position: Position, show: ShowPosition) -> f64 {
        let today_s = position.since_midnight_s + self.settings.offset_s;
        let away_s = |target_s: f64| (target_s - self.within_run_s(target_s)).abs();
        let days = [today_s, today_s - position.day_s, today_s + position.day_s];
        let nearer = |one: &f64, other: &f64| {
            let from_show_s = |target_s: f64| (target_s - show.show_time_s).abs();
            away_s(*one).total_cmp(&away_s(*other)).then(from_show_s(*one).total_cmp(&from_show_s(*other)))
        };
        days.into_iter().min_by(nearer).expect("there are three candidates")
    }

    fn within_run_s(&self, target_s: f64) -> f64 {
        target_s.clamp(self.settings.first_s, self.settings.last_s)
    }

    /// Whether a difference needs a seek. The controller corrects smaller ones. It also corrects the lead from the
    /// head's braking: a seek would be a jump at each stop of the timecode.
    fn is_jump(&self, difference_s: f64) -> bool {
        !(-Self::JUMP_S - self.braked_s..=Self::JUMP_S).contains(&difference_s)
    }

    /// Adds the show time that has passed since the show was ordered to stand.
    fn note_braking(&mut self, show: ShowPosition) {
        let went_on_s = self.stood_s.map_or(0.0, |stood_s| show.show_time_s - stood_s);
        // A step outside of this range is an operator's seek.
        if (0.0..Self::JUMP_S).contains(&went_on_s) {
            self.braked_s += went_on_s;
        }
    }

    fn learn(&mut self, newest: TimecodeSample, difference_s: f64) {
        let before_ns = match self.learned_ns {
            Some(before_ns) if before_ns == newest.arrived_ns => return,
            before_ns => before_ns,
        };
        self.learned_ns = Some(newest.arrived_ns);
        let step_s = before_ns.map_or(0.0, |before_ns| newest.arrived_ns.saturating_sub(before_ns) as f64 * 1e-9);
        // The show's position contains the earlier correction for the tick that is about to begin.
        let difference_s = difference_s + self.correction * self.settings.period_s;
        let correction = GAIN_PER_S * difference_s;
        self.correction = correction.clamp(-CORRECTION_RANGE, CORRECTION_RANGE);
        // The correction is bounded, and so is its integral. So a large difference that is no measure of the pace does little.
        let pace = self.pace + INTEGRAL_GAIN_PER_S * self.correction * step_s.min(LONGEST_STEP_S);
        self.pace = pace.clamp(1.0 - PACE_RANGE, 1.0 + PACE_RANGE);
    }

    fn order(&self, stands: bool, seek_s: Option<f64>) -> FollowerOrder {
        FollowerOrder { time_scale: self.pace + self.correction, stands, seek_s }
    }

    /// Returns a seek, unless the last one was tried within [`SEEK_PERIOD_NS`].
    fn seek(&mut self, target_s: f64, now_ns: u64) -> Option<f64> {
        let is_due = self.sought_ns.is_none_or(|sought_ns| now_ns.saturating_sub(sought_ns) >= SEEK_PERIOD_NS);
        is_due.then(|| {
            self.sought_ns = Some(now_ns);
            target_s
        })
    }
}

//! What a show is to do about the timecode that it follows, from tick to tick. Pure: instants are arguments.
//!
//! While the timecode runs, the time scale is that of a proportional-integral controller on the difference between where the
//! timecode is and where the show is: the integral part learns how fast the timecode runs, the proportional part makes good
//! the difference. It is critically damped, so that it comes near without swinging.
//!
//! A position that does not go on from the ones before moves nothing, until the next one agrees with it: one packet that is
//! astray is no jump. Readers of linear timecode do the same.

use bench_dragon_ipc::TimecodeState;
use serde::{Deserialize, Serialize};

use super::{Position, TimecodeSample};

/// Proportional gain, per second: differences are made good within some seconds.
const GAIN_PER_S: f64 = 1.0;
/// Integral gain, per square second, at which that is critically damped.
const INTEGRAL_GAIN_PER_S2: f64 = GAIN_PER_S * GAIN_PER_S / 4.0;
/// How far the timecode's own pace may be from one second per second.
const PACE_RANGE: f64 = 0.05;
/// By how much the time scale may be changed to make good a difference.
const CORRECTION_RANGE: f64 = 0.05;
/// A timecode that has repeated a position for so long stands: two frames of the slowest, and more.
const STANDS_AFTER_NS: u64 = 100_000_000;
/// A show that stands so near to its timecode stands where that does: show time is in nanoseconds.
const SAME_PLACE_S: f64 = 2e-9;
/// How often a seek that was refused is tried again.
const SEEK_PERIOD_NS: u64 = 100_000_000;
/// More than this between two positions tells nothing of the pace.
const LONGEST_STEP_S: f64 = 0.5;

/// How to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowerSettings {
    /// Show time minus the timecode's position, in seconds.
    pub offset_s: f64,
    /// Silence after which a timecode is lost, in nanoseconds.
    pub timeout_ns: u64,
    /// The least show time that the run has, in seconds.
    pub first_s: f64,
    /// The greatest.
    pub last_s: f64,
}

/// The show at the tick that is about to begin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShowPosition {
    /// Show time of the tick if it goes on as before, in seconds.
    pub sim_time_s: f64,
    /// Whether the operator has paused or held it.
    pub is_stopped: bool,
}

/// What the show is to do from this tick on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FollowerOrder {
    /// Show seconds per second.
    pub time_scale: f64,
    /// Whether it is to stand.
    pub stands: bool,
    /// Show time to reposition it to, in seconds; the outcome goes to [`Follower::note_seek`].
    pub seek_s: Option<f64>,
}

/// What happened to the timecode.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "event", rename_all = "snake_case")]
pub enum FollowerEvent {
    /// It runs, and the show follows.
    Follows {
        /// Its position in seconds.
        position_s: f64,
    },
    /// It stands, and the show with it.
    Stands {
        /// Its position in seconds.
        position_s: f64,
    },
    /// It is lost. The show goes on at its own pace, unless it stood.
    Lost {
        /// Its last position in seconds.
        position_s: f64,
    },
}

/// Follows a timecode.
#[derive(Clone, Copy, Debug)]
pub struct Follower {
    settings: FollowerSettings,
    /// [`TimecodeState::Waiting`] before the first one.
    state: TimecodeState,
    /// Whether a timecode that is lost stood.
    stood: bool,
    /// The first sample of the position that was heard last.
    newest: Option<TimecodeSample>,
    /// When a sample came last, of whatever position.
    heard_ns: u64,
    /// A sample that does not go on from those before, and that none has agreed with yet.
    suspect: Option<TimecodeSample>,
    /// How fast the timecode runs, as far as that is known.
    pace: f64,
    correction: f64,
    /// The sample that the pace was last learned from.
    learned_ns: Option<u64>,
    /// Whether the show has been where the timecode is since the first one.
    has_met: bool,
    sought_ns: Option<u64>,
    /// By how much the show is ahead because it has gone on while its head braked, at most.
    braked_s: f64,
    /// Show time at the last tick, where it was to stand there.
    stood_s: Option<f64>,
}

impl Follower {
    /// Difference in seconds above which the show is repositioned to the timecode.
    pub const JUMP_S: f64 = 0.5;
    /// The least time scale by which a show follows.
    pub const LEAST_TIME_SCALE: f64 = 1.0 - PACE_RANGE - CORRECTION_RANGE;
    /// The greatest.
    pub const GREATEST_TIME_SCALE: f64 = 1.0 + PACE_RANGE + CORRECTION_RANGE;

    /// A follower that has heard nothing yet.
    pub fn new(settings: FollowerSettings) -> Self {
        Self {
            settings,
            state: TimecodeState::Waiting,
            stood: false,
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
        }
    }

    /// Takes a sample, later than those before.
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

    /// What the show is to do from the tick on that is due now, and what has happened to the timecode.
    pub fn steer(&mut self, now_ns: u64, show: ShowPosition) -> (FollowerOrder, Option<FollowerEvent>) {
        let Some(newest) = self.newest else {
            return (FollowerOrder { time_scale: 1.0, stands: true, seek_s: None }, None);
        };
        self.note_braking(show);
        let event = self.look(newest, now_ns);
        let order = match self.state {
            TimecodeState::Locked => self.follow(newest, now_ns, show),
            TimecodeState::Standing => self.stand(newest, now_ns, show),
            _ => self.go_on(newest, now_ns, show),
        };
        self.stood_s = order.stands.then_some(show.sim_time_s);
        (order, event)
    }

    /// Takes note whether the show was repositioned as the last order asked.
    pub fn note_seek(&mut self, is_there: bool) {
        if is_there {
            self.has_met = true;
            (self.sought_ns, self.stood_s, self.braked_s) = (None, None, 0.0);
        }
    }

    /// How the timecode is, as the status reports it.
    pub fn timecode_state(&self) -> TimecodeState {
        self.state
    }

    /// Whether it is the timecode that says where the show is: one has come and is not lost.
    pub fn leads(&self) -> bool {
        matches!(self.state, TimecodeState::Locked | TimecodeState::Standing)
    }

    /// Whether a later sample is where an earlier one says that the timecode should be by then, running or standing.
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
        self.stood = before == TimecodeState::Standing;
        // What was learned of the pace is of a timecode that ran on.
        (self.pace, self.correction, self.learned_ns) = (1.0, 0.0, None);
        Some(event)
    }

    fn follow(&mut self, newest: TimecodeSample, now_ns: u64, show: ShowPosition) -> FollowerOrder {
        let target_s = self.running_target_s(newest, now_ns, show);
        let is_before = target_s < self.settings.first_s;
        let target_s = self.within_run_s(target_s);
        let difference_s = target_s - show.sim_time_s;
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

    /// Stands exactly where the timecode stands; where the head had to brake, and is less than a jump beyond it, there.
    fn stand(&mut self, newest: TimecodeSample, now_ns: u64, show: ShowPosition) -> FollowerOrder {
        let target_s = self.within_run_s(self.target_s(newest.position, show));
        let difference_s = target_s - show.sim_time_s;
        let has_stood_at_once = self.stood_s.is_some() && self.braked_s == 0.0;
        let is_beside = has_stood_at_once && difference_s.abs() > SAME_PLACE_S;
        let is_away = !self.has_met || self.is_jump(difference_s) || is_beside;
        let seek_s = if is_away && !show.is_stopped { self.seek(target_s, now_ns) } else { None };
        self.order(true, seek_s)
    }

    /// Goes on without the timecode, unless that stood. A run whose start was still to come starts when it was due.
    fn go_on(&self, newest: TimecodeSample, now_ns: u64, show: ShowPosition) -> FollowerOrder {
        let is_before = self.running_target_s(newest, now_ns, show) < self.settings.first_s;
        self.order(self.stood || !self.has_met || is_before, None)
    }

    /// Show time at which the show should be now, of a timecode that runs.
    fn running_target_s(&self, newest: TimecodeSample, now_ns: u64, show: ShowPosition) -> f64 {
        let age_s = now_ns.saturating_sub(newest.arrived_ns) as f64 * 1e-9;
        self.target_s(newest.position, show) + self.pace * age_s
    }

    /// Show time of a position: of those that are a day apart the one nearest to the run and, where a run is longer than that,
    /// to where the show is.
    fn target_s(&self, position: Position, show: ShowPosition) -> f64 {
        let today_s = position.since_midnight_s + self.settings.offset_s;
        let away_s = |target_s: f64| (target_s - self.within_run_s(target_s)).abs();
        let days = [today_s, today_s - position.day_s, today_s + position.day_s];
        let nearer = |one: &f64, other: &f64| {
            let from_show_s = |target_s: f64| (target_s - show.sim_time_s).abs();
            away_s(*one).total_cmp(&away_s(*other)).then(from_show_s(*one).total_cmp(&from_show_s(*other)))
        };
        days.into_iter().min_by(nearer).expect("there are three")
    }

    fn within_run_s(&self, target_s: f64) -> f64 {
        target_s.clamp(self.settings.first_s, self.settings.last_s)
    }

    /// Whether the pace is not to make good a difference. What the head's braking has cost, it is: a seek would be a jump at
    /// each stop of the timecode.
    fn is_jump(&self, difference_s: f64) -> bool {
        !(-Self::JUMP_S - self.braked_s..=Self::JUMP_S).contains(&difference_s)
    }

    /// Takes note of the show time that has gone by while the show was to stand.
    fn note_braking(&mut self, show: ShowPosition) {
        let went_on_s = self.stood_s.map_or(0.0, |stood_s| show.sim_time_s - stood_s);
        // An operator's seek is more, or goes back.
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
        let correction = GAIN_PER_S * difference_s;
        self.correction = correction.clamp(-CORRECTION_RANGE, CORRECTION_RANGE);
        if self.correction == correction {
            // A difference that is made good as fast as may be tells nothing more of the pace.
            let pace = self.pace + INTEGRAL_GAIN_PER_S2 * difference_s * step_s.min(LONGEST_STEP_S);
            self.pace = pace.clamp(1.0 - PACE_RANGE, 1.0 + PACE_RANGE);
        }
    }

    fn order(&self, stands: bool, seek_s: Option<f64>) -> FollowerOrder {
        FollowerOrder { time_scale: self.pace + self.correction, stands, seek_s }
    }

    /// A seek, unless one was tried just before.
    fn seek(&mut self, target_s: f64, now_ns: u64) -> Option<f64> {
        let is_due = self.sought_ns.is_none_or(|sought_ns| now_ns.saturating_sub(sought_ns) >= SEEK_PERIOD_NS);
        is_due.then(|| {
            self.sought_ns = Some(now_ns);
            target_s
        })
    }
}

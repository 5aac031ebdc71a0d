//! The promises about one run of the server: a book of what was accepted, and what must follow from it.

use std::sync::Arc;

use bench_dragon_geometry::formation::Formation;
use bench_dragon_ipc::{FrameHeader, Refusal, Request, RunStart, ShowState, Stop};

use super::cues::{CueBook, Place, Walked, is_over};
use super::{Promise, ROUNDING_M};
use crate::scenario::Scenario;
use crate::server::{Decided, Ticked};

/// What the accepted commands of a run require of its frames.
#[derive(Debug)]
#[expect(clippy::struct_excessive_bools, reason = "each is a stop of its own")]
pub(super) struct RunBook {
    settings: RunSettings,
    formation: Arc<Formation>,
    cues: CueBook,
    run_id: u64,
    next_tick: u64,
    held: bool,
    paused: bool,
    ready: bool,
    ending: bool,
    /// Tick at which a command last changed one of these.
    stopped_tick: u64,
    speed_mps: f64,
    /// Where a head that must stand has begun to brake, and its braking distance.
    stand: Option<[f64; 2]>,
    granted: Vec<[f64; 2]>,
    new_grants: Vec<[f64; 2]>,
    /// Travel at which the head may stand without a grant or below the margin: where the run or a seek put it.
    exempt_m: Option<f64>,
    last: Option<Last>,
}

#[derive(Clone, Copy, Debug)]
struct RunSettings {
    is_guarded: bool,
    margin_m: f64,
    accel_mps2: Option<f64>,
    time_scale: f64,
    period_ns: f64,
    most_jumped: u64,
    follows_timecode: bool,
    first_s: f64,
    last_s: f64,
    speed_mps: f64,
    end_travel_m: f64,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    header: FrameHeader,
    behind_ns: u64,
    clearance_m: f64,
}

type Report<'a> = &'a mut dyn FnMut(Promise, String);

impl RunBook {
    pub(super) fn new(scenario: &Scenario, run_id: u64, start: RunStart) -> Self {
        let config = &scenario.config;
        let tables = config.tables();
        let settings = RunSettings {
            is_guarded: tables.monitor.guard,
            margin_m: tables.monitor.margin_m,
            accel_mps2: config.accel_mps2(),
            time_scale: tables.serve.time_scale,
            period_ns: 1e9 / f64::from(tables.serve.rate_hz),
            most_jumped: config.most_jumped(),
            follows_timecode: start.follows_timecode,
            first_s: config.start_s(),
            last_s: start.until_s.map_or(config.last_seek_s(), |until_s| until_s.min(config.last_seek_s())),
            speed_mps: tables.head.speed_mps,
            end_travel_m: config.formation().end_m(),
        };
        let mut run = Self {
            settings,
            formation: Arc::clone(config.formation()),
            cues: CueBook::new(scenario),
            run_id,
            next_tick: 0,
            held: start.is_held,
            paused: start.is_paused,
            ready: start.is_ready,
            ending: false,
            stopped_tick: 0,
            speed_mps: start.speed_mps,
            stand: None,
            granted: Vec::new(),
            new_grants: Vec::new(),
            exempt_m: Some(start.travel_m),
            last: None,
        };
        run.note_stand(start.travel_m, 0.0);
        run
    }

    /// Whether the start of the next run keeps the stops and the ordered speed of this one, and holds the show unless it resumes by itself.
    /// A command that no status has told yet is lost with its server.
    pub(super) fn is_kept_by(&self, start: &RunStart, told: Option<(u64, u64)>, auto_resume: bool) -> bool {
        let holds = start.is_held || start.is_ready;
        // The first status is published before tick 0, and has its number.
        let covers = |tick: u64| tick > 0 && tick >= self.stopped_tick;
        let is_told = told.is_some_and(|(run_id, tick)| run_id == self.run_id && covers(tick));
        let keeps_hold = !self.held || start.is_held || auto_resume && !is_told;
        let keeps_ready = !self.ready || start.is_ready;
        let keeps_pause = !self.paused || start.is_paused || holds && start.follows_timecode || !is_told;
        let keeps_speed = start.speed_mps == self.speed_mps || !is_told;
        keeps_hold && keeps_ready && keeps_pause && keeps_speed && (holds || auto_resume)
    }

    pub(super) fn new_grants(&mut self) -> Vec<[f64; 2]> {
        std::mem::take(&mut self.new_grants)
    }

    pub(super) fn take(&mut self, ticked: &Ticked<'_>, clearance_m: f64, report: Report<'_>) {
        let header = ticked.header;
        if header.run_id != self.run_id || header.tick != self.next_tick {
            report(Promise::TicksWithoutHole, format!("tick {} of run {} is due", self.next_tick, self.run_id));
        }
        self.next_tick = header.tick + 1;
        self.cues.begin_tick(ticked.missed);
        let sought_s = self.take_requests(ticked, report);
        let has_sought = sought_s.is_some();
        if let Some(show_time_s) = sought_s {
            self.check_sought(&header, show_time_s, report);
        }
        self.check_stops(ticked, report);
        self.check_cues(ticked, sought_s, report);
        self.check_places(&header, has_sought, report);
        self.check_stand(&header, report);
        self.check_travel(ticked, clearance_m, has_sought, report);
        self.check_steps(ticked, has_sought, report);
        self.last = Some(Last { header, behind_ns: ticked.behind_ns, clearance_m });
    }

    /// Travel to which a seek moves the head. A head that is planned to reach its end is there in spite of rounding.
    fn travel_at(&self, show_time_s: f64) -> f64 {
        let (travel_m, end_m) = (self.settings.speed_mps * show_time_s, self.settings.end_travel_m);
        let is_rounded = !self.formation.has_plan_course() && end_m - travel_m <= 2.0 * f64::EPSILON * end_m.abs();
        if is_rounded { end_m } else { travel_m.min(end_m) }
    }

    /// Checks that the frame of a seek shows its target.
    fn check_sought(&self, header: &FrameHeader, show_time_s: f64, report: Report<'_>) {
        let off_m = header.course_m - self.travel_at(show_time_s);
        let off_ns = header.show_time_ns as f64 - show_time_s * 1e9;
        if off_m.abs() > ROUNDING_M || off_ns.abs() > 1.0 {
            report(Promise::RepliesAreTrue, format!("a seek to {show_time_s} s is off by {off_m} m, {off_ns} ns"));
        }
    }

    /// Follows the requests of a tick in their order. Returns the show time of the last seek that has moved the head.
    fn take_requests(&mut self, ticked: &Ticked<'_>, report: Report<'_>) -> Option<f64> {
        let (mut travel_m, mut speed_mps) = (ticked.before.travel_m, ticked.before.speed_mps);
        let mut sought_s = None;
        // A hold hides the end of a show.
        let is_at_end = travel_m >= self.settings.end_travel_m
            || ticked.before.show_time_ns as f64 * 1e-9 >= self.settings.last_s - ROUNDING_M;
        for &decided in &ticked.decided {
            let place = Place {
                travel_m,
                is_held: self.held,
                is_ready: self.ready,
                is_paused: self.paused,
                is_ending: self.ending,
                may_be_over: is_over(ticked.before.state) || is_at_end || sought_s.is_some(),
            };
            self.check_reply(decided, place, report);
            if decided.outcome.is_err() {
                continue;
            }
            let (stops, ordered_mps) = ([self.paused, self.held, self.ready], self.speed_mps);
            match decided.request {
                Request::Pause => self.paused = true,
                Request::Resume => self.paused = false,
                Request::Hold => (self.held, self.ready) = (true, false),
                Request::Release => (self.held, self.ready) = (false, false),
                Request::Stop => self.ending = true,
                Request::Speed { speed_mps } => self.speed_mps = self.along_mps(travel_m, speed_mps),
                Request::Seek { show_time_s } => {
                    (travel_m, speed_mps) = (self.travel_at(show_time_s), 0.0);
                    (self.stand, sought_s) = (None, Some(show_time_s));
                    self.exempt_m = None;
                    self.cues.seek();
                }
                Request::Grant { from_m, to_m, .. } => {
                    self.granted.push([from_m, to_m]);
                    self.new_grants.push([from_m, to_m]);
                    self.join_grants();
                }
                Request::Pace { factor } => self.speed_mps = factor * self.settings.speed_mps,
                Request::Go => self.cues.go(travel_m),
            }
            if stops != [self.paused, self.held, self.ready] || ordered_mps.to_bits() != self.speed_mps.to_bits() {
                self.stopped_tick = ticked.header.tick;
            }
            self.note_stand(travel_m, speed_mps);
        }
        sought_s
    }

    /// Keeps few intervals: joins those that overlap.
    fn join_grants(&mut self) {
        self.granted.sort_by(|one, other| one[0].total_cmp(&other[0]));
        let mut joined: Vec<[f64; 2]> = Vec::new();
        for &[from_m, to_m] in &self.granted {
            match joined.last_mut() {
                Some(last) if from_m <= last[1] => last[1] = last[1].max(to_m),
                _ => joined.push([from_m, to_m]),
            }
        }
        self.granted = joined;
    }

    /// Begins or ends the time in which the head must come to rest and stand.
    fn note_stand(&mut self, travel_m: f64, speed_mps: f64) {
        if !(self.held || self.paused || self.ready || self.ending) {
            self.stand = None;
        } else if self.stand.is_none() {
            let braking_m = self.settings.accel_mps2.map_or(0.0, |accel_mps2| 0.5 * speed_mps * speed_mps / accel_mps2);
            self.stand = Some([travel_m, braking_m]);
        }
    }

    /// Whether the reply to a request is true.
    fn check_reply(&self, decided: Decided, place: Place, report: Report<'_>) {
        let Decided { request, outcome, .. } = decided;
        let RunSettings { first_s, last_s, is_guarded, .. } = self.settings;
        let is_valid = match request {
            Request::Speed { speed_mps } => {
                (0.0..=Request::MAX_SPEED_MPS).contains(&self.along_mps(place.travel_m, speed_mps))
            }
            Request::Seek { show_time_s } => (first_s..=last_s).contains(&show_time_s),
            Request::Pace { factor } => (0.0..=Request::MAX_SPEED_MPS / self.settings.speed_mps).contains(&factor),
            _ => true,
        };
        let is_granted =
            |travel_m: f64| self.granted.iter().any(|interval| (interval[0]..=interval[1]).contains(&travel_m));
        let is_true = match (request, outcome) {
            (Request::Pause | Request::Hold | Request::Stop, outcome) => outcome.is_ok(),
            (Request::Speed { .. } | Request::Pace { .. }, Ok(())) => is_valid,
            (Request::Seek { show_time_s }, Ok(())) => {
                is_valid && (!is_guarded || is_granted(self.travel_at(show_time_s)))
            }
            (Request::Speed { .. } | Request::Seek { .. } | Request::Pace { .. }, Err(Refusal::OutOfRange { .. })) => {
                !is_valid
            }
            (Request::Seek { .. }, Err(Refusal::NotProved)) => is_guarded,
            (Request::Seek { .. }, Err(Refusal::Followed)) => self.settings.follows_timecode,
            (Request::Go, outcome) => self.cues.is_true(outcome, place),
            (Request::Release, Ok(())) => self.held || self.ready,
            (Request::Release, Err(Refusal::NotHeld)) | (Request::Resume, Ok(())) => !self.held && !self.ready,
            (Request::Release | Request::Resume, Err(Refusal::HeldByGuard)) => is_guarded && !self.held && !self.ready,
            (Request::Resume, Err(Refusal::Held)) => self.held,
            (Request::Resume, Err(Refusal::Ready)) => self.ready,
            (Request::Resume, Err(Refusal::Finished)) => self.ending || !self.held && !self.ready,
            (Request::Grant { run_id, .. }, Ok(())) => is_guarded && run_id == self.run_id,
            (Request::Grant { run_id, .. }, Err(Refusal::OtherRun)) => run_id != self.run_id,
            _ => false,
        };
        if !is_true {
            report(Promise::RepliesAreTrue, format!("{request:?} gets {outcome:?} of {self:?}"));
        }
    }

    fn check_stops(&self, ticked: &Ticked<'_>, report: Report<'_>) {
        let [held, paused, ready, ending] =
            [Stop::Held, Stop::Paused, Stop::Ready, Stop::Ending].map(|stop| ticked.stops.has(stop));
        let steered = ticked.steering.is_some_and(|steering| steering.stands);
        let state = ticked.header.show_state();
        let must_stand = self.held || self.paused || self.ready || self.ending || steered;
        let is_true = (held, paused, ready, ending) == (self.held, self.paused, self.ready, self.ending)
            && ticked.stops.has(Stop::Waiting) == self.cues.waits_at(ticked.header.course_m)
            && (!must_stand || state != Some(ShowState::Running));
        if !is_true {
            report(Promise::StopsAreTrue, format!("the stops are {:?} of {self:?}", ticked.stops));
        }
    }

    /// The speed along the course at which the leading head walks at a speed.
    fn along_mps(&self, course_m: f64, speed_mps: f64) -> f64 {
        let planned_mps = self.settings.speed_mps;
        let is_plan = self.formation.has_plan_course();
        let ordered_mps = if is_plan { self.formation.ordered_mps(course_m) } else { planned_mps };
        if ordered_mps == 0.0 || ordered_mps == planned_mps {
            speed_mps
        } else {
            speed_mps * (planned_mps / ordered_mps)
        }
    }

    /// Checks that no wait is left without GO, that GO moves the next frame, and the events of cues.
    fn check_cues(&self, ticked: &Ticked<'_>, sought_s: Option<f64>, report: Report<'_>) {
        let (header, before_m) = (ticked.header, ticked.before.travel_m);
        let from_m = self.last.map(|last| last.header.course_m);
        let put_m = sought_s.map(|show_time_s| self.travel_at(show_time_s));
        let passed_m = self.cues.passed(put_m.or(from_m).unwrap_or(before_m), header.course_m);
        if let Some(passed_m) = passed_m {
            report(Promise::WaitsForGo, format!("the show passes the wait at {passed_m} m, {self:?}"));
        }
        let may_walk = !(self.held || self.paused || self.ready || self.ending || self.settings.is_guarded);
        let must_move = may_walk && header.tick > 0 && put_m.is_none() && self.speed_mps > 0.0;
        let stands = header.course_m == before_m && !header.show_state().is_some_and(is_over);
        if must_move && stands && self.cues.has_gone() {
            report(Promise::GoMovesNextFrame, format!("the show stands at {before_m} m, {self:?}"));
        }
        let walk = Walked { from_m, before_m, put_m, to_m: header.course_m };
        if let Err(what) = self.cues.check_reached(&ticked.reached, &walk) {
            report(Promise::CueIsAnEvent, what);
        }
    }

    /// Checks that each dragon of a plan is where its timetable has it, and that none goes back.
    fn check_places(&self, header: &FrameHeader, has_sought: bool, report: Report<'_>) {
        if !self.formation.has_plan_course() {
            return;
        }
        let plan_s = header.course_m / self.settings.speed_mps;
        let last = self.last.filter(|_| !has_sought);
        for (number, (shown, planned)) in header.dragons().iter().zip(self.formation.dragons()).enumerate() {
            let off_m = shown.travel_m - planned.travel_m(plan_s);
            let back_m = last.map_or(0.0, |last| last.header.dragons()[number].travel_m - shown.travel_m);
            if off_m.abs() > ROUNDING_M || back_m > ROUNDING_M {
                let text = format!("dragon {number} is {off_m} m off at plan time {plan_s} s, and {back_m} m behind");
                report(Promise::PlacesFollowPlan, text);
            }
        }
    }

    fn check_stand(&self, header: &FrameHeader, report: Report<'_>) {
        if let Some([from_m, braking_m]) = self.stand {
            let moved_m = header.course_m - from_m;
            if moved_m < -ROUNDING_M || moved_m > braking_m + ROUNDING_M {
                report(
                    Promise::StandsUntilRelease,
                    format!("moved {moved_m} m, braking distance {braking_m} m, {self:?}"),
                );
            }
        }
    }

    fn check_travel(&mut self, ticked: &Ticked<'_>, clearance_m: f64, has_sought: bool, report: Report<'_>) {
        if !self.settings.is_guarded {
            return;
        }
        let travel_m = ticked.header.course_m;
        if self.exempt_m != Some(travel_m) {
            self.exempt_m = None;
        }
        let is_in = |interval: &[f64; 2], travel_m: f64| (interval[0]..=interval[1]).contains(&travel_m);
        let here = self.granted.iter().find(|interval| is_in(interval, travel_m));
        let is_granted = here.is_some();
        let limit_m = ticked.limits.granted_to_m.unwrap_or(f64::INFINITY);
        let is_limit = limit_m == travel_m || here.is_some_and(|interval| is_in(interval, limit_m));
        if !is_limit || !is_granted && self.exempt_m.is_none() {
            report(Promise::OnGrantedTravel, format!("granted are {:?}, the limit is {limit_m} m", self.granted));
        }
        let was_below = self.last.is_some_and(|last| last.clearance_m < self.settings.margin_m) && !has_sought;
        if clearance_m < self.settings.margin_m - ROUNDING_M && self.exempt_m.is_none() && !was_below {
            report(Promise::MarginKept, format!("the clearance is {clearance_m} m"));
        }
    }

    /// Checks the step of show time and travel from the last frame.
    fn check_steps(&self, ticked: &Ticked<'_>, has_sought: bool, report: Report<'_>) {
        let Some(last) = self.last.filter(|_| !has_sought) else { return };
        let RunSettings { time_scale, period_ns, most_jumped, follows_timecode, .. } = self.settings;
        let (header, missed) = (ticked.header, ticked.missed);
        let show_ns = (header.show_time_ns - last.header.show_time_ns) as f64;
        let travel_m = header.course_m - last.header.course_m;
        let state = |state: ShowState| header.show_state() == Some(state);
        if let Some(accel_mps2) =
            self.settings.accel_mps2.filter(|_| !self.settings.is_guarded && !ticked.stops.has(Stop::RunEnd))
        {
            let change_mps = (header.course_mps - last.header.course_mps).abs();
            let most_mps = accel_mps2 * (show_ns + 4.0) * 1e-9 + ROUNDING_M;
            // The plan itself has the ramps of its rests.
            let is_rest = |travel_m: f64| {
                self.formation.has_plan_course()
                    && (travel_m == self.formation.begin_m() || self.cues.is_wait(travel_m))
            };
            // Missed periods may bring the show to a wait, which a GO of this tick ends.
            let may_jump = [last.header.course_m, ticked.before.travel_m, header.course_m].into_iter().any(is_rest);
            if change_mps > most_mps && !may_jump && !state(ShowState::Finished) && !state(ShowState::Ended) {
                report(Promise::RampsAreKept, format!("the speed changes by {change_mps} m/s, at most {most_mps} m/s"));
            }
        }
        let fastest_m = Request::MAX_SPEED_MPS * (show_ns + 4.0) * 1e-9;
        // A timecode changes the length of ticks, in which a head at its end counts its instants: that rounds its travel.
        let back_m = if follows_timecode { 1e-12 } else { 0.0 };
        if show_ns < 0.0 || travel_m < -back_m || travel_m > fastest_m {
            report(Promise::NoJump, format!("the step is {travel_m} m in {show_ns} ns of show time"));
        }
        let due_ns = (header.scheduled_ns - last.header.scheduled_ns) as f64;
        if (due_ns - (missed + 1) as f64 * period_ns).abs() > 2.0 {
            report(Promise::TimeIsKept, format!("{missed} missed periods, but the ticks are {due_ns} ns apart"));
        }
        let walks = |state: Option<ShowState>| state.is_some_and(ShowState::walks);
        let stands = ![last.header.show_state(), Some(ticked.before.state), header.show_state()].into_iter().any(walks);
        let has_changed = ticked.decided.iter().any(|decided| decided.outcome.is_ok());
        if stands && !follows_timecode && !has_changed && (show_ns != 0.0 || last.behind_ns != ticked.behind_ns) {
            report(Promise::TimeIsKept, format!("show time goes on by {show_ns} ns while the show stands"));
        }
        let runs = [last.header.show_state(), Some(ticked.before.state), header.show_state()];
        if follows_timecode || runs != [Some(ShowState::Running); 3] {
            return;
        }
        let (before_ns, periods) = (last.behind_ns as f64, (missed + 1) as f64);
        let (added_ns, made_up) = if missed > most_jumped { (missed as f64 * period_ns, 1.0) } else { (0.0, periods) };
        let lag_ns = before_ns + added_ns;
        let expected_ns = lag_ns - (made_up * 0.1 * period_ns).min(lag_ns);
        let behind_ns = ticked.behind_ns as f64;
        let off_ns = show_ns / time_scale - (periods * period_ns - (behind_ns - before_ns));
        let tolerance_ns = 4.0 + 4.0 / time_scale;
        if (behind_ns - expected_ns).abs() > tolerance_ns || off_ns.abs() > tolerance_ns {
            report(
                Promise::TimeIsKept,
                format!(
                    "after {missed} missed periods the step is {show_ns} ns, behind {before_ns} then {behind_ns} ns"
                ),
            );
        }
        if self.settings.accel_mps2.is_none() && (header.course_mps - self.speed_mps).abs() > ROUNDING_M {
            report(Promise::RepliesAreTrue, format!("the head walks at another speed than ordered, {self:?}"));
        }
    }
}

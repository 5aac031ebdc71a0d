//! The guard: prevents contacts with a movement authority, as railway signalling separates trains.
//!
//! A guarded server moves the head only within its grants. From the published description, the guard proves that no two benches
//! come nearer than a margin on the travel ahead ([`Request::Grant`]). It keeps the grant a horizon ahead of the head, but
//! never beyond the point at which the clearance falls below the margin. With `[stage] guard` it also proves that all boards keep
//! `clear_m` from the borders of the stage. Bench positions depend on travel alone. So a grant is
//! valid at any speed until the run ends. If the guard dies, lags or has a wrong state, the head comes to rest on proven
//! travel.
//!
//! Pure: frame headers go in, grants come out. The command owns the clocks, the bus and the thread.

use std::sync::Arc;

use bench_dragon_geometry::clearance::{
    ClearanceSearch, CourseSearch, PairClearance, ProvenCourse, Standing, most_play_reach_m, nearest_to_borders,
};
use bench_dragon_geometry::dragon::{Board, ChainSolver, Handle, Meter};
use bench_dragon_geometry::formation::Formation;
use bench_dragon_geometry::stage::Stage;
use bench_dragon_ipc::{FrameHeader, Refusal, Request, ShowState, Status};

use crate::config::Config;

/// Greatest number of handles placed in one call, in whole strides: less than a second of work. Between calls, the guard reads
/// the newest frame.
const HANDLES_AT_A_TIME: usize = 4_000_000;
/// Greatest work of one call in steps: about two seconds. So a stride with very many pairs near the margin does not keep the
/// guard from the newest frame.
pub const STEPS_AT_A_TIME: u64 = 50_000_000;
/// Greatest work of the forecast of a contact beyond the final rest, in steps.
const FORECAST_STEPS: u64 = 20_000_000;
/// Least reach of a grant ahead of the head in ticks. The server applies a grant one tick later.
const LEAST_TICKS: f64 = 3.0;
/// Reach of a grant ahead of the head if the server misses no period, in seconds of wall time at the head's speed.
const LEAST_HORIZON_S: f64 = 0.5;
/// Reach of a new grant in horizons: more than one, so that not every frame needs a new grant.
const GRANTED_HORIZONS: f64 = 1.5;
/// Greatest distance in metres over `clear_m` at which a border is the reason for a stop: more than the resolution of the proof.
const BORDER_TOLERANCE_M: f64 = 1e-6;

/// The final rest of the head: no further travel can be granted from here.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinalRest {
    /// Travel of the head in metres.
    pub travel_m: f64,
    /// Show time in seconds.
    pub show_time_s: f64,
    /// Whether the clearance keeps the margin here. If not, the head was repositioned to this travel, and did not walk to it.
    pub is_free: bool,
    /// Show time in seconds at which two benches would touch if the head continued at its planned speed. `None` if they would
    /// not touch before the run ends, or if the search needs too much work.
    pub forecast_s: Option<f64>,
    /// The board that is as near to a border of the stage as it may be, and the border; `None` if none is.
    pub border: Option<Standing>,
}

/// The target of a refused seek that no grant contains yet, by a status of the source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Asked {
    /// Travel in metres.
    pub travel_m: f64,
    /// Tick of the status.
    pub tick: u64,
}

impl Asked {
    /// Returns what a status asks for, if it does.
    pub fn of(status: &Status) -> Option<Self> {
        status.asked().map(|travel_m| Self { travel_m, tick: status.tick })
    }
}

/// The guard of one run.
#[derive(Debug)]
pub struct Guard<'a> {
    formation: &'a Formation,
    /// The stage whose borders the guard keeps clear, if there is one.
    stage: Option<&'a Stage>,
    /// Clearance that the guard keeps, in metres.
    margin_m: f64,
    /// Reach of a grant ahead of the head, in seconds of wall time at the head's speed.
    horizon_s: f64,
    run_id: u64,
    planned_speed_mps: f64,
    accel_mps2: Option<f64>,
    rate_hz: f64,
    /// Last walking speed of the head.
    walking_speed_mps: f64,
    /// Proven travel at the head; `None` if the head is at a margin violation.
    present: Option<Granting<'a>>,
    /// Proven travel at the target of a seek.
    prepared: Option<Granting<'a>>,
    /// Target of the last seek, which may be at a margin violation.
    asked_m: Option<f64>,
    /// Travel of the last margin violation.
    refused_m: Option<f64>,
    /// Whether the source has refused grants altogether, as a replay does.
    takes_no_grants: bool,
}

/// Proven travel, and the part of it that the server has.
#[derive(Debug)]
struct Granting<'a> {
    proven: ProvenCourse<'a>,
    /// The last grant that the server has taken.
    granted: Option<Granted>,
}

/// A grant that the server has taken.
#[derive(Clone, Copy, Debug)]
struct Granted {
    to_m: f64,
    is_final: bool,
    /// The tick in which the server took it.
    tick: u64,
}

impl<'a> Guard<'a> {
    /// The guard of a run of a formation with its published configuration.
    pub fn new(formation: &'a Formation, config: &'a Config, run_id: u64) -> Self {
        Self {
            formation,
            stage: config.guarded_stage(),
            margin_m: config.tables().monitor.margin_m,
            // A server that misses periods jumps without a frame in between. The grant for a frame may arrive after the next
            // jump. So a grant reaches two jumps further.
            horizon_s: LEAST_HORIZON_S + 2.0 * config.tables().serve.catch_up_s,
            run_id,
            planned_speed_mps: config.tables().head.speed_mps,
            accel_mps2: config.accel_mps2(),
            rate_hz: f64::from(config.tables().serve.rate_hz),
            walking_speed_mps: 0.0,
            present: None,
            prepared: None,
            asked_m: None,
            refused_m: None,
            takes_no_grants: false,
        }
    }

    /// Takes a frame of the run, and the target of a refused seek. Proves more travel if it is needed, and returns a grant for
    /// the server. Returns the grant again until [`Guard::note_reply`] confirms it.
    pub fn advance(&mut self, header: &FrameHeader, asked: Option<Asked>) -> Option<Request> {
        if self.takes_no_grants {
            return None;
        }
        if header.show_state().is_some_and(ShowState::walks) {
            self.walking_speed_mps = header.course_mps;
        }
        let (run_id, travel_m) = (self.run_id, header.course_m);
        let horizon_m = self.horizon_m(header.time_scale);
        self.update_present(travel_m);
        self.prepare(asked);
        let present = self.present.as_mut().and_then(|present| present.next_grant(run_id, travel_m, horizon_m));
        present.or_else(|| self.prepared.as_mut()?.next_grant(run_id, self.asked_m?, horizon_m))
    }

    /// Notes the source's reply to a grant. Returns whether the source has taken it.
    pub fn note_reply(&mut self, grant: Request, outcome: Result<u64, Refusal>) -> bool {
        match (grant, outcome) {
            (Request::Grant { from_m, to_m, is_final, .. }, Ok(tick)) => {
                self.note_granted(from_m, Granted { to_m, is_final, tick });
                return true;
            }
            (_, Err(Refusal::Replayed | Refusal::NotGuarded)) => self.takes_no_grants = true,
            // The server has restarted or ended. The next frame shows which.
            _ => {}
        }
        false
    }

    fn note_granted(&mut self, from_m: f64, granted: Granted) {
        let grantings = [&mut self.present, &mut self.prepared].into_iter().flatten();
        for granting in grantings.filter(|granting| granting.proven.begin_m() == from_m) {
            granting.granted = Some(granted);
        }
    }

    /// Whether the head is at its final rest in this frame. Call it after [`Guard::advance`] with the same frame. A head that is
    /// held at the end of the run rests there because of the run, and not because of the guard.
    pub fn is_final(&self, header: &FrameHeader) -> bool {
        let travel_m = header.course_m;
        if travel_m >= self.formation.end_m() {
            return false;
        }
        let is_end = match &self.present {
            Some(Granting { proven, .. }) => proven.is_whole() && travel_m >= proven.end_m(),
            None => self.refused_m == Some(travel_m),
        };
        is_end && header.show_state() == Some(ShowState::Held)
    }

    /// Returns the final rest of a frame for which [`Guard::is_final`] is true.
    pub fn final_rest(&self, header: &FrameHeader) -> FinalRest {
        let travel_m = header.course_m;
        let formation = self.formation.metered(&Meter::of(FORECAST_STEPS));
        let contact = CourseSearch::within(&formation, 0.0).first(travel_m, formation.end_m()).ok().flatten();
        let show_time_s = header.show_time_s();
        let forecast_s = contact.map(|contact| show_time_s + (contact.travel_m - travel_m) / self.planned_speed_mps);
        let border = self.stage.and_then(|stage| {
            let near_m = stage.clear_m() + most_play_reach_m(self.formation.lead()) + BORDER_TOLERANCE_M;
            nearest_to_borders(self.formation, stage, travel_m, near_m)
        });
        FinalRest { travel_m, show_time_s, is_free: self.present.is_some(), forecast_s, border }
    }

    /// Reach of a grant ahead of the head in metres: a horizon of wall time at the head's speed, or at least [`LEAST_TICKS`],
    /// plus the braking distance.
    fn horizon_m(&self, time_scale: f64) -> f64 {
        let speed_mps = self.walking_speed_mps.max(self.planned_speed_mps);
        let braking_m = self.accel_mps2.map_or(0.0, |accel_mps2| speed_mps * speed_mps / (2.0 * accel_mps2));
        self.horizon_s.max(LEAST_TICKS / self.rate_hz) * time_scale * speed_mps + braking_m
    }

    /// Finds the proven travel that contains the head's travel, or begins a new proof there.
    fn update_present(&mut self, travel_m: f64) {
        let holds =
            |granting: &Option<Granting<'_>>| granting.as_ref().is_some_and(|some| some.proven.contains(travel_m));
        if holds(&self.present) || self.refused_m == Some(travel_m) {
            return;
        }
        self.present = if holds(&self.prepared) { self.prepared.take() } else { self.begin(travel_m) };
        self.refused_m = self.present.is_none().then_some(travel_m);
    }

    /// Begins a proof at a new target of a seek. A target that is asked for again, after its grant, is granted again: an older grant, which
    /// came late, has replaced that one.
    ///
    /// A target within the travel at the last known place of the head means that the source lacks that travel: the head
    /// was elsewhere since, and another grant has replaced it. It is granted again as a whole, and nothing is begun
    /// beside it.
    fn prepare(&mut self, asked: Option<Asked>) {
        if let (Some(asked), Some(present)) = (asked, &mut self.present)
            && present.proven.contains(asked.travel_m)
        {
            present.note_asked(asked);
            self.asked_m = None;
            return;
        }
        let asked_m = asked.map(|asked| asked.travel_m);
        if asked_m != self.asked_m {
            self.asked_m = asked_m;
            self.prepared = asked_m.map_or(self.prepared.take(), |asked_m| self.begin(asked_m));
        } else if let (Some(asked), Some(prepared)) = (asked, &mut self.prepared) {
            prepared.note_asked(asked);
        }
    }

    fn begin(&self, travel_m: f64) -> Option<Granting<'a>> {
        let is_on_course = (self.formation.begin_m()..=self.formation.end_m()).contains(&travel_m);
        let begun = || ProvenCourse::at(self.formation, self.stage, self.margin_m, travel_m);
        let proven = is_on_course.then(begun)?.ok()?;
        Some(Granting { proven, granted: None })
    }
}

impl Granting<'_> {
    /// Notes that the source asks for a part of this travel. If it does so after the tick in which it took the last
    /// grant, it has that grant no more. The status of that tick itself may be older than the grant.
    fn note_asked(&mut self, asked: Asked) {
        self.granted = self.granted.filter(|granted| asked.tick <= granted.tick);
    }

    /// Extends the proof, and returns a grant if a head at `travel_m` needs one.
    fn next_grant(&mut self, run_id: u64, travel_m: f64, horizon_m: f64) -> Option<Request> {
        let is_needed = |granted: Granted| !granted.is_final && granted.to_m < travel_m + horizon_m;
        if !self.granted.is_none_or(is_needed) {
            return None;
        }
        self.proven.extend(travel_m + GRANTED_HORIZONS * horizon_m, HANDLES_AT_A_TIME);
        let (from_m, to_m, is_final) = (self.proven.begin_m(), self.proven.end_m(), self.proven.is_whole());
        let is_new = self.granted.is_none_or(|granted| granted.to_m < to_m || is_final);
        is_new.then_some(Request::Grant { run_id, from_m, to_m, is_final })
    }
}

/// Difference of clearance in metres above which a frame is faulty: far above the rounding of any pose, far below any margin.
pub const FAULT_M: f64 = 1e-8;

/// Checks the clearances of the frames of one run against the reference solver.
#[derive(Debug)]
pub struct ClearanceCheck {
    formation: Arc<Formation>,
    solvers: Vec<ChainSolver>,
    boards: Vec<Board>,
    search: ClearanceSearch,
}

impl ClearanceCheck {
    /// A check of a formation.
    pub fn new(formation: Arc<Formation>) -> Self {
        let solvers = formation.dragons().iter().map(|planned| ChainSolver::new(&planned.dragon)).collect();
        let search = ClearanceSearch::of(formation.layout());
        Self { formation, solvers, boards: Vec::new(), search }
    }

    /// Returns the nearest pair for a place of the course, by the reference solver. `None` off the course, and where no two benches
    /// are a pair.
    pub fn nearest(&mut self, course_m: f64) -> Option<PairClearance> {
        let Self { formation, solvers, boards, search } = self;
        boards.clear();
        for (number, (solver, planned)) in solvers.iter_mut().zip(formation.dragons()).enumerate() {
            let handles = solver.solve(&planned.dragon, formation.travel_m(number, course_m)).ok()?;
            planned.dragon.add_boards(handles, Handle::in_space, boards);
        }
        search.nearest(boards)
    }

    /// Whether the clearance of the nearest pair in a frame agrees with the reference solver, to [`FAULT_M`].
    pub fn agrees(&mut self, header: &FrameHeader, measured: Option<PairClearance>) -> bool {
        match (self.nearest(header.course_m), measured) {
            (Some(expected), Some(measured)) => (expected.clearance_m - measured.clearance_m).abs() <= FAULT_M,
            (None, None) => self.formation.layout().benches() < 3,
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hold_at_the_end_of_the_run_is_not_the_stop_of_the_guard() {
        let config =
            Config::from_toml("[dragon]\nbenches = 2\n[monitor]\nguard = true\n").expect("a sound configuration");
        let mut guard = Guard::new(config.formation(), &config, 7);
        let head_travel_m = config.formation().end_m();
        for state in [ShowState::Finished, ShowState::Held] {
            let header = FrameHeader { run_id: 7, head_travel_m, state: state.to_wire(), ..FrameHeader::default() }
                .of_one_dragon();
            let _ = guard.advance(&header, None);
            assert!(!guard.is_final(&header), "{state:?}");
        }
    }
}

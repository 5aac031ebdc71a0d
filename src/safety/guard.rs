//! The guard: keeps benches from touching by a movement authority, as railway signalling keeps trains apart.
//!
//! A guarded server moves the head only as far as it was granted. The guard proves from the published description that on
//! the travel ahead no two benches come nearer than a margin ([`Request::Grant`]), and keeps the grant a horizon ahead of the
//! head: never past the point where the clearance would fall under the margin. Where the benches are is a function of
//! travel alone, so a grant holds at any speed, for as long as the run lasts. If the guard dies, lags or is wrong about the
//! state, the head comes to rest on travel that was proved free.
//!
//! Pure: frame headers go in, grants come out. Clocks, the bus and the thread are the command's.

use std::sync::Arc;

use bench_dragon_geometry::clearance::{ClearanceSearch, ContactSearch, PairClearance, ProvenTravel};
use bench_dragon_geometry::dragon::{Board, ChainSolver, Dragon, Meter};
use bench_dragon_ipc::{FrameHeader, Request, ShowState};

use crate::config::Config;

/// Handles that are placed in one go, in whole strides, so that the present is looked at in between: for less than a
/// second's work.
const HANDLES_AT_A_TIME: usize = 4_000_000;
/// Work that may be done in one go, in steps: some two seconds, so that a stride on which very many pairs are near the margin
/// does not keep the guard from its present.
pub const STEPS_AT_A_TIME: u64 = 50_000_000;
/// Work that the forecast of a contact behind the final rest may take, in steps.
const FORECAST_STEPS: u64 = 20_000_000;
/// Ticks that a grant reaches ahead at least: one passes before the server takes it.
const LEAST_TICKS: f64 = 3.0;
/// How far ahead of the head a grant reaches where the server misses no release, in seconds of wall time at its speed.
const LEAST_HORIZON_S: f64 = 0.5;
/// How far a grant reaches where one is needed, in horizons, so that not every frame needs one.
const GRANTED_HORIZONS: f64 = 1.5;

/// Where the head rests for good: no further travel can ever be granted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FinalRest {
    /// Travel of the head in metres.
    pub travel_m: f64,
    /// Show time in seconds.
    pub sim_time_s: f64,
    /// Whether the margin is kept there; where it is not, the head was repositioned there, and never walked.
    pub is_free: bool,
    /// Show time at which two benches would touch if the head walked on at its planned speed; `None` where they would not
    /// up to the run's end, or where it takes too much work to find out.
    pub forecast_s: Option<f64>,
}

/// The guard of one run.
#[derive(Debug)]
pub struct Guard<'a> {
    dragon: &'a Dragon,
    /// Clearance that it keeps, in metres.
    margin_m: f64,
    /// How far ahead of the head a grant reaches, in seconds of wall time at its speed.
    horizon_s: f64,
    run_id: u64,
    planned_speed_mps: f64,
    accel_mps2: Option<f64>,
    rate_hz: f64,
    /// Speed at which the head last walked.
    walking_speed_mps: f64,
    /// The proven travel that the head is on, unless it is not free.
    present: Option<Granting<'a>>,
    /// Proven travel that a seek has asked for.
    prepared: Option<Granting<'a>>,
    /// Travel that was asked for last, which may not be free.
    asked_m: Option<f64>,
    /// Travel at which a margin violation was last found.
    refused_m: Option<f64>,
}

/// Proven travel and how much of it the server knows.
#[derive(Debug)]
struct Granting<'a> {
    proven: ProvenTravel<'a>,
    /// Where the last grant of it that was taken ends, and whether for good.
    granted: Option<(f64, bool)>,
}

impl<'a> Guard<'a> {
    /// The guard of a run of this dragon, which was published with this configuration.
    pub fn new(dragon: &'a Dragon, config: &Config, run_id: u64) -> Self {
        Self {
            dragon,
            margin_m: config.tables().monitor.margin_m,
            // A server that has missed releases jumps without a frame in between. The guard's answer to a frame may come after
            // the next jump, so a grant reaches two jumps further.
            horizon_s: LEAST_HORIZON_S + 2.0 * config.tables().serve.catch_up_s,
            run_id,
            planned_speed_mps: config.tables().head.speed_mps,
            accel_mps2: config.tables().head.accel_mps2,
            rate_hz: f64::from(config.tables().serve.rate_hz),
            walking_speed_mps: 0.0,
            present: None,
            prepared: None,
            asked_m: None,
            refused_m: None,
        }
    }

    /// Looks at a frame of the run, and at the travel that a refused seek asked for, proves more travel where it is needed,
    /// and returns a grant for the server. It is returned again until [`Guard::note_granted`] says that it was taken.
    pub fn follow(&mut self, header: &FrameHeader, asked_m: Option<f64>) -> Option<Request> {
        if header.show_state().is_some_and(ShowState::walks) {
            self.walking_speed_mps = header.head_speed_mps;
        }
        let (run_id, travel_m) = (self.run_id, header.head_travel_m);
        let horizon_m = self.horizon_m(header.time_scale);
        self.stand_on(travel_m);
        self.prepare(asked_m);
        let present = self.present.as_mut().and_then(|present| present.next_grant(run_id, travel_m, horizon_m));
        present.or_else(|| self.prepared.as_mut()?.next_grant(run_id, self.asked_m?, horizon_m))
    }

    /// Takes note that the server has taken a grant.
    pub fn note_granted(&mut self, from_m: f64, to_m: f64, is_final: bool) {
        let grantings = [&mut self.present, &mut self.prepared].into_iter().flatten();
        for granting in grantings.filter(|granting| granting.proven.begin_m() == from_m) {
            granting.granted = Some((to_m, is_final));
        }
    }

    /// Whether this frame, which the guard has looked at, shows the head at rest where no further travel can ever be
    /// granted.
    pub fn is_final(&self, header: &FrameHeader) -> bool {
        let travel_m = header.head_travel_m;
        let is_end = match &self.present {
            Some(Granting { proven, .. }) => proven.is_whole() && travel_m >= proven.end_m(),
            None => self.refused_m == Some(travel_m),
        };
        is_end && header.show_state() == Some(ShowState::Held)
    }

    /// What there is to report of such a frame.
    pub fn final_rest(&self, header: &FrameHeader) -> FinalRest {
        let travel_m = header.head_travel_m;
        let dragon = self.dragon.metered(&Meter::of(FORECAST_STEPS));
        let contact = ContactSearch::new(&dragon).first(travel_m, dragon.end_travel_m()).ok().flatten();
        let sim_time_s = header.sim_time_s();
        let forecast_s = contact.map(|contact| sim_time_s + (contact.travel_m - travel_m) / self.planned_speed_mps);
        FinalRest { travel_m, sim_time_s, is_free: self.present.is_some(), forecast_s }
    }

    /// How far ahead of the head a grant is to reach: a horizon of wall time at its speed, some ticks of it at least, and the
    /// way to brake from there.
    fn horizon_m(&self, time_scale: f64) -> f64 {
        let speed_mps = self.walking_speed_mps.max(self.planned_speed_mps);
        let braking_m = self.accel_mps2.map_or(0.0, |accel_mps2| speed_mps * speed_mps / (2.0 * accel_mps2));
        self.horizon_s.max(LEAST_TICKS / self.rate_hz) * time_scale * speed_mps + braking_m
    }

    /// Finds the proven travel that the head is on, or begins it there.
    fn stand_on(&mut self, travel_m: f64) {
        let holds =
            |granting: &Option<Granting<'_>>| granting.as_ref().is_some_and(|some| some.proven.contains(travel_m));
        if holds(&self.present) || self.refused_m == Some(travel_m) {
            return;
        }
        self.present = if holds(&self.prepared) { self.prepared.take() } else { self.begin(travel_m) };
        self.refused_m = self.present.is_none().then_some(travel_m);
    }

    /// Begins a proof where a seek was asked to go, unless it was before.
    fn prepare(&mut self, asked_m: Option<f64>) {
        if asked_m != self.asked_m {
            self.asked_m = asked_m;
            self.prepared = asked_m.map_or(self.prepared.take(), |asked_m| self.begin(asked_m));
        }
    }

    fn begin(&self, travel_m: f64) -> Option<Granting<'a>> {
        let within_run = (self.dragon.start_travel_m()..=self.dragon.end_travel_m()).contains(&travel_m);
        let proven = within_run.then(|| ProvenTravel::at(self.dragon, self.margin_m, travel_m))?.ok()?;
        Some(Granting { proven, granted: None })
    }
}

impl Granting<'_> {
    /// Proves on, and returns what is to be granted if it is needed for a head at `travel_m`.
    fn next_grant(&mut self, run_id: u64, travel_m: f64, horizon_m: f64) -> Option<Request> {
        let is_needed = |(to_m, is_final): (f64, bool)| !is_final && to_m < travel_m + horizon_m;
        if !self.granted.is_none_or(is_needed) {
            return None;
        }
        self.proven.extend(travel_m + GRANTED_HORIZONS * horizon_m, HANDLES_AT_A_TIME);
        let (from_m, to_m, is_final) = (self.proven.begin_m(), self.proven.end_m(), self.proven.is_whole());
        let is_new = self.granted.is_none_or(|granted| granted.0 < to_m || is_final);
        is_new.then_some(Request::Grant { run_id, from_m, to_m, is_final })
    }
}

/// A difference of clearance over this, in metres, is a fault: far above the rounding of any pose, far below any margin.
pub const FAULT_M: f64 = 1e-8;

/// Checks the frames of one run.
#[derive(Debug)]
pub struct ClearanceCheck {
    dragon: Arc<Dragon>,
    solver: ChainSolver,
    boards: Vec<Board>,
    search: ClearanceSearch,
}

impl ClearanceCheck {
    /// A check of this dragon.
    pub fn new(dragon: Arc<Dragon>) -> Self {
        let solver = ChainSolver::new(&dragon);
        Self { dragon, solver, boards: Vec::new(), search: ClearanceSearch::default() }
    }

    /// The nearest pair with the head at a travel, by the reference solver; `None` outside the run and with fewer than
    /// three benches.
    pub fn nearest(&mut self, travel_m: f64) -> Option<PairClearance> {
        let handles = self.solver.solve(&self.dragon, travel_m).ok()?;
        self.dragon.place_boards(handles, &mut self.boards);
        self.search.nearest(&self.boards)
    }

    /// Whether the nearest pair that was measured in a frame is as near as it should be, to [`FAULT_M`].
    pub fn agrees(&mut self, header: &FrameHeader, measured: Option<PairClearance>) -> bool {
        match (self.nearest(header.head_travel_m), measured) {
            (Some(expected), Some(measured)) => (expected.clearance_m - measured.clearance_m).abs() <= FAULT_M,
            (None, None) => self.dragon.dimensions().benches() < 3,
            _ => false,
        }
    }
}

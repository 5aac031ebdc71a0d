//! The planned clearance, as a page draws it.

use bench_dragon_geometry::planner::ClosestApproach;
use serde::Serialize;

use crate::display::observe::PlannedClearance;

/// What lies ahead in a whole run: some 15 kB, 40 at most. Metres.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename = "plan")]
pub struct PlanMessage {
    run_id: u64,
    /// Whether everything that is to be found out has been.
    is_complete: bool,
    /// Travel and least clearance, travel and least clearance, …, in order of travel, to a micrometre.
    curve: Vec<f64>,
    near_misses: Vec<NearMissReport>,
    /// Near misses that are left out, none of them nearer than those that are here.
    near_misses_dropped: usize,
    contact: Option<ContactReport>,
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct NearMissReport {
    travel_m: f64,
    clearance_m: f64,
    benches: [usize; 2],
}

#[derive(Clone, Debug, PartialEq, Serialize)]
struct ContactReport {
    travel_m: f64,
    benches: [usize; 2],
}

impl PlanMessage {
    /// The plan of a run.
    pub fn of(run_id: u64, plan: &PlannedClearance) -> Self {
        let near_miss = |&ClosestApproach { travel_m, pair }: &ClosestApproach| NearMissReport {
            travel_m,
            clearance_m: pair.clearance_m,
            benches: pair.benches,
        };
        Self {
            run_id,
            is_complete: plan.is_complete(),
            curve: plan.curve().iter().flat_map(|point| [point.travel_m, point.pair.clearance_m]).map(round).collect(),
            near_misses: plan.near_misses().iter().map(near_miss).collect(),
            near_misses_dropped: plan.near_misses_dropped(),
            contact: plan
                .contact()
                .map(|contact| ContactReport { travel_m: contact.travel_m, benches: contact.benches }),
        }
    }
}

fn round(value_m: f64) -> f64 {
    (value_m * 1e6).round() / 1e6
}

//! The passage of a whole dragon through a turn, and its limits on clearance and speed.

use std::sync::Arc;

use super::infeasible::Infeasible;
use super::least_clearance::{ClosestApproach, least_clearance};
use super::planned_turn::PlannedTurn;
use super::speed_limit::{LargestRatio, largest_speed_ratio};
use crate::clearance::{Contact, first_within};
use crate::dragon::{ARC_PER_CHORD, Dimensions, Dragon, DragonError, Handle, Meter, Spent};
use crate::numerics::{Slope, rising_root};

/// Tolerance of the end of a passage, in metres of travel.
const TOLERANCE_M: f64 = 1e-9;

/// Bound on how often the length of a passage is doubled.
const MAX_DOUBLINGS: usize = 10;

/// Distance before the end of the ground at which a passage may end, in metres: more than rounding.
const BEFORE_GAP_M: f64 = 1e-6;

/// Limits for a dragon on its whole passage through a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Staging {
    /// Every pair of boards stays further apart than this, in metres. For 0, boards may come arbitrarily near but must not
    /// touch.
    pub clearance_m: f64,
    /// Largest allowed ratio of a handle's speed to the head's speed, 1 or more.
    pub speed_ratio: f64,
}

impl Staging {
    /// No contact, and no limit on speeds.
    pub const LIMITLESS: Self = Self { clearance_m: 0.0, speed_ratio: f64::INFINITY };

    /// Whether the speeds are limited.
    pub(super) fn limits_speed(&self) -> bool {
        self.speed_ratio < f64::INFINITY
    }
}

/// Result of the passage of a whole dragon through a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TurnPassage {
    /// The passage is within all limits.
    Clear {
        /// The closest approach of two benches; `None` with fewer than three benches.
        closest: Option<ClosestApproach>,
    },
    /// Two benches touch, or come within the required clearance.
    Contact(Contact),
    /// A handle exceeds the speed limit.
    TooFast(LargestRatio),
    /// The dragon cannot walk the passage.
    Infeasible(Infeasible),
    /// Unknown: the limit of work is reached. No two benches touch up to the travel in the error.
    TooMuchWork(Spent),
}

/// Walks a whole dragon through a turn. The passage lasts from when all benches are on the way in until the last handle has
/// left the S. It is longer at either end if the turnaround is planned longer. The limits of `staging` are checked first.
///
/// The meter counts all work. `progress` receives the share of the work that each step completes, from any thread.
pub fn walk_through(
    turn: impl Into<PlannedTurn>,
    dimensions: Dimensions,
    staging: Staging,
    meter: &Meter,
    progress: impl Fn(f64) + Sync,
) -> TurnPassage {
    let walked = walk_within(&turn.into(), dimensions, staging, meter, progress);
    walked.unwrap_or_else(|infeasible| match infeasible {
        Infeasible::TooMuchWork(spent) => TurnPassage::TooMuchWork(spent),
        infeasible => TurnPassage::Infeasible(infeasible),
    })
}

fn walk_within(
    turn: &PlannedTurn,
    dimensions: Dimensions,
    staging: Staging,
    meter: &Meter,
    progress: impl Fn(f64) + Sync,
) -> Result<TurnPassage, Infeasible> {
    let dragon = passage(turn, dimensions, meter)?;
    if staging.limits_speed() {
        let largest = largest_speed_ratio(&dragon)?;
        if largest.ratio > staging.speed_ratio {
            return Ok(TurnPassage::TooFast(largest));
        }
    }
    let (from_m, to_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    if let Some(contact) = first_within(&dragon, staging.clearance_m, from_m, to_m)? {
        return Ok(TurnPassage::Contact(contact));
    }
    // The whole passage is already proved to be without a contact.
    let closest =
        least_clearance(&dragon, from_m, to_m, progress).map_err(|spent| Spent { reached_m: to_m, ..spent })?;
    Ok(TurnPassage::Clear { closest })
}

/// The dragon whose run is its whole passage through the turn. The run lasts from when all benches are on the way in until the
/// last handle has left the S. It is longer at either end if the turnaround is walked longer.
///
/// The meter counts the work for this dragon, now and later.
///
/// # Errors
/// The dragon cannot stand, a handle would stop, walk backwards or jump, the ground ends, or the meter is spent.
pub fn passage_through(
    turn: impl Into<PlannedTurn>,
    dimensions: Dimensions,
    meter: &Meter,
) -> Result<Dragon, Infeasible> {
    passage(&turn.into(), dimensions, meter)
}

pub(super) fn passage(turn: &PlannedTurn, dimensions: Dimensions, meter: &Meter) -> Result<Dragon, Infeasible> {
    let turnaround = turn.turnaround();
    let from_m = turnaround.start_travel_m().min(0.0);
    let (planned_m, turn_m, links_m) = (turnaround.end_travel_m(), turnaround.turn_length_m(), dimensions.links_m());
    // If the curvature is under 2 / link, it bounds the arc behind the head. Otherwise the length is doubled.
    let mut plan_m = turn_m + ARC_PER_CHORD * links_m;
    for _ in 0..MAX_DOUBLINGS {
        let route = Arc::new(turn.route_in_plan(dimensions, meter, from_m, plan_m)?);
        let walked = Dragon::with_meter(dimensions, route, meter.clone()).map_err(Infeasible::from);
        // The ground may end only after the last handle has left the S.
        let gap = match walked {
            Err(Infeasible::Dragon(DragonError::Ground(gap))) if gap.travel_m > turn_m => Some(gap),
            _ => None,
        };
        let dragon = match gap {
            Some(gap) => turn.walked(dimensions, meter, from_m, gap.travel_m - BEFORE_GAP_M)?,
            None => walked?,
        };
        Infeasible::check(&dragon)?;
        let (exit_m, to_m) = (dragon.route().in_space(turn_m), dragon.end_travel_m());
        if tail(&dragon, to_m).1 >= exit_m {
            let left_m = tail_leaves(&dragon, exit_m, (exit_m + links_m).min(to_m), to_m);
            let dragon = turn.walked(dimensions, meter, from_m, left_m.max(planned_m))?;
            return Infeasible::check(&dragon).map(|()| dragon);
        }
        if let Some(gap) = gap {
            return Err(Infeasible::Dragon(DragonError::Ground(gap)));
        }
        meter.check(from_m)?;
        plan_m *= 2.0;
    }
    // On the way out the spiral straightens, and the tail follows. Only a coil wound far tighter than the links needs more.
    Err(Infeasible::TooMuchWork(meter.spent(from_m)))
}

/// The tail's rear handle, and its travel.
fn tail(dragon: &Dragon, travel_m: f64) -> (Handle, f64) {
    let handle = dragon.chain(travel_m).expect("within the run").last().expect("a chain has a head");
    (handle, dragon.route().travel(handle.parameter))
}

/// Finds the head's travel at which the tail's rear handle reaches `exit_m`, in the interval from `low_m` to `high_m`. At
/// `high_m` the handle has reached it. The result is too large by at most [`TOLERANCE_M`].
fn tail_leaves(dragon: &Dragon, exit_m: f64, low_m: f64, high_m: f64) -> f64 {
    let left_m = rising_root(low_m..=high_m, low_m, 0.25 * TOLERANCE_M, |travel_m| {
        let (handle, tail_m) = tail(dragon, travel_m);
        Slope { value: tail_m - (exit_m + 0.25 * TOLERANCE_M), growth: handle.speed_ratio }
    });
    left_m.min(high_m)
}

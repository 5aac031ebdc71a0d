//! Whether a dragon gets through a turn within limits, and how near its benches come to each other on the way.

use super::least_clearance::{ClosestApproach, least_clearance};
use super::passage::{Infeasible, passage_through};
use super::speed_limit::{LargestRatio, largest_speed_ratio};
use super::staging::Staging;
use crate::clearance::{Contact, first_within};
use crate::dragon::{Dimensions, Meter, Spent};
use crate::route::Turnaround;

/// How a whole dragon gets through a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TurnPassage {
    /// Within all limits.
    Clear {
        /// Where two benches come nearest; none with fewer than three.
        closest: Option<ClosestApproach>,
    },
    /// Two benches touch, or come within the clearance that is to remain.
    Contact(Contact),
    /// A handle is faster than it may be.
    TooFast(LargestRatio),
    /// Not at all.
    Infeasible(Infeasible),
    /// It is not known: the work that was allowed is done. No two benches touch up to where it came.
    TooMuchWork(Spent),
}

/// Walks a whole dragon through a turn, from when all benches are on the way in until the last handle has left the S,
/// and longer at either end where the turnaround is planned for longer. What `staging` limits is looked for first.
///
/// All work counts on the meter. `progress` hears of the share of the work that is done, from any thread.
pub fn walk_through(
    turnaround: Turnaround,
    dimensions: Dimensions,
    staging: Staging,
    meter: &Meter,
    progress: impl Fn(f64) + Sync,
) -> TurnPassage {
    let dragon = match passage_through(turnaround, dimensions, meter) {
        Ok(dragon) => dragon,
        Err(Infeasible::TooMuchWork(spent)) => return TurnPassage::TooMuchWork(spent),
        Err(infeasible) => return TurnPassage::Infeasible(infeasible),
    };
    if staging.limits_speed() {
        match largest_speed_ratio(&dragon) {
            Ok(largest) if largest.ratio > staging.speed_ratio => return TurnPassage::TooFast(largest),
            Ok(_) => (),
            Err(Infeasible::TooMuchWork(spent)) => return TurnPassage::TooMuchWork(spent),
            Err(infeasible) => return TurnPassage::Infeasible(infeasible),
        }
    }
    let (from_m, to_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    match first_within(&dragon, staging.clearance_m, from_m, to_m) {
        Ok(Some(contact)) => TurnPassage::Contact(contact),
        Ok(None) => match least_clearance(&dragon, from_m, to_m, progress) {
            Ok(closest) => TurnPassage::Clear { closest },
            // That no benches touch is known of the whole passage.
            Err(spent) => TurnPassage::TooMuchWork(Spent { reached_m: to_m, ..spent }),
        },
        Err(spent) => TurnPassage::TooMuchWork(spent),
    }
}

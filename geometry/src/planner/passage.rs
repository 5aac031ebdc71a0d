//! The passage of a whole dragon through a turn, and what it must keep so that people can dance it.

use std::sync::Arc;

use thiserror::Error;

use super::least_clearance::{ClosestApproach, least_clearance};
use super::speed_limit::{LargestRatio, largest_speed_ratio};
use crate::clearance::{Contact, first_within};
use crate::dragon::{Dimensions, Dragon, DragonError, Handle, Meter, RunEnd, Spent};
use crate::numerics::{Slope, rising_root};
use crate::route::Turnaround;

/// Arc under a chord of a curve with |κ| ≤ K, per metre of the chord, at most, where K times the chord is under 2:
/// (2/x)·asin(x/2) at x = 2, which is π/2, rounded up.
pub(super) const ARC_PER_CHORD: f64 = 1.571;

/// Travel to which the end of a passage is known.
const TOLERANCE_M: f64 = 1e-9;

/// Bound on doublings of the way that a passage may take.
const MAX_DOUBLINGS: usize = 10;

/// Why a dragon cannot walk all of its route.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum Infeasible {
    /// It cannot even stand at the start.
    #[error(transparent)]
    Dragon(DragonError),
    /// It comes to a parameter that a handle does not get past.
    #[error("{end} with the head at {travel_m:.6} m of travel")]
    Fault {
        /// Travel of the head.
        travel_m: f64,
        /// What happens there.
        end: RunEnd,
    },
    /// It is not known: the work that was allowed is done.
    #[error("not known: {0}")]
    TooMuchWork(Spent),
}

impl From<DragonError> for Infeasible {
    fn from(error: DragonError) -> Self {
        match error {
            DragonError::TooMuchWork(spent) => Self::TooMuchWork(spent),
            error => Self::Dragon(error),
        }
    }
}

impl From<Spent> for Infeasible {
    fn from(spent: Spent) -> Self {
        Self::TooMuchWork(spent)
    }
}

impl Infeasible {
    /// Refuses a dragon that does not come to its route's end.
    ///
    /// # Errors
    /// The fault that ends its run.
    pub(super) fn check(dragon: &Dragon) -> Result<(), Self> {
        match dragon.run_end() {
            RunEnd::RouteEnd => Ok(()),
            end => Err(Self::Fault { travel_m: dragon.end_travel_m(), end }),
        }
    }
}

/// Limits that a dragon keeps on its whole passage through a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Staging {
    /// Every pair of boards stays further apart than this, in metres; with 0 they may be as near as they like but do not
    /// touch.
    pub clearance_m: f64,
    /// No handle is faster than the head by more than this factor, 1 or more.
    pub speed_ratio: f64,
}

impl Staging {
    /// Boards that do not touch, and handles of any speed: what can be walked at all.
    pub const LIMITLESS: Self = Self { clearance_m: 0.0, speed_ratio: f64::INFINITY };

    /// Whether speeds are limited.
    pub(super) fn limits_speed(&self) -> bool {
        self.speed_ratio < f64::INFINITY
    }
}

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
    let walked = walk_within(turnaround, dimensions, staging, meter, progress);
    walked.unwrap_or_else(|infeasible| match infeasible {
        Infeasible::TooMuchWork(spent) => TurnPassage::TooMuchWork(spent),
        infeasible => TurnPassage::Infeasible(infeasible),
    })
}

fn walk_within(
    turnaround: Turnaround,
    dimensions: Dimensions,
    staging: Staging,
    meter: &Meter,
    progress: impl Fn(f64) + Sync,
) -> Result<TurnPassage, Infeasible> {
    let dragon = passage_through(turnaround, dimensions, meter)?;
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
    // That no benches touch is known of the whole passage.
    let closest =
        least_clearance(&dragon, from_m, to_m, progress).map_err(|spent| Spent { reached_m: to_m, ..spent })?;
    Ok(TurnPassage::Clear { closest })
}

/// The dragon whose run is its whole passage through the turn: from when all benches are on the way in, until the last
/// handle has left the S; longer at either end where the turnaround is walked for longer.
///
/// The work for it, then and later, counts on the meter.
///
/// # Errors
/// A dragon that cannot stand, or a handle that would stop, walk backwards or jump on the way; or the meter is spent.
pub fn passage_through(turnaround: Turnaround, dimensions: Dimensions, meter: &Meter) -> Result<Dragon, Infeasible> {
    let from_m = turnaround.start_travel_m().min(0.0);
    let planned_m = turnaround.end_travel_m();
    let links_m: f64 = (0..dimensions.benches()).map(|bench| dimensions.link_m(bench)).sum();
    // Where it is under 2 / link, curvature alone bounds the arc behind the head; else the way is doubled.
    let mut to_m = turnaround.turn_length_m() + ARC_PER_CHORD * links_m;
    for _ in 0..MAX_DOUBLINGS {
        let dragon = walked(turnaround, dimensions, meter, from_m, to_m)?;
        Infeasible::check(&dragon)?;
        if tail(&dragon, to_m).1 >= turnaround.turn_length_m() {
            let left_m = tail_leaves(&dragon, turnaround.turn_length_m(), turnaround.turn_length_m() + links_m, to_m);
            let dragon = walked(turnaround, dimensions, meter, from_m, left_m.max(planned_m))?;
            return Infeasible::check(&dragon).map(|()| dragon);
        }
        meter.check(from_m)?;
        to_m *= 2.0;
    }
    // Outward the spiral straightens, and the tail follows: only a coil wound far tighter than the links takes so long.
    Err(Infeasible::TooMuchWork(meter.spent(from_m)))
}

fn walked(
    turnaround: Turnaround,
    dimensions: Dimensions,
    meter: &Meter,
    from_m: f64,
    to_m: f64,
) -> Result<Dragon, Infeasible> {
    let turnaround = turnaround.between(from_m, to_m).expect("both are finite, and no dragon is without length");
    Dragon::with_meter(dimensions, Arc::new(turnaround.route()), meter.clone()).map_err(Infeasible::from)
}

/// The tail's rear handle and its travel.
fn tail(dragon: &Dragon, travel_m: f64) -> (Handle, f64) {
    let handle = dragon.chain(travel_m).expect("within the run").last().expect("a chain has a head");
    (handle, dragon.route().travel(handle.parameter))
}

/// The head's travel at which the tail's rear handle has come to `exit_m`, between two of which the first may be too
/// little and the second is not; too much by [`TOLERANCE_M`] at most.
fn tail_leaves(dragon: &Dragon, exit_m: f64, low_m: f64, high_m: f64) -> f64 {
    let left_m = rising_root(low_m..=high_m, low_m, 0.25 * TOLERANCE_M, |travel_m| {
        let (handle, tail_m) = tail(dragon, travel_m);
        Slope { value: tail_m - (exit_m + 0.25 * TOLERANCE_M), growth: handle.speed_ratio }
    });
    left_m.min(high_m)
}

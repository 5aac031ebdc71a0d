//! The passage of a whole dragon through a turn.

use std::sync::Arc;

use thiserror::Error;

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
        if meter.is_spent() {
            return Err(Infeasible::TooMuchWork(meter.spent(from_m)));
        }
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

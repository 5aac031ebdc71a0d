//! The smallest pitch at which the head comes in to a circle with no contact on the way, or with a clearance kept.
//!
//! A pitch is *feasible* if the spiral starts outside the circle, with the head's link spanning less than half a turn,
//! and the dragon walks from there to where the head is on the circle, every handle moving forward and no two boards
//! touching. Where a clearance is asked for, boards *touch* or *overlap* here once they are within it. The feasible pitches need not be an interval: a tighter spiral shifts the benches of the next turn along
//! the head's board, and may so bring a gap to where a wider one has a corner. So the threshold cannot be bisected.
//!
//! It is climbed to instead, from the lowest pitch that can be thought of, in steps over which every pitch is proved to
//! be infeasible: by a *witness*, which is a radius of the head where two boards overlap, or where the head's link stops,
//! at all pitches of the step. Where no witness is found, a search of the whole way decides: what it finds is the next
//! witness, and if it finds nothing, this pitch is feasible and all below are not. Nothing is assumed of the feasible set;
//! only parts of it narrower than the tolerance could be passed over, where one witness ends and the next begins.
//!
//! How a witness covers a step is told in its module. Both rest on what a link does on spirals r = b·θ, with its front
//! handle at the radius r and its rear handle the first point behind at the distance d, further out by the angle Δ:
//!
//! - Δ falls as b or r grows: for the distance of the point Δ further out grows with both, at each Δ, so it comes
//!   sooner to d.
//! - The rear handle's radius grows with b, at the same r: it lies on a circle of radius d around the front handle, on
//!   the part that is further from the centre than the tangents to it, where a smaller Δ lies further out.
//! - It grows with r, at the same b, while the link walks, which K·d < 2 ensures (see `dragon::run`); and over all b the
//!   curvature K at the radius r is at most 2·1.5^(-3/2)/r.
//!
//! So with the head held at one radius, and each link behind the first walking, all handles move outward and towards the
//! head's direction as the pitch grows.

mod overlap;
mod stop;

use std::f64::consts::TAU;
use std::sync::Arc;

use thiserror::Error;

use crate::clearance::{Contact, first_within};
use crate::dragon::{Chain, Dimensions, Dragon, DragonError, Meter, Spent};
use crate::number::Number;
use crate::route::{Route, RouteError};

use overlap::Overlap;
use stop::Stop;

/// Greatest pitch looked at, in metres: that of a route.
const MAX_PITCH_M: f64 = 1_000.0;

/// Exactness of the answer, in radii of the start: a few hundred times the rounding of a handle's position.
const TOLERANCE_PER_RADIUS: f64 = 1e-13;

/// Bound on searches of the whole way. Each finds another witness or steps on by the tolerance; a dozen are usual.
const MAX_SEARCHES: usize = 10_000;

/// Smallest circle looked at, in lengths of the head's link: towards the centre of a spiral the head turns ever faster,
/// and pitches that let its link follow differ ever less in what they do there.
const LEAST_CIRCLE_PER_LINK: f64 = 0.01;

/// A body link of length d walks wherever its front handle is further out than this times d, 1.5^(-3/2): K·d < 2 there.
const LEAST_RADIUS_PER_LINK: f64 = 0.544_331_053_951_817_4;

/// Why there is no smallest pitch.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum PitchError {
    /// Not a number of turns.
    #[error("{0}")]
    Route(RouteError),
    /// No spiral that may be configured starts outside the circle, or the circle is too tight for the benches.
    #[error(
        "turn_diameter_m is {}, must be above {} and under {}, where start_turns {} begin at the greatest pitch",
        Number(*turn_diameter_m),
        Number(*least_m),
        Number(2.0 * start_turns * MAX_PITCH_M),
        Number(*start_turns)
    )]
    TurnDiameter {
        /// Metres.
        turn_diameter_m: f64,
        /// Bound on the diameter in metres: a hundredth of the head's link, or more if the head's is not longer than the body's by a tenth.
        least_m: f64,
        /// Full turns from the centre to the start.
        start_turns: f64,
    },
    /// Every pitch up to the greatest is infeasible.
    #[error("no pitch up to {MAX_PITCH_M} m lets the head come to a circle of diameter {} m", Number(*turn_diameter_m))]
    NoPitch {
        /// Metres.
        turn_diameter_m: f64,
    },
    /// More searches than allowed.
    #[error("no pitch up to {} m is feasible, and {MAX_SEARCHES} searches do not tell of wider ones", Number(*pitch_m))]
    Undecided {
        /// All pitches below are infeasible.
        pitch_m: f64,
    },
    /// The work that was allowed is done.
    #[error("no pitch up to {} m is feasible, and of wider ones it is not known: {spent}", Number(*pitch_m))]
    TooMuchWork {
        /// All pitches below are infeasible.
        pitch_m: f64,
        /// The limit.
        spent: Spent,
    },
}

/// The smallest feasible pitch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmallestPitch {
    /// Metres. All pitches under it, but for the tolerance, are infeasible; it is feasible itself.
    pub pitch_m: f64,
    /// Why none under it is.
    pub limit: PitchLimit,
}

/// What goes wrong at a pitch just under the smallest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PitchLimit {
    /// Two boards touch, or come within the clearance.
    Contact(Contact),
    /// The head's link cannot follow: handle 1 stops, or jumps, before the head is at the circle.
    Stop,
    /// The spiral starts inside the circle, or so near to its centre that the head's link spans half a turn.
    Start,
    /// A route's pitch is above the width of the boards.
    Width,
}

/// The smallest pitch at which a dragon, led in from `start_turns` turns out, comes to where its head is on the circle of
/// diameter `turn_diameter_m` around the centre with no two boards overlapping on the way, or with all of them further apart
/// than `clearance_m`, which is not negative.
///
/// It is the infimum of the feasible pitches, to some 10⁻¹³ of the start's radius and never under it. Works by proved
/// steps from below, as the module tells, and ends with a contact search of the whole way at the pitch that it returns.
///
/// ```
/// use bench_dragon_geometry::{dragon::{Dimensions, Meter}, planner::smallest_pitch};
///
/// let paper = Dimensions::new(223, 3.41, 2.20, 0.30, 0.275)?;
/// let smallest = smallest_pitch(&paper, 16.0, 9.0, 0.0, &Meter::unlimited())?;
/// assert!((smallest.pitch_m - 0.450337).abs() < 5e-7);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// The diameter must be above a hundredth of the head's link and such that some spiral starts outside, the turns as a
/// route has them. A circle within which body links could stop, which they cannot if the head's link is longer by a tenth,
/// is refused. There may be no such pitch, or it is not found by the work that the meter allows.
pub fn smallest_pitch(
    dimensions: &Dimensions,
    start_turns: f64,
    turn_diameter_m: f64,
    clearance_m: f64,
    meter: &Meter,
) -> Result<SmallestPitch, PitchError> {
    Route::spiral(MAX_PITCH_M, start_turns).map_err(PitchError::Route)?;
    let link_radius_m = LEAST_RADIUS_PER_LINK * dimensions.link_m(1);
    let smallest_m = LEAST_CIRCLE_PER_LINK * dimensions.link_m(0);
    // No handle but the first is nearer to the centre than half of the head's link.
    let walks = dimensions.benches() == 1 || 0.5 * dimensions.link_m(0) > link_radius_m;
    let least_m = if walks { smallest_m } else { smallest_m.max(2.0 * link_radius_m) };
    if !(turn_diameter_m > least_m && turn_diameter_m < 2.0 * start_turns * MAX_PITCH_M) {
        return Err(PitchError::TurnDiameter { turn_diameter_m, least_m, start_turns });
    }
    climb(&LeadIn { dimensions, start_turns, circle_radius_m: 0.5 * turn_diameter_m, clearance_m, meter })
}

fn climb(lead_in: &LeadIn<'_>) -> Result<SmallestPitch, PitchError> {
    let (start_m, width_m) = (lead_in.least_start_m(), lead_in.dimensions.width_m());
    // All pitches up to this one are infeasible, the last of them for this reason.
    let mut pitch_m = start_m.max(width_m);
    let mut limit = if start_m >= width_m { PitchLimit::Start } else { PitchLimit::Width };
    for _ in 0..MAX_SEARCHES {
        let tried_m = pitch_m + lead_in.tolerance_m(pitch_m);
        let Some(spiral) = lead_in.spiral(tried_m) else {
            return Err(PitchError::NoPitch { turn_diameter_m: 2.0 * lead_in.circle_radius_m });
        };
        let verdict = Verdict::of(lead_in, tried_m, spiral);
        let verdict = verdict.map_err(|spent| PitchError::TooMuchWork { pitch_m, spent })?;
        match verdict {
            Verdict::Feasible => return Ok(SmallestPitch { pitch_m: tried_m, limit }),
            Verdict::StopsLate => (pitch_m, limit) = (tried_m, PitchLimit::Stop),
            Verdict::Stops(stop) => (pitch_m, limit) = (stop.proves_up_to(lead_in, tried_m), PitchLimit::Stop),
            Verdict::Overlaps(overlap) => {
                let (proved_m, overlap) = overlap.proves_up_to(lead_in, tried_m);
                (pitch_m, limit) = (proved_m, PitchLimit::Contact(overlap.contact(lead_in, proved_m)));
            }
        }
    }
    Err(PitchError::Undecided { pitch_m })
}

/// The lead-in of a dragon: its head's way from the start to the circle.
#[derive(Clone, Copy, Debug)]
struct LeadIn<'a> {
    dimensions: &'a Dimensions,
    start_turns: f64,
    circle_radius_m: f64,
    clearance_m: f64,
    meter: &'a Meter,
}

impl LeadIn<'_> {
    /// The spiral of a pitch, if it is not over the greatest.
    fn spiral(&self, pitch_m: f64) -> Option<Route> {
        Route::spiral(pitch_m, self.start_turns).ok()
    }

    /// The chain with the head at a parameter of that spiral.
    fn chain<'b>(&'b self, spiral: &'b Route, parameter: f64) -> Chain<'b> {
        Chain::new(spiral, self.dimensions, self.meter, parameter)
    }

    fn start_radius_m(&self, pitch_m: f64) -> f64 {
        self.start_turns * pitch_m
    }

    fn parameter(pitch_m: f64, radius_m: f64) -> f64 {
        -TAU * radius_m / pitch_m
    }

    fn radius_m(pitch_m: f64, parameter: f64) -> f64 {
        -parameter * pitch_m / TAU
    }

    /// The pitch above which the spiral starts outside the circle, and with the head's link spanning less than half a
    /// turn: a point half a turn behind the start is two start radii and half a pitch away.
    fn least_start_m(&self) -> f64 {
        let outside_m = self.circle_radius_m / self.start_turns;
        outside_m.max(self.dimensions.link_m(0) / (2.0 * self.start_turns + 0.5))
    }

    /// How near to each other two pitches are alike.
    fn tolerance_m(&self, pitch_m: f64) -> f64 {
        TOLERANCE_PER_RADIUS * self.start_radius_m(pitch_m)
    }
}

/// What is known of a pitch: whether it is feasible, or else what may prove wider ones infeasible too.
enum Verdict {
    Feasible,
    Overlaps(Overlap),
    Stops(Stop),
    /// The head's link stops so late that no radius was seen at which it does.
    StopsLate,
}

impl Verdict {
    /// Looks for a witness where one is likely, and searches the whole way if there is none.
    ///
    /// # Errors
    /// The meter is spent.
    fn of(lead_in: &LeadIn<'_>, pitch_m: f64, spiral: Route) -> Result<Self, Spent> {
        let likely = Stop::tightest(lead_in, pitch_m).map(Self::Stops);
        let likely = likely.or_else(|| Overlap::near_circle(lead_in, pitch_m).map(Self::Overlaps));
        lead_in.meter.check(0.0)?;
        if let Some(likely) = likely {
            return Ok(likely);
        }
        let arrival_m = spiral.travel(LeadIn::parameter(pitch_m, lead_in.circle_radius_m));
        let dragon = match Dragon::with_meter(*lead_in.dimensions, Arc::new(spiral), lead_in.meter.clone()) {
            Ok(dragon) => dragon,
            Err(DragonError::TooMuchWork(spent)) => return Err(spent),
            Err(_) => return Ok(Self::StopsLate),
        };
        if let Some(contact) = first_within(&dragon, lead_in.clearance_m, 0.0, arrival_m)? {
            let radius_m = LeadIn::radius_m(pitch_m, dragon.route().parameter(contact.travel_m));
            return Ok(Self::Overlaps(Overlap { benches: contact.benches, radius_m }));
        }
        Ok(if dragon.end_travel_m() < arrival_m { Self::StopsLate } else { Self::Feasible })
    }
}

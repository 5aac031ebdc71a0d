//! The smallest pitch at which the head reaches a circle without a contact, or with a minimum clearance.
//!
//! A pitch is *feasible* if three conditions hold. The spiral starts outside the circle. At the start, the head's link spans
//! less than half a turn. The dragon walks from the start until the head is on the circle, with every handle moving forward and
//! no two boards touching. If a clearance is required, boards *touch* or *overlap* here once they are within it.
//!
//! The feasible pitches need not be an interval. A tighter spiral shifts the benches of the next turn along the head's board.
//! So a gap may lie where a wider spiral has a corner. Therefore the threshold cannot be bisected.
//!
//! Instead, the search climbs from the lowest possible pitch, in steps over which every pitch is proved infeasible. The proof
//! is a *witness*: a radius of the head. At that radius, two boards overlap or the head's link stops, at all pitches of the
//! step. If no witness is found, a contact search of the whole lead-in decides. A contact is the next witness. Without a
//! contact, this pitch is feasible and all below it are not. The search assumes nothing about the set of feasible pitches. It
//! can miss only parts narrower than the tolerance, between the end of one witness and the beginning of the next.
//!
//! On hills the search of `hills` takes its place.
//!
//! The modules of the witnesses prove their steps. Both proofs use the following facts about a link of length d on spirals r =
//! b·θ. Its front handle is at the radius r. Its rear handle is the first point behind it at the distance d, further out by the
//! angle Δ:
//!
//! - Δ falls as b or r grows. For each Δ, the distance to the point Δ further out grows with both, so it reaches d at a smaller
//!   Δ.
//! - The rear handle's radius grows with b, at the same r. The handle lies on a circle of radius d around the front handle, on
//!   the part beyond the tangents to it from the centre. On that part a smaller Δ lies further out.
//! - The rear handle's radius grows with r, at the same b, while the link walks. K·d < 2 ensures that it walks (see
//!   `dragon::feasible`). Over all b, the curvature K at the radius r is at most 2·1.5^(-3/2)/r.
//!
//! Take the head at a fixed radius, with each link behind the first one walking. As the pitch grows, all handles then move
//! outward and towards the head's direction.

mod hills;
mod overlap;
mod play;
mod stop;

use std::f64::consts::TAU;
use std::sync::Arc;

use thiserror::Error;

use crate::clearance::{Contact, first_within};
use crate::dragon::{Chain, Dimensions, Dragon, DragonError, Meter, Spent};
use crate::number::Number;
use crate::route::{GroundGap, Route, RouteError};

pub use hills::smallest_pitch_on;
pub use play::guaranteed_pitch;

use overlap::Overlap;
use stop::Stop;

/// Greatest pitch of the search, in metres: that of a route.
const MAX_PITCH_M: f64 = 1_000.0;

/// Tolerance of the answer, in radii of the start: a few hundred times the rounding of a handle's position.
const TOLERANCE_PER_RADIUS: f64 = 1e-13;

/// Bound on contact searches of the whole lead-in. Each search finds another witness or advances by the tolerance. A dozen are
/// usual.
const MAX_SEARCHES: usize = 10_000;

/// Smallest circle, in lengths of the head's link. Towards the centre of a spiral the head turns ever faster. There, pitches at
/// which the head's link can follow differ less and less in their effect.
const LEAST_CIRCLE_PER_LINK: f64 = 0.01;

/// Smallest radius of a front handle at which a body link of length d always walks, divided by d: 1.5^(-3/2). There, K·d < 2.
const LEAST_RADIUS_PER_LINK: f64 = 0.544_331_053_951_817_4;

/// Reason why there is no smallest pitch.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum PitchError {
    /// The number of turns is out of range.
    #[error("{0}")]
    Route(RouteError),
    /// No valid spiral starts outside the circle, or the circle is too tight for the benches.
    #[error(
        "turn_diameter_m is {}, must be above {} and under {}, the diameter at start_turns {} and the greatest pitch",
        Number(*turn_diameter_m),
        Number(*least_m),
        Number(2.0 * start_turns * MAX_PITCH_M),
        Number(*start_turns)
    )]
    TurnDiameter {
        /// Diameter of the circle, in metres.
        turn_diameter_m: f64,
        /// Lower limit of the diameter in metres: a hundredth of the head's link. It is larger if the head's link is not more
        /// than 1.089 times as long as a body link.
        least_m: f64,
        /// Full turns from the centre to the start.
        start_turns: f64,
    },
    /// Every pitch up to the greatest one is infeasible.
    #[error("no pitch up to {MAX_PITCH_M} m lets the head reach a circle of diameter {} m", Number(*turn_diameter_m))]
    NoPitch {
        /// Diameter of the circle, in metres.
        turn_diameter_m: f64,
    },
    /// The ground ends before a feasible pitch is found.
    #[error("no narrower pitch that was tried is feasible; at {pitch_m:.6} m {gap}")]
    Ground {
        /// The first pitch that leads beyond the ground.
        pitch_m: f64,
        /// Where the ground ends.
        gap: GroundGap,
    },
    /// The limit of work is reached before a feasible pitch on hills is tried.
    #[error("no pitch that was tried is feasible, up to {} m; wider pitches are undecided: {spent}", Number(*pitch_m))]
    HillsUndecided {
        /// The greatest pitch that was tried.
        pitch_m: f64,
        /// The limit.
        spent: Spent,
    },
    /// The number of searches exceeds its bound.
    #[error("no pitch up to {} m is feasible; {MAX_SEARCHES} searches did not decide wider pitches", Number(*pitch_m))]
    Undecided {
        /// All pitches below are infeasible.
        pitch_m: f64,
    },
    /// The limit of work is reached before a pitch is found that is wide enough for loose hinges.
    #[error("whether {pitch_m:.6} m is wide enough for every pose of the hinges is undecided: {spent}")]
    PlayUndecided {
        /// The pitch that was examined.
        pitch_m: f64,
        /// The limit.
        spent: Spent,
    },
    /// The limit of work is reached.
    #[error("no pitch up to {} m is feasible; wider pitches are undecided: {spent}", Number(*pitch_m))]
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
    /// The smallest feasible pitch, in metres. All pitches below it are infeasible, up to the tolerance.
    pub pitch_m: f64,
    /// The reason why smaller pitches are infeasible.
    pub limit: PitchLimit,
}

/// Reason why a pitch just below the smallest one is infeasible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PitchLimit {
    /// Two boards touch, or come within the clearance.
    Contact(Contact),
    /// The head's link cannot follow: handle 1 stops or jumps before the head reaches the circle.
    Stop,
    /// The spiral starts inside the circle, or so near its centre that the head's link spans half a turn.
    Start,
    /// The pitch of a route must exceed the width of the boards.
    Width,
}

/// Finds the smallest pitch at which a dragon reaches a circle around the centre. The head starts `start_turns` turns from the
/// centre and walks in until it is on the circle of diameter `turn_diameter_m`. On this lead-in no two boards overlap, and all
/// stay further apart than `clearance_m`, which is not negative.
///
/// The result is the infimum of the feasible pitches, to about 10⁻¹³ of the start's radius, and never below it. The search
/// climbs by the proved steps that the module describes. It ends with a contact search of the whole lead-in at the returned
/// pitch.
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
/// The diameter must exceed a hundredth of the head's link, some spiral must start outside the circle, and the turns must be
/// valid for a route. A circle in which body links could stop is rejected. They cannot stop if the head's link is more than
/// 1.089 times as long as a body link. There may be no such pitch, or the meter's limit may be reached first.
pub fn smallest_pitch(
    dimensions: &Dimensions,
    start_turns: f64,
    turn_diameter_m: f64,
    clearance_m: f64,
    meter: &Meter,
) -> Result<SmallestPitch, PitchError> {
    climb(&lead_in(dimensions, start_turns, turn_diameter_m, clearance_m, meter)?)
}

/// The lead-in of a question, whose circle must be one that a dragon can reach.
fn lead_in<'a>(
    dimensions: &'a Dimensions,
    start_turns: f64,
    turn_diameter_m: f64,
    clearance_m: f64,
    meter: &'a Meter,
) -> Result<LeadIn<'a>, PitchError> {
    Route::spiral(MAX_PITCH_M, start_turns).map_err(PitchError::Route)?;
    let link_radius_m = LEAST_RADIUS_PER_LINK * dimensions.link_m(1);
    let smallest_m = LEAST_CIRCLE_PER_LINK * dimensions.link_m(0);
    // All handles except the head are at least half of the head's link from the centre.
    let walks = dimensions.benches() == 1 || 0.5 * dimensions.link_m(0) > link_radius_m;
    let least_m = if walks { smallest_m } else { smallest_m.max(2.0 * link_radius_m) };
    if !(turn_diameter_m > least_m && turn_diameter_m < 2.0 * start_turns * MAX_PITCH_M) {
        return Err(PitchError::TurnDiameter { turn_diameter_m, least_m, start_turns });
    }
    Ok(LeadIn { dimensions, start_turns, circle_radius_m: 0.5 * turn_diameter_m, clearance_m, meter })
}

fn climb(lead_in: &LeadIn<'_>) -> Result<SmallestPitch, PitchError> {
    let (start_m, width_m) = (lead_in.least_start_m(), lead_in.dimensions.width_m());
    // All pitches up to this one are infeasible. `limit` is the reason for the last of them.
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

/// The lead-in of a dragon: the head's walk from the start to the circle.
#[derive(Clone, Copy, Debug)]
struct LeadIn<'a> {
    dimensions: &'a Dimensions,
    start_turns: f64,
    circle_radius_m: f64,
    clearance_m: f64,
    meter: &'a Meter,
}

impl LeadIn<'_> {
    /// The spiral of a pitch; `None` above the greatest pitch.
    fn spiral(&self, pitch_m: f64) -> Option<Route> {
        Route::spiral(pitch_m, self.start_turns).ok()
    }

    /// The chain with its head at a parameter of that spiral.
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

    /// The pitch above which the spiral starts outside the circle, with the head's link spanning less than half a turn. A point
    /// half a turn behind the start is two start radii and half a pitch away from it.
    fn least_start_m(&self) -> f64 {
        let outside_m = self.circle_radius_m / self.start_turns;
        outside_m.max(self.dimensions.link_m(0) / (2.0 * self.start_turns + 0.5))
    }

    /// Tolerance of a pitch, in metres.
    fn tolerance_m(&self, pitch_m: f64) -> f64 {
        TOLERANCE_PER_RADIUS * self.start_radius_m(pitch_m)
    }
}

/// Result for one pitch: feasible, or a witness that may prove wider pitches infeasible too.
enum Verdict {
    Feasible,
    Overlaps(Overlap),
    Stops(Stop),
    /// The head's link stops so late that no radius of the search shows it.
    StopsLate,
}

impl Verdict {
    /// Searches for a witness where one is likely, and otherwise searches the whole lead-in.
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

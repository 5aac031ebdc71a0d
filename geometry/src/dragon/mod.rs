//! The dragon: hinged benches led along a route.
//!
//! Bench 0 is the head. Handle i is the front hinge of bench i, handle N the tail's rear hinge. The state of the dragon is a
//! function of the head's travel in metres. The terms "per metre" and "speed ratio" refer to the travel and the speed of the
//! head.

pub(crate) mod board;
pub(crate) mod chain;
pub(crate) mod dimensions;
pub(crate) mod feasible;
pub(crate) mod link;
pub(crate) mod loose;
pub(crate) mod meter;
mod orbit;
mod question;
mod stepper;

use std::f64::consts::TAU;
use std::sync::Arc;

use glam::{DVec2, DVec3};
use thiserror::Error;

use crate::number::Number;
use crate::route::{GroundGap, Route};

pub use board::{Approach, Board};
pub use chain::{Chain, ChainSolver, Handle, TravelOutOfRange};
pub use dimensions::{
    Dimensions, DimensionsError, LEAST_LINK_M, LENGTH_M, MAX_BENCHES, MOST_PER_LINK, MOST_PER_WIDTH,
    MOST_PLAY_PER_LINK, WIDTH_M,
};
pub use feasible::{FeasibleEnd, TightSpot};
pub use meter::{Meter, Spent};
pub use question::Question;
pub use stepper::{ChainStepper, Instructions};

pub(crate) use link::ARC_PER_CHORD;
pub(crate) use orbit::Station;

use feasible::FeasibleTravel;
use loose::Loose;

/// Reason why a dragon cannot walk a route.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum DragonError {
    /// The boards of neighbouring turns overlap at the start.
    #[error("pitch_m is {}, must be above width_m {}", Number(*pitch_m), Number(*width_m))]
    PitchUnderWidth {
        /// Distance between neighbouring turns, in metres.
        pitch_m: f64,
        /// Width of the boards, in metres.
        width_m: f64,
    },
    /// At the start, a handle has no position behind the handle before it, or could not move forward.
    #[error(
        "the route is too tight at its start: {at}: handle {} cannot stand and walk {link_m:.3} m behind handle {}",
        at.bench + 1,
        at.bench
    )]
    CannotStand {
        /// The first bench that cannot stand. Its rear handle has no valid position.
        at: TightSpot,
        /// Length of the link of that bench, in metres.
        link_m: f64,
    },
    /// The ground ends before the dragon's feasible travel does, or under the dragon at its start.
    #[error("{0}")]
    Ground(GroundGap),
    /// The search for the end of the feasible travel takes too much work.
    #[error("the dragon's run is too long, or too tightly wound for its links, to be searched: {0}")]
    TooMuchWork(Spent),
}

/// A dragon on its route.
///
/// ```
/// use std::sync::Arc;
/// use bench_dragon_geometry::{dragon::{ChainSolver, Dimensions, Dragon}, route::Route};
///
/// let paper = Dragon::new(Dimensions::new(223, 3.41, 2.20, 0.30, 0.275)?, Arc::new(Route::spiral(0.55, 16.0)?))?;
/// let mut solver = ChainSolver::new(&paper);
/// let tail = solver.solve(&paper, 300.0)?[223];
/// assert!((tail.position.x - 1.785033).abs() < 5e-7 && (tail.speed_ratio - 0.996478).abs() < 5e-7);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct Dragon {
    dimensions: Dimensions,
    route: Arc<Route>,
    feasible: FeasibleTravel,
    /// Parameter of the head at the end of the feasible travel.
    pub(crate) end_parameter: f64,
    meter: Meter,
    /// The chains that bracket the poles; `None` for hinges without play.
    loose: Option<Arc<Loose>>,
}

impl Dragon {
    /// Places a dragon on a route, with the head at the route's start, and finds how far it can walk.
    ///
    /// # Errors
    /// The pitch of a spiral must exceed the boards' width, if the dragon stands on more than a turn of it. At the start, every
    /// handle must be on the route and move forward. The end of the feasible travel must be found within a bounded number of steps.
    pub fn new(dimensions: Dimensions, route: Arc<Route>) -> Result<Self, DragonError> {
        Self::with_meter(dimensions, route, Meter::unlimited())
    }

    /// The same, with a meter that counts all work for this dragon.
    ///
    /// # Errors
    /// The errors of [`new`](Self::new), and [`DragonError::TooMuchWork`] if the meter reaches its limit first.
    pub fn with_meter(dimensions: Dimensions, route: Arc<Route>, meter: Meter) -> Result<Self, DragonError> {
        let rigid = Self::rigid(dimensions, route, meter)?;
        let loose = (dimensions.play_m() > 0.0).then(|| Loose::new(&rigid).map(Arc::new)).transpose()?;
        Ok(Self { loose, ..rigid })
    }

    /// The dragon without play in its hinges.
    fn rigid(dimensions: Dimensions, route: Arc<Route>, meter: Meter) -> Result<Self, DragonError> {
        let (pitch_m, width_m) = (route.pitch_m(), dimensions.width_m());
        if pitch_m <= width_m && stands_beside_itself(&route, &dimensions) {
            return Err(DragonError::PitchUnderWidth { pitch_m, width_m });
        }
        let placing = meter.for_placing();
        let feasible = FeasibleTravel::of(&route, &dimensions, &placing);
        if placing.is_spent() {
            return Err(DragonError::TooMuchWork(placing.spent(route.start_travel_m())));
        }
        let feasible = feasible.map_err(|at| DragonError::CannotStand { at, link_m: dimensions.link_m(at.bench) })?;
        let end_parameter = route.parameter(feasible.end_travel_m);
        if route.is_on_ground() {
            let start = route.parameter(route.start_travel_m());
            let last = Chain::new(&route, &dimensions, &meter, start).last().map_or(start, |handle| handle.parameter);
            route.ground_gap(last, end_parameter).map_or(Ok(()), |gap| Err(DragonError::Ground(gap)))?;
        }
        Ok(Self { dimensions, end_parameter, route, feasible, meter, loose: None })
    }

    /// The same dragon with another meter for its work.
    #[must_use]
    pub fn metered(&self, meter: &Meter) -> Self {
        let loose = self.loose.as_ref().map(|loose| Arc::new(loose.metered(meter)));
        Self { meter: meter.clone(), loose, ..self.clone() }
    }

    /// The same dragon with all links as long as the play of the hinges allows, and without further play: one that is pulled.
    /// `None` for hinges without play.
    pub fn taut(&self) -> Option<&Self> {
        self.loose().map(Loose::taut)
    }

    /// The same dragon with all links as short as the play of the hinges allows, and without further play: one that is pushed.
    /// `None` for hinges without play.
    pub fn compact(&self) -> Option<&Self> {
        self.loose().map(Loose::compact)
    }

    /// The chains that bracket the poles; `None` for hinges without play.
    pub(crate) fn loose(&self) -> Option<&Loose> {
        self.loose.as_deref()
    }

    /// The meter that counts the work for this dragon.
    pub fn meter(&self) -> &Meter {
        &self.meter
    }

    /// The benches.
    pub fn dimensions(&self) -> &Dimensions {
        &self.dimensions
    }

    /// The curve that the handles follow.
    pub fn route(&self) -> &Route {
        &self.route
    }

    /// Beginning of the feasible travel.
    pub fn start_travel_m(&self) -> f64 {
        self.route.start_travel_m()
    }

    /// End of the feasible travel, to about 10⁻¹² m. Every handle walks forward up to this travel.
    pub fn end_travel_m(&self) -> f64 {
        self.feasible.end_travel_m
    }

    /// Parameter of the head at the end of the feasible travel.
    pub fn end_parameter(&self) -> f64 {
        self.end_parameter
    }

    /// The reason why the feasible travel ends.
    pub fn feasible_end(&self) -> FeasibleEnd {
        self.feasible.end
    }

    /// The place that a bench cannot follow at the end of the feasible travel; `None` at the route's end.
    pub fn tight_spot(&self) -> Option<TightSpot> {
        let bench = self.feasible.end.handle()? - 1;
        let handle = self.chain(self.end_travel_m()).ok()?.nth(bench)?;
        Some(TightSpot::at(&self.route, bench, handle.parameter))
    }

    /// Iterator over the handles with the head at `travel_m`, head first.
    ///
    /// # Errors
    /// The travel must be feasible.
    pub fn chain(&self, travel_m: f64) -> Result<Chain<'_>, TravelOutOfRange> {
        self.require_travel(travel_m)?;
        Ok(Chain::new(self.route(), &self.dimensions, &self.meter, self.route.parameter(travel_m)))
    }

    /// Returns an error for a travel that is not feasible.
    pub(crate) fn require_travel(&self, travel_m: f64) -> Result<(), TravelOutOfRange> {
        let (start_travel_m, end_travel_m) = (self.start_travel_m(), self.end_travel_m());
        let within = travel_m >= start_travel_m && travel_m <= end_travel_m;
        if within { Ok(()) } else { Err(TravelOutOfRange { travel_m, start_travel_m, end_travel_m }) }
    }

    /// Iterator over the handles behind the handle of this index.
    pub(crate) fn chain_behind(&self, index: usize, handle: &Handle) -> Chain<'_> {
        Chain::behind(self.route(), &self.dimensions, &self.meter, index, handle)
    }

    /// The board of a bench between its two handles, seen from above.
    pub fn board(&self, bench: usize, front: &Handle, rear: &Handle) -> Board {
        self.board_between(bench, front.in_space(), rear.in_space())
    }

    /// The board of a bench between two hinges in space, seen from above: pitched along its link, and level across.
    pub(crate) fn board_between(&self, bench: usize, front: DVec3, rear: DVec3) -> Board {
        let (length_m, width_m) = (self.dimensions.length_m(bench), self.dimensions.width_m());
        let level = Board::from_handles(front.truncate(), rear.truncate(), length_m, width_m);
        if self.route.is_on_ground() { level.pitched(front, rear) } else { level }
    }

    /// The share of a bench's link, and of its board's length, that is seen from above: 1 without ground.
    pub(crate) fn seen_share(&self, bench: usize, board: &Board) -> f64 {
        if self.route.is_on_ground() { board.half_length / (0.5 * self.dimensions.length_m(bench)) } else { 1.0 }
    }

    /// A length which, multiplied with a change of a link's direction and of its heading in the plan, bounds the change of a corner
    /// relative to the nearest hinge, seen from above. Without ground it is the overhang: board and link turn as one.
    pub(crate) fn corner_arm_m(&self) -> f64 {
        let dimensions = &self.dimensions;
        if self.route.is_on_ground() {
            dimensions.hole_offset_m() + 0.5 * dimensions.width_m()
        } else {
            dimensions.overhang_m()
        }
    }

    /// Distance from the centre of a bench's board to its corners.
    pub(crate) fn board_radius_m(&self, bench: usize) -> f64 {
        0.5 * DVec2::new(self.dimensions.length_m(bench), self.dimensions.width_m()).length()
    }

    /// Replaces `boards` by the boards of all benches, head first.
    pub fn place_boards(&self, handles: &[Handle], boards: &mut Vec<Board>) {
        self.place_boards_at(handles, Handle::in_space, boards);
    }

    /// The same for any type of handle from which `position` returns the position in space.
    pub fn place_boards_at<T>(&self, handles: &[T], position: impl Fn(&T) -> DVec3, boards: &mut Vec<Board>) {
        boards.clear();
        self.add_boards(handles, position, boards);
    }

    /// Adds the boards of all benches to `boards`.
    pub fn add_boards<T>(&self, handles: &[T], position: impl Fn(&T) -> DVec3, boards: &mut Vec<Board>) {
        let ends = handles.windows(2).enumerate();
        boards.extend(ends.map(|(bench, ends)| self.board_between(bench, position(&ends[0]), position(&ends[1]))));
    }
}

/// Whether a dragon at the start of a route stands on more than a turn of a spiral.
fn stands_beside_itself(route: &Route, dimensions: &Dimensions) -> bool {
    let start = route.parameter(route.start_travel_m());
    let angle = route.coil().and_then(|coil| Some((coil, coil.angle(start)?)));
    angle.is_some_and(|(coil, angle)| {
        let turn_m = route.travel(start) - route.travel(coil.parameter(angle + TAU));
        dimensions.links_m() > turn_m
    })
}

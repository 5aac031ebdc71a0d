//! The dragon: hinged benches led along a route.
//!
//! Bench 0 is the head. Handle i is the front hinge of bench i, handle N the tail's rear hinge. All that the dragon
//! does is a function of the head's travel in metres; "per metre" and "speed ratio" mean per metre of that.

pub(crate) mod board;
pub(crate) mod chain;
pub(crate) mod dimensions;
pub(crate) mod link;
pub(crate) mod meter;
mod orbit;
pub(crate) mod run;
mod stepper;

use std::sync::Arc;

use glam::DVec2;
use thiserror::Error;

use crate::number::Number;
use crate::route::Route;

pub use board::{Approach, Board};
pub use chain::{Chain, ChainSolver, Handle, TravelOutOfRange};
pub use dimensions::{
    Dimensions, DimensionsError, LEAST_LINK_M, LENGTH_M, MAX_BENCHES, MOST_PER_LINK, MOST_PER_WIDTH, WIDTH_M,
};
pub use meter::{Meter, Spent};
pub use run::RunEnd;
pub use stepper::{ChainStepper, Instructions};

pub(crate) use orbit::Station;

use run::Run;

/// Why a dragon cannot walk a route.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum DragonError {
    /// Boards overlap from one turn of the route to the next.
    #[error("pitch_m is {}, must be above width_m {}", Number(*pitch_m), Number(*width_m))]
    PitchUnderWidth {
        /// Metres between neighbouring turns.
        pitch_m: f64,
        /// Metres.
        width_m: f64,
    },
    /// At the start, no parameter behind a handle is right for the next one.
    #[error(
        "the route is too tight at its start: handle {handle} cannot stand and walk {link_m:.3} m behind the one before"
    )]
    CannotStand {
        /// The first such handle.
        handle: usize,
        /// Length of the link before it.
        link_m: f64,
    },
    /// A run that takes too much work to look through.
    #[error("the dragon's run is too long, or too tightly wound for its links, to be looked through: {0}")]
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
    run: Run,
    /// Parameter of the head at the run's end.
    pub(crate) end_parameter: f64,
    meter: Meter,
}

impl Dragon {
    /// Puts a dragon onto a route, the head at the route's start, and finds out how far it can walk.
    ///
    /// # Errors
    /// The pitch must be above the boards' width, and at the start every handle must stand on the route and move
    /// forward. How far it can walk is found within a bounded number of steps of work.
    pub fn new(dimensions: Dimensions, route: Arc<Route>) -> Result<Self, DragonError> {
        Self::with_meter(dimensions, route, Meter::unlimited())
    }

    /// The same, with all work for this dragon counted on a meter.
    ///
    /// # Errors
    /// As [`new`](Self::new); and the meter may be spent before it is known how far the dragon can walk.
    pub fn with_meter(dimensions: Dimensions, route: Arc<Route>, meter: Meter) -> Result<Self, DragonError> {
        let (pitch_m, width_m) = (route.pitch_m(), dimensions.width_m());
        if pitch_m <= width_m {
            return Err(DragonError::PitchUnderWidth { pitch_m, width_m });
        }
        let placing = meter.for_placing();
        let run = Run::of(&route, &dimensions, &placing);
        if placing.is_spent() {
            return Err(DragonError::TooMuchWork(placing.spent(route.start_travel_m())));
        }
        let run = run.map_err(|handle| DragonError::CannotStand { handle, link_m: dimensions.link_m(handle - 1) })?;
        Ok(Self { dimensions, end_parameter: route.parameter(run.end_travel_m), route, run, meter })
    }

    /// The same dragon, with all work for it counted on this meter.
    #[must_use]
    pub fn metered(&self, meter: &Meter) -> Self {
        Self { meter: meter.clone(), ..self.clone() }
    }

    /// Where the work for this dragon is counted.
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

    /// Travel at which the run begins.
    pub fn start_travel_m(&self) -> f64 {
        self.route.start_travel_m()
    }

    /// Travel at which the run ends, to some 10⁻¹² m; every handle still walks up to here.
    pub fn end_travel_m(&self) -> f64 {
        self.run.end_travel_m
    }

    /// What ends the run.
    pub fn run_end(&self) -> RunEnd {
        self.run.end
    }

    /// The handles with the head at `travel_m`, one by one from the head.
    ///
    /// # Errors
    /// The travel must lie within the run.
    pub fn chain(&self, travel_m: f64) -> Result<Chain<'_>, TravelOutOfRange> {
        self.require_travel(travel_m)?;
        Ok(Chain::new(self.route(), &self.dimensions, &self.meter, self.route.parameter(travel_m)))
    }

    /// Refuses a travel beyond the run.
    fn require_travel(&self, travel_m: f64) -> Result<(), TravelOutOfRange> {
        let (start_travel_m, end_travel_m) = (self.start_travel_m(), self.end_travel_m());
        let within = travel_m >= start_travel_m && travel_m <= end_travel_m;
        if within { Ok(()) } else { Err(TravelOutOfRange { travel_m, start_travel_m, end_travel_m }) }
    }

    /// The handles behind the one of this index.
    pub(crate) fn chain_behind(&self, index: usize, handle: &Handle) -> Chain<'_> {
        Chain::behind(self.route(), &self.dimensions, &self.meter, index, handle)
    }

    /// The board of a bench between its two handles.
    pub fn board(&self, bench: usize, front: &Handle, rear: &Handle) -> Board {
        Board::from_handles(front.position, rear.position, self.dimensions.length_m(bench), self.dimensions.width_m())
    }

    /// The boards of all benches, head first, in place of what is in `boards`.
    pub fn place_boards(&self, handles: &[Handle], boards: &mut Vec<Board>) {
        self.place_boards_at(handles, |handle| handle.position, boards);
    }

    /// The same from anything that tells where the handles are.
    pub fn place_boards_at<T>(&self, handles: &[T], position: impl Fn(&T) -> DVec2, boards: &mut Vec<Board>) {
        boards.clear();
        boards.extend(handles.windows(2).enumerate().map(|(bench, ends)| {
            let [front, rear] = [position(&ends[0]), position(&ends[1])];
            Board::from_handles(front, rear, self.dimensions.length_m(bench), self.dimensions.width_m())
        }));
    }
}

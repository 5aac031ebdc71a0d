//! Why a dragon cannot walk its whole route.

use thiserror::Error;

use crate::dragon::{Dragon, DragonError, FeasibleEnd, Spent};
use crate::number::Fixed;
use crate::route::RouteError;

/// Reason why a dragon cannot walk its whole route.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum Infeasible {
    /// The dragon cannot stand at the start.
    #[error(transparent)]
    Dragon(DragonError),
    /// The route is not valid on its ground.
    #[error(transparent)]
    Route(RouteError),
    /// A handle cannot pass a parameter of the route.
    #[error("{end} with the head at {} m of travel", Fixed::<6>(*travel_m))]
    Fault {
        /// Travel of the head.
        travel_m: f64,
        /// The fault of the handle.
        end: FeasibleEnd,
    },
    /// Unknown: the limit of work is reached.
    #[error("no answer: {0}")]
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

impl From<RouteError> for Infeasible {
    fn from(error: RouteError) -> Self {
        match error {
            RouteError::Ground(gap) => Self::Dragon(DragonError::Ground(gap)),
            error => Self::Route(error),
        }
    }
}

impl From<Spent> for Infeasible {
    fn from(spent: Spent) -> Self {
        Self::TooMuchWork(spent)
    }
}

impl Infeasible {
    /// Returns an error for a dragon that does not reach its route's end.
    ///
    /// # Errors
    /// The fault that ends its run.
    pub(super) fn check(dragon: &Dragon) -> Result<(), Self> {
        match dragon.feasible_end() {
            FeasibleEnd::RouteEnd => Ok(()),
            end => Err(Self::Fault { travel_m: dragon.end_travel_m(), end }),
        }
    }
}

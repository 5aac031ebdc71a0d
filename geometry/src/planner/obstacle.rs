//! What is in the way of a dragon on a turn.

use std::f64::consts::PI;
use std::fmt::{self, Display, Formatter};
use std::ops::RangeInclusive;
use std::sync::Arc;

use super::passage::{Infeasible, Staging, passage_through};
use super::speed_limit::{LargestRatio, largest_speed_ratio};
use crate::clearance::{Contact, first_within};
use crate::dragon::{Dimensions, Dragon, DragonError, Meter, RunEnd, Spent};
use crate::route::Turnaround;

/// Benches whose speeds are looked at where only the links are.
const SPEED_BENCHES: usize = 8;

/// The piece of a turnaround's route behind its last seam: the way out.
const WAY_OUT: usize = 3;

/// What is in the way of a dragon on a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Obstacle {
    /// A handle would stop or jump.
    Fault {
        /// Travel of the head, from where it enters the S.
        travel_m: f64,
        /// What would happen.
        end: RunEnd,
        /// The piece of the route on which the handle before stands: the way in, the entry arc, the exit arc, the way
        /// out.
        piece: usize,
    },
    /// Two benches touch, or come within the clearance that is to remain.
    Contact(Contact),
    /// A handle is faster than it may be: where any is fastest.
    TooFast(LargestRatio),
    /// The dragon cannot stand before it.
    Dragon(DragonError),
}

impl Display for Obstacle {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault { travel_m, end, .. } => write!(formatter, "{end} after {travel_m:.6} m"),
            Self::Contact(Contact { travel_m, benches: [first, second], .. }) => {
                write!(formatter, "benches {first} and {second} come too near after {travel_m:.6} m")
            }
            Self::TooFast(LargestRatio { ratio, travel_m, handle }) => {
                write!(formatter, "handle {handle} is {ratio:.6} times as fast as the head after {travel_m:.6} m")
            }
            Self::Dragon(error) => write!(formatter, "{error}"),
        }
    }
}

impl Obstacle {
    /// Whether the same thing is in the way, wherever it happens: of two contacts, whether the same bench runs into
    /// others. Any two handles that are too fast count as the same: golden section looks between them.
    pub(super) fn resembles(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Fault { end, piece, .. }, Self::Fault { end: other_end, piece: other_piece, .. }) => {
                (end, piece) == (other_end, other_piece)
            }
            (Self::Contact(contact), Self::Contact(other)) => contact.benches[0] == other.benches[0],
            (Self::Dragon(_), Self::Dragon(_)) | (Self::TooFast(_), Self::TooFast(_)) => true,
            _ => false,
        }
    }
}

/// How much of a passage is looked at.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Extent {
    /// Whether the links walk, and no contacts: what is shortest so, and turns out to be clear, is shortest.
    Links,
    /// From the entry until the head has gone once round on the way out.
    OnceRound,
    /// The whole passage.
    Whole,
}

/// Looks for what is in the way of one dragon on turns inside the turning circle of a turnaround.
pub(super) struct TurnCheck {
    pub(super) turnaround: Turnaround,
    pub(super) dimensions: Dimensions,
    pub(super) staging: Staging,
    pub(super) extent: Extent,
}

impl TurnCheck {
    /// The turn whose S begins at this radius, with this ratio of its arcs.
    pub(super) fn turn(&self, radius_m: f64, ratio: f64) -> Turnaround {
        let turn = Turnaround::new(self.turnaround.pitch_m(), 2.0 * radius_m, ratio);
        let (start_m, end_m) = (self.turnaround.start_travel_m(), self.turnaround.end_travel_m());
        turn.and_then(|turn| turn.between(start_m, end_m)).expect("a smaller circle on the same spiral is valid")
    }

    /// A thing in the way on that turn: a fault, or else a limit that is broken.
    pub(super) fn obstacle(&self, meter: &Meter, radius_m: f64, ratio: f64) -> Result<Option<Obstacle>, Spent> {
        match self.walk(meter, &self.turn(radius_m, ratio), radius_m) {
            Ok(()) => Ok(None),
            Err(Blocked::By(obstacle)) => Ok(Some(obstacle)),
            Err(Blocked::TooMuchWork(spent)) => Err(spent),
        }
    }

    fn walk(&self, meter: &Meter, turn: &Turnaround, radius_m: f64) -> Result<(), Blocked> {
        let turn_m = turn.turn_length_m();
        let round_m = turn_m + 2.0 * PI * (radius_m + turn.pitch_m());
        let once_round = turn.between(0.0, round_m).expect("once round is ahead");
        let walked = |benches: usize| walked(meter, once_round, self.dimensions.with_benches(benches));
        let benches = self.dimensions.benches();
        // Faults are those of the first two links, for all others are like the second.
        walked(benches.min(2))?;
        if self.staging.limits_speed() {
            self.check_speed(&walked(benches.min(SPEED_BENCHES))?)?;
        }
        match self.extent {
            Extent::Links => Ok(()),
            // The way out first: where links stand steep, as in the S, a search takes longest.
            Extent::OnceRound => self.check_limits(&walked(benches)?, &[turn_m..=round_m, 0.0..=turn_m]),
            Extent::Whole => {
                let dragon = passage_through(*turn, self.dimensions, meter)?;
                self.check_limits(&dragon, &[dragon.start_travel_m()..=dragon.end_travel_m()])
            }
        }
    }

    /// Checks the clearance on some ways, in their order, and the speed on the dragon's run.
    fn check_limits(&self, dragon: &Dragon, ways_m: &[RangeInclusive<f64>]) -> Result<(), Blocked> {
        for way_m in ways_m {
            if let Some(contact) = first_within(dragon, self.staging.clearance_m, *way_m.start(), *way_m.end())? {
                return Err(Blocked::By(Obstacle::Contact(contact)));
            }
        }
        self.check_speed(dragon)
    }

    fn check_speed(&self, dragon: &Dragon) -> Result<(), Blocked> {
        if self.staging.limits_speed() {
            let largest = largest_speed_ratio(dragon)?;
            if largest.ratio > self.staging.speed_ratio {
                return Err(Blocked::By(Obstacle::TooFast(largest)));
            }
        }
        Ok(())
    }
}

/// A dragon that walks all of a turn.
fn walked(meter: &Meter, turn: Turnaround, dimensions: Dimensions) -> Result<Dragon, Blocked> {
    let dragon = Dragon::with_meter(dimensions, Arc::new(turn.route()), meter.clone()).map_err(Infeasible::from)?;
    let (travel_m, end) = (dragon.end_travel_m(), dragon.run_end());
    let (RunEnd::HandleStops { handle } | RunEnd::HandleJumps { handle }) = end else { return Ok(dragon) };
    let ahead = dragon.chain(travel_m).expect("the run's end is in it").nth(handle - 1).expect("the handle ahead");
    let piece = dragon.route().seams().partition_point(|&seam| seam < ahead.parameter);
    Err(Blocked::By(Obstacle::Fault { travel_m, end, piece }))
}

/// Why a dragon is not known to get through a turn.
enum Blocked {
    By(Obstacle),
    TooMuchWork(Spent),
}

impl From<Spent> for Blocked {
    fn from(spent: Spent) -> Self {
        Self::TooMuchWork(spent)
    }
}

impl From<Infeasible> for Blocked {
    fn from(infeasible: Infeasible) -> Self {
        match infeasible {
            Infeasible::Dragon(error) => Self::By(Obstacle::Dragon(error)),
            Infeasible::Fault { travel_m, end } => Self::By(Obstacle::Fault { travel_m, end, piece: WAY_OUT }),
            Infeasible::TooMuchWork(spent) => Self::TooMuchWork(spent),
        }
    }
}

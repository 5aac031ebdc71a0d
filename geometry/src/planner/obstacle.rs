//! Obstacles: reasons why a dragon cannot pass a turn.

use std::f64::consts::PI;
use std::fmt::{self, Display, Formatter};
use std::ops::RangeInclusive;
use std::sync::Arc;

use super::infeasible::Infeasible;
use super::passage::{Staging, passage};
use super::planned_turn::PlannedTurn;
use super::speed_limit::{LargestRatio, largest_speed_ratio};
use crate::clearance::{Contact, first_within};
use crate::dragon::{Dimensions, Dragon, DragonError, FeasibleEnd, Meter, Spent};
use crate::number::Fixed;
use crate::route::{RouteError, Turnaround};

/// Number of benches whose speeds are checked when only the links are.
const SPEED_BENCHES: usize = 8;

/// Greatest work for finding the faults of a trial, in steps. Where a handle almost jumps, no bound decides whether it does: the
/// trial then counts as blocked.
const PLACING_STEPS: u64 = 2_000_000;

/// Index of the way out among the pieces of a turnaround's route.
const WAY_OUT: usize = 4;

/// Reason why a dragon cannot pass a turn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Obstacle {
    /// A handle would stop or jump.
    Fault {
        /// Travel of the head, from its entry into the S.
        travel_m: f64,
        /// The fault of the handle.
        end: FeasibleEnd,
        /// Index of the piece that contains the handle before it: way in, entry arc, line, exit arc, way out.
        piece: usize,
    },
    /// Two benches touch, or come within the required clearance.
    Contact(Contact),
    /// A handle exceeds the speed limit: the fastest handle.
    TooFast(LargestRatio),
    /// The dragon cannot stand before the turn, or the ground ends.
    Dragon(DragonError),
    /// The route is not valid on its ground.
    Route(RouteError),
}

impl Display for Obstacle {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fault { travel_m, end, .. } => {
                write!(formatter, "{end} after {} m", Fixed::<6>(*travel_m))
            }
            Self::Contact(Contact { travel_m, benches: [first, second], .. }) => {
                write!(
                    formatter,
                    "benches {first} and {second} come too near each other after {} m",
                    Fixed::<6>(*travel_m)
                )
            }
            Self::TooFast(LargestRatio { ratio, travel_m, handle }) => {
                write!(
                    formatter,
                    "handle {handle} is {ratio:.6} times as fast as the head after {} m",
                    Fixed::<6>(*travel_m)
                )
            }
            Self::Dragon(error) => write!(formatter, "{error}"),
            Self::Route(error) => write!(formatter, "{error}"),
        }
    }
}

impl Obstacle {
    /// Whether two obstacles are of the same kind, at any travel. Two contacts are of the same kind if their front benches are
    /// the same. Any two handles that are too fast are, because golden section searches between them.
    pub(super) fn resembles(&self, other: &Self) -> bool {
        match (self, other) {
            (Self::Fault { end, piece, .. }, Self::Fault { end: other_end, piece: other_piece, .. }) => {
                (end, piece) == (other_end, other_piece)
            }
            (Self::Contact(contact), Self::Contact(other)) => contact.benches[0] == other.benches[0],
            (Self::Dragon(_), Self::Dragon(_))
            | (Self::Route(_), Self::Route(_))
            | (Self::TooFast(_), Self::TooFast(_)) => true,
            _ => false,
        }
    }
}

/// Part of a passage that a check covers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Extent {
    /// The motion of the links, without contacts. If the shortest S of this check has no other obstacle, it is the shortest of
    /// all.
    Links,
    /// From the entry until the head has walked once round on the way out.
    OnceRound,
    /// The whole passage.
    Whole,
}

impl Extent {
    /// All extents, each of which includes those before it.
    pub(super) const ALL: [Self; 3] = [Self::Links, Self::OnceRound, Self::Whole];
}

/// Checks one dragon on turns inside the turning circle of a turnaround.
pub(super) struct TurnCheck {
    pub(super) planned: PlannedTurn,
    pub(super) dimensions: Dimensions,
    pub(super) staging: Staging,
    pub(super) extent: Extent,
    /// Length of the line between the arcs, in metres.
    pub(super) line_m: f64,
}

impl TurnCheck {
    /// The turn whose S begins at this radius, with this ratio of its arcs.
    pub(super) fn turn(&self, radius_m: f64, ratio: f64) -> Turnaround {
        let planned = self.planned.turnaround();
        let turn = Turnaround::with_line(planned.pitch_m(), 2.0 * radius_m, ratio, self.line_m);
        turn.map(|turn| turn.placed(planned.placement()))
            .and_then(|turn| turn.between(planned.start_travel_m(), planned.end_travel_m()))
            .expect("a smaller circle on the same spiral is valid")
    }

    /// Returns an obstacle on that turn: a fault, or else an exceeded limit.
    pub(super) fn obstacle(&self, meter: &Meter, radius_m: f64, ratio: f64) -> Result<Option<Obstacle>, Spent> {
        match self.walk(meter, &self.planned.with(self.turn(radius_m, ratio)), radius_m) {
            Ok(()) => Ok(None),
            Err(Blocked::By(obstacle)) => Ok(Some(obstacle)),
            Err(Blocked::TooMuchWork(spent)) => Err(spent),
        }
    }

    fn walk(&self, meter: &Meter, turn: &PlannedTurn, radius_m: f64) -> Result<(), Blocked> {
        let (turn_m, pitch_m) = (turn.turnaround().turn_length_m(), turn.turnaround().pitch_m());
        let round_m = turn_m + 2.0 * PI * (radius_m + pitch_m);
        let walked = |benches: usize| walked(meter, turn, round_m, self.dimensions.with_benches(benches));
        let benches = self.dimensions.benches();
        if self.staging.limits_speed() {
            self.check_speed(&walked(benches.min(SPEED_BENCHES))?)?;
        } else {
            // The first two links have all faults, because all other links are like the second.
            walked(benches.min(2))?;
        }
        match self.extent {
            Extent::Links => Ok(()),
            // Checks the way out first: a search takes longest where links are at steep angles, as in the S.
            Extent::OnceRound => {
                let dragon = walked(benches)?;
                let exit_m = dragon.route().in_space(turn_m);
                self.check_limits(&dragon, &[exit_m..=dragon.end_travel_m(), 0.0..=exit_m])
            }
            Extent::Whole => {
                let dragon = passage(turn, self.dimensions, meter)?;
                self.check_limits(&dragon, &[dragon.start_travel_m()..=dragon.end_travel_m()])
            }
        }
    }

    /// Checks the clearance on some intervals, in their order, and the speed on the dragon's run.
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

/// A dragon that walks the whole turn, from its entry up to a travel in the plan.
fn walked(meter: &Meter, turn: &PlannedTurn, plan_m: f64, dimensions: Dimensions) -> Result<Dragon, Blocked> {
    let route = turn.route_in_plan(dimensions, meter, 0.0, plan_m).map_err(Infeasible::from)?;
    let placing = meter.part(meter.left().min(PLACING_STEPS));
    let placed = Dragon::with_meter(dimensions, Arc::new(route), placing.clone());
    meter.add(placing.done());
    let dragon = match placed {
        Err(error @ DragonError::TooMuchWork(_)) if !meter.is_spent() => {
            return Err(Blocked::By(Obstacle::Dragon(error)));
        }
        placed => placed.map_err(Infeasible::from)?.metered(meter),
    };
    let (travel_m, end) = (dragon.end_travel_m(), dragon.feasible_end());
    let (FeasibleEnd::HandleStops { handle } | FeasibleEnd::HandleJumps { handle }) = end else { return Ok(dragon) };
    let ahead = dragon.chain(travel_m).expect("the run's end is in it").nth(handle - 1).expect("the handle ahead");
    let segment = dragon.route().seams().partition_point(|&seam| seam < ahead.parameter);
    let piece = if turn.turnaround().line_m() > 0.0 || segment < 2 { segment } else { segment + 1 };
    Err(Blocked::By(Obstacle::Fault { travel_m, end, piece }))
}

/// Reason why a dragon is not proved to pass a turn.
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
            Infeasible::Route(error) => Self::By(Obstacle::Route(error)),
            Infeasible::Fault { travel_m, end } => Self::By(Obstacle::Fault { travel_m, end, piece: WAY_OUT }),
            Infeasible::TooMuchWork(spent) => Self::TooMuchWork(spent),
        }
    }
}

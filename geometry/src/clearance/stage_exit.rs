//! The first board that leaves a stage, after it was inside.
//!
//! A dragon that comes onto the stage has boards that stand outside. A board counts as inside from the first look at which all of
//! it is inside. There are [`LOOKS_PER_LINK`] looks per link.
//!
//! *Method.* The pose of a bench depends only on the parameter of its front handle, and all body benches are alike. So a bench
//! behind bench 1 repeats the poses of the bench before it, once its front handle has reached the parameter at which that
//! bench began. Before that it is on ground of its own. The search follows each bench over its own ground, benches 0 and 1 up
//! to the end of the run. A bench is followed at most up to the earliest exit found so far.
//!
//! A bench is followed stride by stride. On each stride, bounds on its motion (see `coverage`) prove that the board stays
//! inside, or the stride is bisected. So no exit is missed, however short. An exit is exact to [`RESOLUTION_M`].
//!
//! *Limits.* A board that is less than 10⁻⁹ m outside counts as inside, because positions are rounded. A board that leaves and
//! returns within [`RESOLUTION_M`] is not found.

use glam::DVec2;

use super::coverage::BoardCoverage;
use super::pose::BenchPose;
use crate::dragon::{Dragon, Handle, Spent};
use crate::numerics::turning_point;
use crate::outline::{Edge, GRAZE_M, Outline};

/// Shortest interval that is bisected, in metres that the front handle walks.
const RESOLUTION_M: f64 = 1e-9;
/// Tolerance of the head's travel at an exit, in metres.
const TRAVEL_TOLERANCE_M: f64 = 1e-12;
/// Length of a stride, in lengths of the bench's link.
const STRIDE_LINKS: f64 = 0.25;
/// Looks per link for a board that comes in.
const LOOKS_PER_LINK: f64 = 64.0;
/// Work for a step of a search, and number of edges that take as long as one more, in steps.
const STEPS_PER_LOOK: u64 = 8;
const EDGES_PER_STEP: usize = 4;

/// A board that leaves the stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageExit {
    /// Travel of the head.
    pub travel_m: f64,
    /// Index of the bench.
    pub bench: usize,
    /// The corner of the board that is outside, or the point of the outline that is in the board.
    pub point: DVec2,
}

/// The number of boards that stand outside an outline at the start of a run.
pub fn standing_outside(dragon: &Dragon, outline: &Outline) -> usize {
    let handles: Vec<Handle> = dragon.chain(dragon.start_travel_m()).expect("within the run").collect();
    let mut boards = Vec::new();
    dragon.place_boards(&handles, &mut boards);
    boards.iter().filter(|board| outline.leaving_point(board).is_some()).count()
}

/// Finds the first time during the whole run at which a board of the dragon that was inside an outline is not inside any more.
///
/// # Errors
/// The dragon's meter is spent. The search is then not finished at any travel.
pub fn first_exit(dragon: &Dragon, outline: &Outline) -> Result<Option<StageExit>, Spent> {
    let parameters = |travel_m: f64| -> Vec<f64> {
        dragon.chain(travel_m).expect("within the run").map(|handle| handle.parameter).collect()
    };
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let (beginning, mut limits) = (parameters(start_m), parameters(end_m));
    let mut first: Option<StageExit> = None;
    for bench in 0..dragon.dimensions().benches() {
        let own_ground = if bench < 2 { f64::INFINITY } else { beginning[bench - 1] };
        let search = BenchSearch { dragon, outline, bench };
        let exit = search.first(beginning[bench], limits[bench].min(own_ground));
        dragon.meter().check(start_m)?;
        let Some(exit) = exit else { continue };
        let travel_m =
            search.head_travel_m(exit.pose.front.parameter, [start_m, first.map_or(end_m, |exit| exit.travel_m)]);
        first = Some(StageExit { travel_m, bench, point: exit.outside.expect("the board is outside") });
        limits = parameters(travel_m);
    }
    Ok(first)
}

/// Follows one bench.
#[derive(Clone, Copy)]
struct BenchSearch<'a> {
    dragon: &'a Dragon,
    outline: &'a Outline,
    bench: usize,
}

/// A bench at one parameter of its front handle.
struct Moment {
    pose: BenchPose,
    /// The point at which the board is outside.
    outside: Option<DVec2>,
}

impl BenchSearch<'_> {
    /// The first moment at which the board has left, with its front handle between two parameters.
    fn first(&self, from: f64, to: f64) -> Option<Moment> {
        let mut earlier = self.at(from)?;
        while earlier.pose.front.parameter < to {
            if earlier.outside.is_some() {
                self.dragon.meter().add(STEPS_PER_LOOK);
                earlier = self.further(&earlier, 1.0 / LOOKS_PER_LINK, to)?;
                continue;
            }
            let later = self.further(&earlier, STRIDE_LINKS, to)?;
            let leaving = self.walk(&earlier, &later);
            if leaving.is_some() || self.dragon.meter().is_spent() {
                return leaving;
            }
            earlier = later;
        }
        None
    }

    /// The bench after its front handle has walked this many lengths of its link, or is at a parameter. `None` if the meter is
    /// spent.
    fn further(&self, earlier: &Moment, links: f64, to: f64) -> Option<Moment> {
        let stride_m = links * self.dragon.dimensions().link_m(self.bench);
        let from = earlier.pose.front.parameter;
        let next = self.dragon.route().parameter_near(earlier.pose.front_travel_m + stride_m, from);
        if self.dragon.meter().is_spent() { None } else { self.at(if next > from { next.min(to) } else { to }) }
    }

    fn walk(&self, earlier: &Moment, later: &Moment) -> Option<Moment> {
        self.dragon.meter().add(STEPS_PER_LOOK + (self.outline.corners().len() / EDGES_PER_STEP) as u64);
        if self.dragon.meter().is_spent() || (later.outside.is_none() && self.stays_inside(earlier, later)) {
            return None;
        }
        let [rear, front] = [earlier, later].map(|moment| moment.pose.front.parameter);
        let middle = 0.5 * (rear + front);
        let walked_m = later.pose.front_travel_m - earlier.pose.front_travel_m;
        if walked_m <= RESOLUTION_M || middle <= rear || middle >= front {
            return later.outside.and_then(|_| self.at(front));
        }
        let middle = self.at(middle)?;
        self.walk(earlier, &middle).or_else(|| self.walk(&middle, later))
    }

    /// Whether the board provably stays inside between two moments at which it is inside. It does if it meets no edge, or none
    /// by more than [`GRAZE_M`].
    fn stays_inside(&self, earlier: &Moment, later: &Moment) -> bool {
        let coverage = BoardCoverage::new(self.dragon, self.bench, &earlier.pose, &later.pose);
        let boards = [&earlier.pose.board, &later.pose.board];
        self.outline.edges().all(|edge| {
            let distances_m = boards.map(|board| edge.board_distance_m(board));
            // The displacements from the two ends add up to at most the drift.
            distances_m[0] + distances_m[1] > coverage.drift_m()
                || stays_beside(&coverage, &edge, boards.map(|board| board.centre))
        })
    }

    /// The bench with its front handle at a parameter. Only a spent meter has no pose.
    fn at(&self, parameter: f64) -> Option<Moment> {
        let (dragon, point) = (self.dragon, self.dragon.route().point(parameter));
        let rear = dragon.rear(self.bench, parameter)?;
        let front = Handle::new(parameter, point, 1.0);
        let rear = Handle::new(rear.parameter, rear.point, rear.speed_ratio());
        let pose = BenchPose::new(dragon, self.bench, front, rear);
        Some(Moment { outside: self.outline.leaving_point(&pose.board), pose })
    }

    /// Travel of the head with the bench's front handle at a parameter, between two travels.
    fn head_travel_m(&self, parameter: f64, [low_m, high_m]: [f64; 2]) -> f64 {
        let front = |travel_m: f64| {
            let handle = self.dragon.chain(travel_m).ok().and_then(|mut chain| chain.nth(self.bench));
            handle.map_or(f64::INFINITY, |handle| handle.parameter)
        };
        if front(low_m) >= parameter {
            return low_m;
        }
        turning_point(low_m, high_m, TRAVEL_TOLERANCE_M, |travel_m| front(travel_m) >= parameter).1
    }
}

/// Whether the board stays on one side of an edge, across the edge or in the direction from the edge to the board's centre.
fn stays_beside(coverage: &BoardCoverage, edge: &Edge, centres: [DVec2; 2]) -> bool {
    let across = (edge.to - edge.from).perp().normalize_or_zero();
    let away = centres.map(|centre| (centre - edge.nearest(centre)).normalize_or_zero());
    [across, -across, away[0], away[1]]
        .into_iter()
        .any(|direction| direction != DVec2::ZERO && coverage.edge_gap_m([edge.from, edge.to], direction) > -GRAZE_M)
}

//! Follows one bench with respect to borders of a stage.
//!
//! A bench is followed stride by stride. On each stride, bounds on its motion (see `coverage`) prove that the board keeps
//! clear, or the stride is bisected. So no breach is missed, however short. A breach is exact to [`RESOLUTION_M`]. The least
//! distance is exact to [`DISTANCE_TOLERANCE_M`]: a stride is bisected until no lower distance is possible on it.
//!
//! *Limits.* A board that is less than 10⁻⁹ m beyond a border, or too near by less, keeps clear, because positions are rounded. A
//! board that leaves and returns within [`RESOLUTION_M`] is not found.

use glam::DVec2;

use super::coverage::BoardCoverage;
use super::pose::BenchPose;
use crate::dragon::{Board, Dragon, Handle};
use crate::numerics::turning_point;
use crate::stage::{Border, BorderKind, Edge, GRAZE_M};

/// Shortest interval that is bisected, in metres that the front handle walks.
const RESOLUTION_M: f64 = 1e-9;
/// Tolerance of a least distance, in metres.
const DISTANCE_TOLERANCE_M: f64 = 1e-6;
/// Tolerance of the head's travel at a breach, in metres.
const TRAVEL_TOLERANCE_M: f64 = 1e-12;
/// Length of a stride, in lengths of the bench's link.
const STRIDE_LINKS: f64 = 0.25;
/// Looks per link for a board that comes in.
const LOOKS_PER_LINK: f64 = 64.0;
/// Work for a step of a search, and number of edges that take as long as one more, in steps.
const STEPS_PER_LOOK: u64 = 8;
const EDGES_PER_STEP: usize = 4;

/// Follows one bench with respect to borders of one kind.
#[derive(Clone, Copy)]
pub(super) struct BenchSearch<'a> {
    pub(super) dragon: &'a Dragon,
    pub(super) borders: &'a [Border],
    pub(super) clear_m: f64,
    pub(super) bench: usize,
}

/// A bench at one parameter of its front handle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Moment {
    pose: BenchPose,
    /// The border that the board is beyond, or too near to, and the point of the board.
    pub(super) breach: Option<(usize, DVec2)>,
}

impl Moment {
    pub(super) fn parameter(&self) -> f64 {
        self.pose.front.parameter
    }

    pub(super) fn board(&self) -> &Board {
        &self.pose.board
    }
}

/// The nearest moment that a search has found.
#[derive(Clone, Copy, Debug)]
pub(super) struct Nearest {
    pub(super) distance_m: f64,
    pub(super) bench: usize,
    pub(super) parameter: f64,
    pub(super) border: usize,
    pub(super) board: Board,
}

impl BenchSearch<'_> {
    /// The first breach, with the front handle between two parameters: a moment that keeps clear, and the next one. They are the same
    /// if the bench does not keep clear at the beginning.
    pub(super) fn first(&self, from: f64, to: f64) -> Option<[Moment; 2]> {
        let mut earlier = self.at(from)?;
        if earlier.breach.is_some() && !self.comes_in() {
            return Some([earlier; 2]);
        }
        while earlier.parameter() < to {
            if earlier.breach.is_some() {
                earlier = self.next_look(&earlier, to)?;
                continue;
            }
            match self.stride(&earlier, to) {
                Stride::Clear(later) => earlier = later,
                Stride::Breach(moments) => return Some(moments),
                Stride::Spent => return None,
            }
        }
        None
    }

    /// Whether a board that does not keep clear at the beginning is one that comes in.
    pub(super) fn comes_in(&self) -> bool {
        self.borders.first().is_some_and(|border| border.kind() == BorderKind::Outline)
    }

    /// The next look at a board that comes in. `None` if the meter is spent.
    pub(super) fn next_look(&self, earlier: &Moment, to: f64) -> Option<Moment> {
        self.dragon.meter().add(STEPS_PER_LOOK);
        self.further(earlier, 1.0 / LOOKS_PER_LINK, to)
    }

    /// Whether a look at the bench keeps clear, with its front handle between two parameters. It looks backwards. `None` if the meter is
    /// spent.
    pub(super) fn has_come_in(&self, from: f64, to: f64) -> Option<bool> {
        let mut parameter = to;
        loop {
            self.dragon.meter().add(STEPS_PER_LOOK);
            if self.dragon.meter().is_spent() {
                return None;
            }
            if self.at(parameter)?.breach.is_none() {
                return Some(true);
            }
            if parameter <= from {
                return Some(false);
            }
            let route = self.dragon.route();
            let back_m = self.dragon.dimensions().link_m(self.bench) / LOOKS_PER_LINK;
            let next = route.parameter_near(route.travel(parameter) - back_m, parameter);
            parameter = if next < parameter { next.max(from) } else { from };
        }
    }

    /// Follows a board that keeps clear over the next stride, at most to a parameter.
    pub(super) fn stride(&self, earlier: &Moment, to: f64) -> Stride {
        let Some(later) = self.further(earlier, STRIDE_LINKS, to) else { return Stride::Spent };
        match self.walk(earlier, &later) {
            Some(moments) => Stride::Breach(moments),
            None if self.dragon.meter().is_spent() => Stride::Spent,
            None => Stride::Clear(later),
        }
    }

    /// The bench after its front handle has walked this many lengths of its link, or is at a parameter. `None` if the meter is
    /// spent.
    fn further(&self, earlier: &Moment, links: f64, to: f64) -> Option<Moment> {
        let stride_m = links * self.dragon.dimensions().link_m(self.bench);
        let from = earlier.parameter();
        let next = self.dragon.route().parameter_near(earlier.pose.front_travel_m + stride_m, from);
        if self.dragon.meter().is_spent() { None } else { self.at(if next > from { next.min(to) } else { to }) }
    }

    fn walk(&self, earlier: &Moment, later: &Moment) -> Option<[Moment; 2]> {
        self.count_step();
        let is_spent = self.dragon.meter().is_spent();
        if is_spent || (later.breach.is_none() && self.keeps_clear(earlier, later, self.clear_m)) {
            return None;
        }
        let Some(middle) = self.middle(earlier, later) else { return later.breach.map(|_| [*earlier, *later]) };
        self.walk(earlier, &middle).or_else(|| self.walk(&middle, later))
    }

    /// Lowers `nearest` to the least distance with the front handle between two parameters.
    pub(super) fn approach(&self, from: f64, to: f64, nearest: &mut Option<Nearest>) {
        let Some(mut earlier) = self.at(from) else { return };
        while nearest.is_none_or(|nearest| nearest.distance_m > 0.0) {
            let is_coming_in = earlier.breach.is_some() && self.comes_in();
            if !is_coming_in {
                self.note(&earlier, nearest);
            }
            if earlier.parameter() >= to {
                return;
            }
            let links = if is_coming_in { 1.0 / LOOKS_PER_LINK } else { STRIDE_LINKS };
            let Some(later) = self.further(&earlier, links, to) else { return };
            if is_coming_in {
                self.dragon.meter().add(STEPS_PER_LOOK);
            } else {
                self.note(&later, nearest);
                self.descend(&earlier, &later, nearest);
            }
            earlier = later;
        }
    }

    /// The same between two moments that are noted.
    fn descend(&self, earlier: &Moment, later: &Moment, nearest: &mut Option<Nearest>) {
        self.count_step();
        let known_m = nearest.map_or(f64::INFINITY, |nearest| nearest.distance_m);
        let limit_m = (known_m - DISTANCE_TOLERANCE_M).max(0.0);
        if known_m == 0.0 || self.dragon.meter().is_spent() || self.keeps_clear(earlier, later, limit_m) {
            return;
        }
        let Some(middle) = self.middle(earlier, later) else { return };
        self.note(&middle, nearest);
        self.descend(earlier, &middle, nearest);
        self.descend(&middle, later, nearest);
    }

    fn note(&self, moment: &Moment, nearest: &mut Option<Nearest>) {
        for (border, distance_m) in self.borders.iter().map(|border| border.distance_m(&moment.pose.board)).enumerate()
        {
            // A board that keeps clear of a border touches it only by rounding.
            let distance_m = if moment.breach.is_none() { distance_m.max(f64::MIN_POSITIVE) } else { distance_m };
            if nearest.is_none_or(|nearest| distance_m < nearest.distance_m) {
                let (parameter, board) = (moment.parameter(), moment.pose.board);
                *nearest = Some(Nearest { distance_m, bench: self.bench, parameter, border, board });
            }
        }
    }

    fn count_step(&self) {
        let edges: usize = self.borders.iter().map(|border| border.corners().len()).sum();
        self.dragon.meter().add(STEPS_PER_LOOK + (edges / EDGES_PER_STEP) as u64);
    }

    /// The bench halfway between two moments; `None` if they are as near as the search looks.
    fn middle(&self, earlier: &Moment, later: &Moment) -> Option<Moment> {
        let [rear, front] = [earlier, later].map(Moment::parameter);
        let middle = 0.5 * (rear + front);
        let walked_m = later.pose.front_travel_m - earlier.pose.front_travel_m;
        if walked_m <= RESOLUTION_M || middle <= rear || middle >= front { None } else { self.at(middle) }
    }

    /// Whether the board provably keeps clear between two moments at which it does. It does if it comes near no edge, or not nearer than
    /// the clearance by more than [`GRAZE_M`].
    fn keeps_clear(&self, earlier: &Moment, later: &Moment, clear_m: f64) -> bool {
        let coverage = BoardCoverage::new(self.dragon, self.bench, &earlier.pose, &later.pose);
        let boards = [&earlier.pose.board, &later.pose.board];
        self.borders.iter().all(|border| {
            border.is_beyond(boards[0], clear_m + coverage.drift_m())
                || border.edges().all(|edge| keeps_beside(&coverage, &edge, boards, clear_m))
        })
    }

    /// The bench with its front handle at a parameter. Only a spent meter has no pose.
    pub(super) fn at(&self, parameter: f64) -> Option<Moment> {
        let (dragon, point) = (self.dragon, self.dragon.route().point(parameter));
        let rear = dragon.rear(self.bench, parameter)?;
        let front = Handle::new(parameter, point, 1.0);
        let rear = Handle::new(rear.parameter, rear.point, rear.speed_ratio());
        let pose = BenchPose::new(dragon, self.bench, front, rear);
        let breaches = self.borders.iter().map(|border| border.breach(&pose.board, self.clear_m));
        let breach = breaches.enumerate().find_map(|(border, point)| Some((border, point?)));
        Some(Moment { pose, breach })
    }

    /// Travels of the head before and after the bench's front handle reaches a parameter, between two travels.
    pub(super) fn head_travels_m(&self, parameter: f64, [low_m, high_m]: [f64; 2]) -> [f64; 2] {
        let front = |travel_m: f64| {
            let handle = self.dragon.chain(travel_m).ok().and_then(|mut chain| chain.nth(self.bench));
            handle.map_or(f64::INFINITY, |handle| handle.parameter)
        };
        if front(low_m) >= parameter {
            return [low_m; 2];
        }
        turning_point(low_m, high_m, TRAVEL_TOLERANCE_M, |travel_m| front(travel_m) >= parameter).into()
    }
}

/// The end of a stride of a board that keeps clear.
pub(super) enum Stride {
    /// The board keeps clear up to this moment.
    Clear(Moment),
    /// The board keeps clear up to the first moment, and not at the second.
    Breach([Moment; 2]),
    /// The meter is spent.
    Spent,
}

/// Whether a board keeps clear of an edge: it is too far from it at both ends, or stays on one side in some direction.
fn keeps_beside(coverage: &BoardCoverage, edge: &Edge, boards: [&Board; 2], clear_m: f64) -> bool {
    // The displacements from the two ends add up to at most the drift.
    let needed_m = coverage.drift_m() + 2.0 * clear_m;
    let bounds_m = boards.map(|board| edge.board_bound_m(board));
    if bounds_m[0] + bounds_m[1] > needed_m {
        return true;
    }
    let approaches = boards.map(|board| edge.approach(board));
    if approaches[0].distance_m + approaches[1].distance_m > needed_m {
        return true;
    }
    let across = (edge.to - edge.from).perp().normalize_or_zero();
    let away = boards.map(|board| (board.centre - edge.nearest(board.centre)).normalize_or_zero());
    let nearest = approaches.map(|nearest| (nearest.on_board - nearest.on_edge).normalize_or_zero());
    [across, -across, away[0], away[1], nearest[0], nearest[1]].into_iter().any(|direction| {
        direction != DVec2::ZERO && coverage.edge_gap_m([edge.from, edge.to], direction) > clear_m - GRAZE_M
    })
}

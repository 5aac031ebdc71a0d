//! The first board that passes a border of a stage, or comes too near, and the least distance of all boards from a border.
//!
//! A dragon that comes onto the stage has boards that stand outside its outline. A board counts there from the first look at which it
//! keeps clear of the outline. There are [`LOOKS_PER_LINK`] looks per link. Other borders count throughout.
//!
//! *Method.* The pose of a bench depends only on the parameter of its front handle, and all body benches are alike. So a bench
//! behind bench 1 repeats the poses of the bench before it, once its front handle has reached the parameter at which that
//! bench began. Before that it is on ground of its own. The search follows each bench over its own ground, benches 0 and 1 up
//! to the end of the run. A bench is followed at most up to the earliest breach found so far.
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
use crate::dragon::{Board, Dragon, Handle, Spent};
use crate::formation::Formation;
use crate::numerics::turning_point;
use crate::stage::{Border, BorderKind, Edge, GRAZE_M, Stage};

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

/// A board that passes a border, or comes too near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breach {
    /// Travel of the head.
    pub travel_m: f64,
    /// Index of the bench.
    pub bench: usize,
    /// Index of the border on its stage.
    pub border: usize,
    /// The corner of the board that is beyond, the point of the border that is in the board, or the point of the board that is
    /// nearest to the border.
    pub point: DVec2,
}

/// The board that comes nearest to a border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastDistance {
    /// The distance in metres; 0 for a board that touches or passes the border.
    pub distance_m: f64,
    /// Travel of the head.
    pub travel_m: f64,
    /// Index of the bench.
    pub bench: usize,
    /// Index of the border on its stage.
    pub border: usize,
    /// The point of the board that is nearest to the border.
    pub point: DVec2,
}

/// A board that stands beyond a border, or nearer to it than allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing {
    /// Index of the bench, numbered on from dragon to dragon.
    pub bench: usize,
    /// Index of the border on its stage.
    pub border: usize,
    /// Distance of the board from it.
    pub distance_m: f64,
}

/// The boards that are beyond a border of a kind, or nearer to it than `clear_m`, where a formation stands at a place of its course.
///
/// # Panics
/// Panics for a place that is not on the course.
pub fn standing_at(
    formation: &Formation,
    stage: &Stage,
    kind: BorderKind,
    clear_m: f64,
    course_m: f64,
) -> Vec<Standing> {
    let (first, borders) = (stage.first_of(kind), stage.of_kind(kind));
    let boards = if borders.is_empty() { Vec::new() } else { formation.boards_at(course_m) };
    let standing = boards.iter().enumerate().filter_map(|(bench, board)| {
        let border = borders.iter().position(|border| border.breach(board, clear_m).is_some())?;
        Some(Standing { bench, border: first + border, distance_m: borders[border].distance_m(board) })
    });
    standing.collect()
}

/// The board that keeps the greatest distance of all that are within `near_m` of a border, where a formation stands at a place of its
/// course. A board that comes in may be nearer.
///
/// # Panics
/// Panics for a place that is not on the course.
pub fn nearest_to_borders(formation: &Formation, stage: &Stage, course_m: f64, near_m: f64) -> Option<Standing> {
    let kinds = BorderKind::ALL.into_iter();
    let standing = kinds.flat_map(|kind| standing_at(formation, stage, kind, near_m, course_m));
    standing.reduce(|nearest, other| if other.distance_m > nearest.distance_m { other } else { nearest })
}

/// Finds the first time during the whole run at which a board of the dragon is beyond a border of a stage, or nearer to it than
/// `clear_m`.
///
/// # Errors
/// The dragon's meter is spent. The search is then not finished at any travel.
pub fn first_breach(dragon: &Dragon, stage: &Stage, clear_m: f64) -> Result<Option<Breach>, Spent> {
    let (beginning, mut limits) = (parameters(dragon, dragon.start_travel_m()), end_parameters(dragon));
    let mut first: Option<Breach> = None;
    for kind in BorderKind::ALL.into_iter().filter(|&kind| !stage.of_kind(kind).is_empty()) {
        for bench in 0..dragon.dimensions().benches() {
            let search = BenchSearch { dragon, borders: stage.of_kind(kind), clear_m, bench };
            let found = search.first(beginning[bench], limits[bench].min(own_ground(&beginning, bench)));
            dragon.meter().check(dragon.start_travel_m())?;
            let Some([_, later]) = found else { continue };
            let end_m = first.map_or(dragon.end_travel_m(), |first| first.travel_m);
            let travels_m = search.head_travels_m(later.parameter(), [dragon.start_travel_m(), end_m]);
            let (border, point) = later.breach.expect("the board is beyond a border");
            if first.is_none_or(|first| travels_m[1] < first.travel_m) {
                first = Some(Breach { travel_m: travels_m[1], bench, border: stage.first_of(kind) + border, point });
                limits = parameters(dragon, travels_m[1]);
            }
        }
    }
    Ok(first)
}

/// Finds the least distance of a board of the dragon from the borders of a kind during the whole run, and the first bench and travel at
/// which it occurs. `None` without such a border, and if no board counts.
///
/// # Errors
/// The dragon's meter is spent.
pub fn least_distance(dragon: &Dragon, stage: &Stage, kind: BorderKind) -> Result<Option<LeastDistance>, Spent> {
    let borders = stage.of_kind(kind);
    if borders.is_empty() {
        return Ok(None);
    }
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let (beginning, limits) = (parameters(dragon, start_m), end_parameters(dragon));
    let mut least: Option<Nearest> = None;
    for bench in 0..dragon.dimensions().benches() {
        let search = BenchSearch { dragon, borders, clear_m: 0.0, bench };
        search.approach(beginning[bench], limits[bench].min(own_ground(&beginning, bench)), &mut least);
        dragon.meter().check(start_m)?;
    }
    let Some(nearest) = least else { return Ok(None) };
    let bench = nearest.bench;
    if nearest.distance_m == 0.0 {
        let only = Stage::new(borders.to_vec(), 0.0);
        if let Some(Breach { travel_m, bench, border, point }) = first_breach(dragon, &only, 0.0)? {
            let border = stage.first_of(kind) + border;
            return Ok(Some(LeastDistance { distance_m: 0.0, travel_m, bench, border, point }));
        }
    }
    let search = BenchSearch { dragon, borders, clear_m: 0.0, bench };
    let [_, travel_m] = search.head_travels_m(nearest.parameter, [start_m, end_m]);
    let point = borders[nearest.border].nearest_point(&nearest.board);
    let border = stage.first_of(kind) + nearest.border;
    Ok(Some(LeastDistance { distance_m: nearest.distance_m, travel_m, bench, border, point }))
}

/// Parameters of all handles at a travel of the head.
pub(super) fn parameters(dragon: &Dragon, travel_m: f64) -> Vec<f64> {
    dragon.chain(travel_m).expect("within the run").map(|handle| handle.parameter).collect()
}

fn end_parameters(dragon: &Dragon) -> Vec<f64> {
    parameters(dragon, dragon.end_travel_m())
}

/// The parameter up to which a bench does not repeat the poses of the bench before it.
pub(super) fn own_ground(beginning: &[f64], bench: usize) -> f64 {
    if bench < 2 { f64::INFINITY } else { beginning[bench - 1] }
}

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
struct Nearest {
    distance_m: f64,
    bench: usize,
    parameter: f64,
    border: usize,
    board: Board,
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
    fn approach(&self, from: f64, to: f64, nearest: &mut Option<Nearest>) {
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

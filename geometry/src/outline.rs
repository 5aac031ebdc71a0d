//! The outline of a stage: a polygon that no board should leave.

use glam::DVec2;
use thiserror::Error;

use crate::dragon::Board;
use crate::number::Number;

/// Largest depth beyond the outline that is only rounding, in metres. A board that slides along an edge does not leave the stage.
pub(crate) const GRAZE_M: f64 = 1e-9;
/// Least area of an outline, in m².
const LEAST_AREA_M2: f64 = 1e-6;

/// A simple polygon with either orientation.
///
/// ```
/// use bench_dragon_geometry::{dragon::Board, outline::Outline};
/// use glam::DVec2;
///
/// let stage = Outline::new(&[[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [0.0, 8.0]])?;
/// let board = |x| Board::from_handles(DVec2::new(x, 4.0), DVec2::new(x - 2.0, 4.0), 2.4, 0.3);
/// assert_eq!(stage.leaving_point(&board(9.0)), None);
/// assert!((stage.leaving_point(&board(9.9)).unwrap().x - 10.1).abs() < 1e-12);
/// # Ok::<(), bench_dragon_geometry::outline::OutlineError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Outline {
    corners: Vec<DVec2>,
}

/// Reason why an outline is invalid. Points are numbered from 1.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum OutlineError {
    /// There are too few or too many points.
    #[error("has {points} points, must have from 3 to {}", Outline::MAX_POINTS)]
    Points {
        /// Number of points.
        points: usize,
    },
    /// A coordinate is out of range.
    #[error("point {point} has the coordinate {}, must be from -{max} to {max}", Number(*value), max = Outline::MAX_M)]
    Coordinate {
        /// Number of the point.
        point: usize,
        /// The coordinate in metres.
        value: f64,
    },
    /// Two neighbouring points are the same.
    #[error("points {first} and {second} are the same, must differ: leave out one of them")]
    Repeated {
        /// Number of the first point.
        first: usize,
        /// Number of the second point: the next one, or the last.
        second: usize,
    },
    /// Two edges cross or touch.
    #[error("crosses or touches itself: the edges from points {first} and {second} meet, must not")]
    Crossing {
        /// Number of the point at which the first edge begins.
        first: usize,
        /// Number of the point at which the second edge begins.
        second: usize,
    },
    /// All points lie on a line.
    #[error("encloses {} m², must enclose more than {LEAST_AREA_M2} m²", Number(*area_m2))]
    Area {
        /// The enclosed area.
        area_m2: f64,
    },
}

/// An edge of an outline.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub(crate) from: DVec2,
    pub(crate) to: DVec2,
}

impl Outline {
    /// Greatest number of points.
    pub const MAX_POINTS: usize = 256;
    /// Greatest coordinate, in metres.
    pub const MAX_M: f64 = 1_000_000.0;

    /// The polygon with these corners, in metres.
    ///
    /// # Errors
    /// It needs 3 to [`MAX_POINTS`](Self::MAX_POINTS) points in range, an area, and edges that meet only at their common
    /// corners.
    pub fn new(points_m: &[[f64; 2]]) -> Result<Self, OutlineError> {
        let points = points_m.len();
        if !(3..=Self::MAX_POINTS).contains(&points) {
            return Err(OutlineError::Points { points });
        }
        for (point, coordinates) in (1..).zip(points_m) {
            let outlying = coordinates.iter().find(|value| value.is_nan() || value.abs() > Self::MAX_M);
            outlying.map_or(Ok(()), |&value| Err(OutlineError::Coordinate { point, value }))?;
        }
        let outline = Self { corners: points_m.iter().map(|&point| point.into()).collect() };
        outline.check_repeated()?;
        outline.check_crossings()?;
        let area_m2 = outline.area_m2();
        if area_m2 > LEAST_AREA_M2 { Ok(outline) } else { Err(OutlineError::Area { area_m2 }) }
    }

    /// The corners, in the given order.
    pub fn corners(&self) -> &[DVec2] {
        &self.corners
    }

    /// The point of a board that is furthest outside, or a point of the outline in the board; `None` if the board is inside.
    ///
    /// A board is inside if its corners are, and no edge of the outline enters it.
    pub fn leaving_point(&self, board: &Board) -> Option<DVec2> {
        let depth_m = |corner: DVec2| if self.contains(corner) { 0.0 } else { self.distance_m(corner) };
        let corners = board.corners().map(|corner| (depth_m(corner), corner));
        let furthest =
            corners.into_iter().reduce(|furthest, corner| if corner.0 > furthest.0 { corner } else { furthest });
        let outside = furthest.filter(|(depth_m, _)| *depth_m > GRAZE_M).map(|(_, corner)| corner);
        outside.or_else(|| self.edges().find_map(|edge| edge.middle_in(board)))
    }

    /// Whether a point lies inside, by the number of edges that a ray from the point crosses. On an edge: either.
    pub fn contains(&self, point: DVec2) -> bool {
        let crosses = |edge: &Edge| {
            let Edge { from, to } = *edge;
            let is_left = (to - from).perp_dot(point - from) > 0.0;
            (from.y <= point.y) != (to.y <= point.y) && is_left == (to.y > from.y)
        };
        self.edges().filter(crosses).count() % 2 == 1
    }

    /// Distance of a point from the outline.
    pub fn distance_m(&self, point: DVec2) -> f64 {
        self.edges().map(|edge| edge.nearest(point).distance(point)).fold(f64::INFINITY, f64::min)
    }

    pub(crate) fn edges(&self) -> impl Iterator<Item = Edge> {
        let next = self.corners.iter().cycle().skip(1);
        self.corners.iter().zip(next).map(|(&from, &to)| Edge { from, to })
    }

    fn area_m2(&self) -> f64 {
        let origin = self.corners[0];
        let doubled: f64 = self.edges().map(|edge| (edge.from - origin).perp_dot(edge.to - origin)).sum();
        0.5 * doubled.abs()
    }

    /// Checks that each edge has a length.
    fn check_repeated(&self) -> Result<(), OutlineError> {
        let count = self.corners.len();
        match self.edges().position(|edge| edge.from.distance(edge.to) <= GRAZE_M) {
            Some(last) if last + 1 == count => Err(OutlineError::Repeated { first: 1, second: count }),
            Some(i) => Err(OutlineError::Repeated { first: i + 1, second: i + 2 }),
            None => Ok(()),
        }
    }

    /// Checks that edges meet only at their common corners.
    fn check_crossings(&self) -> Result<(), OutlineError> {
        let edges: Vec<Edge> = self.edges().collect();
        for (second, other) in edges.iter().enumerate() {
            for (first, edge) in edges[..second].iter().enumerate() {
                let is_closing = first == 0 && second == edges.len() - 1;
                let meets = match (second - first, is_closing) {
                    (1, _) => edge.folds_onto(other),
                    (_, true) => other.folds_onto(edge),
                    _ => edge.touches(other),
                };
                if meets {
                    return Err(OutlineError::Crossing { first: first + 1, second: second + 1 });
                }
            }
        }
        Ok(())
    }
}

impl Edge {
    pub(crate) fn nearest(&self, point: DVec2) -> DVec2 {
        let along = self.to - self.from;
        let length2 = along.length_squared();
        let share = if length2 > 0.0 { ((point - self.from).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
        self.from + share * along
    }

    /// Distance of the edge from a board; 0 if they have a common point.
    pub(crate) fn board_distance_m(&self, board: &Board) -> f64 {
        if self.part_in(board, 0.0).is_some() {
            return 0.0;
        }
        let corners = board.corners().map(|corner| self.nearest(corner).distance(corner));
        let ends = [self.from, self.to].map(|end| board.clamp(end).distance(end));
        corners.into_iter().chain(ends).fold(f64::INFINITY, f64::min)
    }

    /// The middle of the part of the edge that is more than [`GRAZE_M`] deep in a board.
    fn middle_in(&self, board: &Board) -> Option<DVec2> {
        let [from, to] = self.part_in(board, GRAZE_M)?;
        Some(self.from.lerp(self.to, 0.5 * (from + to)))
    }

    /// The part of the edge that is at least `depth_m` deep in a board, as shares of the edge (Liang and Barsky 1984, ACM
    /// Transactions on Graphics 3).
    fn part_in(&self, board: &Board, depth_m: f64) -> Option<[f64; 2]> {
        let (begin, end) = (board.local(self.from), board.local(self.to));
        let (step, half) = (end - begin, DVec2::new(board.half_length, board.half_width) - depth_m);
        let mut part = [0.0_f64, 1.0];
        for (begin, step, half) in [(begin.x, step.x, half.x), (begin.y, step.y, half.y)] {
            if step == 0.0 {
                if begin.abs() > half {
                    return None;
                }
                continue;
            }
            let (enters, leaves) = ((-half.copysign(step) - begin) / step, (half.copysign(step) - begin) / step);
            part = [part[0].max(enters), part[1].min(leaves)];
        }
        (part[0] <= part[1]).then_some(part)
    }

    /// Whether two edges without a common corner have a common point, up to [`GRAZE_M`]. Either an end of one is on the other,
    /// or the ends of each are clearly on different sides of the other.
    fn touches(&self, other: &Self) -> bool {
        let on_edge = |edge: &Self, point: DVec2| edge.nearest(point).distance(point) <= GRAZE_M;
        let has_end_on = |one: &Self, edge: &Self| on_edge(edge, one.from) || on_edge(edge, one.to);
        let is_on_both_sides = |one: &Self, edge: &Self| {
            let across = (edge.to - edge.from).perp().normalize_or_zero();
            let [from_m, to_m] = [one.from, one.to].map(|end| across.dot(end - edge.from));
            from_m.min(to_m) < -GRAZE_M && from_m.max(to_m) > GRAZE_M
        };
        has_end_on(self, other)
            || has_end_on(other, self)
            || is_on_both_sides(self, other) && is_on_both_sides(other, self)
    }

    /// Whether the next edge runs back along this one.
    fn folds_onto(&self, next: &Self) -> bool {
        next.nearest(self.from).distance(self.from) <= GRAZE_M || self.nearest(next.to).distance(next.to) <= GRAZE_M
    }
}

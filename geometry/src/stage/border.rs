//! A border of a stage: an edge that no board should pass, or come near.

use glam::DVec2;

use super::edge::{Edge, EdgeApproach, GRAZE_M, least_distance_m, surround};
use super::outline::{Outline, OutlineError, points_in_range};
use crate::dragon::Board;

/// What a border is, and so which side of it boards belong on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum BorderKind {
    /// The outline of the stage: boards belong inside.
    Outline,
    /// The edge of an area that no board may enter.
    KeepOut,
    /// A line that people stand behind: no board may cross it.
    Crowd,
}

impl BorderKind {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::Outline, Self::KeepOut, Self::Crowd];
}

/// A border of a stage.
///
/// ```
/// use bench_dragon_geometry::{dragon::Board, stage::{Border, Outline}};
/// use glam::DVec2;
///
/// let stage = Border::outline(Outline::new(&[[0.0, 0.0], [10.0, 0.0], [10.0, 8.0], [0.0, 8.0]])?);
/// let board = |x| Board::from_handles(DVec2::new(x, 4.0), DVec2::new(x - 2.0, 4.0), 2.4, 0.3);
/// assert_eq!(stage.breach(&board(9.0), 0.0), None);
/// assert!((stage.breach(&board(9.9), 0.0).unwrap().x - 10.1).abs() < 1e-12);
/// assert!((stage.distance_m(&board(9.0)) - 0.8).abs() < 1e-12 && stage.breach(&board(9.0), 1.0).is_some());
/// # Ok::<(), bench_dragon_geometry::stage::OutlineError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Border {
    kind: BorderKind,
    corners: Vec<DVec2>,
    /// The rectangle round the corners: its lowest and its highest coordinates.
    bounds: [DVec2; 2],
}

impl Border {
    /// The outline of a stage.
    pub fn outline(outline: Outline) -> Self {
        Self::of(BorderKind::Outline, outline.into_corners())
    }

    /// The edge of an area that no board may enter.
    pub fn keep_out(area: Outline) -> Self {
        Self::of(BorderKind::KeepOut, area.into_corners())
    }

    /// A line through these points, in metres, that people stand behind.
    ///
    /// # Errors
    /// It needs 2 to [`Outline::MAX_POINTS`] points in range, of which no two neighbours are the same.
    pub fn crowd(points_m: &[[f64; 2]]) -> Result<Self, OutlineError> {
        let points = points_m.len();
        if !(2..=Outline::MAX_POINTS).contains(&points) {
            return Err(OutlineError::LinePoints { points });
        }
        let line = Self::of(BorderKind::Crowd, points_in_range(points_m)?);
        let repeated = line.edges().position(|edge| edge.from.distance(edge.to) <= GRAZE_M);
        repeated.map_or(Ok(line), |i| Err(OutlineError::Repeated { first: i + 1, second: i + 2 }))
    }

    fn of(kind: BorderKind, corners: Vec<DVec2>) -> Self {
        let low = corners.iter().copied().fold(DVec2::INFINITY, DVec2::min);
        let high = corners.iter().copied().fold(DVec2::NEG_INFINITY, DVec2::max);
        Self { kind, corners, bounds: [low, high] }
    }

    /// What the border is.
    pub fn kind(&self) -> BorderKind {
        self.kind
    }

    /// The corners in the given order. The last one of an outline and of an area is joined to the first one.
    pub fn corners(&self) -> &[DVec2] {
        &self.corners
    }

    /// Distance of a board from the border; 0 if the board touches it, or is on its wrong side.
    pub fn distance_m(&self, board: &Board) -> f64 {
        let nearest = self.approach(board);
        let is_wrong = nearest.distance_m > 0.0 && self.is_wrong_side(board.centre);
        if is_wrong { 0.0 } else { nearest.distance_m }
    }

    /// Distance of a point from the nearest edge.
    pub fn point_distance_m(&self, point: DVec2) -> f64 {
        least_distance_m(self.edges(), point)
    }

    /// The point of a board that is nearest to the border.
    pub fn nearest_point(&self, board: &Board) -> DVec2 {
        self.approach(board).on_board
    }

    /// The point of a board that is beyond the border, or nearer to it than `clear_m`. `None` for a board that keeps clear.
    ///
    /// Of a clearance of 0 it is the corner that is furthest beyond the border, or a point of the border in the board. A board that is
    /// beyond by no more than 10⁻⁹ m keeps clear.
    pub fn breach(&self, board: &Board, clear_m: f64) -> Option<DVec2> {
        if self.kind != BorderKind::Outline && self.is_beyond(board, clear_m) {
            return None;
        }
        let nearest = self.approach(board);
        let near = (nearest.distance_m < clear_m - GRAZE_M).then_some(nearest.on_board);
        let is_on_right_side = nearest.distance_m > 0.0 && !self.is_wrong_side(board.centre);
        if is_on_right_side { near } else { self.point_beyond(board).or(near) }
    }

    /// Distance that the centre of a board may move, however it turns, with the board still further than `clear_m` from the border. It
    /// is 0 or less if nothing is known.
    pub fn slack_m(&self, board: &Board, clear_m: f64) -> f64 {
        let bound_m = self.edges().map(|edge| edge.board_bound_m(board)).fold(f64::INFINITY, f64::min);
        if self.is_wrong_side(board.centre) { 0.0 } else { bound_m - clear_m }
    }

    /// Whether a board is provably further than `reach_m` from all corners and edges.
    pub(crate) fn is_beyond(&self, board: &Board, reach_m: f64) -> bool {
        let [low, high] = self.bounds;
        let nearest = board.centre.clamp(low, high);
        nearest.distance(board.centre) > board.radius_m() + reach_m
    }

    /// The edges. The outline of a stage and an area are closed.
    pub(crate) fn edges(&self) -> impl Iterator<Item = Edge> {
        let count = self.corners.len();
        let edges = if self.kind == BorderKind::Crowd { count - 1 } else { count };
        (0..edges).map(move |i| Edge { from: self.corners[i], to: self.corners[(i + 1) % count] })
    }

    fn approach(&self, board: &Board) -> EdgeApproach {
        let mut nearest = EdgeApproach { distance_m: f64::INFINITY, on_edge: DVec2::NAN, on_board: DVec2::NAN };
        for edge in self.edges() {
            if edge.board_bound_m(board) < nearest.distance_m {
                nearest = nearest.nearer(edge.approach(board));
            }
        }
        nearest
    }

    /// The corner of a board that is furthest beyond the border, or the middle of a part of the border in the board.
    fn point_beyond(&self, board: &Board) -> Option<DVec2> {
        let depth_m =
            |corner: DVec2| if self.is_wrong_side(corner) { least_distance_m(self.edges(), corner) } else { 0.0 };
        let corners = board.corners().map(|corner| (depth_m(corner), corner));
        let furthest =
            corners.into_iter().reduce(|furthest, corner| if corner.0 > furthest.0 { corner } else { furthest });
        let beyond = furthest.filter(|(depth_m, _)| *depth_m > GRAZE_M).map(|(_, corner)| corner);
        beyond.or_else(|| self.edges().find_map(|edge| edge.middle_in(board)))
    }

    /// Whether a point is on the wrong side. A line has none.
    fn is_wrong_side(&self, point: DVec2) -> bool {
        match self.kind {
            BorderKind::Outline => !surround(self.edges(), point),
            BorderKind::KeepOut => surround(self.edges(), point),
            BorderKind::Crowd => false,
        }
    }
}

//! A straight edge of a border, and its distance from a board.

use glam::DVec2;

use crate::dragon::Board;

/// Largest depth beyond a border that is only rounding, in metres. A board that slides along an edge does not pass it.
pub(crate) const GRAZE_M: f64 = 1e-9;

/// An edge of a border.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub(crate) from: DVec2,
    pub(crate) to: DVec2,
}

/// Where an edge and a board are nearest to each other.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EdgeApproach {
    pub(crate) distance_m: f64,
    pub(crate) on_edge: DVec2,
    pub(crate) on_board: DVec2,
}

impl EdgeApproach {
    fn between(on_edge: DVec2, on_board: DVec2) -> Self {
        Self { distance_m: on_edge.distance(on_board), on_edge, on_board }
    }

    pub(super) fn nearer(self, other: Self) -> Self {
        if other.distance_m < self.distance_m { other } else { self }
    }
}

impl Edge {
    pub(crate) fn nearest(&self, point: DVec2) -> DVec2 {
        let along = self.to - self.from;
        let length2 = along.length_squared();
        let share = if length2 > 0.0 { ((point - self.from).dot(along) / length2).clamp(0.0, 1.0) } else { 0.0 };
        self.from + share * along
    }

    /// Distance of the edge from a board, its nearest point, and that of the board. If they have a common point, the distance is 0
    /// and both points are one that they have in common.
    pub(crate) fn approach(&self, board: &Board) -> EdgeApproach {
        if let Some([from, to]) = self.part_in(board, 0.0) {
            let common = self.from.lerp(self.to, 0.5 * (from + to));
            return EdgeApproach { distance_m: 0.0, on_edge: common, on_board: common };
        }
        let corners = board.corners().map(|corner| EdgeApproach::between(self.nearest(corner), corner));
        let ends = [self.from, self.to].map(|end| EdgeApproach::between(end, board.clamp(end)));
        corners.into_iter().chain(ends).reduce(EdgeApproach::nearer).expect("a board has corners")
    }

    /// A lower bound on the distance of the edge from a board, below 0 if it says nothing.
    pub(crate) fn board_bound_m(&self, board: &Board) -> f64 {
        self.nearest(board.centre).distance(board.centre) - board.radius_m()
    }

    /// The middle of the part of the edge that is more than [`GRAZE_M`] deep in a board.
    pub(super) fn middle_in(&self, board: &Board) -> Option<DVec2> {
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
    pub(super) fn touches(&self, other: &Self) -> bool {
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
    pub(super) fn folds_onto(&self, next: &Self) -> bool {
        next.nearest(self.from).distance(self.from) <= GRAZE_M || self.nearest(next.to).distance(next.to) <= GRAZE_M
    }
}

/// Whether closed edges surround a point, by the number of them that a ray from the point crosses. On an edge: either.
pub(super) fn surround(edges: impl Iterator<Item = Edge>, point: DVec2) -> bool {
    let crosses = |Edge { from, to }: &Edge| {
        let is_left = (to - from).perp_dot(point - from) > 0.0;
        (from.y <= point.y) != (to.y <= point.y) && is_left == (to.y > from.y)
    };
    edges.filter(crosses).count() % 2 == 1
}

/// Distance of a point from the nearest edge.
pub(super) fn least_distance_m(edges: impl Iterator<Item = Edge>, point: DVec2) -> f64 {
    edges.map(|edge| edge.nearest(point).distance(point)).fold(f64::INFINITY, f64::min)
}

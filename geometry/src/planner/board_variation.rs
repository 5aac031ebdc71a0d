//! Change of the clearance of two boards when both move and grow a little.
//!
//! The clearance of two rectangles is the distance, along a direction, between a point of one and a point of the other. These
//! are a corner and an edge, with the direction across that edge, or two corners, with the direction along their connection. As
//! long as the same points decide the clearance, its change is the displacement of the points along the direction. The points
//! stay fixed in their growing boards. The rotation of the direction has no first-order effect. If two such pairs of points
//! tie, the clearance has a kink and no derivative.

use glam::DVec2;
use thiserror::Error;

use super::Change;
use super::chain_variation::HandleVariation;
use crate::dragon::{Board, Dragon};

/// Largest difference of clearances that count as equal, in metres. Contacts are exact to about 10⁻¹¹ m.
pub(super) const TIE_M: f64 = 1e-9;

/// Reason why a value has no derivative.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("{0}")]
pub struct Undefined(pub &'static str);

/// Change of a board per unit of a change. The default is a board that stays as it is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BoardVariation {
    centre: DVec2,
    turn: f64,
    half_length: f64,
    half_width: f64,
}

impl BoardVariation {
    /// The change of a bench's board, seen from above, from the changes of its handles.
    ///
    /// On ground, a share q of the link d is seen from above, and the same share of the board's length. q changes by
    /// (h·Δ − q·∂d) / d, where h is the heading and Δ the difference of the handles' displacements in the plan.
    pub fn new(dragon: &Dragon, bench: usize, board: &Board, ends: &[HandleVariation], change: Change) -> Self {
        let (front, rear) = (ends[0].position, ends[1].position);
        let (link_m, share) = (dragon.dimensions().link_m(bench), dragon.seen_share(bench, board));
        let mut half_length = 0.5 * share * change.length(bench);
        if dragon.route().is_on_ground() {
            let pitched = (board.heading.dot(front - rear) - share * change.link(bench)) / link_m;
            half_length += 0.5 * dragon.dimensions().length_m(bench) * pitched;
        }
        Self {
            centre: 0.5 * (front + rear),
            turn: board.heading.perp_dot(front - rear) / (share * link_m),
            half_length,
            half_width: 0.5 * change.width(),
        }
    }

    /// Change of a point that keeps its share of the half length and the half width.
    fn point(&self, board: &Board, shares: DVec2) -> DVec2 {
        let arm = board.heading.rotate(shares * DVec2::new(board.half_length, board.half_width));
        let growth = board.heading.rotate(shares * DVec2::new(self.half_length, self.half_width));
        self.centre + self.turn * arm.perp() + growth
    }
}

/// The two points that decide the clearance of two boards, and the direction from the first point to the second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Witness {
    direction: DVec2,
    /// Coordinates of the points, in halves of the boards' lengths and widths.
    shares: [DVec2; 2],
}

impl Witness {
    /// Finds the points that decide the clearance of two boards.
    ///
    /// # Errors
    /// Other points decide the clearance as well.
    pub fn of(first: &Board, second: &Board) -> Result<Self, Undefined> {
        let boards = [first, second];
        let mut gaps: Vec<EdgeGap> =
            [0, 1].into_iter().flat_map(|owner| EdgeGap::all(boards[owner], boards[1 - owner], owner)).collect();
        gaps.sort_unstable_by(|a, b| b.gap_m.total_cmp(&a.gap_m));
        let gap = gaps[0];
        let beyond_m = gap.beyond_end_m(boards[gap.owner]);
        if gap.gap_m > TIE_M && beyond_m > 0.0 {
            return Ok(Self::of_corners(first, second));
        }
        if gap.next_corner_m - gap.gap_m < TIE_M {
            return Err(Undefined("the clearance has a kink: two edges are parallel"));
        }
        if gap.gap_m - gaps[1].gap_m < TIE_M || (gap.gap_m > -TIE_M && beyond_m > -TIE_M) {
            return Err(Undefined("the clearance has a kink: a corner meets a corner"));
        }
        Ok(gap.witness(boards))
    }

    /// Growth of the clearance per unit of the change.
    pub fn variation(&self, boards: [&Board; 2], variations: [&BoardVariation; 2]) -> f64 {
        let [first, second] = [0, 1].map(|i| variations[i].point(boards[i], self.shares[i]));
        self.direction.dot(second - first)
    }

    /// Whether the same corners and edges decide the clearance.
    pub fn decides_like(&self, other: &Self) -> bool {
        let end = |share: f64| if share.abs() < 1.0 - f64::EPSILON.sqrt() { 0.0 } else { share.signum() };
        let ends = |witness: &Self| witness.shares.map(|shares| DVec2::new(end(shares.x), end(shares.y)));
        ends(self) == ends(other)
    }

    fn of_corners(first: &Board, second: &Board) -> Self {
        let distance_m = |&[i, j]: &[usize; 2]| first.corners()[i].distance(second.corners()[j]);
        let pairs = (0..4).flat_map(|i| (0..4).map(move |j| [i, j]));
        let [i, j] = pairs.min_by(|a, b| distance_m(a).total_cmp(&distance_m(b))).expect("boards have corners");
        Self {
            direction: (second.corners()[j] - first.corners()[i]).normalize(),
            shares: [shares(first, first.corners()[i]), shares(second, second.corners()[j])],
        }
    }
}

/// The gap between the line of one edge and the other board.
#[derive(Clone, Copy, Debug)]
struct EdgeGap {
    /// Index of the board that has the edge.
    owner: usize,
    normal: DVec2,
    /// Distance from the line to the nearest corner, negative behind the line.
    gap_m: f64,
    corner: DVec2,
    /// Distance from the line to the second nearest corner.
    next_corner_m: f64,
}

impl EdgeGap {
    fn all(board: &Board, other: &Board, owner: usize) -> [Self; 4] {
        let (along, across) = (board.heading, board.heading.perp());
        [
            (along, board.half_length),
            (-along, board.half_length),
            (across, board.half_width),
            (-across, board.half_width),
        ]
        .map(|(normal, half_size_m)| {
            let height_m = |corner: &DVec2| normal.dot(*corner - board.centre) - half_size_m;
            let mut corners = other.corners();
            corners.sort_unstable_by(|a, b| height_m(a).total_cmp(&height_m(b)));
            let [corner, next, ..] = corners;
            Self { owner, normal, gap_m: height_m(&corner), corner, next_corner_m: height_m(&next) }
        })
    }

    fn foot(&self) -> DVec2 {
        self.corner - self.gap_m * self.normal
    }

    /// Distance of the corner's foot beyond the end of the edge, negative on the edge.
    fn beyond_end_m(&self, board: &Board) -> f64 {
        let foot = board.local(self.foot()).abs();
        let is_end = self.normal.dot(board.heading).abs() > 0.5;
        if is_end { foot.y - board.half_width } else { foot.x - board.half_length }
    }

    fn witness(&self, boards: [&Board; 2]) -> Witness {
        let edge = shares(boards[self.owner], self.foot());
        let corner = shares(boards[1 - self.owner], self.corner);
        if self.owner == 0 {
            Witness { direction: self.normal, shares: [edge, corner] }
        } else {
            Witness { direction: -self.normal, shares: [corner, edge] }
        }
    }
}

/// Coordinates of a point, in halves of a board's length and width.
fn shares(board: &Board, point: DVec2) -> DVec2 {
    board.local(point) / DVec2::new(board.half_length, board.half_width)
}

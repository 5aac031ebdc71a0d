//! The area that a board may cover between two travels.
//!
//! The board is known exactly at both ends of the interval. The motion of its link in between is bounded (see `link_motion` for
//! the terms). Let ℓ be the arc that the front handle walks on the interval. Two bounds follow:
//!
//! - A corner is a handle plus a vector of length ρ fixed to the board: |corner''| ≤ max(|p''|, |r''|) + ρ·|u''| =: A. So the
//!   corner stays within A·ℓ²/8 of the straight line between its ends. The board stays within the same distance of the convex
//!   hull of its two ends.
//! - With its sides moved out by that distance at both ends, the board stays in their convex hull. A point of this hull is a mean of two
//!   points x and y of the board, one at each end, with the weights 1 − s and s. It differs from the same mean of the point of the
//!   board that has the mean coordinates by s·(1 − s)·|(M₁ − M₂)(x − y)|, where M maps coordinates in the board to the plan. That is at
//!   most ½·(|Δ(½L·u)| + ½W·|Δu|), for a board of length L and width W.
//! - Relative to the board's centre m, a fixed point x has the coordinates u·(x − m) and u⊥·(x − m). Their second derivatives
//!   are at most |m''| + 2·|u'|·|m'| + |u''|·|x − m| =: E. So a point that is E·ℓ²/8 deep in the board at both ends is in the
//!   board on the whole interval. On ground, the board is also seen to grow and to shrink.

use std::f64::consts::SQRT_2;

use glam::DVec2;

use super::link_motion::LinkMotion;
use super::pose::{BenchPose, drift_m};
use crate::dragon::Dragon;
use crate::dragon::board::Board;

/// The motion of one board over an interval.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoardCoverage {
    ends: [Board; 2],
    /// The corners at the first end, then those at the second end.
    corners: [DVec2; 8],
    /// Largest distance of a corner from the straight line between its ends; infinite if the interval is too long for the
    /// bound.
    bulge_m: f64,
    /// Depth at both ends that keeps a point in the board on the whole interval; infinite if the interval is too long for the
    /// bound.
    skin_m: f64,
    /// Largest distance of a point of the board from its position at either end.
    drift_m: f64,
}

impl BoardCoverage {
    /// The motion of a bench's board from one pose to a later one.
    pub(super) fn new(dragon: &Dragon, bench: usize, earlier: &BenchPose, later: &BenchPose) -> Self {
        let walk_m = later.front_travel_m - earlier.front_travel_m;
        let motion = LinkMotion::new(dragon, bench, earlier, later);
        let drift_m = drift_m(dragon, bench, &earlier.board, earlier.walks_m(later));
        // A, and E for a point at most `distance_m` from the board's centre.
        let heading = motion.heading();
        let corner = motion.acceleration + dragon.corner_arm_m() * heading.turn_rate;
        let distance_m = earlier.board.radius_m() + drift_m;
        let fixed_point = motion.acceleration
            + 2.0 * heading.turn * motion.ratio
            + distance_m * heading.turn_rate
            + 0.5 * dragon.dimensions().length_m(bench) * heading.growth_rate;
        let [a, b] = [earlier, later].map(|bench_pose| bench_pose.board.corners());
        Self {
            ends: [earlier.board, later.board],
            corners: [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]],
            bulge_m: 0.125 * corner * walk_m * walk_m,
            skin_m: 0.125 * fixed_point * walk_m * walk_m,
            drift_m,
        }
    }

    /// A lower bound on the clearance of two boards over the interval, from their clearances at both ends. The clearance
    /// changes by at most the sum of the boards' displacements. The displacements from the two ends add up to at most the drift
    /// of each board.
    pub(super) fn least_between_m(&self, other: &Self, clearances_m: [f64; 2]) -> f64 {
        0.5 * (clearances_m[0] + clearances_m[1] - (self.drift_m + other.drift_m))
    }

    /// Largest distance of a point of the board from its position at either end, in metres.
    pub(super) fn drift_m(&self) -> f64 {
        self.drift_m
    }

    /// Corners whose convex hull has every point that the board covers on the interval.
    pub(super) fn covering_corners(&self) -> [DVec2; 8] {
        let [a, b] = self.ends.map(|board| {
            let [half_length, half_width] = [board.half_length, board.half_width].map(|half_m| half_m + self.bulge_m);
            Board { half_length, half_width, ..board }.corners()
        });
        [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]]
    }

    /// Bound on the distance of a point of that hull from the nearest point that the board covers on the interval.
    pub(super) fn hull_excess_m(&self) -> f64 {
        let [a, b] = &self.ends;
        let along_m = (a.half_length * a.heading).distance(b.half_length * b.heading);
        let across_m = a.half_width * a.heading.distance(b.heading);
        // A corner of a board moves out by √2 times as much as its sides.
        0.5 * (along_m + across_m) + (1.0 + SQRT_2) * self.bulge_m
    }

    /// The least gap from a straight edge to this board in a direction, with the board anywhere in its motion.
    pub(super) fn edge_gap_m(&self, edge: [DVec2; 2], direction: DVec2) -> f64 {
        let near = edge[0].dot(direction).max(edge[1].dot(direction));
        let far = self.corners.iter().map(|corner| corner.dot(direction)).fold(f64::INFINITY, f64::min);
        far - near - self.bulge_m
    }

    /// The least gap from this board to the other one in a direction, with each board anywhere in its motion. It is a lower
    /// bound on the clearance.
    pub(super) fn gap_m(&self, other: &Self, direction: DVec2) -> f64 {
        let near = self.corners.iter().map(|corner| corner.dot(direction)).fold(f64::NEG_INFINITY, f64::max);
        let far = other.corners.iter().map(|corner| corner.dot(direction)).fold(f64::INFINITY, f64::min);
        far - near - (self.bulge_m + other.bulge_m)
    }

    /// Whether two boards stay within a clearance with each board anywhere in its motion. At one end they are within it by
    /// `depth_m`; for a clearance of 0, that is the depth of the overlap. They stay if they cannot move that far, or if one
    /// board always contains a corner of the other.
    pub(super) fn stays_touching(&self, other: &Self, depth_m: f64) -> bool {
        depth_m > self.drift_m + other.drift_m || self.holds_a_corner(other) || other.holds_a_corner(self)
    }

    fn holds_a_corner(&self, other: &Self) -> bool {
        let needed_m = self.skin_m + other.bulge_m;
        let held = |corner: DVec2| self.ends.iter().all(|board| board.depth_m(corner) >= needed_m);
        (0..4).any(|corner| held(other.corners[corner]) && held(other.corners[corner + 4]))
    }
}

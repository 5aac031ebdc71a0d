//! What a board may cover on the way from one travel to a later one.
//!
//! Both ends of the way are known exactly, and how its link moves in between is bounded (see `link_motion`, whose words
//! are used here). From that follow two bounds, ℓ being the arc that the front handle walks on the whole way:
//!
//! - a corner is a handle plus a vector of length ρ fixed to the board, |corner''| ≤ max(|p''|, |r''|) + ρ·|u''| =: A,
//!   so it stays within A·ℓ²/8 of the segment between its ends, and the board within as much of the hull of its two
//!   ends;
//! - a fixed point x, seen from the board's centre m, has the coordinates u·(x − m) and u⊥·(x − m), whose second
//!   derivatives are at most |m''| + 2·|u'|·|m'| + |u''|·|x − m| =: E, so a point E·ℓ²/8 deep in the board at both ends
//!   is in it all the way.

use glam::DVec2;

use super::link_motion::LinkMotion;
use super::pose::BenchPose;
use crate::dragon::Dragon;
use crate::dragon::board::Board;

/// The way of one board.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoardCoverage {
    ends: [Board; 2],
    /// The corners at the first end, then those at the second.
    corners: [DVec2; 8],
    /// How far a corner may leave the segment between its ends; infinite if the way is too long to tell.
    bulge_m: f64,
    /// How deep a point must be in the board at both ends to be in it all the way; infinite as well.
    skin_m: f64,
    /// How far a point of the board may get from where it is at either end.
    drift_m: f64,
}

impl BoardCoverage {
    /// The way of a bench from one pose to a later one.
    pub(super) fn new(dragon: &Dragon, bench: usize, earlier: &BenchPose, later: &BenchPose) -> Self {
        let walk_m = later.front_travel_m - earlier.front_travel_m;
        let motion = LinkMotion::new(dragon, bench, earlier, later);
        let drift_m = drift_m(dragon, bench, earlier.walks_m(later));
        // A, and E for a point at most so far from the board's centre.
        let corner = motion.acceleration + dragon.dimensions().overhang_m() * motion.turn_rate;
        let distance_m = earlier.board.radius_m() + drift_m;
        let fixed_point = motion.acceleration + 2.0 * motion.turn * motion.ratio + distance_m * motion.turn_rate;
        let [a, b] = [earlier, later].map(|bench_pose| bench_pose.board.corners());
        Self {
            ends: [earlier.board, later.board],
            corners: [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]],
            bulge_m: 0.125 * corner * walk_m * walk_m,
            skin_m: 0.125 * fixed_point * walk_m * walk_m,
            drift_m,
        }
    }

    /// A bound that the clearance of two boards does not fall under on their ways, from what it is at both ends: it changes
    /// by at most as much as they move, and what they move towards the one end is left for the other.
    pub(super) fn least_between_m(&self, other: &Self, clearances_m: [f64; 2]) -> f64 {
        0.5 * (clearances_m[0] + clearances_m[1] - (self.drift_m + other.drift_m))
    }

    /// The least gap in this direction, from this board to the other, at whatever point of its way each is: a bound that
    /// their clearance does not fall under.
    pub(super) fn gap_m(&self, other: &Self, direction: DVec2) -> f64 {
        let near = self.corners.iter().map(|corner| corner.dot(direction)).fold(f64::NEG_INFINITY, f64::max);
        let far = other.corners.iter().map(|corner| corner.dot(direction)).fold(f64::INFINITY, f64::min);
        far - near - (self.bulge_m + other.bulge_m)
    }

    /// Whether boards that are `depth_m` within a clearance of each other at one end of their ways, with a clearance of 0
    /// overlap so deep, are so at whatever point of its way each is: because they cannot move that far, or because one holds
    /// a corner of the other.
    pub(super) fn stays_touching(&self, other: &Self, depth_m: f64) -> bool {
        depth_m > self.drift_m + other.drift_m || self.holds_a_corner(other) || other.holds_a_corner(self)
    }

    fn holds_a_corner(&self, other: &Self) -> bool {
        let needed_m = self.skin_m + other.bulge_m;
        let held = |corner: DVec2| self.ends.iter().all(|board| board.depth_m(corner) >= needed_m);
        (0..4).any(|corner| held(other.corners[corner]) && held(other.corners[corner + 4]))
    }
}

/// How far a point of a bench's board may get from where it is at either end of a way on which its handles walk these arcs.
///
/// The handles get no further than the arcs that they walk. A corner is a handle plus a vector of length ρ fixed to the
/// board, and the heading changes by at most the two arcs over d. Of all points of a rigid board a corner moves
/// furthest.
pub(super) fn drift_m(dragon: &Dragon, bench: usize, [front_m, rear_m]: [f64; 2]) -> f64 {
    let turn = (front_m + rear_m) / dragon.dimensions().link_m(bench);
    front_m.max(rear_m) + dragon.dimensions().overhang_m() * turn
}

//! What a board may cover on the way from one travel to a later one.
//!
//! Both ends of the way are known exactly. In between, the only facts used are that both handles walk forward along the
//! route, that their distance d is fixed, and that the route's curvature there is at most some K. With s the arc walked
//! by the front handle, p and r the handles, u the heading, and α and β the angles between the heading and the tangents
//! at front and rear:
//!
//! - |p'| = 1 and |p''| ≤ K;
//! - |r'| = g = cos α / cos β (rigid link), |r''| ≤ |g'| + K·g²;
//! - |u'| = ω ≤ (sin α + g·sin β) / d, for u turns by what the handles move across it, and |u''| ≤ (|p''| + |r''|) / d;
//! - |α'| ≤ K + ω and |β'| ≤ K·g + ω, so |g'| ≤ sin α·(K + ω)/cos β + sin β·(K·g + ω)/cos² β.
//!
//! From these follow two bounds, ℓ being the arc of the whole way:
//!
//! - a corner is a handle plus a vector of length ρ fixed to the board, |corner''| ≤ max(|p''|, |r''|) + ρ·|u''| =: A,
//!   so it stays within A·ℓ²/8 of the segment between its ends, and the board within as much of the hull of its two
//!   ends;
//! - a fixed point x, seen from the board's centre m, has the coordinates u·(x − m) and u⊥·(x − m), whose second
//!   derivatives are at most |m''| + 2·|u'|·|m'| + |u''|·|x − m| =: E, so a point E·ℓ²/8 deep in the board at both ends
//!   is in it all the way.

use glam::DVec2;

use super::Dragon;
use super::board::Board;
use super::pose::Seat;

/// The way of one board.
#[derive(Clone, Copy, Debug)]
pub(super) struct Passage {
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

impl Passage {
    /// The way of a bench from one seat to a later one.
    pub(super) fn new(dragon: &Dragon, bench: usize, earlier: &Seat, later: &Seat) -> Self {
        let walk_m = later.front_travel_m - earlier.front_travel_m;
        let link = LinkBounds {
            length_m: dragon.dimensions().link_m(bench),
            curvature: dragon.route().curvature_bound(earlier.rear.place, later.front.place),
        };
        let motion = link.motion(link.angles(earlier, walk_m));
        let drift_m = drift_m(dragon, bench, earlier, later);
        let [a, b] = [earlier, later].map(|seat| seat.board.corners());
        Self {
            ends: [earlier.board, later.board],
            corners: [a[0], a[1], a[2], a[3], b[0], b[1], b[2], b[3]],
            bulge_m: 0.125 * motion.of_corner(dragon.dimensions().overhang_m()) * walk_m * walk_m,
            skin_m: 0.125 * motion.of_fixed_point(earlier.board.radius_m() + drift_m) * walk_m * walk_m,
            drift_m,
        }
    }

    /// Whether there is a gap in this direction, from this board to the other, at whatever point of its way each is.
    pub(super) fn stays_apart(&self, other: &Self, direction: DVec2) -> bool {
        self.gap_m(other, direction) > 0.0
    }

    /// The least gap in this direction, from this board to the other, at whatever point of its way each is: a bound that
    /// their clearance does not fall under.
    pub(super) fn gap_m(&self, other: &Self, direction: DVec2) -> f64 {
        let near = self.corners.iter().map(|corner| corner.dot(direction)).fold(f64::NEG_INFINITY, f64::max);
        let far = other.corners.iter().map(|corner| corner.dot(direction)).fold(f64::INFINITY, f64::min);
        far - near - (self.bulge_m + other.bulge_m)
    }

    /// Whether boards that overlap `depth_m` deep at one end of their ways overlap at whatever point of its way each
    /// is: because they cannot move that far, or because one holds a corner of the other.
    pub(super) fn stays_touching(&self, other: &Self, depth_m: f64) -> bool {
        depth_m > self.drift_m + other.drift_m || self.holds_a_corner(other) || other.holds_a_corner(self)
    }

    fn holds_a_corner(&self, other: &Self) -> bool {
        let needed_m = self.skin_m + other.bulge_m;
        let held = |corner: DVec2| self.ends.iter().all(|board| board.depth_m(corner) >= needed_m);
        (0..4).any(|corner| held(other.corners[corner]) && held(other.corners[corner + 4]))
    }
}

/// How far a point of a bench's board may get from where it is at either seat, on the way between them.
///
/// The handles get no further than the arcs that they walk. A corner is a handle plus a vector of length ρ fixed to the
/// board, and the heading changes by at most the two arcs over d. Of all points of a rigid board a corner moves
/// furthest.
pub(super) fn drift_m(dragon: &Dragon, bench: usize, earlier: &Seat, later: &Seat) -> f64 {
    let front_m = later.front_travel_m - earlier.front_travel_m;
    let rear_m = later.rear_travel_m - earlier.rear_travel_m;
    let turn = (front_m + rear_m) / dragon.dimensions().link_m(bench);
    front_m.max(rear_m) + dragon.dimensions().overhang_m() * turn
}

/// Bounds on the angles between a link and the tangents at its handles.
#[derive(Clone, Copy)]
struct Angles {
    /// Sine, at most.
    sine: f64,
    /// Cosine at the rear handle, at least.
    rear_cosine: f64,
}

/// What bounds a link's motion.
struct LinkBounds {
    length_m: f64,
    curvature: f64,
}

impl LinkBounds {
    /// Bounds on the angles over a way of `walk_m` of front arc, taken from the curvature alone if that is small.
    ///
    /// A curve with |κ| ≤ K that is left at angle 0 has, after an arc s ≤ π/K, a chord at an angle of at most K·s/2 and
    /// at least (2/K)·sin(K·s/2) long. So for a chord of length d with K·d < 2 the sines of its end angles are at most
    /// K·d/2.
    fn angles(&self, earlier: &Seat, walk_m: f64) -> Angles {
        let sine = 0.5 * self.curvature * self.length_m;
        if sine < 0.75 {
            Angles { sine, rear_cosine: (1.0 - sine * sine).sqrt() }
        } else {
            self.steep_angles(earlier, walk_m)
        }
    }

    /// Bounds from the rear angle at the beginning: while its cosine is at least half of what it is there, its rate has
    /// a bound; if that cannot use up the half on the way, the cosine stays so all the way, else there is no bound.
    fn steep_angles(&self, earlier: &Seat, walk_m: f64) -> Angles {
        let rear_cosine = 0.5 * earlier.rear.tangent.dot(earlier.board.heading);
        let ratio = 1.0 / rear_cosine;
        let rate = self.curvature * ratio + (1.0 + ratio) / self.length_m;
        Angles { sine: 1.0, rear_cosine: if rate * walk_m <= rear_cosine { rear_cosine } else { 0.0 } }
    }

    fn motion(&self, angles: Angles) -> Motion {
        let Angles { sine, rear_cosine } = angles;
        let ratio = 1.0 / rear_cosine;
        let turn = sine * (1.0 + ratio) / self.length_m;
        let ratio_rate =
            ratio * sine * (self.curvature + turn) + ratio * ratio * sine * (self.curvature * ratio + turn);
        let rear = ratio_rate + self.curvature * ratio * ratio;
        Motion {
            speed: ratio,
            turn,
            acceleration: self.curvature.max(rear),
            turn_rate: (self.curvature + rear) / self.length_m,
        }
    }
}

/// Bounds on a link's motion per metre that its front handle walks, or infinities.
struct Motion {
    /// Of either handle, and so of the centre.
    speed: f64,
    /// |u'|.
    turn: f64,
    /// Of either handle, and so of the centre.
    acceleration: f64,
    /// |u''|.
    turn_rate: f64,
}

impl Motion {
    /// A, for a corner `overhang_m` from its handle.
    fn of_corner(&self, overhang_m: f64) -> f64 {
        self.acceleration + overhang_m * self.turn_rate
    }

    /// E, for a point at most `distance_m` from the board's centre.
    fn of_fixed_point(&self, distance_m: f64) -> f64 {
        self.acceleration + 2.0 * self.turn * self.speed + distance_m * self.turn_rate
    }
}

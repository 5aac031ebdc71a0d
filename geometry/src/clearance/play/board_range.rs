//! All places of one board that the play of its hinges allows, while its poles are anywhere in two intervals of the route.
//!
//! **One place of the poles.** Let P and Q be the front and the rear pole of a board, and c the play. The holes of the board are
//! at P + v and Q + w with |v| ≤ c and |w| ≤ c, and d apart. In the frame of the line from Q to P, with the middle of the poles
//! as its origin, the middle of the holes is m = (v + w)/2, and the heading of the board is u = (√(1 − η²), η) with
//! η = (v − w)·ŷ/d. So a corner with the nominal coordinates (x, y) is at
//!
//! m + (x·√(1 − η²) − y·η, y·√(1 − η²) + x·η).
//!
//! In a direction n with n·(x, y) ≥ 0 it is at most
//!
//! n·(x, y) + n·m + η·λ·d/2 = n·(x, y) + v·(n + λ·ŷ)/2 + w·(n − λ·ŷ)/2, with λ = (2/d)·((x, y) × n),
//!
//! and so at most n·(x, y) + (c/2)·(|n + λ·ŷ| + |n − λ·ŷ|). A corner with n·(x, y) < 0 is nowhere further than its opposite. So
//! the sum is a bound on the board, and the boards that the hinges allow touch it, but for the distance of the poles: across the
//! board, a corner is off by c·L/d, and the middle of its side by c.
//!
//! **Tension.** The board keeps its length, so v·x̂ − w·x̂ is d·√(1 − η²) − D, with x̂ along the line of the poles and D their
//! distance: at most d − D, and less by at most e = d − √(d² − 4·c²). So for any number μ, the *tension*, (μ/2)·(v·x̂ − w·x̂) may be
//! added to the sum if (μ/2)·(D − d) is added too, and e·μ/2 for μ > 0. Then (c/2)·(|n + q| + |n − q|) with q = λ·ŷ + μ·x̂ takes the
//! place of the last term. Without tension, a board could use its play across although its poles are as far apart as the play
//! allows, which takes all of it. The best tension is that with the least bound (Lagrangian duality: Boyd and Vandenberghe 2004,
//! Convex Optimization, chapter 5). An opposite corner has the lever −λ, and counts with n·(x, y) = 0.
//!
//! **All places of the poles.** A point that is fixed in that frame is a function of the travels a and b of the two poles. By
//! each of them, its second derivative is at most M (below). So on a rectangle of travels with the sides α and β, the point is
//! within (α² + β²)·M/8 of the bilinear function with the same values at the four corners of the rectangle. In any direction,
//! that function is greatest at one of these. So four boards and a remainder bound all of them. The same holds for the sum of that
//! function and (μ/2)·D, because |∂²D| ≤ K + 1/D: D has a remainder of (α² + β²)·(K + 1/D)/8.
//!
//! **M.** Let K bound the route's curvature, and D be the distance of the poles. The middle of the poles has a second derivative
//! of at most K/2. The line from pole to pole turns by the angle φ with φ' = sin σ/D, where σ is its angle with the tangent, and
//! |φ''| ≤ K/D + 2·|sin σ·cos σ|/D². If K·D < 2, then |sin σ| ≤ K·D/2 (see `link_motion`), so |φ''| + φ'² ≤ 2K/D + K²/4. In any
//! case it is at most K/D + 2/D². A point ρ from the middle has M = K/2 + ρ·(|φ''| + φ'²).

//!
//! **On ground.** The line from Q to P is pitched, and the board is seen shortened to the share q of its length. Let e be the unit
//! vector from Q to P, n a level direction, and n⊥ = n − (n·e)·e. In the direction n, a point of the board's middle line at x is off
//! by at most c·(|V| + |W|) with |V|² = (n·e)²/4 + n⊥²·(1/2 + x/d)² and |W|² = (n·e)²/4 + n⊥²·(1/2 − x/d)², and by the second
//! order, L·η²/4. The board stays level across, so its corners turn with its heading in the plan, by at most η/(q − η) with
//! η = 2·c/d. In M, the frame has the axes e, the level one across, and the one square to both: see `link_motion` for the second
//! derivative of the level one.

use glam::DVec2;

use super::pole_range::PoleRange;
use crate::clearance::link_motion::HeadingMotion;
use crate::dragon::board::Board;
use crate::dragon::{Dragon, Meter};
use crate::numerics::peak;

/// Greatest tension that is tried, either way, and how close to the best one the search ends. Any tension proves.
const MOST_TENSION: f64 = 1.0;
const TENSION_TOLERANCE: f64 = 0.2;
/// Widest overlap without tension, in lengths of the play, for which a tension is searched.
const MOST_GAIN_PLAYS: f64 = 3.0;
/// Work of the search for the tensions of two boards, in steps.
const STEPS_PER_TENSION: u64 = 40;

/// The places of a bench's board.
#[derive(Clone, Copy, Debug)]
pub(super) struct BoardRange {
    /// The boards without play, with the poles at the ends of their intervals.
    boards: [Board; 4],
    /// Distance between the holes.
    link_m: f64,
    play_m: f64,
    /// Greatest distance of any place from those of the four boards.
    remainder_m: f64,
    /// Distances of the poles of the four boards, and the greatest difference of any distance of the poles from them.
    distances_m: [f64; 4],
    distance_remainder_m: f64,
    /// Length of the board, if it is on ground.
    pitched_m: Option<f64>,
}

impl BoardRange {
    /// The places of the board of a bench with its poles in two intervals.
    pub(super) fn new(dragon: &Dragon, bench: usize, front: &PoleRange, rear: &PoleRange) -> Self {
        let dimensions = dragon.dimensions();
        let play_m = dimensions.play_m();
        let ends = [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(a, b)| [front.ends[a], rear.ends[b]]);
        let boards = ends.map(|[front, rear]| dragon.board_between(bench, front, rear));
        let slack_m = 0.5 * (front.length_m + rear.length_m);
        let distances_m = ends.map(|[front, rear]| front.distance(rear));
        let least_m = distances_m.into_iter().fold(f64::INFINITY, f64::min) - slack_m;
        let most_m = distances_m.into_iter().fold(0.0, f64::max) + slack_m;
        let curvature = dragon.route().curvature_bound(rear.rear, front.front);
        let turn = if curvature * most_m < 2.0 {
            2.0 * curvature / least_m + 0.25 * curvature * curvature
        } else {
            curvature / least_m + 2.0 / (least_m * least_m)
        };
        let pitched_m = dragon.route().is_on_ground().then(|| dimensions.length_m(bench));
        let second = match pitched_m {
            None => 0.5 * curvature + (dragon.board_radius_m(bench) + 2.0 * play_m) * turn,
            Some(length_m) => {
                let rate = if curvature * most_m < 2.0 { 0.5 * curvature } else { least_m.recip() };
                let shares = boards.map(|board| dragon.seen_share(bench, &board));
                let turned = rate * (front.length_m + rear.length_m);
                let share = shares.into_iter().fold(1.0, f64::min) - turned;
                let across = HeadingMotion::new(rate, turn, share.max(0.0));
                let frame = turn + across.turn_rate + 2.0 * rate * across.turn;
                0.5 * curvature + (0.5 * (length_m + dimensions.width_m()) + 6.0 * play_m) * frame
            }
        };
        let squares = front.length_m * front.length_m + rear.length_m * rear.length_m;
        let remainder_m = if least_m > 0.0 { 0.125 * second * squares } else { f64::INFINITY };
        let distance_remainder_m = 0.125 * (curvature + least_m.recip()) * squares;
        let link_m = dimensions.link_m(bench);
        Self { boards, link_m, play_m, remainder_m, distances_m, distance_remainder_m, pitched_m }
    }

    /// Whether every place of this board is more than `clearance_m` from every place of the other one, by the gaps in a few
    /// directions. Only those are examined in which the boards without play have such a gap. With a meter, tensions are searched, and
    /// counted there.
    pub(super) fn is_beyond(&self, other: &Self, clearance_m: f64, tension: Option<&Meter>) -> bool {
        let [ours, theirs] = [self, other].map(|range| range.boards[1]);
        let approach = ours.approach(&theirs);
        if approach.clearance_m <= clearance_m {
            return false;
        }
        let axes = [ours.heading.perp(), theirs.heading.perp(), ours.heading, theirs.heading];
        let apart = theirs.centre - ours.centre;
        let is_open =
            |axis: &DVec2| axis.dot(apart) - ours.half_extent_m(*axis) - theirs.half_extent_m(*axis) > clearance_m;
        let axes = axes.map(|axis| if axis.dot(apart) < 0.0 { -axis } else { axis }).into_iter().filter(is_open);
        std::iter::once(approach.direction).chain(axes).any(|axis| self.is_open(other, axis, clearance_m, tension))
    }

    /// Whether the gap from this board to the other one in a direction, a lower bound on their clearance, is above `clearance_m`.
    fn is_open(&self, other: &Self, direction: DVec2, clearance_m: f64, tension: Option<&Meter>) -> bool {
        let gap_m = -other.extent_m(-direction, 0.0) - self.extent_m(direction, 0.0);
        let Some(meter) = tension.filter(|_| gap_m <= clearance_m && self.pitched_m.is_none()) else {
            return gap_m > clearance_m;
        };
        // Tension gains little more than the play across, so it cannot open a wide overlap.
        if gap_m <= clearance_m - MOST_GAIN_PLAYS * self.play_m.max(other.play_m) {
            return false;
        }
        meter.add(STEPS_PER_TENSION);
        -other.least_extent_m(-direction) - self.least_extent_m(direction) > clearance_m
    }

    /// The least bound on how far the board reaches in a direction, from the origin of the route.
    fn least_extent_m(&self, direction: DVec2) -> f64 {
        -peak(-MOST_TENSION, MOST_TENSION, TENSION_TOLERANCE, |tension| -self.extent_m(direction, tension)).value
    }

    /// How far the board reaches in a direction, from the origin of the route: the bound with a tension μ.
    fn extent_m(&self, direction: DVec2, tension: f64) -> f64 {
        let furthest = |(board, apart_m): (&Board, f64)| {
            if let Some(length_m) = self.pitched_m {
                return self.pitched_extent_m(board, length_m, direction);
            }
            let (along, across) = (board.heading.dot(direction), board.heading.perp().dot(direction));
            let ahead = board.heading * board.half_length;
            let aside = board.heading.perp() * board.half_width;
            let holes_m = |lever: f64| {
                let squared = 1.0 + lever * lever + tension * tension;
                let turned = 2.0 * (lever * across + tension * along);
                let [one, other] = [turned, -turned].map(|turned| (squared + turned).max(0.0).sqrt());
                0.5 * self.play_m * (one + other)
            };
            let corners_m = [ahead + aside, ahead - aside].map(|corner| {
                let along_m = corner.dot(direction);
                let lever = 2.0 * corner.perp_dot(direction) / self.link_m * along_m.signum();
                // The opposite corner; without tension it reaches less far.
                let opposite_m = if tension == 0.0 { 0.0 } else { holes_m(-lever) };
                (along_m.abs() + holes_m(lever)).max(opposite_m)
            });
            let furthest_m = corners_m[0].max(corners_m[1]);
            board.centre.dot(direction) + furthest_m + 0.5 * tension * (apart_m - self.link_m)
        };
        let shortening_m = self.link_m - (self.link_m * self.link_m - 4.0 * self.play_m * self.play_m).max(0.0).sqrt();
        let rest_m = 0.5 * (tension.max(0.0) * shortening_m + tension.abs() * self.distance_remainder_m);
        let boards = self.boards.iter().zip(self.distances_m);
        boards.map(furthest).fold(f64::NEG_INFINITY, f64::max) + self.remainder_m + rest_m
    }

    /// The same for one place of the poles on ground.
    fn pitched_extent_m(&self, board: &Board, length_m: f64, direction: DVec2) -> f64 {
        let share = 2.0 * board.half_length / length_m;
        let along = board.heading.dot(direction) * share;
        let (along_squared, across_squared) = (0.25 * along * along, (1.0 - along * along).max(0.0));
        let arm = 0.5 * length_m / self.link_m;
        let offs = [0.5 + arm, 0.5 - arm].map(|arm| (along_squared + across_squared * arm * arm).sqrt());
        let angle = 2.0 * self.play_m / self.link_m;
        let turn = if share > angle { angle / (share - angle) } else { 2.0 };
        let off_m = self.play_m * (offs[0] + offs[1]) + board.half_width * turn + 0.25 * length_m * angle * angle;
        let corners = board.corners().into_iter().map(|corner| corner.dot(direction));
        corners.fold(f64::NEG_INFINITY, f64::max) + off_m
    }
}

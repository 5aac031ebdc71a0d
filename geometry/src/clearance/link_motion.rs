//! Bounds on the motion of a link from one pose to a later one.
//!
//! The proof uses only these facts: both handles walk forward along the route, their distance d is fixed, and the route's
//! curvature there is at most some K. Let s be the arc walked by the front handle, p and r the handles, and u the heading. Let
//! α and β be the angles between the heading and the tangents at front and rear.
//!
//! 1. |p'| = 1 and |p''| ≤ K;
//! 2. |r'| = g = cos α / cos β (rigid link), |r''| ≤ |g'| + K·g²;
//! 3. |u'| = ω ≤ (sin α + g·sin β) / d, because the handles' motion across u turns it, and |u''| ≤ (|p''| + |r''|) / d;
//! 4. |α'| ≤ K + ω and |β'| ≤ K·g + ω, so |g'| ≤ sin α·(K + ω)/cos β + sin β·(K·g + ω)/cos² β.
//!
//! On ground, all of this holds in space. Boards are seen from above, where motions are not larger. Only the heading in the plan
//! turns faster than the link. Let h be the link's direction seen from above, and q = |h| ≥ c. Then h/q, the heading, has
//!
//! 5. |(h/q)'| ≤ ω/c, and |(h/q)″| ≤ |u″|/c + 3·(ω/c)²: its angle ψ has ψ' = h×h'/q² and ψ″ = h×h″/q² − 2·ψ'·q'/q;
//! 6. |q″| ≤ |u″| + ω²/c, by which the board is seen to grow.
//!
//! Over an interval on which u turns by ε, q falls by at most ε.

use super::pose::BenchPose;
use crate::dragon::Dragon;

/// Bounds on a link's motion per metre that its front handle walks. A bound may be infinite.
pub(super) struct LinkMotion {
    /// K.
    pub(super) curvature: f64,
    /// Bound on the sines of α and β.
    pub(super) sine: f64,
    /// g, and so the largest speed of either handle.
    pub(super) ratio: f64,
    /// |g'|.
    pub(super) ratio_rate: f64,
    /// |u'|.
    pub(super) turn: f64,
    /// Bound on |p''| and |r''|.
    pub(super) acceleration: f64,
    /// |u''|.
    pub(super) turn_rate: f64,
    /// c: 1 without ground.
    pub(super) seen_share: f64,
}

/// Bounds on the motion of a link's heading in the plan.
pub(super) struct HeadingMotion {
    /// Bound on |(h/q)'|.
    pub(super) turn: f64,
    /// Bound on |(h/q)″|.
    pub(super) turn_rate: f64,
    /// Bound on |q″|: 0 without ground.
    pub(super) growth_rate: f64,
}

impl HeadingMotion {
    /// The motion in the plan of a link that turns in space, of which at least this share is seen from above.
    pub(super) fn new(turn: f64, turn_rate: f64, seen_share: f64) -> Self {
        if seen_share == 1.0 {
            return Self { turn, turn_rate, growth_rate: 0.0 };
        }
        let seen_turn = turn / seen_share;
        let growth_rate = turn_rate + turn * seen_turn;
        Self { turn: seen_turn, turn_rate: turn_rate / seen_share + 3.0 * seen_turn * seen_turn, growth_rate }
    }
}

impl LinkMotion {
    /// The bounds for a bench's link from one pose to a later one.
    pub(super) fn new(dragon: &Dragon, bench: usize, earlier: &BenchPose, later: &BenchPose) -> Self {
        let length_m = dragon.dimensions().link_m(bench);
        let curvature = dragon.route().curvature_bound(earlier.rear.parameter, later.front.parameter);
        let walk_m = later.front_travel_m - earlier.front_travel_m;
        let Angles { sine, rear_cosine } = Angles::new(length_m, curvature, earlier, walk_m);
        let ratio = 1.0 / rear_cosine;
        let turn = sine * (1.0 + ratio) / length_m;
        let ratio_rate = ratio * sine * (curvature + turn) + ratio * ratio * sine * (curvature * ratio + turn);
        let rear = ratio_rate + curvature * ratio * ratio;
        Self {
            curvature,
            sine,
            ratio,
            ratio_rate,
            turn,
            acceleration: curvature.max(rear),
            turn_rate: (curvature + rear) / length_m,
            seen_share: seen_share(dragon, bench, earlier, turn * walk_m),
        }
    }

    /// The motion of the heading in the plan.
    pub(super) fn heading(&self) -> HeadingMotion {
        HeadingMotion::new(self.turn, self.turn_rate, self.seen_share)
    }
}

/// c over an interval on which the link turns by at most `turned`. Without a bound it is 0, and all bounds are infinite.
fn seen_share(dragon: &Dragon, bench: usize, earlier: &BenchPose, turned: f64) -> f64 {
    let share = dragon.seen_share(bench, &earlier.board);
    if dragon.route().is_on_ground() { (share - turned).max(0.0) } else { share }
}

/// Bounds on the angles between a link and the tangents at its handles.
struct Angles {
    /// Upper bound on the sines.
    sine: f64,
    /// Lower bound on the cosine at the rear handle.
    rear_cosine: f64,
}

impl Angles {
    /// Bounds on the angles over an interval on which the front handle walks `walk_m`. If the curvature is small, they follow
    /// from it alone.
    ///
    /// Take a curve with |κ| ≤ K that begins at angle 0. After an arc s ≤ π/K, its chord has an angle of at most K·s/2 and a
    /// length of at least (2/K)·sin(K·s/2). So for a chord of length d with K·d < 2, the sines of its end angles are at most
    /// K·d/2.
    fn new(length_m: f64, curvature: f64, earlier: &BenchPose, walk_m: f64) -> Self {
        let sine = 0.5 * curvature * length_m;
        if sine < 0.75 {
            Self { sine, rear_cosine: (1.0 - sine * sine).sqrt() }
        } else {
            Self::steep(length_m, curvature, earlier, walk_m)
        }
    }

    /// Bounds from the rear angle at the beginning. As long as the cosine of that angle is at least half of its first value,
    /// its rate has a bound. If that rate cannot use up half of the first value on the interval, the cosine stays at least half
    /// of it. Otherwise there is no bound.
    fn steep(length_m: f64, curvature: f64, earlier: &BenchPose, walk_m: f64) -> Self {
        let link = earlier.front.in_space() - earlier.rear.in_space();
        let rear_cosine = 0.5 * earlier.rear.tangent.extend(earlier.rear.climb).dot(link.normalize());
        let ratio = 1.0 / rear_cosine;
        let rate = curvature * ratio + (1.0 + ratio) / length_m;
        Self { sine: 1.0, rear_cosine: if rate * walk_m <= rear_cosine { rear_cosine } else { 0.0 } }
    }
}

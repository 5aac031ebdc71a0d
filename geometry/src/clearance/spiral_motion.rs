//! Motion of two benches on a spiral, relative to the front bench of the pair.
//!
//! **Terms.** On the spiral r = b·θ, let x be the angle θ of the front handle of the pair's front bench. This x is the
//! parameter of the motion, and its direction is that of a rotating frame. A link lies between the angles x and y = F(x), with
//! δ = y − x < π.
//!
//! 1. In this frame, a handle at the angle θ, with q = dθ/dx, has the radius r = b·θ and the angle θ − x. So its velocity is
//!    (b·q, r·(q − 1)) and its acceleration (b·q' − r·(q − 1)², r·q' + 2b·q·(q − 1)), in radial and tangential components. The
//!    bounds need the difference of q from 1.
//! 2. x² + y² − 2x·y·cos δ = (d/b)². Its derivatives follow, with D = x·y·sin δ + y − x·cos δ, t = tan(δ/2) and z = 1/x + 1/y:
//!    - f := 1 − F' = (x + y)·(1 − cos δ)/D, so 0 < f ≤ z·t;
//!    - F'' = (f·(2·sin δ·(y + x·F') − x·y·cos δ·f) − f² − 2F'·(1 − cos δ))/D, so |F''| ≤ z²·t·(2 + t²)·(1 + z²).
//! 3. Because F' < 1, z and t are greatest at the later end of a motion.
//! 4. While the dragon walks, F' > 0. q is the product of the F' of the links ahead. So 0 ≤ 1 − q ≤ Σ z·t, and |q'| ≤ Σ |F''|.
//! 5. The bench's own frame is the one in which its front handle only moves inward. In it, the bench's heading u turns by ψ,
//!    with |ψ'| ≤ (sum of the handles' speeds)/d and |u''| ≤ (sum of their accelerations)/d.
//! 6. In the frame of x, the heading turns at the rate ψ'·q + q − 1. Bounds on this rate and on its derivative follow.
//! 7. A dragon that walks outward is one that walks inward with its rear first, backwards in time. So the same bounds hold, with x
//!    at the rear handle of the pair's rear bench, and the earlier end of the motion in place of the later one.

use std::f64::consts::FRAC_PI_2;

use glam::DVec2;

use super::pair_motion::{BenchMotion, MotionParameter, PairMotion};
use super::pose::Pose;
use crate::dragon::Dragon;

impl PairMotion {
    /// Bounds on the motion of two benches from one pose to a later one, per radian of x. `None` unless the whole motion is on
    /// one spiral.
    pub(super) fn on_spiral(
        dragon: &Dragon,
        [first, second]: [usize; 2],
        earlier: &Pose,
        later: &Pose,
    ) -> Option<Self> {
        let ends = [earlier.handles[second + 1].parameter, later.handles[first].parameter];
        let spiral = dragon.route().spiral_between(ends)?;
        let b = spiral.radius_per_radian_m;
        let [outer, inner] = if spiral.is_inward { [earlier, later] } else { [later, earlier] };
        let angle = |pose: &Pose, handle: usize| spiral.angle(pose.handles[handle].parameter);
        let mut sum = Lag::default();
        let mut benches = [BenchMotion::default(); 2];
        for step in 0..=second - first {
            let bench = if spiral.is_inward { first + step } else { second - step };
            let handles = if spiral.is_inward { [bench, bench + 1] } else { [bench + 1, bench] };
            let link = Lag::between(handles.map(|handle| angle(inner, handle)))?;
            let ahead = sum;
            sum = Lag { lag: sum.lag + link.lag, rate: sum.rate + link.rate };
            if bench == first || bench == second {
                let [front_m, rear_m] = handles.map(|handle| b * angle(outer, handle));
                let handles = [HandleMotion::new(b, front_m, ahead), HandleMotion::new(b, rear_m, sum)];
                let own_rear = HandleMotion::new(b, rear_m, link);
                benches[usize::from(bench == second)] = bench_motion(dragon, bench, b, handles, own_rear);
            }
        }
        let parameter = if spiral.is_inward { MotionParameter::FrontAngle } else { MotionParameter::RearAngle };
        Some(Self { benches, corner_arm_m: dragon.corner_arm_m(), parameter })
    }
}

/// Bounds on how far a handle lags another one: 1 − q and |q'| (4). For a single link they are z·t and |F''| (2).
#[derive(Clone, Copy, Debug, Default)]
struct Lag {
    lag: f64,
    rate: f64,
}

impl Lag {
    fn between([front_angle, rear_angle]: [f64; 2]) -> Option<Self> {
        let half_angle = 0.5 * (rear_angle - front_angle);
        if half_angle >= FRAC_PI_2 || front_angle <= 0.0 {
            return None;
        }
        let (t, z) = (half_angle.tan(), 1.0 / front_angle + 1.0 / rear_angle);
        Some(Self { lag: z * t, rate: z * z * t * (2.0 + t * t) * (1.0 + z * z) })
    }
}

/// Bounds on a handle's motion.
#[derive(Clone, Copy, Debug)]
struct HandleMotion {
    lag: Lag,
    speed: f64,
    acceleration: f64,
}

impl HandleMotion {
    /// The motion of a handle with this lag, at most `radius_m` from the centre (1).
    fn new(b: f64, radius_m: f64, Lag { lag, rate }: Lag) -> Self {
        let lag = lag.min(1.0);
        Self {
            lag: Lag { lag, rate },
            speed: DVec2::new(b, radius_m * lag).length(),
            acceleration: rate * DVec2::new(b, radius_m).length() + lag * DVec2::new(2.0 * b, radius_m * lag).length(),
        }
    }
}

/// Bounds for a bench. Both handles are relative to the pair's front bench; `own_rear` is the rear handle relative to the
/// bench's own frame (5, 6).
fn bench_motion(
    dragon: &Dragon,
    bench: usize,
    b: f64,
    [front, rear]: [HandleMotion; 2],
    own_rear: HandleMotion,
) -> BenchMotion {
    let link_m = dragon.dimensions().link_m(bench);
    let own_turn = (b + own_rear.speed) / link_m;
    let own_turn_rate = own_rear.acceleration / link_m;
    let turn = own_turn + front.lag.lag;
    BenchMotion {
        speed: front.speed.max(rear.speed),
        accel_along: 0.0,
        accel_across: front.acceleration.max(rear.acceleration),
        sine: 1.0,
        curvature: 0.0,
        turn,
        turn_rate: own_turn_rate + (own_turn + 1.0) * front.lag.rate + turn * turn,
        growth: 0.0,
    }
}

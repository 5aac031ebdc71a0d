//! Motion of two benches on any route, per metre that the front handle of the pair's front bench walks.
//!
//! The motion of each link between them is bounded (see `link_motion` for the terms). Let v be the speed of a link's front
//! handle. Its rear handle has the speed g·v, which changes by at most |g'|·v² + g·|v'|. The bound on g is its larger value at
//! the ends of the interval, plus |g'| times half of the front handle's arc. So the bounds accumulate from link to link. A
//! handle's acceleration is at most |v'| along its tangent and K·v² across it. The sine of the tangent's angle with the link is
//! bounded too. The components of both handles' accelerations across the link turn it.

use super::link_motion::{HeadingMotion, LinkMotion};
use super::pair_motion::{BenchMotion, MotionParameter, PairMotion};
use super::pose::Pose;
use crate::dragon::Dragon;

impl PairMotion {
    /// Bounds on the motion of two benches from one pose to a later one, on any route.
    pub(super) fn along_curve(dragon: &Dragon, [first, second]: [usize; 2], earlier: &Pose, later: &Pose) -> Self {
        let mut front = HandleMotion { speed: 1.0, speed_rate: 0.0 };
        let mut benches = [BenchMotion::default(); 2];
        for bench in first..=second {
            let poses = [earlier.bench_pose(bench), later.bench_pose(bench)];
            let link = LinkMotion::new(dragon, bench, &poses[0], &poses[1]);
            let ratio = poses
                .iter()
                .map(|bench_pose| bench_pose.rear.speed_ratio / bench_pose.front.speed_ratio)
                .fold(0.0, f64::max);
            let walk_m = poses[1].front_travel_m - poses[0].front_travel_m;
            let rear = front.rear(link.ratio.min(ratio + 0.5 * link.ratio_rate * walk_m), link.ratio_rate);
            if bench == first || bench == second {
                let across = |handle: HandleMotion| link.curvature * handle.speed * handle.speed;
                let turned_m = |handle: HandleMotion| link.sine * handle.speed_rate + across(handle);
                let link_m = dragon.dimensions().link_m(bench);
                let turn = link.sine * (front.speed + rear.speed) / link_m;
                let turn_rate = (turned_m(front) + turned_m(rear)) / link_m + turn * turn;
                let heading = HeadingMotion::new(turn, turn_rate, link.seen_share);
                benches[usize::from(bench == second)] = BenchMotion {
                    speed: front.speed.max(rear.speed),
                    accel_along: front.speed_rate.max(rear.speed_rate),
                    accel_across: across(front).max(across(rear)),
                    sine: link.sine,
                    curvature: link.curvature,
                    turn: heading.turn,
                    turn_rate: heading.turn_rate,
                    growth: 0.5 * dragon.dimensions().length_m(bench) * heading.growth_rate,
                };
            }
            front = rear;
        }
        Self { benches, corner_arm_m: dragon.corner_arm_m(), parameter: MotionParameter::Arc }
    }
}

/// Bounds on a handle's motion.
#[derive(Clone, Copy, Debug)]
struct HandleMotion {
    /// v.
    speed: f64,
    /// |v'|.
    speed_rate: f64,
}

impl HandleMotion {
    /// The rear handle of a link with these bounds on g and |g'|.
    fn rear(self, ratio: f64, ratio_rate: f64) -> Self {
        Self { speed: ratio * self.speed, speed_rate: ratio_rate * self.speed * self.speed + ratio * self.speed_rate }
    }
}

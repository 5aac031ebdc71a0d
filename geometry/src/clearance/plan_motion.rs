//! Motion of benches of two dragons, per second of plan time.
//!
//! Over plan time t, a dragon's head has the travel s(t), with |s'| ≤ v and |s''| ≤ a. A quantity x of a bench whose derivatives
//! over s are bounded by x₁ and x₂ has |x'| ≤ x₁·v and |x''| ≤ x₂·v² + x₁·a. The head's timetable must not change its speed at once
//! on the interval.

use super::pair::Member;
use super::pair_motion::{BenchMotion, MotionParameter, PairMotion};
use super::pose::Pose;
use crate::formation::Planned;

impl PairMotion {
    /// Bounds on the motion of benches of two dragons from one plan time to a later one.
    pub(super) fn over_plan_time(members: [Member<'_>; 2], ends: [f64; 2]) -> Self {
        let benches = members.map(|member| {
            let poses = ends.map(|time_s| member.pose(time_s));
            bench_motion(member.planned, member.bench, poses.each_ref())
        });
        let corner_arm_m = members.map(|member| member.planned.dragon.corner_arm_m()).into_iter().fold(0.0, f64::max);
        Self { benches, corner_arm_m, parameter: MotionParameter::PlanTime }
    }
}

/// Bound on the speed of any point of a bench's board from one pose to a later one, in metres per second. It may be infinite.
pub(super) fn point_speed_mps(planned: &Planned, bench: usize, ends: [&Pose; 2]) -> f64 {
    let motion = bench_motion(planned, bench, ends);
    let half_length_m = 0.5 * planned.dragon.dimensions().length_m(bench);
    // On ground, a board is also seen to grow and to shrink, at most as fast as its link turns.
    let grown_m = if motion.growth > 0.0 { half_length_m * motion.turn } else { 0.0 };
    motion.speed + planned.dragon.corner_arm_m() * motion.turn + grown_m
}

fn bench_motion(planned: &Planned, bench: usize, [earlier, later]: [&Pose; 2]) -> BenchMotion {
    let dragon = &*planned.dragon;
    let [_, walked] = PairMotion::along_curve(dragon, [0, bench], earlier, later).benches;
    let (v, a) = (planned.timetable.most_speed_mps(), planned.timetable.most_accel_mps2());
    let half_length_m = 0.5 * dragon.dimensions().length_m(bench);
    let second = |second: f64, first: f64| second * v * v + first * a;
    // Without ground, a board is seen in its length.
    let first_growth = if walked.growth > 0.0 { half_length_m * walked.turn } else { 0.0 };
    BenchMotion {
        speed: walked.speed * v,
        accel_along: second(walked.accel_along, walked.speed),
        accel_across: walked.accel_across * v * v,
        sine: walked.sine,
        curvature: walked.curvature,
        turn: walked.turn * v,
        turn_rate: second(walked.turn_rate, walked.turn),
        growth: second(walked.growth, first_growth),
    }
}

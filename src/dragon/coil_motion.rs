//! How two benches on a coil move against each other.
//!
//! On the spiral r = b·θ take x, the angle θ of the front handle of the bench further ahead, for the parameter and its
//! direction for that of a turning frame. A handle at the angle θ, with q = dθ/dx, has in this frame the radius b·θ and
//! the angle θ − x, so its velocity is (b·q, r·(q − 1)) and its acceleration (b·q' − r·(q − 1)², r·q' + 2b·q·(q − 1)),
//! radially and across. What is needed, then, is how near q is to 1.
//!
//! A link between the angles x and y = F(x), δ = y − x < π, has x² + y² − 2x·y·cos δ = (d/b)². Differentiated, with
//! D = x·y·sin δ + y − x·cos δ, t = tan(δ/2) and z = 1/x + 1/y:
//!
//! - f := 1 − F' = (x + y)·(1 − cos δ)/D, so 0 < f ≤ z·t;
//! - F'' = (f·(2·sin δ·(y + x·F') − x·y·cos δ·f) − f² − 2F'·(1 − cos δ))/D, so |F''| ≤ z²·t·(2 + t²)·(1 + z²).
//!
//! As F' < 1, z and t are greatest at the later end of a way. While the dragon walks, F' > 0, and q is the product of
//! the F' of the links ahead: 0 ≤ 1 − q ≤ Σ z·t, and |q'| ≤ Σ |F''|.
//!
//! A bench's heading u turns by ψ in its own frame, the one in which its front handle only moves inward, so |ψ'| ≤
//! (sum of the handles' speeds)/d and |u''| ≤ (sum of their accelerations)/d there. In the frame of x it turns by
//! ψ'·q + q − 1, from which its rate and the rate of that follow.
//!
//! At last, a corner c of one board has in the frame of another board the coordinates u·(c − m) and u⊥·(c − m). Their
//! second derivatives are at most |c''| + |m''| + 2·|u'|·(|c'| + |m'|) + |u''|·|c − m| =: E. Over a way of ℓ radians such
//! a coordinate stays within E·ℓ²/8 of the straight line between its two ends.

use glam::DVec2;

use super::Dragon;
use super::board::Board;
use super::pose::Pose;

/// Bounds on the motion of a pair over a way and all parts of it, per radian of the parameter.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoilMotion {
    benches: [BenchMotion; 2],
}

/// Bounds on a handle's motion.
#[derive(Clone, Copy, Debug)]
struct HandleMotion {
    /// 1 − q.
    lag: f64,
    /// |q'|.
    lag_rate: f64,
    speed_m: f64,
    acceleration_m: f64,
}

/// Bounds on a bench's motion.
#[derive(Clone, Copy, Debug)]
struct BenchMotion {
    /// Of either handle, and so of the centre.
    speed_m: f64,
    acceleration_m: f64,
    corner_speed_m: f64,
    corner_acceleration_m: f64,
    /// |u'|.
    turn: f64,
    /// |u''|.
    turn_rate: f64,
}

/// Bounds on a link: z·t and |F''|.
#[derive(Clone, Copy, Debug, Default)]
struct LinkMotion {
    lag: f64,
    lag_rate: f64,
}

impl CoilMotion {
    /// The motion of two benches from one pose to a later one, if all of it is on the coil of the route.
    pub(super) fn new(dragon: &Dragon, [first, second]: [usize; 2], earlier: &Pose, later: &Pose) -> Option<Self> {
        let coil = dragon.route().coil()?;
        let b = coil.radius_per_radian_m;
        let angle = |pose: &Pose, handle: usize| coil.angle(pose.handles[handle].place);
        let mut front_angle = angle(later, first)?;
        let mut sum = LinkMotion::default();
        let mut benches = [None; 2];
        for bench in first..=second {
            let rear_angle = angle(later, bench + 1)?;
            let link = LinkMotion::between(front_angle, rear_angle)?;
            let ahead = sum;
            sum = LinkMotion { lag: sum.lag + link.lag, lag_rate: sum.lag_rate + link.lag_rate };
            if bench == first || bench == second {
                let [front_m, rear_m] = [b * angle(earlier, bench)?, b * angle(earlier, bench + 1)?];
                let handles = [HandleMotion::new(b, front_m, ahead), HandleMotion::new(b, rear_m, sum)];
                let own_rear = HandleMotion::new(b, rear_m, link);
                benches[usize::from(bench == second)] = Some(BenchMotion::new(dragon, bench, b, handles, own_rear));
            }
            front_angle = rear_angle;
        }
        Some(Self { benches: [benches[0]?, benches[1]?] })
    }

    /// Whether the boards stay apart on a way of `angle` radians between two poses of theirs: because all corners of one
    /// stay beyond the same edge of the other.
    pub(super) fn stays_apart(&self, earlier: [&Board; 2], later: [&Board; 2], angle: f64) -> bool {
        self.corners_seen(earlier, later, angle).into_iter().any(|seen| {
            let beyond = |depth: fn(DVec2) -> f64, half_size: f64| {
                seen.corners
                    .iter()
                    .all(|corner| corner.at.into_iter().all(|at| depth(at) > half_size + corner.leeway_m))
            };
            beyond(|at| at.y, seen.half_size.y)
                || beyond(|at| -at.y, seen.half_size.y)
                || beyond(|at| at.x, seen.half_size.x)
                || beyond(|at| -at.x, seen.half_size.x)
        })
    }

    /// Whether the boards stay in touch on a way of `angle` radians between two poses of theirs: because one holds a
    /// corner of the other.
    pub(super) fn stays_touching(&self, earlier: [&Board; 2], later: [&Board; 2], angle: f64) -> bool {
        self.corners_seen(earlier, later, angle).into_iter().any(|seen| {
            let held = |corner: &Corner| {
                let depth_m = |at: DVec2| (seen.half_size - at.abs()).min_element();
                corner.at.into_iter().all(|at| depth_m(at) >= corner.leeway_m)
            };
            seen.corners.iter().any(held)
        })
    }

    /// The corners of each board as the other one sees them.
    fn corners_seen(&self, earlier: [&Board; 2], later: [&Board; 2], angle: f64) -> [Seen; 2] {
        [0, 1].map(|viewer| {
            let [from, to] = [&self.benches[viewer], &self.benches[1 - viewer]];
            let speed_m = from.speed_m + to.corner_speed_m;
            let fixed = to.corner_acceleration_m + from.acceleration_m + 2.0 * from.turn * speed_m;
            let [before, after] = [earlier, later].map(|boards| boards[1 - viewer].corners());
            let corner = |k: usize| {
                let at = [earlier[viewer].local(before[k]), later[viewer].local(after[k])];
                let distance_m = at[0].length().max(at[1].length()) + 0.5 * speed_m * angle;
                Corner { at, leeway_m: 0.125 * (fixed + from.turn_rate * distance_m) * angle * angle }
            };
            let half_size = DVec2::new(earlier[viewer].half_length, earlier[viewer].half_width);
            Seen { half_size, corners: [0, 1, 2, 3].map(corner) }
        })
    }
}

/// A board's corners seen from another board.
struct Seen {
    /// Of the board that they are seen from.
    half_size: DVec2,
    corners: [Corner; 4],
}

struct Corner {
    /// Where it is seen at either end of the way.
    at: [DVec2; 2],
    /// How far it may get from the straight line between the two.
    leeway_m: f64,
}

impl LinkMotion {
    fn between(front_angle: f64, rear_angle: f64) -> Option<Self> {
        let half_angle = 0.5 * (rear_angle - front_angle);
        if half_angle >= std::f64::consts::FRAC_PI_2 || front_angle <= 0.0 {
            return None;
        }
        let (t, z) = (half_angle.tan(), 1.0 / front_angle + 1.0 / rear_angle);
        Some(Self { lag: z * t, lag_rate: z * z * t * (2.0 + t * t) * (1.0 + z * z) })
    }
}

impl HandleMotion {
    /// A handle at most `radius_m` from the centre, behind links with these sums.
    fn new(b: f64, radius_m: f64, links: LinkMotion) -> Self {
        let LinkMotion { lag, lag_rate } = links;
        let lag = lag.min(1.0);
        Self {
            lag,
            lag_rate,
            speed_m: b.hypot(radius_m * lag),
            acceleration_m: lag_rate * b.hypot(radius_m) + lag * (2.0 * b).hypot(radius_m * lag),
        }
    }
}

impl BenchMotion {
    /// A bench with its two handles seen from the pair's first bench, and its rear handle seen from its own.
    fn new(dragon: &Dragon, bench: usize, b: f64, [front, rear]: [HandleMotion; 2], own_rear: HandleMotion) -> Self {
        let link_m = dragon.dimensions().link_m(bench);
        let overhang_m = dragon.dimensions().overhang_m();
        let own_turn = (b + own_rear.speed_m) / link_m;
        let own_turn_rate = own_rear.acceleration_m / link_m;
        let turn = own_turn + front.lag;
        let turn_rate = own_turn_rate + (own_turn + 1.0) * front.lag_rate + turn * turn;
        let (speed_m, acceleration_m) =
            (front.speed_m.max(rear.speed_m), front.acceleration_m.max(rear.acceleration_m));
        Self {
            speed_m,
            acceleration_m,
            corner_speed_m: speed_m + overhang_m * turn,
            corner_acceleration_m: acceleration_m + overhang_m * turn_rate,
            turn,
            turn_rate,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;

    use super::*;
    use crate::dragon::Dimensions;
    use crate::route::Spiral;

    fn pose(dragon: &Dragon, travel_m: f64) -> Pose {
        let mut pose = Pose::default();
        pose.place_head(dragon, travel_m);
        pose.extend_to(dragon, usize::MAX);
        pose
    }

    /// A pair of benches of a dragon on a spiral, with the dragon at the ends of a way and somewhere between.
    fn ways() -> impl Strategy<Value = (Dragon, [usize; 2], [Pose; 3])> {
        let benches = (1.0..4.0_f64, 1.0..3.0_f64, 0.05..0.5_f64, 0.0..0.45_f64);
        let spirals = (1.05..6.0_f64, 1.0..12.0_f64);
        let ways = (0.0..1.0_f64, 0.01..0.6_f64, 0.01..0.99_f64);
        let any = (benches, spirals, (0_usize..5, 2_usize..25), ways);
        any.prop_filter_map("cannot stand", |(benches, (pitch, turns), (first, gap), (part, length_m, between))| {
            let (head_m, body_m, width_m, hole_m) = benches;
            let dimensions = Dimensions::new(30, head_m, body_m, width_m, hole_m).ok()?;
            let dragon = Dragon::new(dimensions, Arc::new(Spiral::new(pitch * width_m, turns).ok()?)).ok()?;
            let from_m = part * dragon.end_travel_m();
            let to_m = (from_m + length_m).min(dragon.end_travel_m());
            let poses = [from_m, from_m + between * (to_m - from_m), to_m].map(|travel_m| pose(&dragon, travel_m));
            Some((dragon, [first, first + gap], poses))
        })
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 256, failure_persistence: None, ..ProptestConfig::default() })]

        /// The second derivative's bound says more than the leeway at the middle: it falls off towards the ends.
        #[test]
        fn corners_stay_within_their_leeway((dragon, pair, [earlier, between, later]) in ways()) {
            let Some(motion) = CoilMotion::new(&dragon, pair, &earlier, &later) else { return Ok(()) };
            let place = |pose: &Pose| pose.handles[pair[0]].place;
            let angle = place(&later) - place(&earlier);
            let passed = (place(&between) - place(&earlier)) / angle;
            let [earlier, between, later] = [&earlier, &between, &later].map(|pose| pair.map(|bench| &pose.boards[bench]));
            for (viewer, seen) in motion.corners_seen(earlier, later, angle).iter().enumerate() {
                for (corner, point) in seen.corners.iter().zip(between[1 - viewer].corners()) {
                    let off = between[viewer].local(point) - corner.at[0].lerp(corner.at[1], passed);
                    let leeway_m = corner.leeway_m * 4.0 * passed * (1.0 - passed);
                    prop_assert!(off.abs().max_element() <= leeway_m + 1e-11, "{off} is more than {leeway_m}");
                }
            }
        }
    }
}

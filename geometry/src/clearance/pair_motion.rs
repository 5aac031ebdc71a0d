//! Bounds on the relative motion of two benches from one pose to a later one.
//!
//! A parameter grows steadily during the motion. On a spiral it is an angle, and the frame rotates with it (see `spiral_motion`);
//! elsewhere it is an arc (see `curve_motion`). Relative to a board with the centre m and the heading u, a corner c of the
//! other board has the coordinates u·(c − m) and u⊥·(c − m). Their second derivatives are those of c and m in that direction,
//! plus at most 2·|u'|·(|c'| + |m'|) + |u''|·|c − m|. If they are at most E, then over an interval ℓ of the parameter each
//! coordinate stays within E·ℓ²/8 of the straight line between its two ends.
//!
//! A line fixed to one board keeps the other board at a distance if all corners of the other board stay beyond the line. Two
//! boards stay within a distance of each other if one corner does, because the distance to a rectangle is convex.
//!
//! A part of a handle's acceleration is along its tangent. Across a board, only its component in that direction counts. So a
//! change of speed alone does not make boards that slide along each other appear to part.
//!
//! A corner that stays within [`GRAZE_M`] of the straight line is taken to be on it. So boards that slide along each other with
//! a clearance of 0 up to rounding are settled, and not bisected further and further.

use glam::DVec2;

use super::pair::PairPose;
use super::pose::BenchPose;

/// Largest gap at which boards touch, in metres: a few times the rounding of a handle's position.
pub(super) const GRAZE_M: f64 = 1e-12;

/// Bounds on the motion of a pair over an interval and all parts of it, per unit of the parameter. A bound may be infinite.
#[derive(Clone, Copy, Debug)]
pub(super) struct PairMotion {
    pub(super) benches: [BenchMotion; 2],
    /// How far a corner moves relative to the nearest handle, per radian of the heading.
    pub(super) corner_arm_m: f64,
    pub(super) parameter: MotionParameter,
}

/// The parameter of a motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MotionParameter {
    /// The angle of the pair's front handle on a spiral walked inward. The bounds are nearly the same on every part of an interval.
    FrontAngle,
    /// The angle of the pair's rear handle on a spiral walked outward, likewise.
    RearAngle,
    /// The arc that the pair's front handle walks.
    Arc,
    /// Plan time, for benches of two dragons.
    PlanTime,
}

/// Bounds on a bench's motion. Speeds and accelerations are in metres, turns in radians, per unit of the pair's parameter or its
/// square: the unit is a radian, a metre or a second.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct BenchMotion {
    /// Bound on the speed of either handle, and so of the centre.
    pub(super) speed: f64,
    /// Bound on the acceleration of either handle along its tangent.
    pub(super) accel_along: f64,
    /// Bound on the rest of the acceleration of either handle.
    pub(super) accel_across: f64,
    /// Bound on the sines of the angles between the heading and the tangents at the handles.
    pub(super) sine: f64,
    /// Bound on the curvature of the route under the bench, which turns the tangents.
    pub(super) curvature: f64,
    /// |u'|.
    pub(super) turn: f64,
    /// |u''|.
    pub(super) turn_rate: f64,
    /// Bound on the second derivative of half of the length, as it is seen from above; 0 without ground.
    pub(super) growth: f64,
}

impl MotionParameter {
    pub(super) fn is_angle(self) -> bool {
        matches!(self, Self::FrontAngle | Self::RearAngle)
    }

    fn of(self, pose: &PairPose) -> f64 {
        match self {
            Self::FrontAngle => pose.benches[0].front.parameter,
            Self::RearAngle => pose.benches[1].rear.parameter,
            Self::Arc => pose.benches[0].front_travel_m,
            Self::PlanTime => pose.parameter,
        }
    }
}

impl PairMotion {
    /// Bounds for the pair on a part of the interval.
    pub(super) fn between(&self, earlier: &PairPose, later: &PairPose) -> Encounter {
        let length = self.parameter.of(later) - self.parameter.of(earlier);
        let ends = [&earlier.benches, &later.benches];
        Encounter { seen: [0, 1].map(|viewer| self.seen_from(viewer, ends, length)) }
    }

    /// The corners of one board relative to the other board, at both ends of an interval.
    fn seen_from(&self, viewer: usize, ends: [&[BenchPose; 2]; 2], length: f64) -> Seen {
        let (from, to) = (&self.benches[viewer], &self.benches[1 - viewer]);
        let speed = from.speed + to.speed + self.corner_arm_m * to.turn;
        let both = from.accel_across + to.accel_across + self.corner_arm_m * to.turn_rate + 2.0 * from.turn * speed;
        let swing = 0.5 * (from.turn + to.curvature * to.speed) * length;
        let sine = (sine_seen(viewer, ends) + swing).min(1.0);
        let fixed =
            DVec2::new(from.accel_along + to.accel_along, from.sine * from.accel_along + sine * to.accel_along) + both;
        let corners = ends.map(|poses| {
            let board = &poses[viewer].board;
            poses[1 - viewer].board.corners().map(|corner| board.local(corner))
        });
        let corner = |k: usize| {
            let at = [corners[0][k], corners[1][k]];
            let distance_m = at[0].length().max(at[1].length()) + 0.5 * speed * length;
            let leeway_m = 0.125 * (fixed + from.turn_rate * distance_m) * length * length;
            let growth_m = 0.125 * from.growth * length * length;
            Corner { at, leeway_m: DVec2::new(leeway(leeway_m.x + growth_m), leeway(leeway_m.y)) }
        };
        let half_sizes = ends.map(|poses| DVec2::new(poses[viewer].board.half_length, poses[viewer].board.half_width));
        Seen { half_sizes, corners: [0, 1, 2, 3].map(corner) }
    }
}

/// The largest share of the other board's handle speeds across the viewer's board, at the ends of an interval.
fn sine_seen(viewer: usize, ends: [&[BenchPose; 2]; 2]) -> f64 {
    let across = |poses: &[BenchPose; 2]| {
        let (heading, other) = (poses[viewer].board.heading, &poses[1 - viewer]);
        heading.perp_dot(other.front.tangent).abs().max(heading.perp_dot(other.rear.tangent).abs())
    };
    across(ends[0]).max(across(ends[1]))
}

/// The effective leeway: 0 if it is within rounding, infinite if infinite bounds have made it NaN.
fn leeway(metres: f64) -> f64 {
    if metres <= GRAZE_M {
        0.0
    } else if metres.is_nan() {
        f64::INFINITY
    } else {
        metres
    }
}

/// Two boards over an interval, each relative to the other.
pub(super) struct Encounter {
    seen: [Seen; 2],
}

impl Encounter {
    /// Whether boards that are further apart than `clearance_m` at both ends stay so. They do if all corners of one board stay
    /// beyond the same edge of the other by more than that clearance.
    pub(super) fn stays_apart(&self, clearance_m: f64) -> bool {
        self.seen.iter().any(|seen| {
            let beyond = |part: fn(DVec2) -> f64| {
                let is_beyond = |corner: &Corner| {
                    let leeway_m = part(corner.leeway_m).abs();
                    let mut ends = corner.at.into_iter().zip(seen.half_sizes);
                    ends.all(|(at, half_size)| part(at) > part(half_size).abs() + clearance_m + leeway_m)
                };
                seen.corners.iter().all(is_beyond)
            };
            beyond(|at| at.y) || beyond(|at| -at.y) || beyond(|at| at.x) || beyond(|at| -at.x)
        })
    }

    /// The same for boards that are nearest at two corners. They stay apart if all corners of one board stay beyond a line
    /// perpendicular to a unit vector. `directions` contains that vector for each viewer, along and across its board, towards
    /// the other.
    pub(super) fn stays_apart_along(&self, directions: [DVec2; 2], clearance_m: f64) -> bool {
        self.seen.iter().zip(directions).any(|(seen, direction)| {
            let edges_m = seen.half_sizes.map(|half_size| half_size.dot(direction.abs()) + clearance_m);
            let is_beyond = |corner: &Corner| {
                let leeway_m = corner.leeway_m.dot(direction.abs());
                corner.at.into_iter().zip(edges_m).all(|(at, edge_m)| at.dot(direction) > edge_m + leeway_m)
            };
            seen.corners.iter().all(is_beyond)
        })
    }

    /// Whether boards that are within `clearance_m` of each other at both ends stay so. They do if a corner of one board stays
    /// within that clearance of the other.
    pub(super) fn stays_touching(&self, clearance_m: f64) -> bool {
        self.seen.iter().any(|seen| {
            let held = |corner: &Corner| {
                let outside_m =
                    |at: DVec2, half_size: DVec2| (at.abs() + corner.leeway_m - half_size - GRAZE_M).max(DVec2::ZERO);
                let mut ends = corner.at.into_iter().zip(seen.half_sizes);
                ends.all(|(at, half_size)| outside_m(at, half_size).length() <= clearance_m)
            };
            seen.corners.iter().any(held)
        })
    }
}

/// The corners of a board, relative to another board.
struct Seen {
    /// Half length and half width of the other board at each end of the interval.
    half_sizes: [DVec2; 2],
    corners: [Corner; 4],
}

struct Corner {
    /// Relative position at each end of the interval.
    at: [DVec2; 2],
    /// Largest distance from the straight line between the two positions, along and across.
    leeway_m: DVec2,
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::super::pair::Pair;
    use super::super::pose::Pose;
    use super::*;
    use crate::dragon::{Dimensions, Dragon};
    use crate::route::{Line, Route, Segment, Spiral, Turn, Turnaround};

    fn spirals() -> impl Strategy<Value = Arc<Route>> {
        (0.3..3.0_f64, 1.0..12.0_f64).prop_map(|(pitch_m, turns)| {
            let spiral = Route::spiral(pitch_m, turns).expect("a valid spiral");
            Arc::new(spiral)
        })
    }

    /// A line, and a spiral behind it that is walked outward or inward.
    fn spirals_of_paths() -> impl Strategy<Value = Arc<Route>> {
        let winding = prop_oneof![Just(Turn::Clockwise), Just(Turn::CounterClockwise)];
        (0.3..2.0_f64, 6.0..20.0_f64, 40.0..80.0_f64, any::<bool>(), winding).prop_map(
            |(pitch_m, less, more, is_inward, winding)| {
                let [from, to] = if is_inward { [more, less] } else { [less, more] };
                let spiral = Spiral::new(pitch_m, from, to).from_begin(DVec2::ZERO, DVec2::X, winding);
                let line = Segment::Line(Line::up_to(DVec2::ZERO, DVec2::X));
                let route =
                    Route::new(&[line, Segment::Spiral(spiral)], 0.0, [0.0, 1.0]).expect("the spiral begins there");
                let end_m = route.travel(route.seams()[0] + (to - from).abs());
                Arc::new(route.between(0.0, end_m).expect("the end of the spiral"))
            },
        )
    }

    fn turnarounds() -> impl Strategy<Value = Arc<Route>> {
        (0.5..2.5_f64, 4.0..12.0_f64, 0.5..2.0_f64).prop_map(|(pitch_m, diameter_m, ratio)| {
            let turnaround = Turnaround::new(pitch_m, diameter_m, ratio).expect("a valid turn");
            Arc::new(turnaround.between(-2.0, 60.0).expect("a valid span").route())
        })
    }

    /// A pair of benches of a dragon on a route, and poses of the dragon at both ends of an interval and at one travel in
    /// between.
    fn ways(routes: impl Strategy<Value = Arc<Route>>) -> impl Strategy<Value = (Dragon, [usize; 2], [Pose; 3])> {
        let benches = (1.0..4.0_f64, 1.0..3.0_f64, 0.05..0.3_f64, 0.0..0.45_f64);
        let ways = (0.0..1.0_f64, 0.01..0.6_f64, 0.01..0.99_f64);
        let any = (benches, routes, (0_usize..5, 2_usize..25), ways);
        any.prop_filter_map("cannot stand", |(benches, route, (first, gap), (part, length_m, between))| {
            let (head_m, body_m, width_m, hole_m) = benches;
            let dimensions = Dimensions::new(30, head_m, body_m, width_m, hole_m).ok()?;
            let dragon = Dragon::new(dimensions, route).ok()?;
            let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
            let from_m = start_m + part * (end_m - start_m);
            let to_m = (from_m + length_m).min(end_m);
            let poses = [from_m, from_m + between * (to_m - from_m), to_m]
                .map(|travel_m| Pose::of(&dragon, travel_m, usize::MAX));
            Some((dragon, [first, first + gap], poses))
        })
    }

    /// Compares corners with their leeway. The bound on the second derivative is stricter than the leeway at the middle: it
    /// falls off towards the ends.
    fn assert_leeway(
        motion: &PairMotion,
        dragon: &Dragon,
        pair: [usize; 2],
        poses: &[Pose; 3],
    ) -> Result<(), TestCaseError> {
        let [earlier, between, later] = poses.each_ref().map(|pose| Pair::of(dragon, pair).at(pose));
        let parameter = |pose: &PairPose| motion.parameter.of(pose);
        let passed = (parameter(&between) - parameter(&earlier)) / (parameter(&later) - parameter(&earlier));
        for (viewer, seen) in motion.between(&earlier, &later).seen.iter().enumerate() {
            for (corner, point) in seen.corners.iter().zip(between.benches[1 - viewer].board.corners()) {
                let off = between.benches[viewer].board.local(point) - corner.at[0].lerp(corner.at[1], passed);
                let leeway_m = corner.leeway_m * 4.0 * passed * (1.0 - passed);
                prop_assert!(off.abs().cmple(leeway_m + 1e-11).all(), "{off} is more than {leeway_m}");
            }
        }
        Ok(())
    }

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn corners_stay_within_their_leeway_on_spirals((dragon, pair, poses) in ways(spirals())) {
            if let Some(motion) = PairMotion::on_spiral(&dragon, pair, &poses[0], &poses[2]) {
                assert_leeway(&motion, &dragon, pair, &poses)?;
            }
        }

        #[test]
        fn corners_stay_within_their_leeway_on_spirals_of_paths((dragon, pair, poses) in ways(spirals_of_paths())) {
            let motion = PairMotion::on_spiral(&dragon, pair, &poses[0], &poses[2]);
            prop_assume!(motion.is_some());
            assert_leeway(&motion.expect("it is on the spiral"), &dragon, pair, &poses)?;
        }

        #[test]
        fn corners_stay_within_their_leeway_on_turnarounds((dragon, pair, poses) in ways(turnarounds())) {
            let motion = PairMotion::along_curve(&dragon, pair, &poses[0], &poses[2]);
            assert_leeway(&motion, &dragon, pair, &poses)?;
        }
    }
}

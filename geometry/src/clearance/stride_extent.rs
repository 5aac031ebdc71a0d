//! How far a bench reaches in a direction on a stride, by where its handles are at both ends and the arcs that they walk.
//!
//! A handle that walks an arc of the length 2·a between the ends f and g stays where the sum of its distances from f and g is at most
//! 2·a. With the middle m and the half chord c = (g − f)/2, that ellipse reaches n·m ± √(a² − |c|² + (n·c)²) in the direction n.
//!
//! A board is the segment between its handles, grown by the hole offset h along its heading u and by half of the width across. In the
//! direction n, that is at most h·|n·u| more than the handles, plus half of the width. |n·u| is the extent of the link in that direction,
//! divided by its length. On ground, h is seen shorter by the same share as the link.
//!
//! Benches behind each other walk over the same places, one after the other. There, the links between them prove more. Let d be a
//! direction and n the one across. A link of the length L whose handles reach over a width of δ < L in the direction n is at least
//! √(L² − δ²) long in the direction d at every instant, and keeps its sense. So the gap of two benches in the direction d is at least the
//! sum of that over the links between them, less what their boards reach beyond their handles.

use glam::DVec2;

use crate::dragon::board::Board;
use crate::dragon::{Dimensions, Dragon};

/// Bound on the error of a place of a handle, in metres. It is large for repeated places of a long walk, and on large spirals that are nearly
/// arcs; elsewhere places are exact to some 10⁻¹² m.
pub(super) const PLACE_ERROR_M: f64 = 1e-5;

/// Where a handle may be on a stride.
#[derive(Clone, Copy, Debug)]
pub(super) struct WalkedArc {
    middle: DVec2,
    half_chord: DVec2,
    /// a² − |c|²
    bulge_m2: f64,
}

/// Where a bench may be on a stride.
#[derive(Clone, Copy, Debug)]
pub(super) struct StrideExtent {
    handles: [WalkedArc; 2],
    link_m: f64,
    hole_offset_m: f64,
    half_width_m: f64,
}

impl WalkedArc {
    /// The places of a handle that walks at most `arc_m` from one place to another.
    pub(super) fn new(ends: [DVec2; 2], arc_m: f64) -> Self {
        let [from, to] = ends;
        let half_chord = 0.5 * (to - from);
        let bulge_m2 = (0.25 * arc_m * arc_m - half_chord.length_squared()).max(0.0);
        Self { middle: 0.5 * (from + to), half_chord, bulge_m2 }
    }

    /// Its place at the earlier end of the stride.
    fn begin(&self) -> DVec2 {
        self.middle - self.half_chord
    }

    /// The middle of the places in a direction, and how far they reach from it.
    fn along(&self, direction: DVec2) -> [f64; 2] {
        let along_m = direction.dot(self.half_chord);
        [direction.dot(self.middle), (self.bulge_m2 + along_m * along_m).sqrt()]
    }
}

impl StrideExtent {
    /// The places of a bench, from those of its front and its rear handle.
    pub(super) fn new(dragon: &Dragon, bench: usize, handles: [WalkedArc; 2]) -> Self {
        let dimensions: &Dimensions = dragon.dimensions();
        Self {
            handles,
            link_m: dimensions.link_m(bench),
            hole_offset_m: dimensions.hole_offset_m(),
            half_width_m: 0.5 * dimensions.width_m(),
        }
    }

    /// Whether the benches are proved to stay further apart than `clearance_m`. The directions across each bench and between their middles
    /// are tried.
    pub(super) fn stays_apart(&self, other: &Self, clearance_m: f64) -> bool {
        let directions = [self.across(), other.across(), (other.middle() - self.middle()).normalize_or_zero()];
        directions.into_iter().any(|direction| {
            let [[from, to], [other_from, other_to]] = [self.span_m(direction), other.span_m(direction)];
            other_from - to > clearance_m || from - other_to > clearance_m
        })
    }

    /// The least and the greatest coordinate of the board in the direction of a unit vector.
    fn span_m(&self, direction: DVec2) -> [f64; 2] {
        let [[front_m, front_reach_m], [rear_m, rear_reach_m]] = self.handles.map(|handle| handle.along(direction));
        let link_m = (front_m - rear_m).abs() + front_reach_m + rear_reach_m;
        let beyond_m = self.hole_offset_m * (link_m / self.link_m).min(1.0) + self.half_width_m;
        [
            (front_m - front_reach_m).min(rear_m - rear_reach_m) - beyond_m,
            (front_m + front_reach_m).max(rear_m + rear_reach_m) + beyond_m,
        ]
    }

    /// A rectangle around all places of the board.
    pub(super) fn rectangle(&self) -> Board {
        let across = if self.across() == DVec2::ZERO { DVec2::Y } else { self.across() };
        let heading = -across.perp();
        let [[rear_m, front_m], [right_m, left_m]] = [heading, across].map(|direction| self.span_m(direction));
        Board {
            centre: 0.5 * (rear_m + front_m) * heading + 0.5 * (right_m + left_m) * across,
            heading,
            half_length: 0.5 * (front_m - rear_m),
            half_width: 0.5 * (left_m - right_m),
        }
    }

    fn middle(&self) -> DVec2 {
        0.5 * (self.handles[0].middle + self.handles[1].middle)
    }

    /// The unit vector across the bench.
    fn across(&self) -> DVec2 {
        (self.handles[0].middle - self.handles[1].middle).perp().normalize_or_zero()
    }
}

/// Whether the links between two benches are proved to keep them further apart than `clearance_m`, on level ground. `handles` are those
/// of the first bench, of the links between, and of the second bench.
pub(super) fn is_kept_apart(
    dragon: &Dragon,
    [first, second]: [usize; 2],
    handles: impl Fn(usize) -> WalkedArc,
    clearance_m: f64,
) -> bool {
    let dimensions = dragon.dimensions();
    let ahead = (handles(first).begin() - handles(second + 1).begin()).normalize_or_zero();
    let mut gap_m = -clearance_m;
    for bench in first..=second {
        let [front, rear] = [handles(bench), handles(bench + 1)];
        let [[front_m, front_reach_m], [rear_m, rear_reach_m]] = [front, rear].map(|handle| handle.along(ahead.perp()));
        let (link_m, width_m) = (dimensions.link_m(bench), (front_m - rear_m).abs() + front_reach_m + rear_reach_m);
        if width_m >= link_m || ahead.dot(front.begin() - rear.begin()) <= 0.0 {
            return false;
        }
        gap_m += if bench == first || bench == second {
            -dimensions.hole_offset_m() - 0.5 * dimensions.width_m() * width_m / link_m
        } else {
            (link_m * link_m - width_m * width_m).sqrt()
        };
    }
    gap_m > 0.0
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::super::pose::Pose;
    use super::*;
    use crate::ground::Ground;
    use crate::route::{PathSegment, PathSpec, RouteSpec, Turnaround};

    /// Rounding of positions.
    const ROUNDING_M: f64 = 1e-9;

    /// A dragon on a turnaround, on level ground or on a slope, and its poses at both ends of a stride and in between.
    fn strides() -> impl Strategy<Value = (Dragon, [Pose; 3])> {
        let benches = (1.0..4.0_f64, 1.0..3.0_f64, 0.05..0.6_f64, 0.0..0.45_f64);
        let turns = (0.5..2.5_f64, 4.0..12.0_f64, 0.5..2.0_f64);
        let slopes = proptest::option::of((-0.8..0.8_f64, -0.8..0.8_f64));
        let parts = (0.0..1.0_f64, 0.01..3.0_f64, 0.0..1.0_f64);
        (benches, turns, slopes, parts).prop_filter_map("cannot stand", |(benches, turn, slope, parts)| {
            let (head_m, body_m, width_m, hole_m) = benches;
            let dimensions = Dimensions::new(12, head_m, body_m, width_m, hole_m).ok()?;
            let (pitch_m, diameter_m, ratio) = turn;
            let mut route = Turnaround::new(pitch_m, diameter_m, ratio).ok()?.between(-2.0, 60.0).ok()?.route();
            if let Some((x, y)) = slope {
                let ground = Ground::plane(DVec2::new(x, y)).ok()?;
                route = route.on_ground(&ground, -2.0, Some(60.0), 12.0 * head_m.max(body_m)).ok()?;
            }
            let dragon = Dragon::new(dimensions, Arc::new(route)).ok()?;
            let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
            let (part, length_m, between) = parts;
            let from_m = start_m + part * (end_m - start_m);
            let to_m = (from_m + length_m).min(end_m);
            let poses = [from_m, from_m + between * (to_m - from_m), to_m]
                .map(|travel_m| Pose::of(&dragon, travel_m, usize::MAX));
            Some((dragon, poses))
        })
    }

    fn arc([earlier, .., later]: &[Pose; 3], handle: usize) -> WalkedArc {
        let ends = [earlier, later].map(|pose| pose.handles[handle].position);
        WalkedArc::new(ends, later.handle_travels_m[handle] - earlier.handle_travels_m[handle] + ROUNDING_M)
    }

    fn extent(dragon: &Dragon, bench: usize, poses: &[Pose; 3]) -> StrideExtent {
        StrideExtent::new(dragon, bench, [bench, bench + 1].map(|handle| arc(poses, handle)))
    }

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn no_board_reaches_beyond_its_extent((dragon, poses) in strides(), angle in 0.0..6.3_f64) {
            let direction = DVec2::from_angle(angle);
            for (bench, board) in poses[1].boards.iter().enumerate() {
                let [from_m, to_m] = extent(&dragon, bench, &poses).span_m(direction);
                for corner in board.corners() {
                    let at_m = corner.dot(direction);
                    prop_assert!(from_m - ROUNDING_M <= at_m && at_m <= to_m + ROUNDING_M, "{bench}: {at_m} in {from_m}..{to_m}");
                }
            }
        }

        #[test]
        fn no_board_leaves_the_rectangle_of_its_extent((dragon, poses) in strides()) {
            for (bench, board) in poses[1].boards.iter().enumerate() {
                let rectangle = extent(&dragon, bench, &poses).rectangle();
                for corner in board.corners() {
                    let at = corner - rectangle.centre;
                    let beyond_m = [
                        rectangle.heading.dot(at).abs() - rectangle.half_length,
                        rectangle.heading.perp_dot(at).abs() - rectangle.half_width,
                    ];
                    prop_assert!(beyond_m.iter().all(|&beyond_m| beyond_m <= ROUNDING_M), "{bench}: {beyond_m:?}");
                }
            }
        }

        #[test]
        fn benches_that_stay_apart_are_never_nearer((dragon, poses) in strides(), clearance_m in 0.0..1.0_f64) {
            let extents: Vec<_> = (0..poses[1].boards.len()).map(|bench| extent(&dragon, bench, &poses)).collect();
            for [first, second] in Dimensions::leading_pairs(extents.len()) {
                if extents[first].stays_apart(&extents[second], clearance_m) {
                    let found_m = poses[1].boards[first].clearance(&poses[1].boards[second]);
                    prop_assert!(found_m >= clearance_m - ROUNDING_M, "{first} and {second}: {found_m} < {clearance_m}");
                }
            }
        }

        #[test]
        fn benches_that_their_links_keep_apart_are_never_nearer((dragon, poses) in strides(), clearance_m in 0.0..1.0_f64) {
            prop_assume!(!dragon.route().is_on_ground());
            for [first, second] in Dimensions::leading_pairs(poses[1].boards.len()) {
                if is_kept_apart(&dragon, [first, second], |handle| arc(&poses, handle), clearance_m) {
                    let found_m = poses[1].boards[first].clearance(&poses[1].boards[second]);
                    prop_assert!(found_m >= clearance_m - ROUNDING_M, "{first} and {second}: {found_m} < {clearance_m}");
                }
            }
        }
    }

    #[test]
    fn benches_that_walk_behind_each_other_over_the_same_places_are_kept_apart_by_the_link_between() {
        let dimensions = Dimensions::new(5, 2.0, 2.0, 0.3, 0.25).expect("valid dimensions");
        let line = RouteSpec::from(PathSpec { segments: vec![PathSegment::Line { length_m: 60.0 }], laps: None });
        let route = line.build(1.0, dimensions.links_m()).expect("a valid line");
        let dragon = Dragon::new(dimensions, Arc::new(route)).expect("the dragon stands");
        let poses = [20.0, 20.5, 21.5].map(|travel_m| Pose::of(&dragon, travel_m, usize::MAX));
        let is_kept = |clearance_m: f64| is_kept_apart(&dragon, [0, 2], |handle| arc(&poses, handle), clearance_m);
        // A link of 1.5 m between holes that are 0.25 m from the ends of the boards.
        assert!(!extent(&dragon, 0, &poses).stays_apart(&extent(&dragon, 2, &poses), 0.0));
        assert!(is_kept(0.9999));
        assert!(!is_kept(1.0001));
    }

    #[test]
    fn boards_beside_each_other_are_told_apart_while_they_walk() {
        let straight = |y: f64, handle: usize| {
            let x = 2.0 - 2.0 * handle as f64;
            WalkedArc::new([DVec2::new(x, y), DVec2::new(x + 0.5, y)], 0.5)
        };
        let bench = |y: f64| StrideExtent {
            handles: [straight(y, 0), straight(y, 1)],
            link_m: 2.0,
            hole_offset_m: 0.25,
            half_width_m: 0.15,
        };
        // A gap of 0.1 m between boards that are 0.3 m wide.
        assert!(bench(0.0).stays_apart(&bench(0.4), 0.0999));
        assert!(!bench(0.0).stays_apart(&bench(0.4), 0.1001));
        assert_eq!(bench(0.0).span_m(DVec2::X), [-0.4, 2.9]);
    }
}

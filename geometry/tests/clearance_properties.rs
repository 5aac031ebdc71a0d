//! The clearance of two boards, compared with parry2d and with its definition.

use std::f64::consts::TAU;

use bench_dragon_geometry::dragon::Board;
use glam::DVec2;
use parry2d_f64::math::{Pose2, Rot2};
use parry2d_f64::query;
use parry2d_f64::shape::Cuboid;
use proptest::prelude::*;
use test_support::dragons::boards;
use test_support::property::random_cases;

fn shape(board: &Board) -> (Pose2, Cuboid) {
    let rotation = Rot2::from_cos_sin_unchecked(board.heading.x, board.heading.y);
    let half_extents = DVec2::new(board.half_length, board.half_width);
    (Pose2::from_parts(board.centre, rotation), Cuboid::new(half_extents))
}

fn parry_clearance(first: &Board, second: &Board) -> f64 {
    let ((first_pose, first), (second_pose, second)) = (shape(first), shape(second));
    let contact = query::contact(&first_pose, &first, &second_pose, &second, 100.0).expect("cuboids are supported");
    contact.expect("the boards are less than 100 m apart").dist
}

/// The gap between the projections of two boards onto `direction`.
fn projected_gap(first: &Board, second: &Board, direction: DVec2) -> f64 {
    let near = first.corners().map(|corner| corner.dot(direction)).into_iter().fold(f64::NEG_INFINITY, f64::max);
    let far = second.corners().map(|corner| corner.dot(direction)).into_iter().fold(f64::INFINITY, f64::min);
    far - near
}

proptest! {
    #![proptest_config(random_cases(1024))]

    #[test]
    fn clearance_is_parrys_distance_or_minus_its_depth(first in boards(3.0), second in boards(3.0)) {
        let (ours, theirs) = (first.clearance(&second), parry_clearance(&first, &second));
        prop_assert!((ours - theirs).abs() < 1e-9, "{ours} against {theirs}");
        prop_assert_eq!(first.overlaps(&second), ours <= 0.0);
        prop_assert_eq!(first.approach(&second).clearance_m, ours);
    }

    #[test]
    fn clearance_is_the_same_from_either_board(first in boards(3.0), second in boards(3.0)) {
        prop_assert!((first.clearance(&second) - second.clearance(&first)).abs() < 1e-14);
    }

    #[test]
    fn clearance_is_the_largest_gap_between_projections(first in boards(3.0), second in boards(3.0)) {
        let approach = first.approach(&second);
        let along = projected_gap(&first, &second, approach.direction);
        prop_assert!((along - approach.clearance_m).abs() < 1e-12, "{along} along the approach's direction");
        for step in 0..720 {
            let gap = projected_gap(&first, &second, DVec2::from_angle(TAU * f64::from(step) / 720.0));
            prop_assert!(gap <= approach.clearance_m + 1e-14, "{gap} over {}", approach.clearance_m);
        }
    }

    #[test]
    fn point_of_an_approach_is_between_the_boards_or_in_both(first in boards(2.0), second in boards(2.0)) {
        let approach = first.approach(&second);
        let point = Board { centre: approach.point, half_length: 0.0, half_width: 0.0, ..first };
        let half_m = 0.5 * approach.clearance_m.max(0.0);
        for board in [first, second] {
            let distance_m = board.clearance(&point).max(0.0);
            prop_assert!((distance_m - half_m).abs() < 1e-12, "{distance_m} m instead of {half_m} m");
        }
    }

    #[test]
    fn boards_that_share_an_edge_have_no_clearance(board in boards(3.0), slide in -0.9..0.9_f64) {
        let beside = 2.0 * board.half_width * board.heading.perp();
        let along = 2.0 * slide * board.half_length * board.heading;
        let neighbour = Board { centre: board.centre + beside + along, ..board };
        prop_assert!(board.clearance(&neighbour).abs() < 1e-14);
    }
}

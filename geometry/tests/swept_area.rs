//! The area that boards sweep, in closed form and compared with dense samples of the run.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use bench_dragon_geometry::clearance::SweptArea;
use bench_dragon_geometry::dragon::{Board, Dimensions, Dragon, Meter};
use bench_dragon_geometry::formation::{Formation, Planned, Timetable};
use bench_dragon_geometry::route::{PathSegment, PathSpec, RouteSpec};
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::paper_dragon;
use test_support::property::random_cases;

fn formation(dragon: Dragon) -> Formation {
    let timetable = Timetable::new(1.0, None, 0.0, dragon.end_travel_m());
    Formation::of_one(Planned { dragon: Arc::new(dragon), timetable })
}

fn on_path(dimensions: Dimensions, segments: Vec<PathSegment>, laps: Option<u32>) -> Option<Formation> {
    let route = RouteSpec::from(PathSpec { segments, laps }).build(1.0, dimensions.links_m()).ok()?;
    Some(formation(Dragon::new(dimensions, Arc::new(route)).ok()?))
}

fn swept(formation: &Formation, tolerance_m: f64) -> SweptArea {
    SweptArea::of(formation, tolerance_m).expect("no limit")
}

/// Length of all borders.
fn border_m(area: &SweptArea) -> f64 {
    edges(area).map(|[from, to]| from.distance(to)).sum()
}

fn edges(area: &SweptArea) -> impl Iterator<Item = [DVec2; 2]> {
    area.parts.iter().flatten().flat_map(|border| {
        let next = border.iter().cycle().skip(1);
        border.iter().zip(next).map(|(&from, &to)| [from, to])
    })
}

/// Distance of a point outside the area from it, and 0 inside.
fn outside_m(area: &SweptArea, point: DVec2) -> f64 {
    let crosses = |[from, to]: &[DVec2; 2]| {
        (from.y <= point.y) != (to.y <= point.y) && ((to - from).perp_dot(point - from) > 0.0) == (to.y > from.y)
    };
    if edges(area).filter(crosses).count() % 2 == 1 {
        return 0.0;
    }
    let distance_m = |[from, to]: [DVec2; 2]| {
        let along = to - from;
        let share = ((point - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
        point.distance(from + share * along)
    };
    edges(area).map(distance_m).fold(f64::INFINITY, f64::min)
}

fn board_distance_m(board: &Board, point: DVec2) -> f64 {
    let off = point - board.centre;
    let local = DVec2::new(off.dot(board.heading), board.heading.perp_dot(off)).abs();
    (local - DVec2::new(board.half_length, board.half_width)).max(DVec2::ZERO).length()
}

/// A straight walk sweeps a rectangle, whatever the tolerance.
#[test]
fn boards_on_a_straight_line_sweep_a_rectangle() {
    for benches in [1, 2, 7] {
        let dimensions = Dimensions::new(benches, 3.0, 2.0, 0.4, 0.25).expect("valid");
        let formation = on_path(dimensions, vec![PathSegment::Line { length_m: 30.0 }], None).expect("it stands");
        let area = swept(&formation, 0.1);
        let length_m = 30.0 + dimensions.links_m() + 0.5;
        assert!((area.area_m2() - 0.4 * length_m).abs() < 1e-6, "{} m²", area.area_m2());
        assert_eq!((area.parts.len(), area.parts[0].len()), (1, 1), "{area:?}");
        let [low, high] = area.bounds();
        assert!((high - DVec2::new(30.25, 0.2)).length() < 1e-8, "{high}");
        assert!((low - DVec2::new(30.25 - length_m, -0.2)).length() < 1e-8, "{low}");
    }
}

/// A board whose hinges walk on a circle of radius R has its centre at √(R² − d²/4). Its inner side is nearest to the middle at its
/// centre, and its outer corners are the furthest.
#[test]
fn boards_on_a_circle_sweep_a_ring() {
    let (radius_m, length_m, width_m, hole_m) = (3.0_f64, 2.0_f64, 0.4, 0.25);
    let dimensions = Dimensions::new(1, length_m, length_m, width_m, hole_m).expect("valid");
    let arc = PathSegment::Arc { radius_m, turn: TAU };
    let formation = on_path(dimensions, vec![arc], Some(1)).expect("it stands");
    let link_m = length_m - 2.0 * hole_m;
    let centre_m = (radius_m * radius_m - 0.25 * link_m * link_m).sqrt();
    let (inner_m, outer_m) = (centre_m - 0.5 * width_m, (centre_m + 0.5 * width_m).hypot(0.5 * length_m));
    let true_m2 = PI * (outer_m * outer_m - inner_m * inner_m);
    let mut last_m2 = f64::INFINITY;
    for tolerance_m in [0.1, 0.01, 0.001] {
        let area = swept(&formation, tolerance_m);
        assert_eq!((area.parts.len(), area.parts[0].len()), (1, 2), "a ring has one hole");
        let excess_m2 = area.area_m2() - true_m2;
        assert!(
            (0.0..=1.01 * tolerance_m * TAU * (inner_m + outer_m)).contains(&excess_m2),
            "{tolerance_m}: {excess_m2}"
        );
        let middle = DVec2::new(0.0, radius_m);
        for point in &area.parts[0][0] {
            let outside_m = point.distance(middle) - outer_m;
            assert!(outside_m <= tolerance_m, "{outside_m} m outside, tolerance {tolerance_m}");
        }
        for point in &area.parts[0][1] {
            assert!(point.distance(middle) <= inner_m + 1e-9 && point.distance(middle) >= inner_m - tolerance_m);
        }
        assert!(area.area_m2() < last_m2, "a smaller tolerance gives a smaller area");
        last_m2 = area.area_m2();
    }
}

/// A longer arc adds a sector of the ring: the ends of both areas are alike.
#[test]
fn a_longer_arc_adds_a_sector_of_the_ring() {
    let (radius_m, length_m, width_m, hole_m) = (5.0_f64, 1.0_f64, 0.4, 0.2);
    let dimensions = Dimensions::new(1, length_m, length_m, width_m, hole_m).expect("valid");
    let link_m = length_m - 2.0 * hole_m;
    let centre_m = (radius_m * radius_m - 0.25 * link_m * link_m).sqrt();
    let (inner_m, outer_m) = (centre_m - 0.5 * width_m, (centre_m + 0.5 * width_m).hypot(0.5 * length_m));
    let tolerance_m = 0.0005;
    let [less, more] = [1.5, 3.5].map(|turn| {
        let arc = PathSegment::Arc { radius_m, turn };
        swept(&on_path(dimensions, vec![arc], None).expect("it stands"), tolerance_m)
    });
    let sector_m2 = 0.5 * (3.5 - 1.5) * (outer_m * outer_m - inner_m * inner_m);
    let error_m2 = more.area_m2() - less.area_m2() - sector_m2;
    assert!(error_m2.abs() < tolerance_m * border_m(&more), "{error_m2} m²");
}

fn segments() -> impl Strategy<Value = PathSegment> {
    let turn = || prop_oneof![-4.0..-0.2_f64, 0.2..4.0_f64];
    prop_oneof![
        (0.5..5.0_f64).prop_map(|length_m| PathSegment::Line { length_m }),
        (1.6..4.0_f64, turn()).prop_map(|(radius_m, turn)| PathSegment::Arc { radius_m, turn }),
    ]
}

proptest! {
    #![proptest_config(random_cases(60))]

    #[test]
    fn the_area_has_all_that_boards_cover_and_no_more_than_the_tolerance(
        (count, head_m, body_m, width_m) in (1_usize..8, 1.0..2.5_f64, 0.8..2.0_f64, 0.1..0.3_f64),
        path in prop::collection::vec(segments(), 1..5), tolerance_m in 0.005..0.1_f64,
    ) {
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, 0.1).expect("valid");
        let Some(formation) = on_path(dimensions, path, None) else { return Ok(()) };
        let area = swept(&formation, tolerance_m);
        let (begin_m, end_m) = (formation.begin_m(), formation.end_m());
        let steps = ((end_m - begin_m) / 0.01).ceil();
        let boards: Vec<Board> = (0..=steps as u32)
            .flat_map(|step| formation.boards_at((begin_m + (end_m - begin_m) * f64::from(step) / steps).min(end_m)))
            .collect();
        for board in boards.iter().step_by(7) {
            for point in board.corners().into_iter().chain([board.centre]) {
                let outside_m = outside_m(&area, point);
                prop_assert!(outside_m < 1e-8, "{point} is {outside_m} m outside");
            }
        }
        for [point, next] in edges(&area) {
            for at in [point, 0.5 * (point + next)] {
                let from_boards_m = boards.iter().map(|board| board_distance_m(board, at)).fold(f64::INFINITY, f64::min);
                // A step between samples moves a board by less than this.
                prop_assert!(from_boards_m <= tolerance_m + 0.02, "{at} is {from_boards_m} m from all boards");
            }
        }
    }
}

#[test]
fn the_papers_dragon_sweeps_its_square_within_the_limit_of_work() {
    let dragon = formation(paper_dragon());
    let area = swept(&dragon, 0.01);
    let [low, high] = area.bounds();
    assert!(low.min_element() > -12.5 && high.max_element() < 12.5, "{low} to {high}");
    // Less than all of the disc on which it stands, and more than its boards.
    assert!((300.0..450.0).contains(&area.area_m2()), "{}", area.area_m2());
    assert!(SweptArea::of(&dragon.metered(&Meter::of(10_000)), 0.01).is_err());
}

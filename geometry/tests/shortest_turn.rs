//! The shortest S: it is clear, and no tighter S of a separate grid is clear.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{DragonError, FeasibleEnd, Meter};
use bench_dragon_geometry::ground::Ground;
use bench_dragon_geometry::planner::{
    Infeasible, Obstacle, PlannedTurn, Staging, TurnPassage, largest_speed_ratio, passage_through, shortest_turn,
    shortest_turn_with_line, walk_through,
};
use bench_dragon_geometry::route::{Placement, Turnaround};
use glam::DVec2;
use test_support::dragons::{boards_at, handles_at, least_clearance_m, paper_benches};
use test_support::hills::{hills, hills_every, plane};

fn turn(pitch_m: f64, radius_m: f64, ratio: f64) -> Turnaround {
    Turnaround::new(pitch_m, 2.0 * radius_m, ratio).expect("valid")
}

#[test]
fn shortest_turn_of_the_paper_lies_between_a_stop_and_a_jump_of_the_first_handle() {
    let shortest =
        shortest_turn(turn(1.7, 4.5, 2.0), paper_benches(223), Staging::LIMITLESS, &Meter::unlimited(), |_| ())
            .expect("no limit")
            .expect("the paper's dragon turns");
    let radius_m = 0.5 * shortest.turnaround.turn_diameter_m();
    assert!(matches!(
        walk_through(shortest.turnaround, paper_benches(223), Staging::LIMITLESS, &Meter::unlimited(), |_| ()),
        TurnPassage::Clear { .. }
    ));
    let ends = shortest
        .limits
        .map(|limit| if let Some(Obstacle::Fault { end, .. }) = limit { end } else { FeasibleEnd::RouteEnd });
    assert_eq!(ends, [FeasibleEnd::HandleStops { handle: 1 }, FeasibleEnd::HandleJumps { handle: 1 }]);
    // The way out is the way in, turned and walked backwards. A jump is a stop walked backwards.
    assert!((shortest.radius_ratio - 1.0).abs() < 1e-4, "{shortest:?}");
    let passes = |radius_m: f64, ratio: f64| {
        let turn = turn(1.7, radius_m, ratio).between(-1.0, 1.0).expect("valid");
        passage_through(turn, paper_benches(4), &Meter::unlimited()).is_ok()
    };
    assert!(passes(radius_m, shortest.radius_ratio));
    for i in 0..=400 {
        let near = shortest.radius_ratio * (1.0 + 1e-5 * (f64::from(i) / 200.0 - 1.0));
        assert!(!passes(radius_m - 3e-5, near), "ratio {near}");
        let far = 8.0_f64.powf(f64::from(i) / 200.0 - 1.0);
        assert!(!passes(radius_m - 3e-5, far), "ratio {far}");
        assert!(!passes(0.9 * radius_m, far), "ratio {far}");
    }
}

#[test]
fn circle_too_small_for_any_turn_has_no_shortest_turn() {
    assert_eq!(
        shortest_turn(turn(1.7, 2.5, 2.0), paper_benches(20), Staging::LIMITLESS, &Meter::unlimited(), |_| ())
            .expect("no limit"),
        None
    );
}

#[test]
fn shortest_turn_stays_on_its_spiral() {
    let shortest =
        shortest_turn(turn(1.7, 4.5, 2.0), paper_benches(20), Staging::LIMITLESS, &Meter::unlimited(), |_| ())
            .expect("no limit")
            .expect("the dragon turns");
    assert!((shortest.turnaround.pitch_m() - 1.7).abs() < 1e-15);
}

/// The fastest handle limits the turn. At the answer its speed equals the limit. On a grid of tighter turns, a handle is faster
/// or does not walk.
#[test]
fn shortest_turn_within_a_speed_is_the_tightest_of_a_grid() {
    let staging = Staging { clearance_m: 0.05, speed_ratio: 2.0 };
    let shortest = shortest_turn(turn(1.7, 4.5, 2.0), paper_benches(20), staging, &Meter::unlimited(), |_| ())
        .expect("no limit")
        .expect("the dragon turns");
    let radius_m = 0.5 * shortest.turnaround.turn_diameter_m();
    let largest = |radius_m: f64, ratio: f64| {
        let passage = passage_through(turn(1.7, radius_m, ratio), paper_benches(20), &Meter::unlimited());
        passage.and_then(|dragon| largest_speed_ratio(&dragon)).map_or(f64::INFINITY, |largest| largest.ratio)
    };
    let at_answer = largest(radius_m, shortest.radius_ratio);
    assert!(at_answer <= 2.0 && at_answer > 1.999, "{at_answer} in {shortest:?}");
    assert!(shortest.closest.expect("pairs").pair.clearance_m > 0.05, "{shortest:?}");
    assert!(shortest.limits.iter().all(|limit| matches!(limit, Some(Obstacle::TooFast(_)))), "{shortest:?}");
    for i in 0..=100 {
        let (near, far) = (1.1_f64.powf(f64::from(i) / 50.0 - 1.0), 8.0_f64.powf(f64::from(i) / 50.0 - 1.0));
        assert!(largest(radius_m - 1e-4, shortest.radius_ratio * near) > 2.0, "ratio {near}");
        assert!(largest(0.95 * radius_m, far) > 2.0, "ratio {far}");
    }
}

#[test]
fn a_turn_outside_its_limits_reports_the_pair_or_the_handle() {
    let walk = |clearance_m, speed_ratio| {
        let staging = Staging { clearance_m, speed_ratio };
        walk_through(turn(1.7, 4.5, 2.0), paper_benches(223), staging, &Meter::unlimited(), |_| ())
    };
    let TurnPassage::Contact(contact) = walk(0.3, f64::INFINITY) else { panic!("0.279 m remain") };
    assert_eq!(contact.benches, [0, 16]);
    let TurnPassage::TooFast(largest) = walk(0.0, 1.6) else { panic!("the ratio is 1.6048") };
    assert!((largest.ratio - 1.604_793).abs() < 5.001e-7 && largest.handle == 3, "{largest:?}");
    assert!(matches!(walk(0.279, 1.605), TurnPassage::Clear { .. }));
}

/// The turn with this line whose S has this length.
fn turn_of_length(length_m: f64, ratio: f64, line_m: f64) -> Turnaround {
    let with = |radius_m: f64| Turnaround::with_line(1.7, 2.0 * radius_m, ratio, line_m).expect("valid");
    let (mut low_m, mut high_m) = (0.5 * line_m + 1e-6, 4.5);
    for _ in 0..50 {
        let middle_m = 0.5 * (low_m + high_m);
        if with(middle_m).turn_length_m() < length_m { low_m = middle_m } else { high_m = middle_m }
    }
    with(low_m)
}

/// A line relaxes the links between the arcs. Within limits of clearance and speed, the paper's turn becomes 1.5 % shorter. On a
/// grid of other lines and ratios, no S that is shorter by 5 mm keeps the speed.
#[test]
fn a_line_shortens_the_turn_within_its_limits() {
    let staging = Staging { clearance_m: 0.05, speed_ratio: 2.0 };
    let (planned, dimensions, meter) = (turn(1.7, 4.5, 2.0), paper_benches(20), Meter::unlimited());
    let arcs = shortest_turn(planned, dimensions, staging, &meter, |_| ()).expect("no limit").expect("it turns");
    let lined = shortest_turn_with_line(planned, dimensions, staging, Some(&arcs), &meter, |_| ())
        .expect("no limit")
        .expect("a line shortens the turn");
    let (length_m, line_m) = (lined.turnaround.turn_length_m(), lined.turnaround.line_m());
    assert!(length_m < 0.986 * arcs.turnaround.turn_length_m(), "{lined:?}");
    assert!(((100.0 * line_m).round() - 100.0 * line_m).abs() < 1e-9, "{line_m} m is not in whole centimetres");
    assert!(matches!(walk_through(lined.turnaround, dimensions, staging, &meter, |_| ()), TurnPassage::Clear { .. }));
    for i in 1..=15 {
        for k in -10..=10 {
            let turn = turn_of_length(length_m - 0.005, 1.02_f64.powi(k), 0.1 * f64::from(i));
            let passage = passage_through(turn, dimensions, &meter).and_then(|dragon| largest_speed_ratio(&dragon));
            assert!(passage.is_err() || passage.is_ok_and(|largest| largest.ratio > 2.0), "{turn:?}");
        }
    }
}

#[test]
fn without_a_limit_of_speed_a_line_shortens_the_turn_by_a_twentieth() {
    let (planned, dimensions, meter) = (turn(1.7, 4.5, 2.0), paper_benches(20), Meter::unlimited());
    let arcs = shortest_turn(planned, dimensions, Staging::LIMITLESS, &meter, |_| ()).expect("no limit");
    let lined = shortest_turn_with_line(planned, dimensions, Staging::LIMITLESS, arcs.as_ref(), &meter, |_| ())
        .expect("no limit")
        .expect("a line shortens the turn");
    let arcs_m = arcs.expect("it turns").turnaround.turn_length_m();
    assert!(lined.turnaround.turn_length_m() < 0.952 * arcs_m, "{lined:?}");
    let walked = walk_through(lined.turnaround, dimensions, Staging::LIMITLESS, &meter, |_| ());
    assert!(matches!(walked, TurnPassage::Clear { .. }), "{walked:?}");
}

#[test]
fn a_line_does_not_help_in_a_circle_too_small_for_any_turn() {
    let found = shortest_turn_with_line(
        turn(1.7, 2.5, 2.0),
        paper_benches(20),
        Staging::LIMITLESS,
        None,
        &Meter::unlimited(),
        |_| (),
    );
    assert_eq!(found.expect("no limit"), None);
}

fn on(turn: Turnaround, ground: Ground) -> PlannedTurn {
    PlannedTurn::on(turn, Some(Arc::new(ground)))
}

#[test]
fn on_a_level_plane_a_turn_has_the_answers_of_level_ground() {
    let staging = Staging { clearance_m: 0.05, speed_ratio: 2.0 };
    let (planned, dimensions, meter) = (turn(1.7, 4.5, 2.0), paper_benches(20), Meter::unlimited());
    let level = on(planned, plane(0.0, 0.0));
    let closest = |passage| match passage {
        TurnPassage::Clear { closest } => closest.expect("there are pairs"),
        other => panic!("{other:?}"),
    };
    let [flat, raised] = [planned.into(), level.clone()]
        .map(|turn: PlannedTurn| closest(walk_through(turn, dimensions, staging, &meter, |_| ())));
    assert_eq!(flat.pair.benches, raised.pair.benches);
    assert!((flat.pair.clearance_m - raised.pair.clearance_m).abs() < 1e-10, "{flat:?}, {raised:?}");
    let [flat, raised] = [planned.into(), level.clone()].map(|turn: PlannedTurn| {
        shortest_turn(turn, dimensions, staging, &meter, |_| ()).expect("no limit").expect("it turns")
    });
    let length_m = flat.turnaround.turn_length_m();
    assert!((length_m - raised.turnaround.turn_length_m()).abs() < 1e-8, "{flat:?}, {raised:?}");
}

/// The answer has the limits on its whole passage, by poses at many travels, and tighter turns with the ratios beside it do not.
#[test]
fn on_hills_the_shortest_turn_keeps_its_limits_and_tighter_ones_do_not() {
    let staging = Staging { clearance_m: 0.05, speed_ratio: 2.0 };
    let (dimensions, meter) = (paper_benches(14), Meter::unlimited());
    let placement = Placement { position: DVec2::new(1.2, -0.8), heading: 0.7 };
    let planned = turn(1.7, 4.5, 2.0).placed(placement).between(-5.0, 5.0).expect("valid");
    for ground in [plane(0.4, -0.2), Ground::map(hills_every(3.0, [0.4, 1.3, 2.9], 0.3))] {
        let planned = on(planned, ground);
        let shortest = shortest_turn(planned.clone(), dimensions, staging, &meter, |_| ());
        let shortest = shortest.expect("no limit").expect("it turns");
        let passage = |turn| passage_through(planned.with(turn), dimensions, &meter);
        let dragon = passage(shortest.turnaround).expect("it passes");
        let (from_m, to_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let mut largest = 0.0_f64;
        for step in 0..=2_000 {
            let travel_m = from_m + (to_m - from_m) * f64::from(step) / 2_000.0;
            let handles = handles_at(&dragon, travel_m);
            largest = handles.iter().map(|handle| handle.speed_ratio).fold(largest, f64::max);
            assert!(least_clearance_m(&boards_at(&dragon, travel_m)) > 0.05, "at {travel_m} m");
        }
        assert!(largest <= 2.0 && largest > 1.9, "{largest} in {shortest:?}");
        let last = handles_at(&dragon, to_m).pop().expect("a tail");
        assert!((last.position.distance(shortest.turnaround.exit())) < 1e-6, "{last:?}");
        let radius_m = 0.5 * shortest.turnaround.turn_diameter_m();
        for (less_m, ratio) in (-20..=20).flat_map(|i| [(1e-4, 1.005_f64.powi(i)), (0.05, 1.05_f64.powi(i))]) {
            let tighter = turn(1.7, radius_m - less_m, shortest.radius_ratio * ratio).placed(placement);
            let largest = passage(tighter).and_then(|dragon| largest_speed_ratio(&dragon));
            assert!(largest.map_or(f64::INFINITY, |largest| largest.ratio) > 2.0, "{less_m} m tighter, ratio {ratio}");
        }
    }
}

/// The ground need not reach further than the passage does.
#[test]
fn a_passage_beyond_the_ground_names_the_place() {
    // The hills end 30 m from the origin.
    let placement = Placement { position: DVec2::new(18.0, 0.0), heading: 0.0 };
    let hilly = |benches| {
        let planned = on(
            turn(1.7, 4.5, 2.0).placed(placement).between(-20.0, 30.0).expect("valid"),
            Ground::map(hills([0.4, 1.3, 2.9], 0.2)),
        );
        passage_through(planned, paper_benches(benches), &Meter::unlimited())
    };
    assert!(hilly(100).is_ok(), "{:?}", hilly(100));
    let Err(Infeasible::Dragon(DragonError::Ground(gap))) = hilly(223) else { panic!("{:?}", hilly(223)) };
    assert!((gap.x_m - 30.0).abs() < 1e-3, "{gap}");
}

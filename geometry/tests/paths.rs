//! Paths of lines, arcs and spirals, open and closed: the paper's routes written as paths, laps, contacts where a path crosses
//! itself, and the guard's proofs there.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use bench_dragon_geometry::clearance::{ContactSearch, ProvenTravel, first_contact, first_within};
use bench_dragon_geometry::dragon::{ChainStepper, Dimensions, Dragon, Meter};
use bench_dragon_geometry::planner::{largest_speed_ratio, passage_through};
use bench_dragon_geometry::route::{
    PathError, PathSegment, PathSpec, Placement, Route, RouteError, RouteSpec, Turnaround,
};
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::{boards_at, handles_at, least_clearance_m, paper_benches, paper_dragon};
use test_support::property::random_cases;

fn build(spec: &RouteSpec, dimensions: &Dimensions) -> Result<Route, RouteError> {
    spec.build(1.0, dimensions.links_m())
}

fn dragon_on(spec: &RouteSpec, dimensions: Dimensions) -> Dragon {
    let route = build(spec, &dimensions).expect("a valid path");
    Dragon::new(dimensions, Arc::new(route)).expect("the dragon stands")
}

/// A path with the tangent of a route at a travel as its beginning.
fn path_from(route: &Route, travel_m: f64, segments: Vec<PathSegment>) -> RouteSpec {
    let begin = route.point(route.parameter(travel_m));
    let placement = Placement { position: begin.position, heading: begin.tangent.to_angle() };
    RouteSpec { placement, ..RouteSpec::from(PathSpec { segments, laps: None }) }
}

/// Checks that a dragon has the same positions on both routes. Travels of `path` are greater by `ahead_m`.
fn assert_same_poses(exact: &Dragon, path: &Dragon, ahead_m: f64, travels_m: &[f64]) {
    for &travel_m in travels_m {
        for (ours, exact) in handles_at(path, travel_m + ahead_m).iter().zip(handles_at(exact, travel_m)) {
            let off_m = ours.position.distance(exact.position);
            assert!(off_m < 1e-9, "{travel_m} m: off by {off_m} m at {exact:?}");
            assert!((ours.speed_ratio - exact.speed_ratio).abs() < 1e-9, "{travel_m} m: {ours:?}, {exact:?}");
        }
    }
}

/// The length of the paper's spiral between two radii.
fn spiral_length_m(pitch_m: f64, outer_turns: f64, turns: f64) -> f64 {
    let spiral = Route::spiral(pitch_m, outer_turns).expect("a valid spiral");
    spiral.travel(-TAU * turns)
}

#[test]
fn the_papers_spiral_as_a_path_has_the_same_truth() {
    // Eleven more turns, so that the body stands on the path at the time that the paper calls 0.
    let (pitch_m, outer_turns) = (0.55, 27.0);
    let ahead_m = spiral_length_m(pitch_m, outer_turns, 16.0);
    let outer = Route::spiral(pitch_m, outer_turns).expect("a valid spiral");
    let inward =
        PathSegment::Spiral { start_radius_m: pitch_m * outer_turns, end_radius_m: 0.0, turn: -TAU * outer_turns };
    let spec = path_from(&outer, 0.0, vec![inward]);
    let path = dragon_on(&spec, paper_benches(223));
    let spiral = Route::spiral(0.55, 16.0).expect("the paper's spiral");
    let paper = Dragon::new(paper_benches(223), Arc::new(spiral)).expect("the dragon stands");
    assert_same_poses(&paper, &path, ahead_m, &[0.0, 60.0, 120.0, 180.0, 240.0, 300.0, 412.0, 430.0]);
    let search =
        |dragon: &Dragon, from_m, to_m| first_contact(dragon, from_m, to_m).expect("no limit").expect("a contact");
    let ours = search(&path, ahead_m, path.end_travel_m());
    let exact = search(&paper, 0.0, paper.end_travel_m());
    assert_eq!((ours.benches, exact.benches), ([0, 8], [0, 8]));
    assert!((ours.travel_m - ahead_m - exact.travel_m).abs() < 1e-9 && ours.point.distance(exact.point) < 1e-9);
    assert!((path.end_travel_m() - ahead_m - paper.end_travel_m()).abs() < 1e-9);
    assert_eq!(path.feasible_end(), paper.feasible_end());
}

#[test]
fn the_papers_turnaround_as_a_path_has_the_same_truth() {
    let turnaround =
        Turnaround::new(1.7, 9.0, 2.0).expect("the paper's turnaround").between(-100.0, 100.0).expect("valid");
    let dimensions = paper_benches(223);
    let paper = Dragon::new(dimensions, Arc::new(turnaround.route())).expect("the dragon stands");
    // The body reaches back to a radius of about 16 m at the paper's start.
    let (outer_turns, circle_turns) = (14.0, 4.5 / 1.7);
    let ahead_m = spiral_length_m(1.7, outer_turns, circle_turns);
    let outer = Route::spiral(1.7, outer_turns).expect("a valid spiral");
    let [entry, exit] = turnaround.arcs();
    let turn = TAU * (outer_turns - circle_turns);
    let radius_m = 1.7 * outer_turns;
    let spec = path_from(
        &outer,
        0.0,
        vec![
            PathSegment::Spiral { start_radius_m: radius_m, end_radius_m: 4.5, turn: -turn },
            PathSegment::Arc { radius_m: entry.radius_m(), turn: -entry.angle() },
            PathSegment::Arc { radius_m: exit.radius_m(), turn: exit.angle() },
            PathSegment::Spiral { start_radius_m: 4.5, end_radius_m: radius_m, turn },
        ],
    );
    let path = dragon_on(&spec, dimensions);
    assert_same_poses(&paper, &path, ahead_m, &[-100.0, -50.0, 0.0, 14.48, 50.0, 100.0]);
    let passage = passage_through(turnaround, dimensions, paper.meter()).expect("the paper's dragon passes");
    let [ours, exact] = [&path, &passage].map(|dragon| largest_speed_ratio(dragon).expect("every handle walks"));
    assert!((ours.ratio - exact.ratio).abs() < 1e-9 && (ours.travel_m - ahead_m - exact.travel_m).abs() < 1e-6);
}

#[test]
fn a_spiral_elsewhere_has_the_poses_of_the_papers_spiral() {
    let placement = Placement { position: DVec2::new(30.0, -12.0), heading: 1.0 };
    let shape = RouteSpec::from(bench_dragon_geometry::route::SpiralSpec::default());
    let home = dragon_on(&shape, paper_benches(223));
    let away = dragon_on(&RouteSpec { placement, start_s: -20.0, end_s: Some(400.0), ..shape }, paper_benches(223));
    assert_eq!((away.start_travel_m(), away.end_travel_m()), (-20.0, 400.0));
    for (ours, exact) in handles_at(&away, 300.0).iter().zip(handles_at(&home, 300.0)) {
        assert!(ours.position.distance(placement.place(exact.position)) < 1e-9);
    }
}

/// A stadium: two straights of 20 m, and two half circles.
fn stadium(laps: u32) -> RouteSpec {
    let (line, bend) = (PathSegment::Line { length_m: 20.0 }, PathSegment::Arc { radius_m: 5.0, turn: PI });
    RouteSpec::from(PathSpec { segments: vec![line, bend, line, bend], laps: Some(laps) })
}

#[test]
fn on_a_closed_path_the_body_stands_on_the_lap_before_and_every_lap_is_alike() {
    let dimensions = paper_benches(20);
    let dragon = dragon_on(&stadium(3), dimensions);
    let lap_m = 40.0 + TAU * 5.0;
    assert!((dragon.end_travel_m() - 3.0 * lap_m).abs() < 1e-9);
    let at = |travel_m| handles_at(&dragon, travel_m);
    let start = at(0.0);
    // Behind the beginning is the second bend, not a straight.
    assert!(start[0].position.length() < 1e-12 && start[3].position.y > 0.5, "{:?}", start[3]);
    for travel_m in [0.0, 7.0, 31.0] {
        for (first, third) in at(travel_m).iter().zip(at(travel_m + 2.0 * lap_m)) {
            assert!(first.position.distance(third.position) < 1e-9);
        }
    }
    assert_eq!(first_contact(&dragon, 0.0, dragon.end_travel_m()), Ok(None));
    // A dragon longer than a lap meets its own tail at once.
    let long = dragon_on(&stadium(1), paper_benches(60));
    let contact = first_contact(&long, 0.0, long.end_travel_m()).expect("no limit").expect("it stands on itself");
    assert_eq!(contact.travel_m, 0.0);
}

#[test]
fn laps_of_typed_decimals_close_and_the_last_lap_is_where_the_first_is() {
    let segments = vec![
        PathSegment::Line { length_m: 10.0 },
        PathSegment::Arc { radius_m: 5.0, turn: PI },
        PathSegment::Line { length_m: 10.0009 },
        PathSegment::Arc { radius_m: 5.0, turn: 180.004_f64.to_radians() },
    ];
    let typed = RouteSpec::from(PathSpec { segments: segments.clone(), laps: Some(1_000) });
    let dimensions = paper_benches(3);
    let dragon = dragon_on(&typed, dimensions);
    let lap_m = dragon.end_travel_m() / 1_000.0;
    for travel_m in [3.0, 12.0, 17.0, 45.0] {
        // After 51 km, a travel has fewer digits than at the beginning.
        for (laps, most_m) in [(100.0, 1e-9), (999.0, 1e-6)] {
            for (first, last) in handles_at(&dragon, travel_m).iter().zip(handles_at(&dragon, travel_m + laps * lap_m))
            {
                assert!(first.position.distance(last.position) < most_m, "{first:?} {last:?}");
            }
        }
    }
    // The lap is as typed, to the gap, and the end is the beginning, to the rounding of its travel.
    let typed_m: f64 = segments.iter().map(PathSegment::length_m).sum();
    assert!((lap_m - typed_m).abs() < 1e-3, "{lap_m} {typed_m}");
    let end = dragon.route().point(dragon.route().parameter(dragon.end_travel_m()));
    assert!(end.position.length() < 1e-6 && (end.tangent - DVec2::X).length() < 1e-6, "{end:?}");
}

#[test]
fn a_closed_path_is_closed_by_its_radii_too_or_refused() {
    let dimensions = paper_benches(3);
    let closed = |segments: &[PathSegment]| {
        build(&RouteSpec::from(PathSpec { segments: segments.to_vec(), laps: Some(2) }), &dimensions)
    };
    let arc = |radius_m| PathSegment::Arc { radius_m, turn: PI };
    for ring in [
        vec![PathSegment::Spiral { start_radius_m: 10.0, end_radius_m: 10.0005, turn: TAU }],
        vec![arc(5.0), arc(5.0004)],
        vec![PathSegment::Arc { radius_m: 7.0, turn: 359.995_f64.to_radians() }],
    ] {
        let route = closed(&ring).expect("it closes");
        let lap_m = 0.5 * route.end_travel_m();
        let [begin, end] = [0.0, lap_m].map(|travel_m| route.point(route.parameter(travel_m)));
        assert!(begin.position.distance(end.position) < 1e-9 && begin.tangent.distance(end.tangent) < 1e-9, "{ring:?}");
        let planned_m: f64 = ring.iter().map(PathSegment::length_m).sum();
        assert!((lap_m - planned_m).abs() < 2e-3, "{ring:?}: {lap_m} m");
    }
    let error = closed(&[PathSegment::Line { length_m: 9e-4 }]).expect_err("a line does not close").to_string();
    assert!(error.starts_with("closed: no small change of ") && error.ends_with(", 0.000900 m away"), "{error}");
}

#[test]
fn a_closed_path_too_small_for_the_head_has_no_ground_elsewhere() {
    let ring =
        RouteSpec::from(PathSpec { segments: vec![PathSegment::Arc { radius_m: 1.4, turn: TAU }], laps: Some(2) });
    for benches in [1, 3, 40] {
        let dimensions = paper_benches(benches);
        let error =
            Dragon::new(dimensions, Arc::new(build(&ring, &dimensions).expect("a ring"))).expect_err("too tight");
        assert!(error.to_string().contains("too tight at its start: bench 0 cannot follow at 0.000 m"), "{error}");
    }
    // A start many laps before the beginning is on the ring too.
    let ring = PathSpec { segments: vec![PathSegment::Arc { radius_m: 9.0, turn: TAU }], laps: Some(3) };
    let early = RouteSpec { start_s: -300.0, ..RouteSpec::from(ring) };
    let dragon = dragon_on(&early, paper_benches(20));
    for handle in handles_at(&dragon, -300.0) {
        assert!((handle.position.distance(DVec2::new(0.0, 9.0)) - 9.0).abs() < 1e-9, "{handle:?}");
    }
}

#[test]
fn a_spiral_of_nearly_equal_radii_is_an_arc_and_joins() {
    for difference_m in [0.0, 1e-12, 1e-9, 1e-8, 1e-7, 3e-7, 1e-6, 1e-5] {
        let spiral = PathSegment::Spiral { start_radius_m: 10.0, end_radius_m: 10.0 + difference_m, turn: 0.5 * PI };
        let line = PathSegment::Line { length_m: 5.0 };
        let spec = RouteSpec::from(PathSpec { segments: vec![line, spiral, line], laps: None });
        let route = spec.build(1.0, 10.0).unwrap_or_else(|error| panic!("{difference_m}: {error}"));
        let end = route.point(route.parameter(5.0 + 5.0 * PI));
        assert!(end.position.distance(DVec2::new(15.0, 10.0)) < 1e-8 + 2.0 * difference_m, "{difference_m}: {end:?}");
    }
}

#[test]
fn a_path_with_bad_numbers_is_refused_with_the_segment_and_the_value() {
    let refused = |segments: &[PathSegment], laps: Option<u32>| {
        let spec = RouteSpec::from(PathSpec { segments: segments.to_vec(), laps });
        build(&spec, &paper_benches(223)).expect_err("refused").to_string()
    };
    let line = PathSegment::Line { length_m: 5.0 };
    assert_eq!(refused(&[], None), "a path needs at least one segment");
    for length_m in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e6] {
        let error = refused(&[line, PathSegment::Line { length_m }], None);
        assert!(error.starts_with("segment 2: length_m is ") && error.contains("must be from 0.000001"), "{error}");
    }
    let arc = |radius_m, turn| PathSegment::Arc { radius_m, turn };
    assert!(refused(&[arc(0.0, 1.0)], None).starts_with("segment 1: radius_m is 0, must be"));
    assert!(refused(&[arc(1.0, 0.0)], None).starts_with("segment 1: turn_deg is 0, must be"));
    assert!(refused(&[arc(1.0, f64::NAN)], None).starts_with("segment 1: turn_deg is NaN, must be"));
    for turn in [1e-310, 1e-20, -1e-9] {
        let spiral = PathSegment::Spiral { start_radius_m: 20.0, end_radius_m: 5.0, turn };
        let error = refused(&[line, spiral], None);
        assert!(
            error.starts_with("segment 2: turn_deg is ") && error.contains("at least 0.00001 for a spiral"),
            "{error}"
        );
    }
    assert!(refused(&[arc(1e-6, 1e-3)], None).ends_with(" m long, must be at least 0.000001 m"));
    let spiral = |start_radius_m, end_radius_m| PathSegment::Spiral { start_radius_m, end_radius_m, turn: 3.0 };
    assert!(refused(&[spiral(-1.0, 2.0)], None).starts_with("segment 1: start_radius_m is -1, must be"));
    assert!(refused(&[spiral(0.0, 0.0)], None).starts_with("segment 1: the larger radius is 0, must be"));
    assert!(refused(&[line], Some(2)).starts_with("closed: the end is 5.000000 m from the beginning"));
    assert!(refused(&[arc(1.0, 1.999 * PI)], Some(2)).starts_with("closed: the end is 0.003142 m from"));
    let ring = arc(0.000_1, TAU);
    assert!(matches!(
        build(&RouteSpec::from(PathSpec { segments: vec![ring], laps: Some(9) }), &paper_benches(223)),
        Err(RouteError::Path(PathError::TooMany { .. }))
    ));
    assert!(refused(&[PathSegment::Line { length_m: 1e5 }; 11], None).starts_with("the path is longer than 1000000 m"));
}

#[test]
fn a_bend_under_what_a_link_can_follow_ends_the_run_where_the_head_reaches_it() {
    let segments = vec![
        PathSegment::Line { length_m: 10.0 },
        PathSegment::Arc { radius_m: 0.5, turn: PI },
        PathSegment::Line { length_m: 10.0 },
    ];
    let dragon = dragon_on(&RouteSpec::from(PathSpec { segments, laps: None }), paper_benches(223));
    assert!((10.0..12.0).contains(&dragon.end_travel_m()), "{}", dragon.end_travel_m());
    assert_ne!(dragon.feasible_end(), bench_dragon_geometry::dragon::FeasibleEnd::RouteEnd);
}

/// Segments that a dragon of small benches can walk, with much turning, so that paths cross themselves.
fn segments() -> impl Strategy<Value = PathSegment> {
    let turn = prop_oneof![-5.0..-0.2_f64, 0.2..5.0_f64];
    prop_oneof![
        (0.5..12.0_f64).prop_map(|length_m| PathSegment::Line { length_m }),
        (1.5..6.0_f64, turn.clone()).prop_map(|(radius_m, turn)| PathSegment::Arc { radius_m, turn }),
        (2.0..7.0_f64, 2.0..7.0_f64, turn).prop_map(|(start_radius_m, end_radius_m, turn)| PathSegment::Spiral {
            start_radius_m,
            end_radius_m,
            turn
        }),
    ]
}

fn crossing_dragons() -> impl Strategy<Value = Dragon> {
    let benches = (3_usize..60, 1.0..2.5_f64, 0.8..1.5_f64, 0.1..0.3_f64, 0.0..0.3_f64);
    (benches, prop::collection::vec(segments(), 2..12)).prop_filter_map("cannot stand", |(benches, segments)| {
        let (count, head_m, body_m, width_m, hole) = benches;
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole * head_m.min(body_m)).ok()?;
        let route = build(&RouteSpec::from(PathSpec { segments, laps: None }), &dimensions).ok()?;
        Dragon::new(dimensions, Arc::new(route)).ok()
    })
}

fn least_at(dragon: &Dragon, travel_m: f64) -> f64 {
    least_clearance_m(&boards_at(dragon, travel_m))
}

fn assert_first_within(dragon: &Dragon, clearance_m: f64) -> Result<(), TestCaseError> {
    const STEP_M: f64 = 0.01;
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let found = first_within(dragon, clearance_m, start_m, end_m).expect("no limit");
    let searched_m = found.map_or(end_m, |contact| contact.travel_m);
    let steps = ((searched_m - start_m) / STEP_M) as u32;
    for step in 0..=steps {
        let travel_m = start_m + f64::from(step) * STEP_M;
        let least_m = least_at(dragon, travel_m);
        prop_assert!(
            least_m > clearance_m || travel_m > searched_m - 1e-9,
            "{least_m} m at {travel_m} m, but the search reports {found:?}"
        );
    }
    if let Some(contact) = found {
        let least_m = least_at(dragon, (contact.travel_m + 1e-9).min(end_m));
        prop_assert!(least_m <= clearance_m + 1e-8, "{least_m} m at {contact:?}");
    }
    Ok(())
}

proptest! {
    #![proptest_config(random_cases(64))]

    #[test]
    fn no_pair_is_near_before_the_first_contact_of_a_crossing_path(
        dragon in crossing_dragons(), clearance_m in prop_oneof![Just(0.0), 0.01..0.2_f64],
    ) {
        assert_first_within(&dragon, clearance_m)?;
    }

    /// A search in parts ends strides at other travels. It finds the same contact.
    #[test]
    fn a_search_in_parts_finds_the_contact_of_the_whole(dragon in crossing_dragons(), part_m in 0.3..9.0_f64) {
        let end_m = dragon.end_travel_m();
        let whole = first_contact(&dragon, 0.0, end_m).expect("no limit");
        let mut search = ContactSearch::new(&dragon);
        let mut from_m = 0.0;
        let mut found = None;
        while from_m < end_m && found.is_none() {
            let to_m = (from_m + part_m).min(end_m);
            found = search.first(from_m, to_m).expect("no limit");
            from_m = to_m;
        }
        prop_assert_eq!(whole.map(|contact| contact.benches), found.map(|contact| contact.benches));
        let travels_m = [whole, found].map(|contact| contact.map_or(0.0, |contact| contact.travel_m));
        prop_assert!((travels_m[0] - travels_m[1]).abs() < 1e-9, "{whole:?}, {found:?}");
    }

    /// The guard lets the head walk on proven travel only.
    #[test]
    fn no_pair_is_under_the_margin_on_proven_travel_of_a_crossing_path(
        dragon in crossing_dragons(), margin_m in 0.000_1..0.1_f64,
    ) {
        const STEP_M: f64 = 0.01;
        let Ok(mut proven) = ProvenTravel::at(&dragon, margin_m, 0.0) else { return Ok(()) };
        while !proven.is_whole() {
            proven.extend(dragon.end_travel_m(), 10_000);
        }
        for step in 0..=(proven.end_m() / STEP_M) as u32 {
            let least_m = least_at(&dragon, f64::from(step) * STEP_M);
            prop_assert!(least_m >= margin_m - 1e-11, "{least_m} m at step {step}, under the margin of {margin_m} m");
        }
        if proven.end_m() < dragon.end_travel_m() {
            // The proof ends where the margin is nearly reached.
            let least_m = least_at(&dragon, proven.end_m());
            prop_assert!(least_m < margin_m + 1e-6, "proved up to {} m only, with {least_m} m", proven.end_m());
        }
    }

    /// A guard may begin anywhere, and extends its proof by parts of any length.
    #[test]
    fn a_proof_from_anywhere_in_parts_ends_where_the_whole_one_does(
        dragon in crossing_dragons(), margin_m in 0.000_1..0.1_f64, share in 0.0..1.0_f64, part_m in 0.001..3.0_f64,
    ) {
        let from_m = dragon.start_travel_m() + share * (dragon.end_travel_m() - dragon.start_travel_m());
        let Ok(mut whole) = ProvenTravel::at(&dragon, margin_m, from_m) else { return Ok(()) };
        let mut parts = whole.clone();
        whole.extend(f64::INFINITY, usize::MAX);
        for _ in 0..200 {
            parts.extend(parts.end_m() + part_m, usize::MAX);
        }
        parts.extend(f64::INFINITY, usize::MAX);
        prop_assert!(whole.is_whole() && parts.is_whole());
        // Where the clearance changes slowly, its rounding moves the end.
        let [first_m, last_m] = if whole.end_m() < parts.end_m() {
            [whole.end_m(), parts.end_m()]
        } else {
            [parts.end_m(), whole.end_m()]
        };
        for travel_m in [first_m, 0.5 * (first_m + last_m), last_m] {
            let off_m = least_at(&dragon, travel_m) - margin_m;
            prop_assert!(last_m - first_m < 1e-8 || off_m.abs() < 1e-8, "{first_m} and {last_m}: off by {off_m}");
        }
    }

    #[test]
    fn steps_equal_the_reference_solver_on_a_crossing_path(dragon in crossing_dragons(), step_m in 1e-4..0.04_f64) {
        let dragon = Arc::new(dragon);
        let mut stepper = ChainStepper::new(Arc::clone(&dragon));
        let mut records = vec![DVec2::ZERO; dragon.dimensions().handles()];
        let steps = (dragon.end_travel_m() / step_m) as u32;
        for step in 0..=steps {
            let travel_m = f64::from(step) * step_m;
            stepper.step(travel_m, 1.0, &mut records, |position, _| position.truncate()).expect("within the run");
            if step % 61 == 0 {
                for (position, handle) in records.iter().zip(handles_at(&dragon, travel_m)) {
                    prop_assert!(position.distance(handle.position) < 1e-9, "{travel_m} m: {position}, {handle:?}");
                }
            }
        }
    }
}

/// The search does not take a pair that hardly keeps the margin at the beginning for one that stays within it.
#[test]
fn a_proof_that_begins_at_the_margin_ends_there() {
    let dragon = paper_dragon();
    let from_m = 412.0;
    let least_m = least_at(&dragon, from_m);
    // The nearest pair closes up to the contact at 412.473838 m. Up to 10⁻¹² m over the clearance of the search counts as touching.
    for over_m in [0.5e-12, 1.0e-12, 1.5e-12, 1.9e-12] {
        let mut proven = ProvenTravel::at(&dragon, least_m + over_m, from_m).expect("it is the margin, up to rounding");
        proven.extend(f64::INFINITY, usize::MAX);
        assert!(proven.is_whole() && proven.end_m() < from_m + 1e-8, "{over_m}: proved up to {}", proven.end_m());
    }
}

/// A call whose work is spent stops between two strides. The next one goes on there, with the pairs that the walk still needs.
#[test]
fn a_proof_with_little_work_at_a_time_reaches_the_end_of_the_run() {
    let bend = |side: f64| PathSegment::Arc { radius_m: 9.0, turn: side * 0.8 * PI };
    let street = RouteSpec::from(PathSpec {
        segments: (0..24).map(|i| bend(1.0 - 2.0 * f64::from(i % 2))).collect(),
        laps: None,
    });
    let dragon = dragon_on(&street, paper_benches(60));
    let mut whole = ProvenTravel::at(&dragon, 0.05, 0.0).expect("no benches are near");
    whole.extend(f64::INFINITY, usize::MAX);
    assert_eq!(whole.end_m(), dragon.end_travel_m());
    let metered = dragon.metered(&Meter::of(3_000));
    let mut proven = ProvenTravel::at(&metered, 0.05, 0.0).expect("no benches are near");
    let mut calls = 0;
    while !proven.is_whole() {
        proven.extend(f64::INFINITY, usize::MAX);
        calls += 1;
    }
    assert_eq!(proven.end_m(), dragon.end_travel_m());
    assert!(calls > 3, "{calls} calls");
}

//! The smallest pitch, compared with its published value, with its definition, and with a walk at every pitch of a grid.

use std::f64::consts::TAU;
use std::sync::Arc;

use bench_dragon_geometry::clearance::{first_contact, first_within};
use bench_dragon_geometry::dragon::{Board, Dimensions, Dragon, Meter};
use bench_dragon_geometry::ground::Ground;
use bench_dragon_geometry::planner::{PitchError, PitchLimit, least_clearance, smallest_pitch, smallest_pitch_on};
use bench_dragon_geometry::route::{Placement, Route, RouteSpec, SpiralSpec};
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::{boards_at, clearance_at, pairs, paper_benches};
use test_support::hills::{hills, plane};
use test_support::property::random_cases;

/// A dragon on a spiral, and its travel to a circle; `None` if it cannot start.
fn on_the_way(dimensions: Dimensions, start_turns: f64, diameter_m: f64, pitch_m: f64) -> Option<(Dragon, f64)> {
    let spiral = Route::spiral(pitch_m, start_turns).ok()?;
    let arrival_m = spiral.travel(-0.5 * diameter_m * TAU / pitch_m);
    Some((Dragon::new(dimensions, Arc::new(spiral)).ok()?, arrival_m)).filter(|(_, arrival_m)| *arrival_m >= 0.0)
}

/// Whether two boards that are not neighbours overlap, or are within a clearance that is not 0.
fn some_pair_overlaps(dragon: &Dragon, clearance_m: f64, travel_m: f64) -> bool {
    let boards = boards_at(dragon, travel_m);
    let near = |first: &Board, second: &Board| {
        if clearance_m == 0.0 { first.overlaps(second) } else { first.clearance(second) <= clearance_m }
    };
    pairs(boards.len()).any(|[first, second]| near(&boards[first], &boards[second]))
}

/// Whether a walk in small steps reaches the circle without an overlap.
fn a_walk_is_free(dimensions: Dimensions, start_turns: f64, diameter_m: f64, pitch_m: f64, step_m: f64) -> bool {
    a_walk_keeps(0.0, dimensions, start_turns, diameter_m, pitch_m, step_m)
}

/// Whether a walk in small steps reaches the circle with all boards further apart than a clearance.
fn a_walk_keeps(
    clearance_m: f64,
    dimensions: Dimensions,
    start_turns: f64,
    diameter_m: f64,
    pitch_m: f64,
    step_m: f64,
) -> bool {
    on_the_way(dimensions, start_turns, diameter_m, pitch_m).is_some_and(|(dragon, arrival_m)| {
        let steps = (arrival_m / step_m) as u32;
        // From the circle backwards, because the turns are tightest there, and at the start: boards may overlap there alone.
        let mut travels_m =
            (0..=steps).map(|step| arrival_m - f64::from(step) * step_m).chain([dragon.start_travel_m()]);
        dragon.end_travel_m() >= arrival_m
            && !travels_m.any(|travel_m| some_pair_overlaps(&dragon, clearance_m, travel_m))
    })
}

fn is_feasible(dimensions: Dimensions, start_turns: f64, diameter_m: f64, pitch_m: f64) -> bool {
    on_the_way(dimensions, start_turns, diameter_m, pitch_m).is_some_and(|(dragon, arrival_m)| {
        dragon.end_travel_m() >= arrival_m && first_contact(&dragon, 0.0, arrival_m).expect("no limit").is_none()
    })
}

#[test]
fn a_clearance_of_five_centimetres_needs_a_wider_pitch_that_keeps_exactly_that() {
    let dimensions = paper_benches(223);
    let smallest = smallest_pitch(&dimensions, 16.0, 9.0, 0.05, &Meter::unlimited()).expect("there is one");
    assert!(smallest.pitch_m > 0.46, "{smallest:?}");
    let (dragon, arrival_m) = on_the_way(dimensions, 16.0, 9.0, smallest.pitch_m).expect("the dragon starts");
    let closest = least_clearance(&dragon, 0.0, arrival_m, |_| ()).expect("no limit").expect("pairs");
    assert!((closest.pair.clearance_m - 0.05).abs() < 1e-9, "{closest:?}");
    let (dragon, arrival_m) = on_the_way(dimensions, 16.0, 9.0, smallest.pitch_m - 1e-9).expect("the dragon starts");
    assert!(first_within(&dragon, 0.05, 0.0, arrival_m).expect("no limit").is_some());
    let PitchLimit::Contact(contact) = smallest.limit else { panic!("a pair limits {smallest:?}") };
    assert_eq!(contact.benches, closest.pair.benches);
}

/// Each bench is nearer than that to the next bench but one, on any spiral.
#[test]
fn a_clearance_that_no_spiral_leaves_has_no_pitch() {
    let error = smallest_pitch(&paper_benches(20), 16.0, 9.0, 1.2, &Meter::unlimited()).expect_err("there is none");
    assert_eq!(error, PitchError::NoPitch { turn_diameter_m: 9.0 });
}

#[test]
fn paper_dragon_reaches_nine_metres_at_the_published_pitch() {
    let dimensions = paper_benches(223);
    let smallest = smallest_pitch(&dimensions, 16.0, 9.0, 0.0, &Meter::unlimited()).expect("there is one");
    assert!((smallest.pitch_m - 0.450_337).abs() <= 5.001e-7, "{smallest:?}");
    assert!(is_feasible(dimensions, 16.0, 9.0, smallest.pitch_m));
    assert!(!is_feasible(dimensions, 16.0, 9.0, smallest.pitch_m - 1e-9));
    let PitchLimit::Contact(contact) = smallest.limit else { panic!("a contact limits {smallest:?}") };
    let (dragon, _) = on_the_way(dimensions, 16.0, 9.0, smallest.pitch_m).expect("the dragon starts");
    let clearance_m = clearance_at(&dragon, contact.travel_m, contact.benches);
    assert!(clearance_m.abs() < 1e-9, "{clearance_m} m at {contact:?}");
}

/// These benches have feasible pitches well below a range of infeasible ones. Bisection from above ends at the wrong threshold.
#[test]
fn a_feasible_pitch_below_infeasible_ones_is_found() {
    let dimensions = Dimensions::new(7, 3.57, 2.30, 0.31, 0.18).expect("valid benches");
    let (start_turns, diameter_m) = (3.15, 3.35);
    let smallest =
        smallest_pitch(&dimensions, start_turns, diameter_m, 0.0, &Meter::unlimited()).expect("there is one");
    let walk = |pitch_m| a_walk_is_free(dimensions, start_turns, diameter_m, pitch_m, 2e-3);
    assert!(walk(smallest.pitch_m + 1e-6) && !walk(smallest.pitch_m - 1e-4), "{smallest:?}");
    let wider = (1..100).map(|step| smallest.pitch_m + 1e-3 * f64::from(step)).collect::<Vec<_>>();
    let first_blocked = wider.iter().position(|&pitch_m| !walk(pitch_m)).expect("some wider pitches are infeasible");
    assert!(first_blocked > 3, "the island is {first_blocked} mm wide");
    assert!(walk(0.65), "wider pitches are feasible again");
}

proptest! {
    #![proptest_config(random_cases(64))]

    #[test]
    fn no_walk_on_a_tighter_spiral_is_free(
        benches in (3_usize..16, 0.8..4.0_f64, 0.8..2.5_f64, 0.1..0.4_f64, 0.0..0.2_f64),
        start_turns in 2.5..7.0_f64,
        diameter_m in 2.0..6.0_f64,
    ) {
        let (count, head_m, body_m, width_m, hole) = benches;
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole * head_m.min(body_m)).expect("valid benches");
        let smallest = match smallest_pitch(&dimensions, start_turns, diameter_m, 0.0, &Meter::unlimited()) {
            Ok(smallest) => smallest,
            Err(error) => {
                let body_could_stop = dimensions.link_m(0) < 1.09 * dimensions.link_m(1);
                prop_assert!(matches!(error, PitchError::TurnDiameter { .. }) && body_could_stop, "{error}");
                return Ok(());
            }
        };
        // At the start the head's link must span less than half a turn.
        let half_turn_m = (head_m - 2.0 * dimensions.hole_offset_m()) / (2.0 * start_turns + 0.5);
        let lowest_m = width_m.max(0.5 * diameter_m / start_turns).max(half_turn_m);
        let wider_m = smallest.pitch_m * (1.0 + 1e-9);
        prop_assert!(is_feasible(dimensions, start_turns, diameter_m, wider_m), "{smallest:?}");
        prop_assert!(a_walk_is_free(dimensions, start_turns, diameter_m, wider_m, 0.01), "{smallest:?}");
        let highest_m = smallest.pitch_m - 2e-4;
        for part in 1..=60 {
            let pitch_m = lowest_m + f64::from(part) / 60.0 * (highest_m - lowest_m);
            let free = pitch_m > lowest_m && a_walk_is_free(dimensions, start_turns, diameter_m, pitch_m, 0.01);
            prop_assert!(!free, "{pitch_m} m is feasible, under {smallest:?}");
        }
    }

    #[test]
    fn no_walk_on_a_tighter_spiral_keeps_the_clearance(
        benches in (3_usize..12, 0.8..4.0_f64, 0.8..2.5_f64, 0.1..0.4_f64, 0.0..0.2_f64),
        start_turns in 2.5..6.0_f64,
        diameter_m in 2.5..6.0_f64,
        clearance_m in 0.001..0.2_f64,
    ) {
        let (count, head_m, body_m, width_m, hole) = benches;
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole * head_m.min(body_m)).expect("valid benches");
        let keeps = |pitch_m| a_walk_keeps(clearance_m, dimensions, start_turns, diameter_m, pitch_m, 0.01);
        let smallest = match smallest_pitch(&dimensions, start_turns, diameter_m, clearance_m, &Meter::unlimited()) {
            Ok(smallest) => smallest,
            Err(PitchError::TurnDiameter { .. }) => return Ok(()),
            Err(error) => {
                prop_assert!(matches!(error, PitchError::NoPitch { .. }), "{error}");
                for pitch_m in [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0] {
                    prop_assert!(!keeps(pitch_m), "{pitch_m} m is feasible");
                }
                return Ok(());
            }
        };
        let half_turn_m = (head_m - 2.0 * dimensions.hole_offset_m()) / (2.0 * start_turns + 0.5);
        let lowest_m = width_m.max(0.5 * diameter_m / start_turns).max(half_turn_m);
        prop_assert!(keeps(smallest.pitch_m * (1.0 + 1e-9)), "{smallest:?}");
        let highest_m = smallest.pitch_m - 2e-4;
        for part in 1..=40 {
            let pitch_m = lowest_m + f64::from(part) / 40.0 * (highest_m - lowest_m);
            prop_assert!(pitch_m <= lowest_m || !keeps(pitch_m), "{pitch_m} m is feasible, under {smallest:?}");
        }
    }
}

#[test]
fn few_benches_are_limited_by_width_start_or_the_heads_link() {
    let smallest = |benches, diameter_m| {
        smallest_pitch(&paper_benches(benches), 16.0, diameter_m, 0.0, &Meter::unlimited()).expect("one")
    };
    for benches in [1, 2] {
        let [wide, far, tight] = [9.0, 20.0, 2.0].map(|diameter_m| smallest(benches, diameter_m));
        assert!(wide.pitch_m > 0.30 && wide.pitch_m < 0.30 + 1e-11 && wide.limit == PitchLimit::Width, "{wide:?}");
        assert!(far.pitch_m > 0.625 && far.pitch_m < 0.625 + 1e-11 && far.limit == PitchLimit::Start, "{far:?}");
        assert_eq!(tight.limit, PitchLimit::Stop);
        assert!(is_feasible(paper_benches(benches), 16.0, 2.0, tight.pitch_m + 1e-9));
        assert!(!is_feasible(paper_benches(benches), 16.0, 2.0, tight.pitch_m - 1e-9));
    }
}

#[test]
fn circles_out_of_range_are_rejected() {
    let refuse = |diameter_m| {
        smallest_pitch(&paper_benches(223), 16.0, diameter_m, 0.0, &Meter::unlimited())
            .expect_err("refused")
            .to_string()
    };
    for (diameter_m, shown) in [(40_000.0, "40000"), (f64::NAN, "NaN"), (0.0, "0"), (0.02, "0.02")] {
        let message = refuse(diameter_m);
        assert!(message.starts_with(&format!("turn_diameter_m is {shown}, must be above 0.0286")), "{message}");
        assert!(
            message.ends_with("and under 32000, the diameter at start_turns 16 and the greatest pitch"),
            "{message}"
        );
    }
    let error = smallest_pitch(&paper_benches(223), 0.0, 9.0, 0.0, &Meter::unlimited()).expect_err("refused");
    assert_eq!(error.to_string(), "start_turns is 0, must be above 0 and at most 10000");
}

/// The boards extend further beyond their hinges than the length of the bench between them.
#[test]
fn boards_that_overlap_on_any_spiral_have_no_pitch() {
    let dimensions = Dimensions::new(5, 2.0, 1.0, 0.3, 0.4).expect("valid benches");
    let error = smallest_pitch(&dimensions, 8.0, 9.0, 0.0, &Meter::unlimited()).expect_err("there is none");
    assert_eq!(error.to_string(), "no pitch up to 1000 m lets the head reach a circle of diameter 9 m");
}

/// The paper's plan on other ground.
fn plan_on(ground: Ground) -> RouteSpec {
    RouteSpec { ground: Some(Arc::new(ground)), ..RouteSpec::from(SpiralSpec::default()) }
}

/// A plane without a slope is ground, so its pitches are tried one by one.
#[test]
fn on_a_level_plane_the_smallest_pitch_is_the_proven_one() {
    let (level, meter) = (plan_on(plane(0.0, 0.0)), Meter::unlimited());
    for (benches, turns, diameter_m, clearance_m) in [(223, 16.0, 9.0, 0.0), (60, 8.0, 6.0, 0.05), (40, 5.0, 2.0, 0.0)]
    {
        let proven = smallest_pitch(&paper_benches(benches), turns, diameter_m, clearance_m, &meter).expect("a pitch");
        let tried = smallest_pitch_on(&level, &paper_benches(benches), turns, diameter_m, clearance_m, &meter);
        let tried = tried.expect("a pitch");
        assert!((tried.pitch_m - proven.pitch_m).abs() < 1e-10, "{benches}: {tried:?}, not {proven:?}");
        assert_eq!(kind(&tried.limit), kind(&proven.limit), "{benches}: {tried:?}, not {proven:?}");
    }
}

/// The kind of a limit, and the pair of a contact.
fn kind(limit: &PitchLimit) -> (&'static str, Option<[usize; 2]>) {
    match limit {
        PitchLimit::Contact(contact) => ("contact", Some(contact.benches)),
        PitchLimit::Stop => ("stop", None),
        PitchLimit::Start => ("start", None),
        PitchLimit::Width => ("width", None),
    }
}

#[test]
fn on_hills_the_smallest_pitch_is_feasible_and_one_just_below_is_not() {
    let (dimensions, turns, diameter_m) = (paper_benches(60), 8.0, 6.0);
    for ground in [plane(0.4, -0.3), Ground::map(hills([0.4, 1.3, 2.9], 0.4))] {
        let smallest =
            smallest_pitch_on(&plan_on(ground.clone()), &dimensions, turns, diameter_m, 0.0, &Meter::unlimited())
                .expect("a pitch");
        let is_feasible = |pitch_m: f64| {
            let spiral = Route::spiral(pitch_m, turns).and_then(|spiral| spiral.on_ground(&ground, 0.0, None, 150.0));
            let spiral = spiral.expect("the ground reaches far enough");
            let arrival_m = spiral.travel(-0.5 * diameter_m * TAU / pitch_m);
            let dragon = Dragon::new(dimensions, Arc::new(spiral)).expect("the dragon stands");
            dragon.end_travel_m() >= arrival_m && first_contact(&dragon, 0.0, arrival_m).expect("no limit").is_none()
        };
        assert!(is_feasible(smallest.pitch_m + 1e-9), "{smallest:?}");
        for below_m in [1e-9, 1e-6, 1e-3, 1e-2] {
            assert!(!is_feasible(smallest.pitch_m - below_m), "{smallest:?}");
        }
        let PitchLimit::Contact(contact) = smallest.limit else { panic!("{smallest:?}") };
        assert_eq!(contact.benches[0], 0, "{contact:?}");
    }
}

#[test]
fn ground_that_is_too_small_is_named_with_the_first_pitch_that_leads_beyond_it() {
    // The hills end 30 m from the origin.
    let placement = Placement { position: DVec2::new(24.0, 0.0), heading: 0.0 };
    let aside = RouteSpec { placement, ..plan_on(Ground::map(hills([0.4, 1.3, 2.9], 0.2))) };
    let found = smallest_pitch_on(&aside, &paper_benches(60), 12.0, 6.0, 0.0, &Meter::unlimited());
    let Err(PitchError::Ground { pitch_m, gap }) = found else { panic!("{found:?}") };
    assert!((0.3..0.6).contains(&pitch_m) && (gap.x_m - 30.0).abs() < 1e-3, "{pitch_m} m: {gap}");
}

#[test]
fn on_hills_a_spent_meter_tells_up_to_which_pitch_none_is_feasible() {
    let plan = plan_on(plane(0.4, -0.3));
    let found = smallest_pitch_on(&plan, &paper_benches(60), 8.0, 6.0, 0.0, &Meter::of(2_000_000));
    let Err(PitchError::HillsUndecided { pitch_m, .. }) = found else { panic!("{found:?}") };
    let smallest = smallest_pitch_on(&plan, &paper_benches(60), 8.0, 6.0, 0.0, &Meter::unlimited()).expect("a pitch");
    assert!(pitch_m < smallest.pitch_m, "{pitch_m}, {smallest:?}");
}

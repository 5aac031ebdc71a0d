//! Closest approaches of benches, compared with all pairs at every step of a fine walk.

use std::f64::consts::PI;
use std::sync::Arc;

use bench_dragon_geometry::clearance::{ClearanceSearch, PairClearance, first_contact};
use bench_dragon_geometry::dragon::{ChainSolver, Dimensions, Dragon, Meter};
use bench_dragon_geometry::planner::{
    ClosestApproach, Infeasible, Staging, TurnPassage, clearance_profile, least_clearance, near_misses, walk_through,
};
use bench_dragon_geometry::route::{PathSegment, PathSpec, Route, RouteSpec, Turnaround};
use proptest::prelude::*;
use test_support::dragons::{paper_benches, paper_dragon, paper_turnaround};
use test_support::property::random_cases;

/// Dragons with boards near each other, on routes short enough to walk in small steps.
fn crowded_dragons() -> impl Strategy<Value = Dragon> {
    let benches = (3_usize..30, 1.0..4.0_f64, 1.0..2.5_f64, 0.1..0.4_f64, 0.0..0.3_f64);
    let routes = (any::<bool>(), 1.3..4.0_f64, 2.0..6.0_f64, 0.5..2.0_f64);
    (benches, routes).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m, hole_m), route)| {
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole_m).ok()?;
        let (turnaround, pitch, turns, ratio) = route;
        let pitch_m = pitch * width_m;
        let route: Arc<Route> = if turnaround {
            Arc::new(Turnaround::new(pitch_m, 4.0 * turns, ratio).ok()?.between(-3.0, 20.0).ok()?.route())
        } else {
            Arc::new(Route::spiral(pitch_m, turns).ok()?)
        };
        Dragon::new(dimensions, route).ok()
    })
}

/// The least clearance on a walk in small steps.
fn nearest_of_a_walk(dragon: &Dragon, from_m: f64, to_m: f64, step_m: f64) -> PairClearance {
    let (mut solver, mut search, mut boards) = (ChainSolver::new(dragon), ClearanceSearch::default(), Vec::new());
    let steps = ((to_m - from_m) / step_m) as u32;
    let nearest = (0..=steps).map(|step| {
        let handles = solver.solve(dragon, from_m + f64::from(step) * step_m).expect("within the run");
        dragon.place_boards(handles, &mut boards);
        search.nearest(&boards).expect("three benches")
    });
    nearest.min_by(|first, second| first.clearance_m.total_cmp(&second.clearance_m)).expect("a walk has a step")
}

fn clearance_at(dragon: &Dragon, closest: &ClosestApproach) -> f64 {
    clearance_of(dragon, closest.pair.benches, closest.travel_m)
}

/// Clearance of two benches at a travel.
fn clearance_of(dragon: &Dragon, [first, second]: [usize; 2], travel_m: f64) -> f64 {
    let handles: Vec<_> = dragon.chain(travel_m).expect("within the run").collect();
    dragon.board(first, &handles[first], &handles[first + 1]).clearance(&dragon.board(
        second,
        &handles[second],
        &handles[second + 1],
    ))
}

#[test]
fn paper_turnaround_is_clear_on_the_whole_passage() {
    let dimensions = paper_benches(223);
    let passage = walk_through(paper_turnaround(2.0), dimensions, Staging::LIMITLESS, &Meter::unlimited(), |_| ());
    let TurnPassage::Clear { closest: Some(closest) } = passage else { panic!("{passage:?}") };
    assert_eq!(closest.pair.benches, [0, 16]);
    assert!((closest.pair.clearance_m - 0.279_042_939).abs() < 1e-9, "{closest:?}");
    assert!((closest.travel_m - 30.159_9).abs() < 5e-4, "{closest:?}");
}

#[test]
fn a_turn_that_no_dragon_passes_has_a_reason() {
    let dimensions = paper_benches(223);
    let walk = |pitch_m, diameter_m, ratio| {
        walk_through(
            Turnaround::new(pitch_m, diameter_m, ratio).expect("valid"),
            dimensions,
            Staging::LIMITLESS,
            &Meter::unlimited(),
            |_| (),
        )
    };
    assert!(matches!(walk(1.7, 9.0, 3.0), TurnPassage::Infeasible(Infeasible::Fault { .. })));
    assert!(matches!(walk(0.2, 9.0, 2.0), TurnPassage::Infeasible(Infeasible::Dragon(_))));
    assert!(matches!(walk(0.8, 9.0, 1.0), TurnPassage::Contact(_)));
}

#[test]
fn a_clearance_that_stays_over_seams_of_one_circle_or_line_is_found_at_once() {
    let arc = |turn: f64| PathSegment::Arc { radius_m: 6.0, turn };
    let circle = PathSpec { segments: vec![arc(PI), arc(PI)], laps: Some(3) };
    let street = PathSpec { segments: vec![PathSegment::Line { length_m: 20.0 }; 3], laps: None };
    let dimensions = Dimensions::new(5, 3.41, 2.20, 0.30, 0.275).expect("valid benches");
    for (path, end_m) in [(circle, 36.0 * PI), (street, 60.0)] {
        let route = RouteSpec::from(path).build(1.0, dimensions.links_m()).expect("a valid path");
        let dragon = Dragon::new(dimensions, Arc::new(route)).expect("the dragon stands");
        let metered = dragon.metered(&Meter::of(1_000_000));
        let closest = least_clearance(&metered, 0.0, end_m, |_| ()).expect("little work").expect("five benches");
        assert_eq!(closest.pair.benches, [0, 2]);
        for travel_m in [0.0, 0.5 * end_m, end_m] {
            let there_m = clearance_at(&dragon, &ClosestApproach { travel_m, ..closest });
            assert!((there_m - closest.pair.clearance_m).abs() < 1e-11, "{there_m} m at {travel_m} m, {closest:?}");
        }
    }
}

#[test]
fn clearances_over_time_equal_the_table() {
    let travels_m = [0.0, 100.0, 200.0, 300.0, 400.0];
    let profile = clearance_profile(&paper_dragon(), &travels_m, || ()).approaches;
    let table = [0.169_279, 0.157_908, 0.164_999, 0.120_694, 0.025_533];
    for (point, clearance_m) in profile.iter().zip(table) {
        assert!((point.pair.clearance_m - clearance_m).abs() <= 5.001e-7, "{point:?}");
    }
    let benches: Vec<[usize; 2]> = profile[2..].iter().map(|point| point.pair.benches).collect();
    assert_eq!(benches, [[5, 32], [0, 21], [0, 10]]);
}

#[test]
fn near_miss_before_the_contact_equals_the_table() {
    let dragon = paper_dragon();
    let contact = first_contact(&dragon, 0.0, dragon.end_travel_m()).expect("no limit").expect("benches touch");
    let misses = near_misses(&dragon, 0.0, contact.travel_m, 0.02, |_| ()).approaches;
    let last = misses.last().expect("a near miss");
    assert_eq!(last.pair.benches, [0, 11], "{misses:?}");
    assert!((last.travel_m - 409.832).abs() <= 5.001e-4 && (last.pair.clearance_m - 0.000_865).abs() <= 5.001e-7);
}

proptest! {
    #![proptest_config(random_cases(32))]

    #[test]
    fn no_benches_of_a_walk_come_nearer(dragon in crowded_dragons()) {
        let from_m = dragon.start_travel_m();
        let contact = first_contact(&dragon, from_m, dragon.end_travel_m()).expect("no limit");
        let to_m = contact.map_or(dragon.end_travel_m(), |contact| contact.travel_m - 0.5);
        prop_assume!(to_m > from_m);
        let closest = least_clearance(&dragon, from_m, to_m, |_| ()).expect("no limit").expect("three benches");
        let walked = nearest_of_a_walk(&dragon, from_m, to_m, 0.002);
        prop_assert!(walked.clearance_m >= closest.pair.clearance_m - 1e-12, "{walked:?} under {closest:?}");
        // The clearance changes by at most the sum of both boards' displacements.
        prop_assert!(walked.clearance_m <= closest.pair.clearance_m + 0.02, "{walked:?} over {closest:?}");
        prop_assert!((clearance_at(&dragon, &closest) - closest.pair.clearance_m).abs() < 1e-12, "{closest:?}");
    }

    #[test]
    fn every_minimum_of_a_walk_is_a_near_miss(dragon in crowded_dragons(), limit_m in 0.05..0.6_f64) {
        let from_m = dragon.start_travel_m();
        let contact = first_contact(&dragon, from_m, dragon.end_travel_m()).expect("no limit");
        let to_m = contact.map_or(dragon.end_travel_m().min(from_m + 30.0), |contact| contact.travel_m);
        prop_assume!(to_m > from_m);
        let misses = near_misses(&dragon, from_m, to_m, limit_m, |_| ()).approaches;
        let travels_m: Vec<f64> = (0..=((to_m - from_m) / 0.01) as u32).map(|i| from_m + 0.01 * f64::from(i)).collect();
        let walk = clearance_profile(&dragon, &travels_m, || ()).approaches;
        let clearances_m: Vec<f64> = walk.iter().map(|point| point.pair.clearance_m).collect();
        // Minima of the walk deeper than rounding, away from the ends of the walk.
        for i in 2..clearances_m.len().saturating_sub(2) {
            let floor_m = clearances_m[i];
            let valley = floor_m < limit_m
                && [i - 1, i + 1].iter().all(|&beside| clearances_m[beside] > floor_m + 1e-9);
            let found = misses.iter().any(|miss| {
                (miss.travel_m - travels_m[i]).abs() < 0.021 && miss.pair.clearance_m <= floor_m + 1e-12
            });
            prop_assert!(!valley || found, "{floor_m} m at {} m is not among {misses:?}", travels_m[i]);
        }
        for miss in &misses {
            prop_assert!((clearance_at(&dragon, miss) - miss.pair.clearance_m).abs() < 1e-12, "{miss:?}");
            let at = clearance_profile(&dragon, &[miss.travel_m], || ()).approaches[0].pair.clearance_m;
            prop_assert!((at - miss.pair.clearance_m).abs() < 1e-12, "{miss:?} but {at}");
            // The clearance of its pair is at a minimum. The least clearance of all pairs then is, too: no other pair is nearer
            // there, and clearances are continuous. But a pair that is hardly further there may be nearer at any distance beside.
            // A near miss may lie at an end of the run.
            let [before, after] = [-1e-4, 1e-4].map(|step_m| {
                let travel_m = (miss.travel_m + step_m).clamp(from_m, dragon.end_travel_m());
                clearance_of(&dragon, miss.pair.benches, travel_m)
            });
            prop_assert!(before >= at - 1e-12 && after >= at - 1e-12, "{before} {at} {after} at {miss:?}");
        }
    }
}

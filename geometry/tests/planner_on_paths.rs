//! The planner's questions about a clearance or a speed on random paths, compared with fine walks.

use std::f64::consts::TAU;
use std::sync::Arc;

use bench_dragon_geometry::clearance::{ClearanceSearch, PairClearance};
use bench_dragon_geometry::dragon::{ChainSolver, Dimensions, Dragon};
use bench_dragon_geometry::planner::{
    LargestRatio, clearance_profile, first_faster, largest_speed_ratio, least_clearance, near_misses,
};
use bench_dragon_geometry::route::{PathSegment, PathSpec, RouteSpec};
use proptest::prelude::*;
use test_support::dragons::clearance_at;
use test_support::property::random_cases;

/// Steps of the walks, in metres.
const STEP_M: f64 = 0.01;

fn segments() -> impl Strategy<Value = PathSegment> {
    let radius_m = 1.5..8.0_f64;
    prop_oneof![
        (0.3..10.0_f64).prop_map(|length_m| PathSegment::Line { length_m }),
        (radius_m.clone(), 0.1..5.0_f64, any::<bool>()).prop_map(|(radius_m, turn, left)| {
            PathSegment::Arc { radius_m, turn: if left { turn } else { -turn } }
        }),
        (radius_m.clone(), radius_m, 0.5..7.0_f64, any::<bool>()).prop_map(
            |(start_radius_m, end_radius_m, turn, left)| {
                PathSegment::Spiral { start_radius_m, end_radius_m, turn: if left { turn } else { -turn } }
            }
        ),
    ]
}

/// Open paths, and closed figures of eight.
fn paths() -> impl Strategy<Value = PathSpec> {
    let eight = (4.0..12.0_f64, 1_u32..3).prop_map(|(length_m, laps)| {
        let (line, radius_m) = (PathSegment::Line { length_m }, 0.5 * length_m);
        let arc = |turn| PathSegment::Arc { radius_m, turn };
        PathSpec { segments: vec![line, arc(0.75 * TAU), line, arc(-0.75 * TAU)], laps: Some(laps) }
    });
    let open = prop::collection::vec(segments(), 1..5).prop_map(|segments| PathSpec { segments, laps: None });
    prop_oneof![3 => open, 1 => eight]
}

fn dragons() -> impl Strategy<Value = Dragon> {
    let benches = (3_usize..24, 1.0..2.5_f64, 0.8..2.0_f64, 0.1..0.3_f64, 0.0..0.3_f64);
    (benches, paths()).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m, hole), path)| {
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole * head_m.min(body_m)).ok()?;
        let route = RouteSpec::from(path).build(1.0, dimensions.links_m()).ok()?;
        Dragon::new(dimensions, Arc::new(route)).ok()
    })
}

/// Travels of a walk over the whole run, in equal steps, both ends included.
fn travels_m(dragon: &Dragon) -> Vec<f64> {
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let steps = ((end_m - start_m) / STEP_M).ceil().max(1.0) as u32;
    (0..=steps).map(|step| start_m + (end_m - start_m) * (f64::from(step) / f64::from(steps))).collect()
}

/// The nearest pair at each travel, of all pairs.
fn nearest(dragon: &Dragon, travels_m: &[f64]) -> Vec<PairClearance> {
    let (mut solver, mut search, mut boards) = (ChainSolver::new(dragon), ClearanceSearch::default(), Vec::new());
    let at = |&travel_m: &f64| {
        dragon.place_boards(solver.solve(dragon, travel_m).expect("within the run"), &mut boards);
        search.nearest(&boards).expect("three benches")
    };
    travels_m.iter().map(at).collect()
}

/// The fastest handle at each travel.
fn fastest(dragon: &Dragon, travels_m: &[f64]) -> Vec<LargestRatio> {
    let mut solver = ChainSolver::new(dragon);
    let at = |&travel_m: &f64| {
        let ratios = solver.solve(dragon, travel_m).expect("within the run").iter().map(|handle| handle.speed_ratio);
        let all = ratios.enumerate().map(|(handle, ratio)| LargestRatio { ratio, travel_m, handle });
        all.reduce(|first, second| if second.ratio > first.ratio { second } else { first }).expect("a head")
    };
    travels_m.iter().map(at).collect()
}

proptest! {
    #![proptest_config(random_cases(64))]

    #[test]
    fn the_profile_has_the_nearest_of_all_pairs(dragon in dragons()) {
        let travels_m = travels_m(&dragon);
        let profile = clearance_profile(&dragon, &travels_m, || ()).approaches;
        for (point, nearest) in profile.iter().zip(nearest(&dragon, &travels_m)) {
            prop_assert!((point.pair.clearance_m - nearest.clearance_m).abs() < 1e-12, "{point:?} but {nearest:?}");
        }
        prop_assert_eq!(profile.len(), travels_m.len());
    }

    #[test]
    fn the_least_clearance_is_that_of_a_walk_or_less(dragon in dragons()) {
        let travels_m = travels_m(&dragon);
        let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let closest = least_clearance(&dragon, start_m, end_m, |_| ()).expect("no limit").expect("three benches");
        let walk = nearest(&dragon, &travels_m).into_iter().map(|pair| pair.clearance_m);
        let walked_m = walk.fold(f64::INFINITY, f64::min);
        // A clearance changes by no more than both boards move.
        let clearance_m = closest.pair.clearance_m;
        prop_assert!(clearance_m <= walked_m + 1e-11 && clearance_m >= walked_m - 0.1, "{closest:?} but {walked_m} m");
        let there = nearest(&dragon, &[closest.travel_m])[0];
        prop_assert!((there.clearance_m - clearance_m).abs() < 1e-12, "{closest:?} but {there:?}");
    }

    /// A minimum of the walk, and a clearance that stays at its minimum.
    #[test]
    fn every_minimum_of_a_walk_is_a_near_miss(dragon in dragons(), limit_m in 0.05..1.0_f64) {
        let travels_m = travels_m(&dragon);
        let walk: Vec<f64> = nearest(&dragon, &travels_m).iter().map(|pair| pair.clearance_m).collect();
        prop_assume!(walk.iter().all(|clearance_m| *clearance_m > 0.0));
        let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let misses = near_misses(&dragon, start_m, end_m, limit_m, |_| ()).approaches;
        let mut i = 2;
        while i + 2 < walk.len() {
            let floor_m = walk[i];
            let level = walk[i..].iter().take_while(|clearance_m| (**clearance_m - floor_m).abs() < 1e-11).count();
            let after = i + level;
            let is_valley = after + 2 < walk.len() && walk[i - 1] > floor_m + 1e-6 && walk[after] > floor_m + 1e-6;
            if is_valley && floor_m < limit_m {
                let between = travels_m[i - 1]..=travels_m[after];
                let found = misses.iter().any(|miss| {
                    between.contains(&miss.travel_m) && miss.pair.clearance_m <= floor_m + 1e-11
                });
                prop_assert!(found, "{floor_m} m at {between:?} m is not among {misses:?}");
            }
            i = after;
        }
        for miss in &misses {
            let at_m = nearest(&dragon, &[miss.travel_m])[0].clearance_m;
            prop_assert!((at_m - miss.pair.clearance_m).abs() < 1e-11, "{miss:?} but {at_m}");
            // Another pair may be nearer at any distance beside, but its own pair is at a minimum.
            let after_m = clearance_at(&dragon, (miss.travel_m + 1e-4).min(end_m), miss.pair.benches);
            prop_assert!(after_m >= at_m - 1e-11, "{miss:?} but {after_m}");
        }
    }

    #[test]
    fn no_handle_of_a_walk_is_faster_than_the_largest_ratio(dragon in dragons()) {
        let Ok(largest) = largest_speed_ratio(&dragon) else { return Ok(()) };
        for walked in fastest(&dragon, &travels_m(&dragon)) {
            prop_assert!(walked.ratio <= largest.ratio * (1.0 + 1e-12), "{walked:?} is faster than {largest:?}");
        }
        let there = fastest(&dragon, &[largest.travel_m])[0];
        prop_assert!((there.ratio / largest.ratio - 1.0).abs() < 1e-12, "{largest:?} but {there:?}");
    }

    /// The first excess of a walk is at most one step behind the answer. A run may end with a fault.
    #[test]
    fn the_first_excess_of_a_ratio_is_that_of_a_walk(dragon in dragons(), excess in 0.0..1.0_f64) {
        let ratio = 1.0 + 0.5 * excess * excess;
        let walk = fastest(&dragon, &travels_m(&dragon));
        let walked = walk.iter().position(|fastest| fastest.ratio > ratio * (1.0 + 1e-12));
        let found = first_faster(&dragon, ratio).expect("no limit");
        if let Some(walked) = walked {
            let found = found.expect("a handle of the walk exceeds the ratio");
            prop_assert!(found.travel_m <= walk[walked].travel_m + 1e-9, "{found:?} after {:?}", walk[walked]);
        }
        if let Some(found) = found {
            let [before, there] = [found.travel_m - 1e-9, found.travel_m].map(|travel_m| {
                fastest(&dragon, &[travel_m.max(dragon.start_travel_m())])[0]
            });
            prop_assert!(there.ratio > ratio && (there.ratio - found.ratio).abs() < 1e-12, "{found:?} but {there:?}");
            let is_start = found.travel_m == dragon.start_travel_m();
            prop_assert!(is_start || before.ratio <= ratio * (1.0 + 1e-9), "{found:?} but {before:?} before");
        }
    }
}

/// Handle 1 is the fastest at both ends of an interval of some centimetres, and the tail between them. The search has its samples
/// elsewhere for each end of the run.
#[test]
fn the_largest_ratio_may_be_that_of_a_handle_far_behind() {
    for tenth in 0..40 {
        let segments = vec![
            PathSegment::Spiral { start_radius_m: 1.5, end_radius_m: 4.453_214_234_769_256, turn: -0.5 },
            PathSegment::Line { length_m: 0.346_472_625_854_153 },
            PathSegment::Arc { radius_m: 1.571_021_156_268_325, turn: -3.494_039_813_709_058 },
            PathSegment::Spiral { start_radius_m: 5.864_124, end_radius_m: 3.551_134, turn: 5.613_166 },
        ];
        let dimensions = Dimensions::new(11, 2.408_142, 1.009_16, 0.1, 0.279_784).expect("valid benches");
        let spec = RouteSpec {
            end_s: Some(32.0 + 0.01 * f64::from(tenth)),
            ..RouteSpec::from(PathSpec { segments, laps: None })
        };
        let dragon = Dragon::new(dimensions, Arc::new(spec.build(1.0, dimensions.links_m()).expect("a path")))
            .expect("it stands");
        let largest = largest_speed_ratio(&dragon).expect("every handle walks");
        let walk: Vec<f64> = (0..400).map(|step| 9.664 + 1e-5 * f64::from(step)).collect();
        for walked in fastest(&dragon, &walk) {
            assert!(walked.ratio <= largest.ratio * (1.0 + 1e-12), "{tenth}: {walked:?} is faster than {largest:?}");
        }
    }
}

/// All handles are faster where handle 11 crosses a joint. At the samples of the search on both sides of it, handles 1 to 10 are the
/// fastest.
#[test]
fn the_largest_ratio_may_be_that_of_the_tail_at_a_kink_between_samples() {
    let segments = vec![
        PathSegment::Spiral { start_radius_m: 3.431_496_811_530_114, end_radius_m: 7.096_606_582_407_746, turn: 0.5 },
        PathSegment::Arc { radius_m: 2.932_603_903_508_078, turn: 4.144_058_128_978_162 },
        PathSegment::Spiral {
            start_radius_m: 3.017_615_833_431_490_6,
            end_radius_m: 5.424_091_036_737_479,
            turn: 4.087_932_239_663_057,
        },
    ];
    let dimensions = Dimensions::new(13, 2.264_489_892_425_964, 1.270_118_086_926_206_3, 0.1, 0.043_818_324_199_136_11)
        .expect("valid benches");
    let route = RouteSpec::from(PathSpec { segments, laps: None }).build(1.0, dimensions.links_m()).expect("a path");
    let dragon = Dragon::new(dimensions, Arc::new(route)).expect("it stands");
    let largest = largest_speed_ratio(&dragon).expect("every handle walks");
    assert!(largest.handle == 13 && (largest.travel_m - 18.663).abs() < 1e-3, "{largest:?}");
    let found = first_faster(&dragon, 1.0066).expect("no limit").expect("the tail exceeds it");
    assert!(found.handle == 13 && found.travel_m < largest.travel_m, "{found:?}");
}

//! Properties of every dragon on every spiral, at any travel.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{ChainSolver, Dimensions, Dragon, FeasibleEnd};
use bench_dragon_geometry::route::Route;
use proptest::prelude::*;
use test_support::dragons::handles_at;
use test_support::property::random_cases;

/// Dragons that can stand at the start of a spiral.
fn dragons() -> impl Strategy<Value = Dragon> {
    let benches = (1_usize..60, 0.5..4.0_f64, 0.5..4.0_f64, 0.05..0.5_f64, 0.0..0.4_f64);
    let spirals = (1.02..5.0_f64, 2.0..20.0_f64);
    (benches, spirals).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m, hole), (pitch, turns))| {
        let hole_offset_m = hole * head_m.min(body_m);
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole_offset_m).ok()?;
        Dragon::new(dimensions, Arc::new(Route::spiral(pitch * width_m, turns).ok()?)).ok()
    })
}

/// A dragon and a travel of its run.
fn walks() -> impl Strategy<Value = (Dragon, f64)> {
    (dragons(), 0.0..=1.0_f64).prop_map(|(dragon, part)| {
        let travel_m = part * dragon.end_travel_m();
        (dragon, travel_m)
    })
}

/// The stop is 1.2 cm before the handle would jump, between the same two samples of the search for faults. The expected travel is
/// where the head's link is perpendicular to the spiral, by dense samples and bisection in another language.
#[test]
fn a_handle_that_stops_shortly_before_it_would_jump_ends_the_run() {
    let dimensions = Dimensions::new(1, 2.907_092_952_379_163_5, 1.616, 0.05, 0.094_417_098_496_229_63);
    let spiral = Route::spiral(0.073_070_634_934_938_87, 2.0).expect("a valid spiral");
    let dragon = Dragon::new(dimensions.expect("valid benches"), Arc::new(spiral)).expect("the dragon stands");
    assert_eq!(dragon.feasible_end(), FeasibleEnd::HandleStops { handle: 1 });
    assert!((dragon.end_travel_m() - 0.123_684_412_310_7).abs() < 1e-9, "{}", dragon.end_travel_m());
}

proptest! {
    #![proptest_config(random_cases(256))]

    #[test]
    fn every_link_keeps_its_length((dragon, travel_m) in walks()) {
        for (bench, ends) in handles_at(&dragon, travel_m).windows(2).enumerate() {
            let error_m = ends[0].position.distance(ends[1].position) - dragon.dimensions().link_m(bench);
            prop_assert!(error_m.abs() < 1e-12, "link {bench} is off by {error_m} m");
        }
    }

    #[test]
    fn every_handle_is_on_the_route_behind_the_handle_before_it((dragon, travel_m) in walks()) {
        let handles = handles_at(&dragon, travel_m);
        prop_assert!(handles.windows(2).all(|ends| ends[1].parameter < ends[0].parameter));
        for handle in handles {
            let point = dragon.route().point(handle.parameter);
            prop_assert_eq!((point.position, point.tangent), (handle.position, handle.tangent));
        }
    }

    #[test]
    fn no_nearer_parameter_is_at_the_distance_of_the_link((dragon, travel_m) in walks()) {
        for (bench, ends) in handles_at(&dragon, travel_m).windows(2).enumerate() {
            let link_m = dragon.dimensions().link_m(bench);
            for part in 1..400 {
                let parameter = ends[0].parameter + (ends[1].parameter - ends[0].parameter) * f64::from(part) / 400.0;
                let distance_m = ends[0].position.distance(dragon.route().point(parameter).position);
                prop_assert!(distance_m < link_m, "link {bench} could end after {part}/400 of the arc to its rear handle");
            }
        }
    }

    /// The error of a central difference is c·h² and smaller terms, and rounding over h. So that of half the step is a third of
    /// the change from the whole step to half of it. The bound is three times that, for the smaller terms.
    #[test]
    fn speeds_equal_the_rates_of_the_positions(dragon in dragons(), part in 0.01..0.95_f64) {
        // Rounding of a difference of two positions of a handle as fast as the head: each link is exact to 10⁻¹² m.
        const ROUNDING_M: f64 = 1e-11;
        let (travel_m, half_step_m) = (part * dragon.end_travel_m(), 1e-5_f64.min(0.01 * dragon.end_travel_m()));
        let poses = [-1.0, -0.5, 0.5, 1.0].map(|share| handles_at(&dragon, travel_m + share * half_step_m));
        for (index, handle) in handles_at(&dragon, travel_m).iter().enumerate() {
            let moved = |from: usize, to: usize| poses[to][index].position - poses[from][index].position;
            let [velocity, coarse] = [moved(1, 2) / half_step_m, moved(0, 3) / (2.0 * half_step_m)];
            let error = velocity - handle.speed_ratio * handle.tangent;
            let bound = velocity.distance(coarse) + (1.0 + handle.speed_ratio) * ROUNDING_M / half_step_m;
            prop_assert!(error.length() <= bound, "handle {index} moves at {velocity}, not at {}", handle.speed_ratio);
        }
    }

    #[test]
    fn every_handle_moves_forward((dragon, travel_m) in walks()) {
        for (index, handle) in handles_at(&dragon, travel_m).iter().enumerate() {
            prop_assert!(handle.speed_ratio > 0.0, "handle {index} has ratio {}", handle.speed_ratio);
        }
    }

    /// On the way in, the route has a larger curvature at a link's front. There the chord makes the larger angle (Vogt's
    /// theorem), as long as the link does not span half a turn.
    #[test]
    fn no_handle_on_the_way_in_is_faster_than_the_handle_before_it((dragon, travel_m) in walks()) {
        for (bench, ends) in handles_at(&dragon, travel_m).windows(2).enumerate() {
            if dragon.route().curvature_bound(ends[1].parameter, ends[0].parameter) * dragon.dimensions().link_m(bench) < 2.0 {
                let ratio = ends[1].speed_ratio / ends[0].speed_ratio;
                prop_assert!(ratio <= 1.0 + 1e-12, "bench {bench} has ratio {ratio}");
            }
        }
    }

    #[test]
    fn a_pose_depends_on_its_travel_alone((dragon, travel_m) in walks(), other in 0.0..=1.0_f64) {
        let mut solver = ChainSolver::new(&dragon);
        let first = solver.solve(&dragon, travel_m).expect("within the run").to_vec();
        solver.solve(&dragon, other * dragon.end_travel_m()).expect("within the run");
        prop_assert_eq!(solver.solve(&dragon, travel_m).expect("within the run"), &first[..]);
    }

    #[test]
    fn a_run_ended_by_a_handle_ends_at_the_stop_of_that_handle(dragon in dragons()) {
        let handles = handles_at(&dragon, dragon.end_travel_m());
        match dragon.feasible_end() {
            FeasibleEnd::RouteEnd => prop_assert_eq!(dragon.end_travel_m(), dragon.route().end_travel_m()),
            FeasibleEnd::HandleStops { handle } => {
                prop_assert!(handles[handle].speed_ratio.abs() < 1e-5, "ratio {}", handles[handle].speed_ratio);
                prop_assert!(handles[..handle].iter().all(|ahead| ahead.speed_ratio > 1e-5));
            }
            FeasibleEnd::HandleJumps { handle } => {
                prop_assert!(dragon.dimensions().link_m(handle - 1) > dragon.route().pitch_m());
            }
        }
    }

    #[test]
    fn parameter_and_travel_are_inverse(pitch_m in 0.01..100.0_f64, turns in 0.1..1000.0_f64, part in -1.0..1.0_f64) {
        let spiral = Route::spiral(pitch_m, turns).expect("a valid spiral");
        let travel_m = part * spiral.end_travel_m();
        let error_m = spiral.travel(spiral.parameter(travel_m)) - travel_m;
        prop_assert!(error_m.abs() <= 1e-14 * spiral.end_travel_m(), "off by {error_m} m at {travel_m} m");
    }

    #[test]
    fn a_step_back_covers_at_most_the_arc_and_at_least_a_third(
        pitch_m in 0.01..100.0_f64,
        turns in 0.1..100.0_f64,
        part in 0.0..=1.0_f64,
        arc_m in 1e-6..1000.0_f64,
    ) {
        let spiral = Route::spiral(pitch_m, turns).expect("a valid spiral");
        let parameter = spiral.parameter(part * spiral.end_travel_m());
        let walked_m = spiral.travel(parameter) - spiral.travel(spiral.step_back(parameter, arc_m));
        let rounding_m = 1e-13 * (spiral.end_travel_m() + arc_m);
        prop_assert!(walked_m <= arc_m + rounding_m, "{walked_m} m of {arc_m} m");
        prop_assert!(3.0 * walked_m >= arc_m - rounding_m, "{walked_m} m of {arc_m} m");
    }

    #[test]
    fn curvature_bound_equals_the_turning_rate_of_the_tangent(pitch_m in 0.1..10.0_f64, turns in 0.1..50.0_f64) {
        let spiral = Route::spiral(pitch_m, turns).expect("a valid spiral");
        let parameter = spiral.parameter(0.0);
        let half_step = 1e-5;
        let [before, here, after] = [parameter - half_step, parameter, parameter + half_step].map(|parameter| spiral.point(parameter));
        let curvature = before.tangent.angle_to(after.tangent).abs() / (2.0 * half_step * here.speed_m_per_unit);
        let bound = spiral.curvature_bound(parameter, parameter);
        prop_assert!((curvature - bound).abs() < 1e-6 * bound, "{curvature} against {bound}");
    }
}

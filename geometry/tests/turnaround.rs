//! The turnaround: its known values, its seams, and turns that no dragon can walk. The head walks at 1 m/s, so travel in metres
//! is time in seconds.

use std::sync::Arc;

use bench_dragon_geometry::clearance::first_contact;
use bench_dragon_geometry::dragon::{ChainSolver, Dimensions, Dragon, FeasibleEnd};
use bench_dragon_geometry::route::{RouteError, Turnaround};
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::{
    assert_near, clearance_at, dragon_on, paper_benches, paper_turnaround, some_pair_overlaps, turning_dragon,
};
use test_support::property::random_cases;

/// Lengths of the line of an S, as shares of the diameter.
fn line_shares() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), 0.0..0.1_f64, 0.0..0.999_f64]
}

fn turnarounds() -> impl Strategy<Value = Turnaround> {
    (0.2..3.0_f64, 0.5..40.0_f64, 0.05..20.0_f64, line_shares())
        .prop_map(|(pitch_m, diameter_m, ratio, line)| {
            Turnaround::with_line(pitch_m, diameter_m, ratio, line * diameter_m).expect("valid")
        })
        .prop_map(|turnaround| turnaround.between(-500.0, 500.0).expect("a valid span"))
}

#[test]
fn head_has_the_positions_of_the_table() {
    let dragon = turning_dragon();
    let table = [
        (-100.0, 7.778_034, 3.717_164),
        (-50.0, 6.608_301, 1.898_865),
        (0.0, -2.711_856, -3.591_078),
        (50.0, 1.332_696, 6.175_324),
        (100.0, -3.157_229, 7.548_511),
    ];
    for (time_s, x, y) in table {
        let head = dragon.chain(time_s).expect("within the run").next().expect("a head");
        assert_near(head.position, x, y, &format!("the head at {time_s} s"));
    }
}

#[test]
fn tail_has_the_position_and_speed_of_the_table() {
    let dragon = turning_dragon();
    let tail = ChainSolver::new(&dragon).solve(&dragon, 100.0).expect("within the run")[223];
    assert_near(tail.position, -10.980_157, -6.770_006, "handle 223");
    assert!((tail.speed_ratio - 1.094_833).abs() <= 5.001e-7, "handle 223 has speed {}", tail.speed_ratio);
}

#[test]
fn arcs_equal_the_table() {
    let turnaround = paper_turnaround(2.0);
    let [entry_arc, exit_arc] = turnaround.arcs();
    assert!((entry_arc.radius_m() - 3.005_418).abs() <= 5.001e-7, "{}", entry_arc.radius_m());
    assert!((exit_arc.radius_m() - 1.502_709).abs() <= 5.001e-7, "{}", exit_arc.radius_m());
    for ratio in [0.1, 0.5, 1.0, 2.0, 7.0] {
        let length_m = paper_turnaround(ratio).turn_length_m();
        assert!((length_m - 13.621_245).abs() <= 5.001e-7, "ratio {ratio}: {length_m} m");
    }
}

#[test]
fn paper_turnaround_is_walked_to_its_end_without_a_contact() {
    let dragon = turning_dragon();
    assert_eq!((dragon.end_travel_m(), dragon.feasible_end()), (100.0, FeasibleEnd::RouteEnd));
    assert_eq!(first_contact(&dragon, dragon.start_travel_m(), dragon.end_travel_m()).expect("no limit"), None);
}

/// With radius ratio 3, handle 1 walks backwards, and later jumps by about 3 m.
#[test]
fn feasible_travel_ends_on_a_turn_that_is_too_tight() {
    let dragon = dragon_on(paper_turnaround(3.0).route(), paper_benches(223));
    assert_eq!(dragon.feasible_end(), FeasibleEnd::HandleStops { handle: 1 });
    let end_m = dragon.end_travel_m();
    assert!(end_m > 10.2 && end_m < 15.15, "the run ends at {end_m} m");
    let last = dragon.chain(end_m).expect("within the run").nth(1).expect("a handle");
    assert!(last.speed_ratio.abs() < 1e-5, "handle 1 has speed ratio {}", last.speed_ratio);
}

#[test]
fn no_jump_is_missed_on_turns_that_are_slightly_too_tight() {
    // At lower ratios handle 1 stops in the first arc; above, it jumps by a few millimetres on the way out.
    let dimensions = paper_benches(2);
    for i in 0..2000 {
        let ratio = 1.000_04 + 4e-8 * f64::from(i);
        let turnaround = Turnaround::new(1.7, 5.668_4, ratio).and_then(|turn| turn.between(0.0, 40.0));
        let route = turnaround.expect("valid").route();
        let dragon = Dragon::new(dimensions, Arc::new(route)).expect("the dragon stands on the way in");
        assert_eq!(dragon.feasible_end(), FeasibleEnd::HandleJumps { handle: 1 }, "at the ratio {ratio}");
    }
}

#[test]
fn impossible_turnarounds_are_rejected_with_a_reason() {
    let error = |pitch_m, diameter_m, ratio| Turnaround::new(pitch_m, diameter_m, ratio).expect_err("not valid");
    assert_eq!(error(0.0, 9.0, 2.0), RouteError::Pitch(0.0));
    assert_eq!(error(1.7, 0.0, 2.0), RouteError::TurnDiameter { turn_diameter_m: 0.0, pitch_m: 1.7 });
    assert_eq!(error(1.7, 9.0, -1.0), RouteError::RadiusRatio(-1.0));
    assert!(matches!(error(f64::NAN, 9.0, 2.0), RouteError::Pitch(_)));
    assert!(matches!(error(1.7, f64::INFINITY, 2.0), RouteError::TurnDiameter { .. }));
    assert!(matches!(error(1.7, 9.0, f64::NAN), RouteError::RadiusRatio(_)));
    let error = paper_turnaround(2.0).between(5.0, 5.0).expect_err("an empty span");
    assert_eq!(error, RouteError::Span { start_travel_m: 5.0, end_travel_m: 5.0 });
}

#[test]
fn a_line_is_shorter_than_the_circle_is_wide() {
    let with_line = |line_m| Turnaround::with_line(1.7, 9.0, 2.0, line_m);
    for line_m in [-0.1, 9.0, f64::INFINITY] {
        assert_eq!(with_line(line_m), Err(RouteError::TurnLine { line_m, turn_diameter_m: 9.0 }));
    }
    assert!(with_line(f64::NAN).is_err());
    assert_eq!(
        with_line(9.0).expect_err("too long").to_string(),
        "turn_line_m is 9, must be 0 or more, and under turn_diameter_m 9"
    );
    assert!(with_line(8.999).is_ok());
}

/// Each arc turns by 2·atan θ, and the radii sum to R / sin(atan θ). The numbers have the same bits.
#[test]
fn a_line_of_no_length_is_the_s_of_two_arcs() {
    for (pitch_m, diameter_m, ratio) in [(1.7, 9.0, 2.0), (0.55, 3.3, 0.7), (2.9, 31.0, 1.0)] {
        let turnaround = Turnaround::with_line(pitch_m, diameter_m, ratio, 0.0).expect("valid");
        assert_eq!(turnaround, Turnaround::new(pitch_m, diameter_m, ratio).expect("valid"));
        let angle = 0.5 * diameter_m / (pitch_m / std::f64::consts::TAU);
        let (turn_angle, radii_sum_m) = (2.0 * angle.atan(), 0.5 * diameter_m / angle.atan().sin());
        let [entry_arc, exit_arc] = turnaround.arcs();
        assert_eq!([entry_arc.angle(), exit_arc.angle()], [turn_angle; 2]);
        let exit_radius_m = radii_sum_m / (1.0 + ratio);
        assert_eq!([entry_arc.radius_m(), exit_arc.radius_m()], [radii_sum_m - exit_radius_m, exit_radius_m]);
    }
}

/// The radii of the arcs with a line of 2 m, from the equations of the closed form, solved by bisection.
#[test]
fn a_line_lies_between_two_tighter_arcs_on_the_way_to_the_exit() {
    let (pitch_m, radius_m, line_m) = (1.7, 4.5, 2.0);
    let turnaround = Turnaround::with_line(pitch_m, 2.0 * radius_m, 2.0, line_m).expect("valid");
    let chord_angle = (radius_m * std::f64::consts::TAU / pitch_m).atan();
    let chord = 2.0 * radius_m * DVec2::from_angle(chord_angle);
    // The sum of the radii at which the two equations agree on their second component, for each angle of the arcs.
    let sum_m = |angle: f64| (chord.x - line_m * angle.cos()) / angle.sin();
    let beyond = |angle: f64| sum_m(angle) * (1.0 - angle.cos()) + line_m * angle.sin() - chord.y;
    let (mut low, mut high) = (1.0, 3.0);
    for _ in 0..60 {
        let middle: f64 = 0.5 * (low + high);
        if beyond(middle) < 0.0 { low = middle } else { high = middle }
    }
    let [entry_arc, exit_arc] = turnaround.arcs();
    assert!((entry_arc.angle() - low).abs() < 1e-12, "{} is not {low}", entry_arc.angle());
    let radii_m = entry_arc.radius_m() + exit_arc.radius_m();
    assert!((radii_m - sum_m(low)).abs() < 1e-12, "{radii_m} is not {}", sum_m(low));
    assert!((entry_arc.radius_m() / exit_arc.radius_m() - 2.0).abs() < 1e-12);
    let ends_m = turnaround.ends_m();
    assert!((ends_m[1] - ends_m[0] - line_m).abs() < 1e-12 && ends_m[2] == turnaround.turn_length_m());
    let route = turnaround.route();
    let [begin, end] = [ends_m[0], ends_m[1]].map(|travel_m| route.point(route.parameter(travel_m)));
    assert!(begin.position.distance(end.position - line_m * begin.tangent) < 1e-12);
    assert!(begin.tangent.distance(end.tangent) < 1e-12);
}

/// Numbers from the smallest positive `f64` to `most`. Each power of ten is equally likely.
fn up_to(most: f64) -> impl Strategy<Value = f64> {
    (-323.0..=most.log10()).prop_map(move |power| 10_f64.powf(power).min(most))
}

proptest! {
    #![proptest_config(random_cases(2048))]

    #[test]
    fn every_turnaround_that_is_accepted_has_a_route(
        pitch_m in up_to(1000.0), pitches in up_to(20_000.0), ratio in 0.01..=100.0_f64, line in up_to(1.0),
    ) {
        for (pitch_m, diameter_m) in [(pitch_m, pitches * pitch_m), (pitch_m, f64::from_bits(1)), (f64::from_bits(1), pitches)] {
            for line_m in [0.0, line * diameter_m, diameter_m.next_down()] {
                if let Ok(turnaround) = Turnaround::with_line(pitch_m, diameter_m, ratio, line_m) {
                    prop_assert_eq!(turnaround.route().seams().len(), if line_m > 0.0 { 4 } else { 3 });
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(random_cases(256))]

    #[test]
    fn position_and_tangent_are_continuous_at_every_seam(turnaround in turnarounds()) {
        // A step on which the tightest arc turns by at most 10⁻⁹ rad.
        let step = turnaround.arcs().map(|arc| arc.radius_m()).into_iter().fold(1.0, f64::min) * 1e-9;
        for &seam in turnaround.route().seams() {
            let (before, after) = (turnaround.route().point(seam), turnaround.route().point(seam + step));
            prop_assert!(before.position.distance(after.position) < 1e-7, "{before:?} {after:?}");
            prop_assert!(before.tangent.distance(after.tangent) < 1e-7, "{before:?} {after:?}");
        }
        prop_assert!(turnaround.route().point(turnaround.route().seams()[0]).position.distance(turnaround.entry()) < 1e-12);
        let last = *turnaround.route().seams().last().expect("an S has seams");
        prop_assert!(turnaround.route().point(last).position.distance(turnaround.exit()) < 1e-12);
    }

    #[test]
    fn the_turn_lies_in_its_circle(turnaround in turnarounds(), share in 0.0..1.0_f64) {
        let parameter = turnaround.route().parameter(share * turnaround.turn_length_m());
        let distance_m = turnaround.route().point(parameter).position.length();
        prop_assert!(distance_m <= 0.5 * turnaround.turn_diameter_m() + 1e-12);
    }

    #[test]
    fn the_way_out_is_the_way_in_turned_by_half_a_turn(turnaround in turnarounds(), way_m in 0.0..400.0_f64) {
        let way_in = turnaround.route().point(turnaround.route().parameter(-way_m));
        let way_out = turnaround.route().point(turnaround.route().parameter(turnaround.turn_length_m() + way_m));
        prop_assert!((way_in.position + way_out.position).length() < 1e-10);
        prop_assert!((way_in.tangent - way_out.tangent).length() < 1e-10);
    }

    #[test]
    fn parameter_inverts_travel(turnaround in turnarounds(), travel_m in -400.0..400.0_f64) {
        prop_assert!((turnaround.route().travel(turnaround.route().parameter(travel_m)) - travel_m).abs() < 1e-10);
    }

    #[test]
    fn tangent_and_speed_are_the_derivative_of_the_position(turnaround in turnarounds(), travel_m in -400.0..400.0_f64) {
        let parameter = turnaround.route().parameter(travel_m);
        let step = 1e-6 / turnaround.route().point(parameter).speed_m_per_unit;
        let [behind, ahead] = [parameter - step, parameter + step].map(|parameter| turnaround.route().point(parameter).position);
        let point = turnaround.route().point(parameter);
        let rate = (ahead - behind) / (2.0 * step);
        prop_assert!((rate - point.speed_m_per_unit * point.tangent).length() < 1e-4 * point.speed_m_per_unit, "{point:?} {rate}");
    }

    #[test]
    fn a_step_back_covers_at_most_the_arc_and_at_least_a_third(
        turnaround in turnarounds(),
        travel_m in -400.0..400.0_f64,
        arc_m in 0.001..60.0_f64,
    ) {
        let parameter = turnaround.route().parameter(travel_m);
        let covered_m = travel_m - turnaround.route().travel(turnaround.route().step_back(parameter, arc_m));
        prop_assert!(covered_m <= arc_m + 1e-9 && covered_m >= arc_m / 3.0 - 1e-9, "{covered_m} of {arc_m} m");
    }

    #[test]
    fn curvature_stays_under_its_bound(
        turnaround in turnarounds(),
        travel_m in -100.0..100.0_f64,
        arc_m in 0.01..30.0_f64,
        share in 0.0..1.0_f64,
    ) {
        let [rear, front] = [travel_m - arc_m, travel_m].map(|travel_m| turnaround.route().parameter(travel_m));
        let bound = turnaround.route().curvature_bound(rear, front);
        let (at_m, step_m) = (travel_m - share * arc_m, 1e-5);
        if at_m - step_m > travel_m - arc_m {
            let [a, b] = [at_m - step_m, at_m].map(|at_m| turnaround.route().point(turnaround.route().parameter(at_m)).tangent);
            prop_assert!(a.distance(b) <= bound * step_m * (1.0 + 1e-3) + 1e-9, "{} > {bound}", a.distance(b) / step_m);
        }
    }
}

/// Dragons on turns so narrow and tight that some touch and some cannot walk on.
fn crowded_dragons() -> impl Strategy<Value = Dragon> {
    let benches = (3_usize..40, 1.0..4.0_f64, 1.0..2.5_f64, 0.1..0.4_f64, 0.0..0.3_f64);
    let turns = (1.5..6.0_f64, 2.0..12.0_f64, 0.3..3.0_f64, line_shares());
    (benches, turns).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m, hole_m), turn)| {
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole_m).ok()?;
        let turnaround = Turnaround::with_line(turn.0 * width_m, turn.1, turn.2, turn.3 * turn.1).ok()?;
        let turnaround = turnaround.between(-5.0, 40.0).ok()?;
        Dragon::new(dimensions, Arc::new(turnaround.route())).ok()
    })
}

proptest! {
    #![proptest_config(random_cases(48))]

    #[test]
    fn links_keep_their_length_and_speeds_match_the_positions(
        dragon in crowded_dragons(),
        share in 0.0..1.0_f64,
    ) {
        let (start_m, end_m, step_m) = (dragon.start_travel_m(), dragon.end_travel_m(), 1e-6);
        let travel_m = start_m + share * (end_m - start_m - step_m);
        let mut solver = ChainSolver::new(&dragon);
        let before = solver.solve(&dragon, travel_m).expect("within the run").to_vec();
        let after = solver.solve(&dragon, travel_m + step_m).expect("within the run");
        for (bench, link) in before.windows(2).enumerate() {
            let error_m = link[0].position.distance(link[1].position) - dragon.dimensions().link_m(bench);
            prop_assert!(error_m.abs() < 1e-9, "bench {bench} at {travel_m} m is {error_m} m too long");
        }
        for (index, (before, after)) in before.iter().zip(after).enumerate() {
            let ratio = (dragon.route().travel(after.parameter) - dragon.route().travel(before.parameter)) / step_m;
            let between = before.speed_ratio.min(after.speed_ratio)..=before.speed_ratio.max(after.speed_ratio);
            let off = (between.start() - ratio).max(ratio - between.end());
            prop_assert!(off < 1e-3 * (1.0 + ratio), "handle {index} at {travel_m} m: {ratio} outside {between:?}");
        }
    }

    #[test]
    fn first_contact_is_no_later_than_the_first_overlap_of_a_walk(dragon in crowded_dragons()) {
        let (start_m, end_m, step_m) = (dragon.start_travel_m(), dragon.end_travel_m(), 0.005);
        let steps = ((end_m - start_m) / step_m) as u32;
        let travels = (0..=steps).map(|step| start_m + f64::from(step) * step_m);
        let overlap_m = travels.into_iter().find(|&travel_m| some_pair_overlaps(&dragon, travel_m));
        let contact = first_contact(&dragon, start_m, end_m).expect("no limit");
        let Some(contact) = contact else {
            prop_assert_eq!(overlap_m, None);
            return Ok(());
        };
        prop_assert!(overlap_m.is_none_or(|overlap_m| contact.travel_m <= overlap_m), "{contact:?} after {overlap_m:?}");
        prop_assert!(contact.travel_m == start_m || !some_pair_overlaps(&dragon, contact.travel_m - 2e-11));
        prop_assert!(contact.travel_m == start_m || clearance_at(&dragon, contact.travel_m, contact.benches).abs() < 1e-10);
    }
}

//! The derivatives of the planner's answers, compared with central differences of the whole solvers.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{Dimensions, Dragon, Meter};
use bench_dragon_geometry::ground::Ground;
use bench_dragon_geometry::planner::{
    Curve, NoDerivative, Parameter, Quantity, Response, Sample, Sensitivity, Setting, Undefined,
};
use bench_dragon_geometry::route::{PathSegment, PathSpec, Placement, RouteSpec, SpiralSpec, TurnaroundSpec};
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::{boards_at, handles_at, least_clearance_m, paper_benches, wide_paths};
use test_support::hills::{hills_every, plane};
use test_support::property::random_cases;

/// Relative step of the differences. Their error is the fourth power of the step times a fifth derivative, to which every bench
/// contributes. The solvers' errors of about 10⁻¹¹, divided by the step, are below 10⁻⁶.
const RANGE: f64 = 5e-5;

/// Tolerance relative to the derivative, or to 1 if the derivative is below 1. The time of a contact is exact to 10⁻¹¹ m
/// divided by the closing speed of the pair, which is mostly a few hundredths.
const TOLERANCE: f64 = 1e-5;

fn study(setting: Setting, parameters: &[Parameter]) -> Vec<Response> {
    let parameters = parameters.to_vec();
    Sensitivity { setting, turn_diameter_m: 9.0, range: RANGE, steps: 2, parameters }.study(&Meter::unlimited(), || ())
}

/// All parameters of a plan.
fn all(setting: &Setting) -> Vec<Parameter> {
    Parameter::ALL.into_iter().filter(|parameter| setting.has(*parameter)).collect()
}

/// Richardson's extrapolation of central differences.
fn difference(curve: &Curve) -> Option<f64> {
    let [back_2, back, _, ahead, ahead_2] = &curve.samples[..] else { panic!("two steps to either side") };
    let value = |sample: &Sample| sample.value.clone().ok();
    let step = ahead.parameter_value - curve.parameter_value;
    Some((8.0 * (value(ahead)? - value(back)?) - (value(ahead_2)? - value(back_2)?)) / (12.0 * step))
}

/// Checks every derivative that exists. Returns their number.
fn check(setting: &Setting, parameters: &[Parameter]) -> usize {
    let mut checked = 0;
    for Response { quantity, curves, .. } in study(setting.clone(), parameters) {
        for curve in curves {
            let (Ok(derivative), Some(expected)) = (&curve.derivative, difference(&curve)) else { continue };
            checked += 1;
            assert!(
                (derivative - expected).abs() <= TOLERANCE * expected.abs().max(1.0),
                "{quantity} of {:?} on {:?} over {}: {derivative}, by differences {expected}",
                setting.dimensions,
                setting.route.shape,
                curve.parameter
            );
        }
    }
    checked
}

proptest! {
    #![proptest_config(ProptestConfig { max_shrink_iters: 0, ..random_cases(12) })]

    #[test]
    fn random_paths_have_the_derivatives_of_the_differences(
        path in wide_paths(2..6),
        benches in 3_usize..40,
        (head_m, body_m) in (1.5..4.0_f64, 1.5..2.5_f64),
        (width_m, hole_m) in (0.1..0.4_f64, 0.05..0.3_f64),
        accel_mps2 in prop::option::of(0.2..1.0_f64),
        pole_share in prop::option::of(0.8..0.99_f64),
    ) {
        let rigid = Dimensions::new(benches, head_m, body_m, width_m, hole_m).expect("valid benches");
        let loose = |share| rigid.with_poles(0.05, 0.05 * share).expect("holes within the boards");
        let dimensions = pole_share.map_or(rigid, loose);
        let setting = Setting { dimensions, route: RouteSpec::from(path), speed_mps: 1.3, accel_mps2 };
        check(&setting, &all(&setting));
    }
}

/// The eight's least clearance lasts as long as an arc; its route has no pitch.
#[test]
fn a_path_has_derivatives_over_all_but_the_pitch() {
    let (line, radius_m) = (PathSegment::Line { length_m: 40.0 }, 20.0);
    let arc = |turn| PathSegment::Arc { radius_m, turn };
    let turn = 1.5 * std::f64::consts::PI;
    let eight = PathSpec { segments: vec![line, arc(turn), line, arc(-turn)], laps: Some(1) };
    let dimensions = paper_benches(60);
    let setting = Setting { dimensions, route: RouteSpec::from(eight), speed_mps: 1.0, accel_mps2: None };
    let parameters =
        [Parameter::HeadLength, Parameter::BodyLength, Parameter::Width, Parameter::HoleOffset, Parameter::Speed];
    assert_eq!(check(&setting, &parameters), 2 * 5);
}

fn on_ground(route: impl Into<RouteSpec>, ground: Ground) -> RouteSpec {
    RouteSpec { ground: Some(Arc::new(ground)), ..route.into() }
}

/// The eight crosses itself, so that benches meet. They go on to overlap until a corner meets a corner.
#[test]
fn a_path_on_ground_has_derivatives_over_all_but_the_pitch() {
    let arc = |turn| PathSegment::Arc { radius_m: 6.0, turn };
    let line = PathSegment::Line { length_m: 12.0 };
    let eight = PathSpec { segments: vec![line, arc(4.7), line, arc(-4.4), line], laps: None };
    let dimensions = Dimensions::new(45, 2.4, 1.5, 0.3, 0.2).expect("valid benches");
    let route = on_ground(eight, plane(0.3, -0.2));
    let setting = Setting { dimensions, route, speed_mps: 1.2, accel_mps2: Some(0.5) };
    assert_eq!(check(&setting, &all(&setting)), 2 * 6);
}

#[test]
fn a_spiral_on_ground_has_derivatives_about_its_own_centre() {
    let placement = Placement { position: DVec2::new(1.7, -2.2), heading: 0.4 };
    let of = |ground| paper_of(40, RouteSpec { placement, ..on_ground(SpiralSpec::default(), ground) });
    // Four answers over six parameters, without the smallest pitch over the pitch.
    let inclined = of(plane(0.3, -0.2));
    assert_eq!(check(&inclined, &all(&inclined)), 4 * 6 - 1);
    let hilly = of(Ground::map(hills_every(5.0, [0.4, 1.3, 2.9], 0.3)));
    assert_eq!(check(&hilly, &[Parameter::Pitch, Parameter::BodyLength]), 4 * 2 - 1);
}

/// The smallest pitch is that of a spiral without a turn: it has derivatives over the benches' measures and the speed.
#[test]
fn a_turnaround_on_ground_has_derivatives() {
    let of = |ground, line_m| {
        let plan = TurnaroundSpec { pitch_m: 1.9, line_m, ..TurnaroundSpec::default() };
        paper_of(40, on_ground(plan, ground))
    };
    let inclined = of(plane(0.3, -0.2), 0.0);
    assert_eq!(check(&inclined, &all(&inclined)), 2 * all(&inclined).len() + 5);
    let hilly = of(Ground::map(hills_every(5.0, [0.4, 1.3, 2.9], 0.3)), 2.0);
    let of_turn = [Parameter::Pitch, Parameter::TurnDiameter, Parameter::RadiusRatio, Parameter::TurnLine];
    assert_eq!(check(&hilly, &of_turn), 2 * of_turn.len());
}

/// The least clearance and the largest ratio on ground, from poses at many travels.
#[test]
fn answers_on_ground_are_those_of_many_poses() {
    let placement = Placement { position: DVec2::new(1.7, -2.2), heading: 0.4 };
    let spiral = on_ground(SpiralSpec { pitch_m: 0.9, start_turns: 8.0 }, plane(0.5, 0.2));
    let setting = paper_of(30, RouteSpec { placement, ..spiral });
    let planned = study(setting.clone(), &[]);
    let route = setting.route.build(1.0, setting.dimensions.links_m()).expect("a valid route");
    let dragon = Dragon::new(setting.dimensions, Arc::new(route)).expect("the dragon stands");
    let (mut least_m, mut largest, mut travel_m) = (f64::INFINITY, 0.0_f64, 0.0);
    loop {
        let handles = handles_at(&dragon, travel_m);
        if handles[0].position.distance(placement.position) < 4.5 {
            break;
        }
        largest = handles.iter().map(|handle| handle.speed_ratio).fold(largest, f64::max);
        least_m = least_m.min(least_clearance_m(&boards_at(&dragon, travel_m)));
        travel_m += 0.01;
    }
    assert!(travel_m > 50.0 && largest > 1.0, "{travel_m} {largest}");
    assert!((0.0..2e-4).contains(&(least_m - value_of(&planned, Quantity::LeastClearance))), "{least_m}");
    assert!((0.0..1e-4).contains(&(value_of(&planned, Quantity::LargestSpeedRatio) - largest)), "{largest}");
}

fn paper_of(benches: usize, route: RouteSpec) -> Setting {
    Setting { dimensions: paper_benches(benches), ..paper(route) }
}

fn paper(route: RouteSpec) -> Setting {
    let dimensions = paper_benches(223);
    Setting { dimensions, route, speed_mps: 1.0, accel_mps2: None }
}

fn value_of(responses: &[Response], quantity: Quantity) -> f64 {
    let response = responses.iter().find(|response| response.quantity == quantity).expect("all quantities are there");
    *response.value.as_ref().expect("the paper's dragon has an answer")
}

#[test]
fn papers_spiral_has_the_known_answers_and_their_derivatives() {
    let setting = paper(RouteSpec::from(SpiralSpec::default()));
    let planned = study(setting.clone(), &[]);
    assert!((value_of(&planned, Quantity::FirstContact) - 412.473_838).abs() <= 5.001e-7);
    assert!((value_of(&planned, Quantity::SmallestPitch) - 0.450_337).abs() <= 5.001e-7);
    assert_eq!(value_of(&planned, Quantity::LargestSpeedRatio), 1.0);
    // Four answers over six parameters, without the smallest pitch over the pitch.
    assert_eq!(check(&setting, &all(&setting)), 4 * 6 - 1);
}

#[test]
fn papers_turnaround_has_the_known_answers_and_their_derivatives() {
    let setting = paper(RouteSpec::from(TurnaroundSpec::default()));
    let planned = study(setting.clone(), &[]);
    assert!((value_of(&planned, Quantity::LargestSpeedRatio) - 1.604_793).abs() <= 5.001e-7);
    assert!(planned[0].value.is_err(), "no benches touch");
    // Two answers over eight parameters, and the smallest pitch over those of the benches and the speed.
    assert_eq!(check(&setting, &all(&setting)), 2 * 8 + 5);
}

#[test]
fn other_dragons_have_the_derivatives_of_the_differences() {
    let geometries = [
        (2.233, 2.180, 0.385, 0.062, 0.574, 11.6, 1.64),
        (1.910, 1.583, 0.340, 0.163, 1.779, 8.0, 1.28),
        (3.318, 2.880, 0.328, 0.126, 1.340, 9.4, 0.52),
        (3.929, 1.687, 0.358, 0.150, 1.101, 10.8, 1.85),
        (2.703, 1.811, 0.197, 0.332, 0.738, 8.5, 1.87),
    ];
    for (head_m, body_m, width_m, hole_m, pitch_m, turn_diameter_m, radius_ratio) in geometries {
        let dimensions = Dimensions::new(40, head_m, body_m, width_m, hole_m).expect("valid benches");
        // Some of the settings have ramps.
        let accel_mps2 = (pitch_m > 0.6).then_some(0.4);
        let setting = |route| Setting { dimensions, route, speed_mps: 1.5, accel_mps2 };
        let spiral = SpiralSpec { pitch_m, start_turns: 8.0 / pitch_m };
        let turnaround = TurnaroundSpec { pitch_m, turn_diameter_m, radius_ratio, line_m: 0.0 };
        let with_line = TurnaroundSpec { line_m: 0.2 * turn_diameter_m, ..turnaround };
        let parameters = [Parameter::Pitch, Parameter::HeadLength, Parameter::BodyLength, Parameter::HoleOffset];
        for route in [RouteSpec::from(spiral), RouteSpec::from(turnaround), RouteSpec::from(with_line)] {
            let checked = check(&setting(route.clone()), &parameters);
            assert!(checked >= 8, "{checked} derivatives of {route:?}");
        }
    }
}

#[test]
fn speed_changes_only_times_and_the_smallest_pitch_has_no_derivative_over_the_pitch() {
    let planned = study(paper(RouteSpec::from(SpiralSpec::default())), &[Parameter::Speed, Parameter::Pitch]);
    for Response { quantity, value, curves } in planned {
        let value = value.expect("the paper's spiral has every answer");
        for Sample { parameter_value, value: sampled } in &curves[0].samples {
            let expected = if quantity == Quantity::FirstContact { value / parameter_value } else { value };
            assert_eq!(sampled.clone().ok(), Some(expected), "{quantity}");
        }
        if quantity == Quantity::SmallestPitch {
            assert_eq!(
                curves[1].derivative,
                Err(NoDerivative::Undefined(Undefined(
                    "the pitch is the answer itself and does not depend on the planned pitch"
                )))
            );
            assert!(curves[1].samples.iter().all(|sample| sample.value.is_err()));
        }
    }
}

/// The head walks v² ÷ 2a less than without ramps while it speeds up, and needs v ÷ 2a longer.
#[test]
fn acceleration_changes_only_times() {
    let setting = Setting { accel_mps2: Some(0.5), ..paper(RouteSpec::from(SpiralSpec::default())) };
    let planned = study(setting.clone(), &[Parameter::Accel]);
    for Response { quantity, curves, .. } in planned {
        let expected = if quantity == Quantity::FirstContact { -0.5 / 0.25 } else { 0.0 };
        assert_eq!(curves[0].derivative, Ok(expected), "{quantity}");
    }
    assert_eq!(check(&setting, &[Parameter::Accel]), 4);
    assert!(!paper(RouteSpec::from(SpiralSpec::default())).has(Parameter::Accel));
}

/// The contact with all links long is exact. The bound on all poses has no derivative but those of times.
#[test]
fn loose_hinges_have_derivatives_over_their_diameters() {
    let loose = |setting: Setting, pole_m| {
        let dimensions = setting.dimensions.with_poles(0.055, pole_m).expect("the poles fit");
        Setting { dimensions, ..setting }
    };
    let planned = loose(paper(RouteSpec::from(SpiralSpec::default())), 0.05);
    assert_eq!(all(&planned).len(), 8);
    // The earliest contact has one over the speed, the smallest pitch none over the pitch.
    assert_eq!(check(&planned, &all(&planned)), 5 * 8 - 1 + 1);
    let diameters = [Parameter::HoleDiameter, Parameter::PoleDiameter];
    let responses =
        Sensitivity { setting: planned, turn_diameter_m: 9.0, range: 0.04, steps: 1, parameters: diameters.to_vec() }
            .study(&Meter::unlimited(), || ());
    let keys: Vec<_> = responses.iter().map(|response| response.quantity.key()).collect();
    let of_rigid = ["least_clearance_m", "largest_speed_ratio", "smallest_pitch_m"];
    assert_eq!(keys, [&["first_contact_s", "earliest_s", "taut_contact_s"], &of_rigid[..]].concat());
    for Response { quantity, curves, .. } in responses {
        for Curve { parameter, derivative, samples, .. } in curves {
            let values: Vec<f64> = samples.iter().map(|sample| sample.value.clone().expect("the poles fit")).collect();
            let is_of_play = matches!(quantity, Quantity::EarliestContact | Quantity::TautContact);
            if !is_of_play {
                assert_eq!((derivative, values[0], values[2]), (Ok(0.0), values[1], values[1]), "{quantity}");
                continue;
            }
            // More play, an earlier contact.
            let loosest_first = parameter == Parameter::PoleDiameter;
            assert_eq!(values.is_sorted(), loosest_first, "{quantity} over {parameter}: {values:?}");
            assert!(values[0] != values[1] && values[1] != values[2], "{quantity} over {parameter}: {values:?}");
        }
    }
}

#[test]
fn smallest_pitch_has_a_value_if_no_contact_limits_it() {
    let setting = paper(RouteSpec::from(SpiralSpec::default()));
    let parameters = vec![Parameter::Width];
    let wide = Sensitivity { setting, turn_diameter_m: 30.0, range: 0.05, steps: 1, parameters };
    let Response { value, curves, .. } = &wide.study(&Meter::unlimited(), || ())[3];
    assert!((value.clone().expect("16 turns reach 15 m") - 15.0 / 16.0).abs() < 1e-9);
    assert_eq!(
        curves[0].derivative,
        Err(NoDerivative::Undefined(Undefined("the start of the spiral determines the smallest pitch")))
    );
}

/// Handle 1 would stop on the turn if the head were 5 % longer. Boards wider than the pitch overlap everywhere.
#[test]
fn impossible_values_have_a_reason_and_do_not_affect_the_others() {
    let long = Sensitivity {
        setting: paper(RouteSpec::from(TurnaroundSpec::default())),
        turn_diameter_m: 9.0,
        range: 0.05,
        steps: 1,
        parameters: vec![Parameter::HeadLength],
    };
    let responses = long.study(&Meter::unlimited(), || ());
    let [low, planned, high] = &responses[2].curves[0].samples[..] else { panic!("three values") };
    assert!(low.value.is_ok() && planned.value.is_ok());
    let reason = high.value.clone().expect_err("the turn is too tight").to_string();
    assert!(reason.starts_with("handle 1 would stop and walk backwards"), "{reason}");

    let spiral = paper(RouteSpec::from(SpiralSpec::default()));
    let wide = Sensitivity { setting: spiral, range: 0.95, parameters: vec![Parameter::Width], ..long };
    let responses = wide.study(&Meter::unlimited(), || ());
    for response in &responses[..3] {
        let reason = response.curves[0].samples[2].value.clone().expect_err("boards overlap").to_string();
        assert!(reason.starts_with("pitch_m is 0.55, must be above width_m 0.58"), "{reason}");
        assert!(response.curves[0].samples[1].value.is_ok());
    }
}

//! Changes of handles, speeds and clearances with each parameter, compared with central differences of the chain.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{Board, Dimensions, Dragon, Handle};
use bench_dragon_geometry::ground::Ground;
use bench_dragon_geometry::planner::{
    BoardVariation, Change, HandleVariation, Parameter, Setting, Witness, handle_variations,
};
use bench_dragon_geometry::route::RouteFamily;
use bench_dragon_geometry::route::{PathSegment, PathSpec, Placement, Route, RouteSpec, SpiralSpec, TurnaroundSpec};
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::{paper_benches, wide_paths};
use test_support::hills::{hills_every, plane};
use test_support::property::random_cases;

/// Half of the difference in a parameter, in metres. The error of Richardson's extrapolation is the fourth power of the step
/// times a fifth derivative. The chain's rounding of about 10⁻¹³ m, divided by the step, adds to it.
const STEP_M: f64 = 3e-5;

fn family(setting: &Setting) -> RouteFamily {
    setting.route.family(1.0, setting.dimensions.links_m()).expect("a valid route")
}

/// A dragon at one travel.
struct Stand {
    handles: Vec<Handle>,
    boards: Vec<Board>,
    dragon: Dragon,
    handle_travels_m: Vec<f64>,
}

fn stand(setting: &Setting, travel_m: f64) -> Option<Stand> {
    let route = Arc::clone(family(setting).route());
    let dragon = Dragon::new(setting.dimensions, Arc::clone(&route)).ok()?;
    let handles: Vec<Handle> = dragon.chain(travel_m).ok()?.collect();
    let mut boards = Vec::new();
    dragon.place_boards(&handles, &mut boards);
    let handle_travels_m = handles.iter().map(|handle| route.travel(handle.parameter)).collect();
    Some(Stand { handles, boards, dragon, handle_travels_m })
}

fn changed(setting: &Setting, travel_m: f64, change: Change, by: f64) -> Option<Stand> {
    match change {
        Change::Travel => stand(setting, travel_m + by),
        Change::Measure(parameter) => stand(&setting.with(parameter, setting.value(parameter) + by).ok()?, travel_m),
    }
}

/// Richardson's extrapolation of central differences.
fn difference(at: [f64; 4]) -> f64 {
    let [back_2, back, ahead, ahead_2] = at;
    (8.0 * (ahead - back) - (ahead_2 - back_2)) / (12.0 * STEP_M)
}

const CHANGES: [Change; 9] = [
    Change::Travel,
    Change::Measure(Parameter::Pitch),
    Change::Measure(Parameter::HeadLength),
    Change::Measure(Parameter::BodyLength),
    Change::Measure(Parameter::Width),
    Change::Measure(Parameter::HoleOffset),
    Change::Measure(Parameter::TurnDiameter),
    Change::Measure(Parameter::RadiusRatio),
    Change::Measure(Parameter::TurnLine),
];

/// Bound on the error of [`difference`] by the rounding of these handles. It is large on a spiral that is nearly an arc, whose angle from the
/// centre is. Each link adds the rounding of its rear handle. The factors of the four positions are 18 in all.
fn rounding_error(route: &Route, handles: &[Handle]) -> f64 {
    let rounding_m =
        |handle: &Handle| route.rounding_m(handle.parameter, route.point(handle.parameter).speed_m_per_unit);
    18.0 * handles.iter().map(rounding_m).sum::<f64>() / (12.0 * STEP_M)
}

/// Distance from a seam within which handles are not compared, because the differences would cross the seam. A handle far behind
/// moves by the changes of all links before it.
const SEAM_MARGIN_M: f64 = 0.01;

/// Distance of neighbouring heights, in metres. The curvature of the ground jumps at each: they count as seams.
const SPACING_M: f64 = 3.0;

/// Whether a handle is far from the lines of a map's heights.
fn is_within_cell(handle: &Handle) -> bool {
    let to_line = handle.position / SPACING_M - (handle.position / SPACING_M).round();
    to_line.abs().min_element() * SPACING_M > SEAM_MARGIN_M
}

fn check(setting: &Setting, travel_m: f64) {
    let Some(now) = stand(setting, travel_m) else { return };
    let family = family(setting);
    let route = family.route();
    let has = |change: &Change| if let Change::Measure(parameter) = change { setting.has(*parameter) } else { true };
    for change in CHANGES.into_iter().filter(has) {
        let around: Option<Vec<Stand>> = [-2.0, -1.0, 1.0, 2.0]
            .into_iter()
            .map(|steps| changed(setting, travel_m, change, steps * STEP_M))
            .collect();
        let Some(around) = around else { continue };
        let variations = handle_variations(&setting.dimensions, &family, &now.handles, change);
        let clear =
            |&travel_m: &f64| route.seams().iter().all(|&seam| (travel_m - route.travel(seam)).abs() > SEAM_MARGIN_M);
        let has_map = setting.route.ground.as_ref().is_some_and(|ground| ground.height_map().is_some());
        let handles = now.handle_travels_m.iter().zip(&now.handles);
        let is_clear = |(travel_m, handle): &(&f64, &Handle)| clear(travel_m) && (!has_map || is_within_cell(handle));
        let far_from_seams = handles.take_while(is_clear).count();
        let central = |of: &dyn Fn(&Stand) -> f64| difference([0, 1, 2, 3].map(|i| of(&around[i])));
        for (i, variation) in variations.iter().enumerate().take(far_from_seams) {
            let what = format!(
                "handle {i} of {:?} on {:?} at {travel_m} m, {change:?}",
                setting.dimensions, setting.route.shape
            );
            let near = |actual: f64, expected: f64| {
                let allowed = 2e-6 * (1.0 + expected.abs()) + rounding_error(route, &now.handles[..=i]);
                assert!((actual - expected).abs() <= allowed, "{what}: {actual}, by differences {expected}");
            };
            near(variation.position.x, central(&|stand| stand.handles[i].position.x));
            near(variation.position.y, central(&|stand| stand.handles[i].position.y));
            near(variation.rise, central(&|stand| stand.handles[i].height_m));
            near(variation.travel, central(&|stand| stand.handle_travels_m[i]));
            near(variation.speed_ratio, central(&|stand| stand.handles[i].speed_ratio));
            let tangent = now.handles[i].tangent;
            let turned = |stand: &Stand| tangent.perp_dot(stand.handles[i].tangent) / tangent.length_squared();
            near(variation.turn, central(&turned));
            near(variation.lift, central(&|stand| stand.handles[i].climb.asin()));
        }
        check_clearances(setting, &now, &around, &variations, change, far_from_seams);
    }
}

fn check_clearances(
    setting: &Setting,
    now: &Stand,
    around: &[Stand],
    variations: &[HandleVariation],
    change: Change,
    handles: usize,
) {
    for first in 0..handles.saturating_sub(1) {
        for second in first + 2..handles.saturating_sub(1) {
            let pair = [first, second];
            let boards = pair.map(|bench| &now.boards[bench]);
            let Ok(witness) = Witness::of(boards[0], boards[1]) else { continue };
            // If other points decide the clearance within the differences, there is no derivative to compare.
            let same = |stand: &Stand| {
                Witness::of(&stand.boards[first], &stand.boards[second]).is_ok_and(|other| other.decides_like(&witness))
            };
            if !around.iter().all(same) {
                continue;
            }
            let rates = pair
                .map(|bench| BoardVariation::new(&now.dragon, bench, &now.boards[bench], &variations[bench..], change));
            let actual = witness.variation(boards, [&rates[0], &rates[1]]);
            let clearance_m = |i: usize| around[i].boards[first].clearance(&around[i].boards[second]);
            let expected = difference([0, 1, 2, 3].map(clearance_m));
            let ends = [0, 3].map(|i: usize| pair.map(|bench| &around[i].boards[bench]));
            let rounding = 2.0 * rounding_error(now.dragon.route(), &now.handles[..second + 2]);
            let allowed = 2e-6 * (1.0 + expected.abs()) + corner_error(boards, ends) + rounding;
            let what = format!("benches {pair:?} of {:?}, {change:?}", setting.route.shape);
            assert!((actual - expected).abs() <= allowed, "{what}: {actual}, by differences {expected}");
        }
    }
}

/// Bound on the error of [`difference`] for the distance of two corners that decide the clearance; 0 where an edge decides it.
///
/// Corners that move at a relative speed w have a distance f = √(m² + w²t²), with |f⁽⁵⁾| ≤ 10·w⁵ ÷ f⁴. The error of the extrapolation is
/// h⁴·|f⁽⁵⁾| ÷ 30, where f is at least the distance less 2·h·w. So it is large where corners that are near each other move fast.
fn corner_error(boards: [&Board; 2], [back, ahead]: [[&Board; 2]; 2]) -> f64 {
    let (clearance_m, corners) = (boards[0].clearance(boards[1]), boards.map(Board::corners));
    let apart = corners[0].iter().flat_map(|first| corners[1].iter().map(move |second| first.distance(*second)));
    if (apart.fold(f64::INFINITY, f64::min) - clearance_m).abs() > 1e-9 {
        return 0.0;
    }
    let moved_m = |i: usize| {
        let corners = [back, ahead].map(|boards| boards[i].corners());
        corners[0].iter().zip(corners[1]).map(|(back, ahead)| back.distance(ahead)).fold(0.0, f64::max)
    };
    // The ends are 4 steps apart.
    let step_m = 0.25 * (moved_m(0) + moved_m(1));
    let least_m = clearance_m - 2.0 * step_m;
    if least_m > 0.0 { step_m / STEP_M / 3.0 * (step_m / least_m).powi(4) } else { f64::INFINITY }
}

/// The corners are 25 mm apart, and pass each other by up to 2.4 mm a step.
#[test]
fn a_hole_moves_corners_that_are_near_each_other_as_the_differences() {
    let dimensions = Dimensions::new(
        30,
        2.589_587_169_315_707,
        2.733_424_357_300_342_5,
        0.398_388_724_413_728_9,
        0.385_261_568_622_378_4,
    )
    .expect("valid benches");
    let plan = TurnaroundSpec {
        pitch_m: 0.956_617_615_443_456_7,
        turn_diameter_m: 9.175_116_135_427_343,
        radius_ratio: 0.813_969_250_775_596_1,
        line_m: 2.137_733_148_720_679_7,
    };
    check(
        &Setting { dimensions, route: RouteSpec::from(plan), speed_mps: 1.0, accel_mps2: None },
        47.305_053_478_582_73,
    );
}

/// The angle from the spiral's centre is 65,000 rad, whose rounding is 10⁻¹⁰ m.
#[test]
fn a_spiral_that_is_nearly_an_arc_changes_as_the_differences() {
    let spiral = PathSegment::Spiral { start_radius_m: 8.603_733_92, end_radius_m: 8.604_207_33, turn: -3.563_923_928 };
    let path = PathSpec { segments: vec![spiral], laps: None };
    let dimensions = Dimensions::new(20, 1.5, 1.5, 0.2, 0.2).expect("valid benches");
    for travel_m in [12.749_466, 25.0] {
        let route = RouteSpec::from(path.clone());
        check(&Setting { dimensions, route, speed_mps: 1.0, accel_mps2: None }, travel_m);
    }
}

fn setting(benches: usize, route: RouteSpec) -> Setting {
    let dimensions = paper_benches(benches);
    Setting { dimensions, route, speed_mps: 1.0, accel_mps2: None }
}

#[test]
fn papers_spiral_changes_as_the_differences() {
    let setting = setting(40, RouteSpec::from(SpiralSpec::default()));
    for travel_m in [1.0, 200.0, 380.0, 405.0, 412.3] {
        check(&setting, travel_m);
    }
}

#[test]
fn papers_turnaround_changes_as_the_differences() {
    let setting = setting(40, RouteSpec::from(TurnaroundSpec::default()));
    for travel_m in [-50.0, 2.0, 8.0, 11.0, 12.7, 14.48, 16.0, 30.0, 70.0, 99.0] {
        check(&setting, travel_m);
    }
}

#[test]
fn a_turnaround_with_a_line_changes_as_the_differences() {
    let plan = TurnaroundSpec { line_m: 3.0, ..TurnaroundSpec::default() };
    let setting = setting(40, RouteSpec::from(plan));
    for travel_m in [-50.0, 2.0, 5.0, 7.5, 8.0, 9.5, 11.0, 16.0, 30.0, 70.0, 99.0] {
        check(&setting, travel_m);
    }
}

fn on_ground(route: RouteSpec, ground: Ground) -> RouteSpec {
    RouteSpec { ground: Some(Arc::new(ground)), ..route }
}

/// Where a spiral touches a line of the map's heights, differences are not smooth; these travels are clear of it.
#[test]
fn spirals_on_ground_change_as_the_differences() {
    let spiral = RouteSpec::from(SpiralSpec { pitch_m: 1.1, start_turns: 8.0 });
    let placement = Placement { position: DVec2::new(1.7, -2.2), heading: 0.4 };
    let hills = Ground::map(hills_every(SPACING_M, [0.3, 1.1, 2.0], 0.4));
    let stands: [(_, &[f64]); 2] =
        [(plane(0.4, -0.3), &[1.0, 50.0, 101.0, 152.7, 180.0]), (hills, &[1.0, 50.0, 101.0])];
    for (ground, travels_m) in stands {
        let setting = setting(40, RouteSpec { placement, ..on_ground(spiral.clone(), ground) });
        for &travel_m in travels_m {
            check(&setting, travel_m);
        }
    }
}

#[test]
fn turnarounds_on_ground_change_as_the_differences() {
    for line_m in [0.0, 3.0] {
        let plan = TurnaroundSpec { line_m, ..TurnaroundSpec::default() };
        for ground in [plane(0.4, -0.3), Ground::map(hills_every(SPACING_M, [0.3, 1.1, 2.0], 0.4))] {
            let setting = setting(40, on_ground(RouteSpec::from(plan), ground));
            for travel_m in [-50.0, 2.0, 8.0, 11.0, 12.7, 14.48, 16.0, 30.0, 70.0, 99.0] {
                check(&setting, travel_m);
            }
        }
    }
}

proptest! {
    #![proptest_config(random_cases(24))]

    #[test]
    fn dragons_on_hilly_paths_change_as_the_differences(
        path in wide_paths(1..6),
        (head_m, body_m) in (1.5..4.0_f64, 1.5..2.5_f64),
        (width_m, hole_m) in (0.1..0.4_f64, 0.05..0.3_f64),
        phases in prop::array::uniform3(0.0..6.0_f64),
        height_m in 0.05..0.4_f64,
        share in 0.01..0.99_f64,
    ) {
        let dimensions = Dimensions::new(6, head_m, body_m, width_m, hole_m).expect("valid benches");
        let travel_m = share * path.lap_m();
        let route = on_ground(RouteSpec::from(path), Ground::map(hills_every(SPACING_M, phases, height_m)));
        let setting = Setting { dimensions, route, speed_mps: 1.0, accel_mps2: None };
        if setting.route.family(1.0, dimensions.links_m()).is_ok() {
            check(&setting, travel_m);
        }
    }

    #[test]
    fn dragons_on_paths_change_as_the_differences(
        path in wide_paths(1..6),
        (head_m, body_m) in (1.5..4.0_f64, 1.5..2.5_f64),
        (width_m, hole_m) in (0.1..0.4_f64, 0.05..0.3_f64),
        share in 0.01..0.99_f64,
    ) {
        let dimensions = Dimensions::new(20, head_m, body_m, width_m, hole_m).expect("valid benches");
        let travel_m = share * path.lap_m();
        check(&Setting { dimensions, route: RouteSpec::from(path), speed_mps: 1.0, accel_mps2: None }, travel_m);
    }

    #[test]
    fn other_dragons_change_as_the_differences(
        head_m in 1.5..4.0_f64,
        body_m in 1.5..3.0_f64,
        width_m in 0.1..0.4_f64,
        hole_m in 0.05..0.4_f64,
        pitch_m in 0.5..2.0_f64,
        diameter_m in 8.0..12.0_f64,
        (radius_ratio, line) in (0.5..2.0_f64, prop_oneof![Just(0.0), 0.01..0.6_f64]),
        travel_m in 1.0..99.0_f64,
    ) {
        let dimensions = Dimensions::new(30, head_m, body_m, width_m, hole_m).expect("valid benches");
        let plan = TurnaroundSpec { pitch_m, turn_diameter_m: diameter_m, radius_ratio, line_m: line * diameter_m };
        check(&Setting { dimensions, route: RouteSpec::from(plan), speed_mps: 1.0, accel_mps2: None }, travel_m);
        let plan = SpiralSpec { pitch_m, start_turns: 8.0 };
        check(&Setting { dimensions, route: RouteSpec::from(plan), speed_mps: 1.0, accel_mps2: None }, travel_m);
    }
}

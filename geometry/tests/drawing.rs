//! Paths that follow drawings: how near they are, what stays exact, and how many segments they have.

use std::f64::consts::{FRAC_PI_2, TAU};

use bench_dragon_geometry::drawing::{Bezier, Drawing, DrawingError, Fit, FitSettings, Piece, Spline};
use bench_dragon_geometry::route::{PathSegment, PathSpec, Route, RouteSpec};
use glam::DVec2;
use proptest::prelude::{Strategy, any, prop};
use proptest::{prop_assert, proptest};
use test_support::property::random_cases;

const SETTINGS: FitSettings = FitSettings { tolerance_m: 0.005, corner_radius_m: None, joins_samples: false };

fn rounded(corner_radius_m: f64) -> FitSettings {
    FitSettings { corner_radius_m: Some(corner_radius_m), ..SETTINGS }
}

fn point(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

/// The route of a fit, as a configuration builds it.
fn route(fit: &Fit, laps: Option<u32>) -> Route {
    let path = PathSpec { segments: fit.segments.clone(), laps };
    let spec = RouteSpec { placement: fit.begin, ..RouteSpec::from(path) };
    spec.build(1.0, 1.0).expect("the segments join")
}

/// Points of a route, a millimetre apart.
fn points_of(route: &Route) -> Vec<DVec2> {
    let count = (route.end_travel_m() / 1e-3).ceil();
    let at = |i: usize| route.point(route.parameter(route.end_travel_m() * i as f64 / count)).position;
    (0..=count as usize).map(at).collect()
}

/// The largest distance of the points of a polyline from another one that runs beside it.
fn apart_m(points: &[DVec2], other: &[DVec2]) -> f64 {
    let mut near = 0_usize;
    let mut largest_m = 0.0;
    for point in points {
        // Both run in the same direction, so the nearest edge is not far from the last one.
        let edges = near.saturating_sub(3000)..(near + 3000).min(other.len() - 1);
        let distance_m = |i: usize| {
            let (from, edge) = (other[i], other[i + 1] - other[i]);
            let part = ((*point - from).dot(edge) / edge.length_squared().max(1e-300)).clamp(0.0, 1.0);
            point.distance(from + part * edge)
        };
        let nearest = edges.map(|i| (distance_m(i), i)).min_by(|a, b| a.0.total_cmp(&b.0)).expect("an edge");
        near = nearest.1;
        largest_m = f64::max(largest_m, nearest.0);
    }
    largest_m
}

fn cubic(controls: [DVec2; 4], t: f64) -> DVec2 {
    let [a, b, c, d] = controls;
    let s = 1.0 - t;
    a * s * s * s + b * 3.0 * s * s * t + c * 3.0 * s * t * t + d * t * t * t
}

/// A smooth chain of cubic Bézier curves from left to right.
fn smooth_chain() -> impl Strategy<Value = Vec<[DVec2; 4]>> {
    prop::collection::vec((4.0..12.0, -6.0..6.0, -1.0..1.0, 1.0..3.0), 2..6).prop_map(|steps| {
        let (mut at, mut lead) = (DVec2::ZERO, point(1.5, 0.0));
        let step = |(x, y, heading, handle): (f64, f64, f64, f64)| {
            let (to, end) = (at + point(x, y), handle * DVec2::from_angle(heading));
            let controls = [at, at + lead, to - end, to];
            (at, lead) = (to, 0.7 * end);
            controls
        };
        steps.into_iter().map(step).collect()
    })
}

/// The turn of a corner, to the left or to the right.
fn corners() -> impl Strategy<Value = f64> {
    (0.7..1.9_f64, any::<bool>()).prop_map(|(turn, left)| if left { turn } else { -turn })
}

proptest! {
    #![proptest_config(random_cases(40))]

    #[test]
    fn a_smooth_curve_and_its_path_are_within_the_measured_distance_of_each_other(chain in smooth_chain()) {
        let pieces = chain.iter().map(|controls| Piece::Bezier(Bezier::new(controls.to_vec()))).collect();
        let fit = Drawing { pieces, is_closed: false }.fit(&SETTINGS).expect("a smooth curve");
        prop_assert!(fit.error_m <= SETTINGS.tolerance_m);
        let drawn: Vec<DVec2> =
            chain.iter().flat_map(|&controls| (0..2000).map(move |i| cubic(controls, f64::from(i) / 1999.0))).collect();
        let followed = points_of(&route(&fit, None));
        let measured_m = apart_m(&drawn, &followed).max(apart_m(&followed, &drawn));
        prop_assert!(measured_m <= fit.error_m + 1e-5, "{measured_m} is above {}", fit.error_m);
        prop_assert!(measured_m >= 0.5 * fit.error_m, "{measured_m} is far below {}", fit.error_m);
    }

    #[test]
    fn corners_become_arcs_of_the_radius_that_touch_both_lines(
        headings in prop::collection::vec(corners(), 1..5), radius_m in 0.06..0.7,
    ) {
        let (mut points, mut heading) = (vec![DVec2::ZERO], 0.0);
        for turn in headings.iter().chain(&[0.0]) {
            points.push(*points.last().expect("a point") + 2.1 * DVec2::from_angle(heading));
            heading += turn;
        }
        let fit = Drawing::polyline(&points, false).fit(&rounded(radius_m)).expect("each arc fits");
        prop_assert!(fit.corners == headings.len() && fit.error_m < 1e-9);
        let arcs: Vec<_> = fit.segments.iter().filter_map(|segment| match *segment {
            PathSegment::Arc { radius_m, turn } => Some((radius_m, turn)),
            _ => None,
        }).collect();
        prop_assert!(arcs.len() == headings.len());
        for ((arc_m, turn), heading) in arcs.iter().zip(&headings) {
            prop_assert!((arc_m - radius_m).abs() < 1e-9 && (turn - heading).abs() < 1e-9);
        }
        let end = *points_of(&route(&fit, None)).last().expect("a point");
        prop_assert!(end.distance(points[points.len() - 1]) < 1e-9);
    }

    #[test]
    fn any_numbers_give_a_path_or_one_line(
        numbers in prop::collection::vec(any::<(f64, f64)>(), 0..20), near in prop::collection::vec((-9.0..9.0, -9.0..9.0), 0..20),
        radius_m in prop::option::of(0.01..5.0), is_closed in any::<bool>(), joins_samples in any::<bool>(),
    ) {
        for points in [numbers, near] {
            let points: Vec<DVec2> = points.into_iter().map(DVec2::from).collect();
            let settings = FitSettings { tolerance_m: 0.005, corner_radius_m: radius_m, joins_samples };
            let beziers = points.chunks_exact(4).map(|four| Piece::Bezier(Bezier::new(four.to_vec()))).collect();
            for drawing in [Drawing::polyline(&points, is_closed), Drawing { pieces: beziers, is_closed }] {
                match drawing.fit(&settings) {
                    Ok(fit) => {
                        prop_assert!(fit.error_m <= settings.tolerance_m);
                        let _ = route(&fit, is_closed.then_some(2));
                    }
                    Err(error) => prop_assert!(!error.to_string().contains('\n')),
                }
            }
        }
    }
}

#[test]
fn lines_and_arcs_that_join_stay_as_they_are() {
    let arc = Piece::Arc { centre: point(10.0, 4.0), radius_m: 4.0, from_angle: -FRAC_PI_2, turn: FRAC_PI_2 };
    let pieces = vec![
        Piece::Line { from: DVec2::ZERO, to: point(10.0, 0.0) },
        arc,
        Piece::Line { from: point(14.0, 4.0), to: point(14.0, 9.0) },
    ];
    let fit = Drawing { pieces, is_closed: false }.fit(&SETTINGS).expect("a smooth path");
    assert_eq!((fit.segments.len(), fit.corners), (3, 0));
    let [PathSegment::Line { length_m }, PathSegment::Arc { radius_m, turn }, _] = fit.segments[..] else {
        panic!("{:?}", fit.segments)
    };
    assert!((length_m - 10.0).abs() + (radius_m - 4.0).abs() + (turn - FRAC_PI_2).abs() < 1e-12);
    assert!(fit.size_m.distance(point(14.0, 9.0)) < 1e-12);
    // Only the outline by which the arc is measured is off.
    assert!(fit.error_m <= 2.1e-5, "{}", fit.error_m);
}

#[test]
fn a_circle_of_curves_is_few_arcs_and_can_be_walked_in_laps() {
    let handle = 0.552_284_749_830_793;
    let quarter = |i: usize| {
        let turned = |x, y| DVec2::from_angle(FRAC_PI_2 * i as f64).rotate(point(x, y)) * 5.0;
        Piece::Bezier(Bezier::new(vec![turned(1.0, 0.0), turned(1.0, handle), turned(handle, 1.0), turned(0.0, 1.0)]))
    };
    let fit = Drawing { pieces: (0..4).map(quarter).collect(), is_closed: true }.fit(&SETTINGS).expect("a circle");
    assert!(fit.segments.len() <= 4, "{:?}", fit.segments);
    assert!(fit.error_m <= SETTINGS.tolerance_m);
    assert!(fit.size_m.distance(point(10.0, 10.0)) < 0.02, "{}", fit.size_m);
    assert!((route(&fit, Some(3)).end_travel_m() - 3.0 * TAU * 5.0).abs() < 0.02);
}

/// Samples of a spiral with four turns, 1.7 m apart.
fn spiral(count: u32) -> Vec<DVec2> {
    let at = |i: u32| {
        let turns = 4.0 * f64::from(i) / f64::from(count);
        (3.0 + 1.7 * turns) * DVec2::from_angle(TAU * turns)
    };
    (0..=count).map(at).collect()
}

fn sine(count: u32) -> Vec<DVec2> {
    let at = |x: f64| point(x, 5.0 * (x / 5.0).sin());
    (0..=count).map(|i| at(60.0 * f64::from(i) / f64::from(count))).collect()
}

#[test]
fn sampled_curves_become_few_segments_however_many_points_they_have() {
    let millimetres = |points: Vec<DVec2>| points.iter().map(|point| (*point * 1e3).round() / 1e3).collect::<Vec<_>>();
    for (name, points, most) in [
        ("spiral of 1,000 points", spiral(1_000), 38),
        ("spiral of 1,000,000 points", spiral(1_000_000), 38),
        ("spiral in whole millimetres", millimetres(spiral(100_000)), 38),
        ("sine of 1,000 points", sine(1_000), 48),
        ("sine in whole millimetres", millimetres(sine(100_000)), 48),
    ] {
        let fit = Drawing::polyline(&points, false).fit(&SETTINGS).expect(name);
        assert!(fit.segments.len() <= most, "{name}: {} segments", fit.segments.len());
        assert!(fit.error_m <= SETTINGS.tolerance_m);
    }
}

#[test]
fn a_curve_through_points_far_apart_is_followed_only_if_they_are_samples() {
    let points = spiral(100);
    let drawing = Drawing::polyline(&points, false);
    assert!(matches!(drawing.fit(&SETTINGS), Err(DrawingError::Corner { .. })));
    let fit = drawing.fit(&FitSettings { joins_samples: true, ..SETTINGS }).expect("a smooth curve");
    assert!(apart_m(&points, &points_of(&route(&fit, None))) <= SETTINGS.tolerance_m + 1e-6);
    assert!(fit.segments.len() <= 32, "{}", fit.segments.len());
    let bend = Drawing::polyline(&[DVec2::ZERO, point(9.0, 0.0), point(9.0, 9.0)], false);
    let error = bend.fit(&FitSettings { joins_samples: true, ..SETTINGS }).expect_err("a corner");
    assert_eq!(error, DrawingError::Corner { at: point(9.0, 0.0), turn: FRAC_PI_2 });
}

#[test]
fn samples_close_together_with_rounded_decimals_are_followed_like_any_others() {
    let samples = FitSettings { joins_samples: true, ..SETTINGS };
    let steps = [(0.0, 0.0), (0.2, 0.0), (0.4, 0.02), (0.6, 0.04), (0.8, 0.06), (1.0, 0.06), (1.2, 0.06)];
    for scale in [1.0, 10.0] {
        let points = steps.map(|(x, y)| scale * point(x, y));
        let fit = Drawing::polyline(&points, false).fit(&samples).expect("a smooth curve");
        let apart_m = apart_m(&points, &points_of(&route(&fit, None)));
        assert!(apart_m <= SETTINGS.tolerance_m + 1e-6, "{scale}: {apart_m}");
    }
    // A circle of 10 m, one point a degree, in whole centimetres.
    let centimetres = |metres: f64| (metres * 100.0).round() / 100.0;
    let on_circle = |degrees: i32| DVec2::from_angle(f64::from(degrees % 360).to_radians()) * 10.0;
    let circle: Vec<DVec2> = (0..=360).map(on_circle).map(|at| point(centimetres(at.x), centimetres(at.y))).collect();
    for (points, is_closed) in [(&circle[..], true), (&circle[..181], false)] {
        let fit = Drawing { is_closed, ..Drawing::polyline(points, false) }.fit(&samples).expect("a smooth curve");
        let apart_m = apart_m(points, &points_of(&route(&fit, None)));
        assert!(apart_m <= SETTINGS.tolerance_m + 1e-6, "{}: {apart_m}", points.len());
    }
    let bend = [(0.0, 0.0), (0.2, 0.0), (0.37, 0.105)].map(|(x, y)| point(x, y));
    let error = Drawing::polyline(&bend, false).fit(&samples).expect_err("a corner");
    assert!(matches!(error, DrawingError::Corner { turn, .. } if (turn.to_degrees() - 31.701).abs() < 1e-3), "{error}");
}

#[test]
fn a_radius_that_does_not_fit_names_the_corner_and_the_largest_that_does() {
    let bend = Drawing::polyline(&[DVec2::ZERO, point(3.0, 0.0), point(3.0, 9.0)], false);
    assert_eq!(bend.fit(&rounded(3.0)).expect("it just fits").corners, 1);
    let error = bend.fit(&rounded(3.5)).expect_err("the first line is too short").to_string();
    let expected =
        "corner_radius_m is 3.5, does not fit into the corner of 90.0° at (3.000, 0.000) m: at most 3.000 m fits";
    assert_eq!(error, expected);
}

#[test]
fn a_corner_between_curves_is_rounded_by_an_arc_that_touches_both() {
    let up = Piece::Bezier(Bezier::new(vec![point(0.0, 0.0), point(3.0, 0.0), point(6.0, 1.0), point(8.0, 4.0)]));
    let down = Piece::Bezier(Bezier::new(vec![point(8.0, 4.0), point(9.0, 1.0), point(12.0, 0.0), point(16.0, 0.0)]));
    let fit = Drawing { pieces: vec![up, down], is_closed: false }.fit(&rounded(1.0)).expect("it fits");
    assert_eq!(fit.corners, 1);
    assert!(
        fit.segments.iter().any(|segment| matches!(segment, PathSegment::Arc { radius_m, .. } if *radius_m == 1.0))
    );
    assert!(fit.error_m <= SETTINGS.tolerance_m);
    assert_eq!(points_of(&route(&fit, None))[0], DVec2::ZERO);
}

#[test]
fn a_path_that_is_too_short_for_a_segment_has_no_length() {
    let fit = |length_m: f64| Drawing::polyline(&[DVec2::ZERO, point(0.0, -length_m)], false).fit(&SETTINGS);
    for length_m in [3.307_718_795_514_923e-10, 1e-8, 9e-7] {
        assert_eq!(fit(length_m), Err(DrawingError::Empty), "{length_m}");
    }
    assert_eq!(fit(1e-6).map(|fit| fit.segments.len()), Ok(1));
}

#[test]
fn interrupted_empty_and_sharp_drawings_are_refused() {
    let line = |from: DVec2, to: DVec2| Piece::Line { from, to };
    let of = |pieces: Vec<Piece>| Drawing { pieces, is_closed: false }.fit(&rounded(1.0));
    let gap = of(vec![line(DVec2::ZERO, point(1.0, 0.0)), line(point(2.0, 0.0), point(3.0, 0.0))]);
    assert_eq!(gap, Err(DrawingError::Gap { at: point(1.0, 0.0), gap_m: 1.0 }));
    assert_eq!(of(vec![]), Err(DrawingError::Empty));
    assert_eq!(of(vec![line(DVec2::ONE, DVec2::ONE)]), Err(DrawingError::Empty));
    let cusp = Bezier::new(vec![DVec2::ZERO, point(10.0, 10.0), point(0.0, 10.0), point(10.0, 0.0)]);
    assert!(matches!(of(vec![Piece::Bezier(cusp)]), Err(DrawingError::Sharp { .. })));
    let outlying = of(vec![line(DVec2::ZERO, DVec2::X), line(DVec2::X, point(f64::NAN, 0.0))]);
    assert!(matches!(outlying, Err(DrawingError::Coordinate { part: 2, .. })));
}

#[test]
fn a_path_that_turns_back_on_itself_is_refused_with_any_radius() {
    let back = Drawing::polyline(&[DVec2::ZERO, point(50.0, 0.0), point(20.0, 0.0)], false);
    for settings in [SETTINGS, rounded(0.01), FitSettings { joins_samples: true, ..SETTINGS }] {
        assert_eq!(back.fit(&settings), Err(DrawingError::TurnsBack { at: point(50.0, 0.0) }));
    }
    let needle = Drawing::polyline(&[DVec2::ZERO, point(50.0, 0.0), point(0.0, 0.5)], false);
    assert_eq!(needle.fit(&rounded(0.01)).expect("an arc fits").corners, 1);
}

#[test]
fn the_ends_of_a_closed_path_meet_within_a_tenth_of_the_tolerance() {
    let of = |end: DVec2| Drawing { is_closed: true, ..Drawing::polyline(&[DVec2::ZERO, point(9.0, 0.0), end], false) };
    let error = of(point(9.0, 9.0)).fit(&rounded(1.0)).expect_err("the ends are apart").to_string();
    let expected =
        "closed: the path ends at (9.000, 9.000) m, 12.728 m from its beginning, at most 0.0005 m is allowed";
    assert_eq!(error, expected);
    let error = of(point(0.0, 0.0006)).fit(&rounded(1.0)).expect_err("the ends are apart").to_string();
    assert!(error.contains("(0.000, 0.001) m, 0.0006 m from its beginning"), "{error}");
}

#[test]
fn a_spline_is_its_bezier_curves() {
    let points: Vec<DVec2> = (0..7).map(|i| point(f64::from(i), f64::from(i * i % 5))).collect();
    let knots = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 2.5, 3.0, 3.0, 3.0, 3.0];
    let spline = Spline { degree: 3, knots, points: points.clone(), weights: vec![] };
    let beziers = spline.beziers().expect("a spline");
    assert_eq!(beziers.len(), 3);
    let ends = Piece::Bezier(beziers[0].clone()).begin().distance(points[0])
        + Piece::Bezier(beziers[2].clone()).end().distance(points[6]);
    assert!(ends < 1e-12);
    assert!(Spline { degree: 4, ..spline.clone() }.beziers().is_none());
    assert!(Spline { weights: vec![-1.0; 7], ..spline }.beziers().is_none());
}

/// Lines and half circles whose coordinates have few decimals meet in tiny angles, on both sides of the arc.
#[test]
fn half_circles_between_lines_are_smooth_whatever_the_rounding_of_their_joints() {
    for step in 0..=160 {
        let kink = 10_f64.powf(-11.0 + 0.05 * f64::from(step));
        for (radius_m, before, after) in
            [(10.2, kink, kink), (20.3, -kink, kink), (5.0, kink, -kink), (13.319, 0.0, kink)]
        {
            // The arc begins at the origin, `before` off the direction of the first line.
            let centre = DVec2::from_angle(before).rotate(point(0.0, radius_m));
            let from_angle = (-centre).to_angle();
            let turn = TAU / 2.0 - before + after;
            let end = centre + DVec2::from_angle(from_angle + turn) * radius_m;
            let pieces = vec![
                Piece::Line { from: point(-60.0, 0.0), to: DVec2::ZERO },
                Piece::Arc { centre, radius_m, from_angle, turn },
                Piece::Line { from: end, to: end - point(60.0, 0.0) },
            ];
            let drawing = Drawing { pieces, is_closed: false };
            let fit = drawing.fit(&SETTINGS).unwrap_or_else(|error| panic!("a kink of {kink:e}: {error}"));
            let length_m = route(&fit, None).end_travel_m();
            let exact_m = 120.0 + radius_m * turn;
            assert!((length_m - exact_m).abs() < 0.01, "a kink of {kink:e}: {length_m} m, not {exact_m} m");
        }
    }
}

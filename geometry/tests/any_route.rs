//! Dragons on routes of all segment kinds: lines, arcs and spirals in any order, behind a line or a coil anywhere in the plane.

use std::sync::Arc;

use bench_dragon_geometry::clearance::first_contact;
use bench_dragon_geometry::dragon::{ChainSolver, ChainStepper, Dimensions, Dragon, Instructions};
use bench_dragon_geometry::route::{CircularArc, Line, Route, Segment, Spiral, Turn};
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::{boards_at, paper_benches, some_pair_overlaps};
use test_support::property::random_cases;

/// Metres that a run begins before the first seam. It is short, like the random segments, so that a fine walk covers the whole
/// run.
const RUN_UP_M: f64 = 5.0;

fn turns() -> impl Strategy<Value = Turn> {
    prop_oneof![Just(Turn::Clockwise), Just(Turn::CounterClockwise)]
}

/// The kind of a segment, without its position.
#[derive(Clone, Copy, Debug)]
enum Shape {
    Line { length_m: f64 },
    Arc { radius_m: f64, angle: f64, turn: Turn },
    Spiral { pitch_m: f64, from_angle: f64, to_angle: f64, winding: Turn },
}

impl Shape {
    fn behind(self, position: DVec2, tangent: DVec2) -> Segment {
        match self {
            Self::Line { length_m } => Segment::Line(Line::from_begin(position, tangent, length_m)),
            Self::Arc { radius_m, angle, turn } => {
                Segment::Arc(CircularArc::from_begin(position, tangent, radius_m, angle, turn))
            }
            Self::Spiral { pitch_m, from_angle, to_angle, winding } => {
                Segment::Spiral(Spiral::new(pitch_m, from_angle, to_angle).from_begin(position, tangent, winding))
            }
        }
    }
}

fn shapes() -> impl Strategy<Value = Shape> {
    let spiral = (0.5..2.0_f64, 6.0..14.0_f64, 2.0..6.0_f64, any::<bool>(), turns());
    prop_oneof![
        (0.3..6.0_f64).prop_map(|length_m| Shape::Line { length_m }),
        (1.5..6.0_f64, 0.1..5.0_f64, turns()).prop_map(|(radius_m, angle, turn)| Shape::Arc { radius_m, angle, turn }),
        spiral.prop_map(|(pitch_m, angle, by, inward, winding)| {
            let (from_angle, to_angle) = if inward { (angle + by, angle) } else { (angle, angle + by) };
            Shape::Spiral { pitch_m, from_angle, to_angle, winding }
        }),
    ]
}

/// A line or a coil, anywhere in the plane.
fn first_segments() -> impl Strategy<Value = Segment> {
    let place = ((-50.0..50.0_f64, -50.0..50.0_f64), -3.0..3.0_f64);
    prop_oneof![
        place.clone().prop_map(|(at, angle)| Segment::Line(Line::up_to(at.into(), DVec2::from_angle(angle)))),
        (place, 0.5..2.0_f64, 6.0..20.0_f64, turns()).prop_map(|((at, axis), pitch_m, end_angle, winding)| {
            Segment::Spiral(Spiral::new(pitch_m, f64::INFINITY, end_angle).about(at.into(), axis, winding))
        }),
    ]
}

fn routes() -> impl Strategy<Value = Route> {
    (first_segments(), prop::collection::vec(shapes(), 1..6)).prop_map(|(first, shapes)| route(first, &shapes))
}

fn route(first: Segment, shapes: &[Shape]) -> Route {
    let mut segments = vec![first];
    let mut length_m = 0.0;
    for shape in shapes {
        let last = segments.last().expect("there is a first segment");
        let end = last.point(last.span().1);
        let segment = shape.behind(end.position, end.tangent);
        length_m += length_of(&segment);
        segments.push(segment);
    }
    Route::new(&segments, 0.0, [-RUN_UP_M, length_m]).expect("each segment begins at the end of the one before")
}

/// Arc length by Simpson's rule.
fn length_of(segment: &Segment) -> f64 {
    const PARTS: u32 = 2000;
    let (begin, end) = segment.span();
    let step = (end - begin) / f64::from(PARTS);
    let speed = |k: u32| segment.point(begin + f64::from(k) * step).speed_m_per_unit;
    let weighed = (0..=PARTS).map(|k| {
        speed(k)
            * if k == 0 || k == PARTS {
                1.0
            } else if k % 2 == 1 {
                4.0
            } else {
                2.0
            }
    });
    weighed.sum::<f64>() * step / 3.0
}

fn dragons() -> impl Strategy<Value = Dragon> {
    let benches = (1_usize..70, 1.0..2.5_f64, 0.8..2.0_f64, 0.1..0.3_f64, 0.0..0.3_f64);
    (benches, routes()).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m, hole), route)| {
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole * head_m.min(body_m)).ok()?;
        Dragon::new(dimensions, Arc::new(route)).ok()
    })
}

proptest! {
    #![proptest_config(random_cases(256))]

    #[test]
    fn points_and_tangents_agree_with_the_travel(route in routes(), share in 0.0..1.0_f64) {
        let (start_m, end_m) = (route.start_travel_m(), route.end_travel_m());
        let travel_m = start_m + share * (end_m - start_m);
        let parameter = route.parameter(travel_m);
        prop_assert!((route.travel(parameter) - travel_m).abs() < 1e-11);
        let near = route.parameter_near(travel_m, parameter + 1e-3);
        prop_assert!((near - parameter).abs() < 1e-11, "{near} is not {parameter}");
        // The differences may cross a seam, where the curvature jumps.
        let [before, after] = [-1e-5, 1e-5].map(|by_m| route.point(route.parameter(travel_m + by_m)));
        let here = route.point(parameter);
        let tangent = (after.position - before.position) / 2e-5;
        if travel_m + 1e-5 < end_m {
            prop_assert!(tangent.distance(here.tangent) < 2e-5, "{tangent} is not the tangent of {here:?}");
            let curvature = (after.tangent - before.tangent).length() / 2e-5;
            let [rear, front] = [-2e-5, 2e-5].map(|by_m| route.parameter(travel_m + by_m));
            prop_assert!(curvature <= route.curvature_bound(rear, front) * (1.0 + 1e-5) + 1e-5);
        }
    }

    #[test]
    fn a_step_back_covers_at_most_the_arc_and_at_least_a_third(
        route in routes(), share in 0.0..1.0_f64, arc_m in 0.001..20.0_f64,
    ) {
        let (start_m, end_m) = (route.start_travel_m(), route.end_travel_m());
        let from = route.parameter(start_m + share * (end_m - start_m));
        let covered_m = route.travel(from) - route.travel(route.step_back(from, arc_m));
        prop_assert!(covered_m <= arc_m + 1e-10 && covered_m >= arc_m / 3.0 - 1e-10, "{covered_m} m of {arc_m} m");
    }

    #[test]
    fn steps_equal_poses_of_the_reference_solver(
        dragon in dragons(), share in 0.0..1.0_f64, step_m in 1e-4..0.05_f64, portable in any::<bool>(),
    ) {
        let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let dragon = Arc::new(dragon);
        let instructions = if portable { Instructions::portable() } else { Instructions::best() };
        let mut stepper = ChainStepper::with_instructions(Arc::clone(&dragon), instructions);
        let mut solver = ChainSolver::new(&dragon);
        let mut records = vec![(DVec2::ZERO, DVec2::ZERO); dragon.dimensions().handles()];
        for step in 0..200 {
            let travel_m = start_m + share * (end_m - start_m) + f64::from(step) * step_m;
            if travel_m > end_m {
                break;
            }
            stepper.step(travel_m, 1.0, &mut records, |position, velocity| (position.truncate(), velocity.truncate())).expect("within the run");
            let exact = solver.solve(&dragon, travel_m).expect("within the run");
            for ((position, velocity), handle) in records.iter().zip(exact) {
                prop_assert!(position.distance(handle.position) < 1e-9, "{travel_m} m: {position} is not {handle:?}");
                prop_assert!(velocity.distance(handle.tangent * handle.speed_ratio) < 1e-7, "{travel_m} m: {velocity}");
            }
        }
    }
}

proptest! {
    #![proptest_config(random_cases(48))]

    #[test]
    fn first_contact_is_no_later_than_the_first_overlap_of_a_fine_walk(dragon in dragons()) {
        const STEP_M: f64 = 5e-3;
        let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let contact_m = first_contact(&dragon, start_m, end_m).expect("no limit").map(|contact| contact.travel_m);
        let steps = ((end_m - start_m) / STEP_M) as u32;
        let overlap_m = (0..=steps).map(|step| start_m + f64::from(step) * STEP_M)
            .find(|&travel_m| some_pair_overlaps(&dragon, travel_m));
        match (contact_m, overlap_m) {
            (Some(contact_m), Some(overlap_m)) => {
                prop_assert!(contact_m <= overlap_m + 1e-9, "{contact_m} m, but they overlap at {overlap_m} m");
            }
            (None, Some(overlap_m)) => prop_assert!(false, "none, but they overlap at {overlap_m} m"),
            (_, None) => (),
        }
        if let Some(contact_m) = contact_m && contact_m > start_m {
            // A walk may miss a short contact, but every reported contact must exist.
            let touches = [0.0, 1e-9, 1e-7].iter().any(|by_m| {
                let boards = boards_at(&dragon, (contact_m + by_m).min(end_m));
                (2..boards.len()).any(|second| {
                    (0..second - 1).any(|first| boards[first].clearance(&boards[second]) < 1e-9)
                })
            });
            prop_assert!(touches, "nothing touches at {contact_m} m");
        }
    }

    /// The bounds of the coil use its own centre. They rule out no contact that a search without them finds.
    #[test]
    fn a_coil_anywhere_has_the_same_contacts_as_the_plain_curve(dragon in dragons()) {
        let plain = Dragon::new(*dragon.dimensions(), Arc::new(dragon.route().clone().without_spiral_bounds())).expect("it stands");
        let [known, searched] = [&dragon, &plain].map(|dragon| {
            first_contact(dragon, dragon.start_travel_m(), dragon.end_travel_m()).expect("no limit")
        });
        let travels_m = [known, searched].map(|contact| contact.map(|contact| contact.travel_m));
        if let [Some(known_m), Some(searched_m)] = travels_m {
            prop_assert!((known_m - searched_m).abs() < 1e-9, "{travels_m:?}");
        } else {
            prop_assert_eq!(known, searched);
        }
    }
}

/// The head leaves its coil straight across the outer turns. Those turns surround the origin, but the coil's centre is
/// elsewhere.
#[test]
fn a_head_that_crosses_its_own_coil_touches_it_for_any_centre() {
    for (pitch_m, end_angle, winding) in [(1.0, 9.0, Turn::CounterClockwise), (0.8, 25.0, Turn::Clockwise)] {
        let coil = Spiral::new(pitch_m, f64::INFINITY, end_angle).about(DVec2::ZERO, 0.7, winding);
        let end = Segment::Spiral(coil).point(-end_angle);
        let coil = coil.about(-end.position, 0.7, winding);
        let line = Segment::Line(Line::from_begin(DVec2::ZERO, end.tangent, 60.0));
        let route = Route::new(&[Segment::Spiral(coil), line], 0.0, [-1.0, 60.0]).expect("the line continues the coil");
        let dimensions = Dimensions::new(60, 1.5, 1.2, 0.3, 0.1).expect("valid benches");
        let [known, searched] = [route.clone(), route.without_spiral_bounds()].map(|route| {
            let dragon = Dragon::new(dimensions, Arc::new(route)).expect("the dragon stands");
            first_contact(&dragon, -1.0, 60.0).expect("no limit").expect("the head meets the coil")
        });
        assert_eq!(known.benches, searched.benches);
        assert!((known.travel_m - searched.travel_m).abs() < 1e-9, "{known:?} is not {searched:?}");
    }
}

/// The paper's dragon touches at the same travel if its spiral is moved and wound the other way.
#[test]
fn the_papers_contact_is_the_same_for_any_position_of_the_spiral() {
    for (centre, axis, winding) in [
        ((30.0, -7.0), 1.0, Turn::CounterClockwise),
        ((-4.0, 2.5), -2.0, Turn::Clockwise),
        ((0.0, 12.0), 3.0, Turn::Clockwise),
    ] {
        let home = Route::spiral(0.55, 16.0).expect("the paper's spiral");
        let spiral = Spiral::new(0.55, f64::INFINITY, 0.0).about(centre.into(), axis, winding);
        let length_m = home.end_travel_m();
        let route = Route::new(&[Segment::Spiral(spiral)], length_m, [0.0, length_m]).expect("one segment");
        let dimensions = paper_benches(223);
        let dragon = Dragon::new(dimensions, Arc::new(route)).expect("the dragon stands");
        let contact = first_contact(&dragon, 0.0, length_m).expect("no limit").expect("the dragon touches itself");
        assert_eq!(contact.benches, [0, 8]);
        assert!((contact.travel_m - 412.473_838).abs() <= 5.001e-7, "{contact:?}");
    }
}

#[test]
fn segments_that_do_not_join_are_rejected_with_their_index() {
    let line = Segment::Line(Line::up_to(DVec2::ZERO, DVec2::X));
    let arc = |at: DVec2, tangent| Segment::Arc(CircularArc::from_begin(at, tangent, 1.0, 1.0, Turn::Clockwise));
    let error = |segments: &[Segment], span| Route::new(segments, 0.0, span).expect_err("refused").to_string();
    assert!(
        error(&[line, arc(DVec2::Y, DVec2::X)], [-1.0, 1.0])
            .starts_with("segment 1 does not join the segment before it: gap 1e0 m")
    );
    assert!(error(&[line, arc(DVec2::ZERO, DVec2::Y)], [-1.0, 1.0]).contains("tangents differ by 1.4"));
    assert!(error(&[arc(DVec2::ZERO, DVec2::X)], [0.0, 1.0]).starts_with("segment 0: the first segment"));
    assert!(error(&[line, line], [-1.0, 1.0]).starts_with("segment 1: the first segment"));
    assert!(error(&[line], [-1.0, f64::INFINITY]).starts_with("the route is walked from -1 to inf m"));
    let beyond = error(&[line, arc(DVec2::ZERO, DVec2::X)], [-1.0, 2.0]);
    assert_eq!(beyond, "the route is walked to 2 m, must be at most 1, where its last segment ends");
}

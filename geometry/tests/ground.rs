//! Dragons on ground that is not flat: planes in closed form, random smooth ground, and contacts by brute force.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use bench_dragon_geometry::clearance::{Contact, PlaySearch, ProvenTravel, first_contact};
use bench_dragon_geometry::dragon::{Board, ChainSolver, ChainStepper, Dragon, DragonError, Handle, Instructions};
use bench_dragon_geometry::ground::{Ground, HeightMap};
use bench_dragon_geometry::planner::largest_speed_ratio;
use bench_dragon_geometry::route::{
    CircularArc, Line, PathSegment, PathSpec, Placement, Route, RouteError, RouteSpec, Segment, Turn, Turnaround,
};
use fastrand::Rng;
use glam::{DVec2, DVec3};
use proptest::prelude::*;
use test_support::dragons::{boards_at, handles_at, pairs, paper_benches};
use test_support::hills::{hills, plane};
use test_support::property::{case_count, random_cases};

fn spiral(ground: &Ground, pitch_m: f64, turns: f64, dragon_m: f64) -> Route {
    let spiral = Route::spiral(pitch_m, turns).expect("a valid spiral");
    spiral.on_ground(ground, 0.0, None, dragon_m).expect("ground everywhere")
}

#[test]
fn a_straight_climb_has_its_closed_form() {
    let line = Route::new(&[Segment::Line(Line::up_to(DVec2::new(100.0, 0.0), DVec2::X))], 100.0, [0.0, 100.0]);
    let route = line.expect("a valid line").on_ground(&plane(0.75, 0.3), 0.0, None, 100.0).expect("a plane");
    // 0.75 m of climb over 1 m of the plan are 1.25 m of arc.
    assert!((route.end_travel_m() - 125.0).abs() < 1e-9, "{}", route.end_travel_m());
    let dragon = Dragon::new(paper_benches(20), Arc::new(route)).expect("the dragon stands");
    let mut behind_m = 0.0;
    for (index, handle) in handles_at(&dragon, 50.0).iter().enumerate() {
        let x = (50.0 - behind_m) / 1.25;
        assert!((handle.in_space() - DVec3::new(x, 0.0, 0.75 * x)).length() < 1e-11, "{handle:?}");
        assert!((handle.speed_ratio - 1.0).abs() < 1e-12 && (handle.climb - 0.6).abs() < 1e-12);
        behind_m += dragon.dimensions().link_m(index);
    }
    let boards = boards_at(&dragon, 50.0);
    assert!((boards[1].half_length - 1.1 / 1.25).abs() < 1e-12 && boards[1].half_width == 0.15);
}

#[test]
fn an_arc_on_a_plane_is_an_ellipse_in_space() {
    let arc = CircularArc::from_begin(DVec2::new(5.0, 0.0), DVec2::Y, 5.0, TAU, Turn::CounterClockwise);
    let line = Line::up_to(DVec2::new(5.0, 0.0), DVec2::Y);
    let route = Route::new(&[Segment::Line(line), Segment::Arc(arc)], 0.0, [0.0, 10.0 * PI]).expect("they join");
    let route = route.on_ground(&plane(0.75, 0.0), 0.0, None, 20.0).expect("a plane");
    // The perimeter of an ellipse with the half axes 6.25 and 5 (scipy.special.ellipe).
    let perimeter_m = 4.0 * 6.25 * 1.418_083_394_448_724_3;
    assert!((route.end_travel_m() - perimeter_m).abs() < 1e-9, "{} {perimeter_m}", route.end_travel_m());
    let quarter = route.point(route.parameter(0.25 * perimeter_m));
    assert!(quarter.position.distance(DVec2::new(0.0, 5.0)) < 1e-9 && quarter.height_m.abs() < 1e-9);
}

/// A path of segments of very different lengths, some of a few micrometres.
fn patchy() -> RouteSpec {
    let line = |length_m| PathSegment::Line { length_m };
    let arc = |radius_m, turn| PathSegment::Arc { radius_m, turn };
    let spiral = PathSegment::Spiral { start_radius_m: 9.0, end_radius_m: 5.0, turn: 3.0 };
    let segments =
        vec![line(3.0), line(2e-6), arc(8.0, 1.0), arc(8.0, 4e-7), spiral, line(5e-6), arc(4.0, -1.2), line(6.0)];
    RouteSpec::from(PathSpec { segments, laps: None })
}

#[test]
fn short_segments_on_hills_leave_no_gap() {
    let map = hills([0.2, 1.3, 0.9], 0.3);
    let spec = RouteSpec { ground: Some(Arc::new(Ground::map(map.clone()))), ..patchy() };
    let (ground, route) = (Ground::map(map), spec.build(1.0, 10.0).expect("ground everywhere"));
    let (begin, end) = (route.parameter(-12.0), route.parameter(route.end_travel_m()));
    let mut last: Option<(DVec3, f64)> = None;
    for step in 0..=200_000 {
        let parameter = begin + (end - begin) * f64::from(step) / 200_000.0;
        let point = route.point(parameter);
        let exact_m = ground.height_m(point.position).expect("ground everywhere");
        assert!((point.height_m - exact_m).abs() < 1e-10, "{parameter}: {} {exact_m}", point.height_m);
        let travel_m = route.travel(parameter);
        if let Some((position, before_m)) = last {
            let chord_m = point.position.extend(point.height_m).distance(position);
            assert!((travel_m - before_m - chord_m).abs() < 1e-9, "{parameter}: {travel_m} {before_m} {chord_m}");
        }
        assert!((route.parameter(travel_m) - parameter).abs() < 1e-9);
        last = Some((point.position.extend(point.height_m), travel_m));
    }
    let seams_m: Vec<f64> = route.seams().iter().map(|&seam| route.travel(seam)).collect();
    assert!(seams_m.is_sorted(), "{seams_m:?}");
}

#[test]
fn the_seams_of_a_turnaround_have_the_slope_of_the_plane() {
    let turnaround = Turnaround::new(1.7, 9.0, 2.0).expect("the paper's").between(-20.0, 40.0).expect("times");
    let route = turnaround.route().on_ground(&plane(0.1, 0.0), -20.0, Some(40.0), 20.0).expect("a plane");
    for &seam in route.seams() {
        let [before, at, after] = [-1e-9, 0.0, 1e-9].map(|off| route.point(seam + off));
        for point in [before, after] {
            assert!((point.climb - at.climb).abs() < 1e-8, "{point:?} {at:?}");
        }
        let unit = at.tangent.extend(at.climb).length();
        assert!((unit - 1.0).abs() < 1e-12 && (at.climb - 0.1 * at.tangent.x).abs() < 1e-10, "{at:?}");
    }
    let heights = route.heights(-20.0, 40.0).expect("there is ground");
    assert!(heights.slope <= 0.1 + 1e-9 && heights.slope > 0.0999, "{heights:?}");
}

#[test]
fn level_ground_is_as_flat_as_none() {
    let flat =
        Dragon::new(paper_benches(60), Arc::new(Route::spiral(0.55, 16.0).expect("a spiral"))).expect("it stands");
    let carried = plane(0.0, 0.0).carried_at(1.25).expect("a valid height");
    let level = Dragon::new(paper_benches(60), Arc::new(spiral(&carried, 0.55, 16.0, 200.0))).expect("it stands");
    assert!((flat.end_travel_m() - level.end_travel_m()).abs() < 1e-9);
    for travel_m in [0.0, 100.0, 300.0] {
        for (flat, level) in handles_at(&flat, travel_m).iter().zip(handles_at(&level, travel_m)) {
            assert!(flat.position.distance(level.position) < 1e-10 && level.height_m == 1.25);
            assert!((flat.speed_ratio - level.speed_ratio).abs() < 1e-10);
        }
    }
    let [flat, level] = [&flat, &level]
        .map(|dragon| first_contact(dragon, 0.0, dragon.end_travel_m()).expect("no limit").expect("it touches itself"));
    assert!((flat.travel_m - level.travel_m).abs() < 1e-8 && flat.benches == level.benches, "{flat:?} {level:?}");
}

#[test]
fn ground_that_ends_is_an_error_that_names_the_place() {
    let small = Ground::map(hills([0.0; 3], 0.1));
    let route = spiral(&small, 1.6, 16.0, 800.0);
    let error =
        Dragon::new(paper_benches(400), Arc::new(route)).map(|_| ()).expect_err("the spiral begins outside of the map");
    assert!(matches!(error, DragonError::Ground(gap) if gap.travel_m <= 0.0), "{error}");
    let outside = Route::spiral(4.0, 10.0).expect("a spiral").on_ground(&small, 0.0, None, 10.0);
    let error = outside.expect_err("it begins at 40 m");
    assert_eq!(
        error.to_string(),
        "the ground has no height at 0 m of travel, at (40, 0) m: travel is measured from there"
    );
    let steep = Ground::map(hills([0.0; 3], 5.0));
    let error = Route::spiral(1.0, 10.0).expect("a spiral").on_ground(&steep, 0.0, None, 10.0);
    let is_steep = match error {
        Err(RouteError::Ground(gap)) => gap.is_steep,
        Ok(route) => {
            matches!(Dragon::new(paper_benches(5), Arc::new(route)), Err(DragonError::Ground(gap)) if gap.is_steep)
        }
        Err(_) => false,
    };
    assert!(is_steep);
}

#[test]
fn a_cropped_map_gives_the_same_bits() {
    let map = hills([1.0, 2.0, 3.0], 0.2);
    let whole = Ground::map(map.clone());
    let route = spiral(&whole, 0.55, 10.0, 60.0);
    let runs = route.ground_runs(&whole);
    let stored: usize = runs.iter().map(|run| run.heights_m.len()).sum();
    assert!(stored < 121 * 121 / 4, "{stored} heights");
    let cropped = Ground::map(HeightMap::from_runs(map.first(), map.spacing(), &runs).expect("valid runs"));
    let again = spiral(&cropped, 0.55, 10.0, 60.0);
    assert_eq!(again.ground_runs(&cropped), runs);
    let [first, second] =
        [route, again].map(|route| Dragon::new(paper_benches(20), Arc::new(route)).expect("it stands"));
    assert_eq!(handles_at(&first, 60.0), handles_at(&second, 60.0));
    assert_eq!(first.end_travel_m().to_bits(), second.end_travel_m().to_bits());
}

/// Arc in space between two parameters by the trapezoidal rule.
fn brute_arc_m(route: &Route, ground: &Ground, [from, to]: [f64; 2]) -> f64 {
    const STEPS: u32 = 400_000;
    let at = |step: u32| {
        let position = route.point(from + (to - from) * f64::from(step) / f64::from(STEPS)).position;
        position.extend(ground.height_m(position).expect("ground everywhere"))
    };
    (1..=STEPS).map(|step| at(step).distance(at(step - 1))).sum()
}

#[test]
fn travel_on_hills_is_the_arc_in_space() {
    let ground = Ground::map(hills([0.3, 0.7, 0.1], 0.3));
    let route = spiral(&ground, 0.55, 16.0, 40.0);
    for [from_m, to_m] in [[0.0, 7.0], [100.0, 103.0], [250.0, 251.0]] {
        let ends = [from_m, to_m].map(|travel_m| route.parameter(travel_m));
        for (end, travel_m) in ends.iter().zip([from_m, to_m]) {
            assert!((route.travel(*end) - travel_m).abs() < 1e-11);
        }
        let brute_m = brute_arc_m(&route, &ground, ends);
        assert!((brute_m - (to_m - from_m)).abs() < 2e-9, "{from_m}: {brute_m}");
    }
}

/// Largest gap at which boards touch: the rounding of positions, as `ContactSearch` documents it.
const TOUCH_M: f64 = 1e-12;
/// No boards touch at this travel before a contact. It is twice the length of the interval at which the search ends.
const BEFORE_M: f64 = 2e-11;

/// The least gap of two boards that are not neighbours. Its sign is that of their clearance.
fn least_gap_m(dragon: &Dragon, travel_m: f64) -> f64 {
    let boards = boards_at(dragon, travel_m);
    pairs(boards.len()).map(|[i, j]| boards[i].separation(&boards[j]).0).fold(f64::INFINITY, f64::min)
}

/// Fails unless boards touch at a contact, and none before it.
///
/// The gap has a tolerance, not the travel: boards that close at a rate r have a gap of [`TOUCH_M`] at `TOUCH_M / r` of travel before
/// their edges meet. Where they graze, r is arbitrarily small.
fn assert_first_touch(dragon: &Dragon, contact: &Contact) {
    let gap_m = least_gap_m(dragon, contact.travel_m);
    assert!(gap_m <= TOUCH_M, "{gap_m} m at {contact:?}");
    if contact.travel_m > 0.0 {
        let before_m = least_gap_m(dragon, contact.travel_m - BEFORE_M);
        assert!(before_m > 0.0, "{before_m} m before, {gap_m} m at {contact:?}");
    }
}

/// A part of the route that is fitted as a whole ends 2 mm behind the border of a cell of the ground, near (1.498, -8.363).
#[test]
fn a_route_that_ends_just_in_another_cell_has_the_heights_of_the_ground() {
    let phases = (1.086_939_853_325_879_4, 5.776_138_145_102_31, 3.226_558_066_576_741_3);
    let ground = Ground::map(hills(phases.into(), 0.185_770_800_209_195_2));
    let pitch_m = 1.092_338_143_522_482_2;
    let route = Route::spiral(pitch_m, 10.0 / pitch_m).expect("a spiral").on_ground(&ground, 0.0, None, 80.0);
    let dragon =
        Dragon::new(paper_benches(30), Arc::new(route.expect("ground everywhere"))).expect("the dragon stands");
    for handle in handles_at(&dragon, 0.396_933_864_041_114_8 * dragon.end_travel_m()) {
        let height_m = ground.height_m(handle.position).expect("ground everywhere");
        assert!((height_m - handle.in_space().z).abs() < 1e-12, "{handle:?}: {height_m} m");
    }
}

proptest! {
    #![proptest_config(random_cases(24))]

    #[test]
    fn on_random_hills_every_link_has_its_length_in_space(
        phases in (0.0..TAU, 0.0..TAU, 0.0..TAU), height_m in 0.01..0.4_f64, pitch_m in 0.4..1.2_f64, part in 0.0..0.95_f64,
    ) {
        let ground = Ground::map(hills(phases.into(), height_m));
        let route = Route::spiral(pitch_m, 10.0 / pitch_m).expect("a spiral").on_ground(&ground, 0.0, None, 80.0);
        let Ok(dragon) = Dragon::new(paper_benches(30), Arc::new(route.expect("ground everywhere"))) else { return Ok(()) };
        let handles = handles_at(&dragon, part * dragon.end_travel_m());
        for (bench, ends) in handles.windows(2).enumerate() {
            let in_space = |handle: &Handle| {
                handle.position.extend(ground.height_m(handle.position).expect("ground everywhere"))
            };
            let length_m = in_space(&ends[0]).distance(in_space(&ends[1]));
            prop_assert!((length_m - dragon.dimensions().link_m(bench)).abs() < 1e-9, "{length_m}");
        }
        // The speeds are differences of later and earlier poses.
        let step_m = 1e-5;
        let travel_m = part * dragon.end_travel_m() + 2.0 * step_m;
        if travel_m + step_m < dragon.end_travel_m() {
            let [before, now, after] = [-step_m, 0.0, step_m].map(|off_m| handles_at(&dragon, travel_m + off_m));
            for ((before, now), after) in before.iter().zip(&now).zip(&after) {
                let speed = (after.in_space() - before.in_space()) / (2.0 * step_m);
                let expected = now.speed_ratio * now.tangent.extend(now.climb);
                prop_assert!(speed.distance(expected) < 1e-4 * (1.0 + speed.length()), "{speed} {expected}");
            }
        }
    }

    #[test]
    fn steps_on_random_hills_equal_the_reference_solver(
        phases in (0.0..TAU, 0.0..TAU, 0.0..TAU), height_m in 0.01..0.4_f64, portable in any::<bool>(), step_m in 2e-4..0.03_f64,
        turns in any::<bool>(),
    ) {
        let ground = Ground::map(hills(phases.into(), height_m)).carried_at(0.8).expect("a valid height");
        let route = if turns {
            let turnaround = Turnaround::new(1.7, 9.0, 2.0).expect("the paper's").between(-1.0, 60.0).expect("times");
            turnaround.route().on_ground(&ground, -1.0, Some(60.0), 120.0)
        } else {
            Route::spiral(0.55, 18.0).expect("a spiral").on_ground(&ground, 0.0, None, 120.0)
        };
        let Ok(dragon) = Dragon::new(paper_benches(70), Arc::new(route.expect("ground everywhere"))) else { return Ok(()) };
        let (dragon, mut solver) = (Arc::new(dragon.clone()), ChainSolver::new(&dragon));
        let instructions = if portable { Instructions::portable() } else { Instructions::best() };
        let mut stepper = ChainStepper::with_instructions(Arc::clone(&dragon), instructions);
        let mut records = vec![[DVec3::ZERO; 2]; dragon.dimensions().handles()];
        for step in 0..400 {
            let travel_m = 20.0 + f64::from(step) * step_m;
            if travel_m > dragon.end_travel_m() {
                break;
            }
            stepper.step(travel_m, 1.0, &mut records, |position, velocity| [position, velocity]).expect("within the run");
            let exact = solver.solve(&dragon, travel_m).expect("within the run");
            for ([position, velocity], handle) in records.iter().zip(exact) {
                prop_assert!(position.distance(handle.in_space()) < 1e-9, "{travel_m} m: {position} is not {handle:?}");
                let expected = handle.speed_ratio * handle.tangent.extend(handle.climb);
                prop_assert!(velocity.distance(expected) < 1e-7, "{travel_m} m: {velocity}");
            }
        }
    }

    #[test]
    fn the_first_contact_on_random_hills_is_that_of_brute_force(
        phases in (0.0..TAU, 0.0..TAU, 0.0..TAU), height_m in 0.01..0.4_f64, pitch_m in 0.4..0.7_f64,
    ) {
        let ground = Ground::map(hills(phases.into(), height_m));
        let route = Route::spiral(pitch_m, 5.0 / pitch_m).expect("a spiral").on_ground(&ground, 0.0, None, 60.0);
        let Ok(dragon) = Dragon::new(paper_benches(24), Arc::new(route.expect("ground everywhere"))) else { return Ok(()) };
        let end_m = dragon.end_travel_m();
        let found = first_contact(&dragon, 0.0, end_m).expect("no limit");
        let contact_m = found.map_or(f64::INFINITY, |contact| contact.travel_m);
        let mut travel_m = 0.0;
        while travel_m < end_m.min(contact_m - BEFORE_M) {
            prop_assert!(least_gap_m(&dragon, travel_m) > 0.0, "touching at {travel_m}, found {found:?}");
            travel_m += 0.02;
        }
        if let Some(contact) = found {
            assert_first_touch(&dragon, &contact);
            if contact_m > 0.0 {
                let mut proven = ProvenTravel::at(&dragon, 1e-6, 0.0).expect("apart at the start");
                while !proven.is_whole() {
                    proven.extend(end_m, 1_000_000);
                }
                prop_assert!(proven.end_m() < contact_m && proven.end_m() > contact_m - 0.1, "{} {contact_m}", proven.end_m());
            }
        }
    }
}

#[test]
fn the_largest_ratio_on_hills_is_that_of_dense_samples() {
    let ground = Ground::map(hills([0.5, 1.5, 2.5], 0.15));
    let spiral = Route::spiral(1.7, 8.0).expect("a spiral").on_ground(&ground, 0.0, Some(60.0), 60.0);
    let dragon = Dragon::new(paper_benches(24), Arc::new(spiral.expect("ground everywhere"))).expect("it walks");
    let largest = largest_speed_ratio(&dragon).expect("it walks its whole route");
    let mut sampled = 0.0_f64;
    for step in 0..=60_000 {
        let chain = dragon.chain(f64::from(step) * 1e-3).expect("a travel of the run");
        sampled = chain.map(|handle| handle.speed_ratio).fold(sampled, f64::max);
    }
    assert!(largest.ratio >= sampled - 1e-12 && largest.ratio < sampled + 1e-5, "{largest:?} {sampled}");
}

/// A random vector of at most this length.
fn within_ball(random: &mut Rng, radius_m: f64) -> DVec3 {
    let mut axis = || 2.0 * random.f64() - 1.0;
    loop {
        let vector = DVec3::new(axis(), axis(), axis());
        if vector.length() <= 1.0 {
            return radius_m * vector;
        }
    }
}

/// The parameter behind a pole at which the distance in space is `length_m`: a walk in millimetres, then bisection.
fn behind(route: &Route, parameter: f64, length_m: f64) -> f64 {
    let at = |parameter: f64| {
        let point = route.point(parameter);
        point.position.extend(point.height_m)
    };
    let (front, begin_m) = (at(parameter), route.travel(parameter));
    let is_far = |arc_m: f64| at(route.parameter(begin_m - arc_m)).distance(front) >= length_m;
    let mut arc_m = 0.95 * length_m;
    while !is_far(arc_m) {
        arc_m += 2e-3;
    }
    let (mut low_m, mut high_m) = (arc_m - 2e-3, arc_m);
    while high_m - low_m > 1e-12 {
        let middle_m = 0.5 * (low_m + high_m);
        *(if is_far(middle_m) { &mut high_m } else { &mut low_m }) = middle_m;
    }
    route.parameter(begin_m - high_m)
}

#[test]
fn no_random_pose_of_loose_hinges_on_hills_touches_before_the_bound() {
    let ground = Ground::map(hills([0.3, 1.1, 2.0], 0.25));
    let dimensions = paper_benches(16).with_poles(0.055, 0.045).expect("valid poles");
    let route = Route::spiral(0.55, 10.0).expect("a spiral").on_ground(&ground, 0.0, None, 60.0);
    let dragon = Dragon::new(dimensions, Arc::new(route.expect("ground everywhere"))).expect("it stands");
    let nominal_m = first_contact(&dragon, 0.0, dragon.end_travel_m()).expect("no limit").expect("it touches").travel_m;
    let mut search = PlaySearch::at(&dragon, 0.0, 0.0).expect("no limit").expect("there is play");
    let bound_m = search.advance(dragon.end_travel_m()).expect("no limit").expect("it touches").travel_m;
    assert!(bound_m < nominal_m && bound_m > nominal_m - 20.0, "{bound_m} {nominal_m}");
    let (mut random, play_m, mut drawn) = (Rng::with_seed(7), dimensions.play_m(), 0);
    let poses = case_count(3000);
    for pose in 0..poses {
        // Half of the poses are just before the bound.
        let share = if pose % 2 == 0 { 1.0 } else { random.f64() };
        let mut pole = dragon.route().parameter(share * bound_m);
        let mut boards = Vec::new();
        for bench in 0..dimensions.benches() {
            let link_m = dimensions.link_m(bench);
            let longer_m = 2.0 * play_m * [2.0 * random.f64() - 1.0, 1.0, -1.0][random.usize(..3)];
            let rear = behind(dragon.route(), pole, link_m + longer_m);
            let [front_at, rear_at] = [pole, rear].map(|parameter| {
                let point = dragon.route().point(parameter);
                point.position.extend(point.height_m)
            });
            let off = 0.9 * play_m * (1.0 - longer_m.abs() / (2.0 * play_m));
            let [v, w] = [(); 2].map(|()| within_ball(&mut random, off));
            let (middle, along) = (0.5 * (front_at + v + rear_at + w), (front_at + v - rear_at - w).normalize());
            let holes = [middle + 0.5 * link_m * along, middle - 0.5 * link_m * along];
            let is_allowed = holes[0].distance(front_at).max(holes[1].distance(rear_at)) <= play_m + 1e-9;
            drawn += u32::from(is_allowed);
            let holes = if is_allowed { holes } else { [front_at, rear_at] };
            let share = along.truncate().length();
            let board = Board::from_handles(
                holes[0].truncate(),
                holes[1].truncate(),
                share * dimensions.length_m(bench),
                dimensions.width_m(),
            );
            boards.push(board);
            pole = rear;
        }
        let touch = (0..boards.len()).find(|&i| (i + 2..boards.len()).any(|j| boards[i].overlaps(&boards[j])));
        assert_eq!(touch, None, "pose {pose}");
    }
    assert!(drawn > 10 * poses, "{drawn} benches off their poles");
}

/// The entry of a turn is at t = 0, up to rounding. Between the two is no piece, which would have the slope of rounding.
#[test]
fn turns_of_all_sizes_have_the_slopes_of_the_plane_at_their_entry() {
    let ground = plane(0.4, -0.2);
    for radius_m in (1..=256).map(|k| 4.5 / 256.0 * f64::from(k)) {
        let turnaround =
            Turnaround::new(1.7, 2.0 * radius_m, 2.0).and_then(|turn| turn.between(-1.0, 5.0)).expect("valid");
        let turnaround = turnaround.placed(Placement { position: DVec2::new(1.2, -0.8), heading: 0.7 });
        let route = turnaround.route().on_ground(&ground, -1.0, Some(5.0), 20.0).expect("a plane");
        for parameter in [route.parameter(0.0), route.seams()[0]] {
            let point = route.point(parameter);
            let slope = point.climb / point.tangent.length();
            let expected = DVec2::new(0.4, -0.2).dot(point.tangent.normalize());
            assert!((slope - expected).abs() < 1e-9, "radius {radius_m} m: {slope}, not {expected}");
        }
    }
}

/// A line that ends on the border of a cell, up to rounding: the arc behind it has no piece of the length of that rounding.
#[test]
fn seams_on_the_borders_of_cells_have_the_slope_of_their_surroundings() {
    let ground = Ground::map(hills([0.4, 1.3, 2.9], 0.4));
    let slope = |route: &Route, parameter: f64| {
        let point = route.point(parameter);
        point.climb / point.tangent.length()
    };
    for ulps in -4..=4 {
        for (begin_m, length_m, turn) in [(0.0, 5.0, 1.5), (-0.1, 2.6, -2.0), (0.3, 0.7, 2.0), (1.1, 3.4, -1.0)] {
            let beside = 5.0 + f64::from(ulps) * f64::EPSILON;
            let placement = Placement { position: DVec2::new(begin_m + beside - 5.0, 0.2), heading: 0.0 };
            let arc = PathSegment::Arc { radius_m: 2.5, turn };
            let path = PathSpec { segments: vec![PathSegment::Line { length_m }, arc, arc], laps: None };
            let plan = RouteSpec { placement, ground: Some(Arc::new(ground.clone())), ..RouteSpec::from(path) };
            let route = plan.build(1.0, 2.0).expect("the path lies on the hills");
            for &seam in route.seams() {
                let around = [seam - 1e-7, seam, seam + 1e-7].map(|parameter| slope(&route, parameter));
                assert!((around[0] - around[1]).abs() < 1e-5, "{ulps} {length_m}: {around:?} at {seam}");
                assert!((around[2] - around[1]).abs() < 1e-5, "{ulps} {length_m}: {around:?} at {seam}");
            }
        }
    }
}

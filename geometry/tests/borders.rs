//! Boards that pass a border of a stage or come too near, and their least distance, compared with dense samples of the run.

use std::f64::consts::{PI, TAU};
use std::sync::Arc;

use bench_dragon_geometry::clearance::{Breach, ProvenTravel, first_breach, least_distance, standing_at};
use bench_dragon_geometry::dragon::{Board, ChainSolver, Dimensions, Dragon, Meter, Spent};
use bench_dragon_geometry::formation::{Formation, Planned, Timetable};
use bench_dragon_geometry::route::{PathSegment, PathSpec, Route, RouteSpec};
use bench_dragon_geometry::stage::{Border, BorderKind, Outline, OutlineError, Stage};
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::{least_clearance_m, paper_benches, paper_dragon};
use test_support::property::random_cases;

/// Margin of the proofs, and rounding of a clearance, in metres.
const MARGIN_M: f64 = 1e-6;
const CLEARANCE_ROUNDING_M: f64 = 1e-12;

/// Distance between two samples of a run, in metres of travel.
const STEP_M: f64 = 0.002;
/// More than the rounding of a distance.
const ROUNDING_M: f64 = 1e-9;

fn segments() -> impl Strategy<Value = PathSegment> {
    let turn = || prop_oneof![-4.0..-0.2_f64, 0.2..4.0_f64];
    prop_oneof![
        (0.5..5.0_f64).prop_map(|length_m| PathSegment::Line { length_m }),
        (1.6..4.0_f64, turn()).prop_map(|(radius_m, turn)| PathSegment::Arc { radius_m, turn }),
        (1.6..4.0_f64, 0.2..2.0_f64, any::<bool>(), turn()).prop_map(|(less_m, by_m, inward, turn)| {
            let [start_radius_m, end_radius_m] = if inward { [less_m + by_m, less_m] } else { [less_m, less_m + by_m] };
            PathSegment::Spiral { start_radius_m, end_radius_m, turn }
        }),
    ]
}

/// Closed paths. The body of the dragon stands in the bends, so a bench behind the first two may be the first that leaves.
fn ovals() -> impl Strategy<Value = PathSpec> {
    (0.5..6.0_f64, 1.6..3.0_f64, 0.5..6.0_f64).prop_map(|(length_m, radius_m, other_m)| {
        let (bend, lines) = (
            PathSegment::Arc { radius_m, turn: 0.5 * PI },
            [length_m, other_m].map(|length_m| PathSegment::Line { length_m }),
        );
        let half = [lines[0], bend, lines[1], bend];
        PathSpec { segments: [half, half].concat(), laps: Some(1) }
    })
}

fn dragons() -> impl Strategy<Value = Dragon> {
    let dimensions = (1_usize..12, 1.0..2.5_f64, 0.8..2.0_f64, 0.1..0.3_f64, 0.0..0.3_f64);
    let path = prop_oneof![
        prop::collection::vec(segments(), 1..6).prop_map(|segments| PathSpec { segments, laps: None }),
        ovals(),
    ];
    (dimensions, path).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m, hole), path)| {
        let dimensions = Dimensions::new(count, head_m, body_m, width_m, hole * head_m.min(body_m)).ok()?;
        let route = RouteSpec::from(path).build(1.0, dimensions.links_m()).ok()?;
        Dragon::new(dimensions, Arc::new(route)).ok()
    })
}

/// A star about the middle of the run: its corners have random distances in growing directions, so it may be concave.
fn outlines() -> impl Strategy<Value = (Vec<f64>, f64, bool)> {
    (prop::collection::vec(0.3..1.6_f64, 3..9), 0.0..6.0_f64, any::<bool>())
}

fn boards_at(dragon: &Dragon, solver: &mut ChainSolver, travel_m: f64) -> Vec<Board> {
    let mut boards = Vec::new();
    dragon.place_boards(solver.solve(dragon, travel_m).expect("within the run"), &mut boards);
    boards
}

fn star(dragon: &Dragon, (shares, turn, is_reversed): &(Vec<f64>, f64, bool)) -> Option<Outline> {
    let mut solver = ChainSolver::new(dragon);
    let handles: Vec<DVec2> = [dragon.start_travel_m(), dragon.end_travel_m()]
        .into_iter()
        .flat_map(|travel_m| solver.solve(dragon, travel_m).expect("within the run").to_vec())
        .map(|handle| handle.position)
        .collect();
    let centre = handles.iter().sum::<DVec2>() / handles.len() as f64;
    let reach_m = 2.0 + handles.iter().map(|handle| handle.distance(centre)).fold(0.0, f64::max);
    let corner = |(i, share): (usize, &f64)| {
        let angle = turn + TAU * i as f64 / shares.len() as f64;
        (centre + share * reach_m * 1.3 * DVec2::from_angle(angle)).to_array()
    };
    let mut corners: Vec<[f64; 2]> = shares.iter().enumerate().map(corner).collect();
    if *is_reversed {
        corners.reverse();
    }
    Outline::new(&corners).ok()
}

/// A stage with an outline alone.
fn within(outline: &Outline) -> Stage {
    Stage::new(vec![Border::outline(outline.clone())], 0.0)
}

fn first_exit(dragon: &Dragon, outline: &Outline) -> Result<Option<Breach>, Spent> {
    first_breach(dragon, &within(outline), 0.0)
}

fn leaving_point(outline: &Outline, board: &Board) -> Option<DVec2> {
    Border::outline(outline.clone()).breach(board, 0.0)
}

fn standing_outside(dragon: &Dragon, outline: &Outline) -> usize {
    let timetable = Timetable::new(1.0, None, 0.0, dragon.end_travel_m());
    let formation = Formation::of_one(Planned { dragon: Arc::new(dragon.clone()), timetable });
    standing_at(&formation, &within(outline), BorderKind::Outline, 0.0, dragon.start_travel_m()).len()
}

/// The first sample at which a board is outside that was inside for a while: for at least a sixteenth of its link, which no look
/// misses.
fn first_sampled_exit(dragon: &Dragon, outline: &Outline) -> Option<f64> {
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let count = ((end_m - start_m) / STEP_M).ceil();
    let step_m = (end_m - start_m) / count;
    let mut solver = ChainSolver::new(dragon);
    let mut inside_m = vec![0.0; dragon.dimensions().benches()];
    (0..=count as u32).map(|step| start_m + (end_m - start_m) * (f64::from(step) / count)).find(|&travel_m| {
        let boards = boards_at(dragon, &mut solver, travel_m);
        boards.iter().enumerate().any(|(bench, board)| {
            let was_inside_m = inside_m[bench];
            let is_outside = leaving_point(outline, board).is_some();
            inside_m[bench] = if is_outside { 0.0 } else { was_inside_m + step_m };
            is_outside && was_inside_m > dragon.dimensions().link_m(bench) / 16.0 + 2.0 * step_m
        })
    })
}

/// Compares the first exit with samples of the whole run.
fn assert_like_samples(dragon: &Dragon, outline: &Outline) -> Result<(), TestCaseError> {
    let exit = first_exit(dragon, outline).expect("no limit");
    let sampled = first_sampled_exit(dragon, outline);
    let Some(exit) = exit else {
        prop_assert!(sampled.is_none(), "outside at {sampled:?}");
        return Ok(());
    };
    prop_assert!(sampled.is_none_or(|sampled_m| exit.travel_m <= sampled_m + 1e-8), "{exit:?}, sampled at {sampled:?}");
    let mut solver = ChainSolver::new(dragon);
    let mut outside_at = |travel_m: f64| {
        let boards = boards_at(dragon, &mut solver, travel_m.max(dragon.start_travel_m()));
        leaving_point(outline, &boards[exit.bench])
    };
    prop_assert!(outside_at(exit.travel_m - 1e-7).is_none(), "{exit:?} is late");
    let point = outside_at(exit.travel_m);
    prop_assert!(point.is_some_and(|point| point.distance(exit.point) < 1e-6), "{exit:?}: {point:?}");
    prop_assert!(outline.distance_m(exit.point) < 1e-6, "{exit:?} is not on the outline");
    Ok(())
}

proptest! {
    #![proptest_config(random_cases(300))]

    #[test]
    fn the_first_exit_is_that_of_dense_samples(dragon in dragons(), star_of in outlines()) {
        let Some(outline) = star(&dragon, &star_of) else { return Ok(()) };
        assert_like_samples(&dragon, &outline)?;
    }

    /// A spike from outside points at a place on or beside the route behind the head. So any bench may be the first that meets
    /// it.
    #[test]
    fn each_bench_is_followed_over_its_own_ground(
        radius_m in 3.0..6.0_f64, behind_m in -2.0..14.0_f64, off_m in -0.3..0.4_f64, (head_m, body_m, width_m) in (1.0..2.5_f64, 0.8..2.0_f64, 0.1..0.3_f64),
    ) {
        let circle = PathSpec { segments: vec![PathSegment::Arc { radius_m, turn: TAU }], laps: Some(1) };
        let dimensions = Dimensions::new(8, head_m, body_m, width_m, 0.1).expect("valid");
        let route = RouteSpec::from(circle).build(1.0, dimensions.links_m()).expect("valid");
        let Ok(dragon) = Dragon::new(dimensions, Arc::new(route)) else { return Ok(()) };
        let out = DVec2::from_angle(-0.5 * PI - behind_m / radius_m);
        let (centre, side) = (DVec2::new(0.0, radius_m), 0.01 * out.perp());
        let at = |m: f64, across: f64| (centre + m * out + across * out.perp()).to_array();
        let (tip, base) = (centre + (radius_m + off_m) * out, centre + 10.0 * out);
        let corners = [at(10.0, 10.0), at(-10.0, 10.0), at(-10.0, -10.0), at(10.0, -10.0), (base - side).to_array(), tip.to_array(), (base + side).to_array()];
        assert_like_samples(&dragon, &Outline::new(&corners).expect("simple"))?;
    }

    /// The mean of random samples inside the board decides, and no other function of the outline.
    #[test]
    fn a_board_is_inside_if_all_of_its_points_are(
        star_of in outlines(), at in (-4.0..4.0_f64, -4.0..4.0_f64), heading in -3.0..3.0_f64,
    ) {
        let corners: Vec<[f64; 2]> = star_of.0.iter().enumerate().map(|(i, share)| {
            let angle = star_of.1 + TAU * i as f64 / star_of.0.len() as f64;
            (3.0 * share * DVec2::from_angle(angle)).to_array()
        }).collect();
        let Ok(outline) = Outline::new(&corners) else { return Ok(()) };
        let along = DVec2::from_angle(heading);
        let board = Board::from_handles(DVec2::from(at) + 0.8 * along, DVec2::from(at) - 0.8 * along, 2.0, 0.4);
        let points = (0..=60).flat_map(|i| (0..=20).map(move |j| (f64::from(i) / 30.0 - 1.0, f64::from(j) / 10.0 - 1.0)));
        let mut points = points.map(|(u, v)| board.centre + u * board.half_length * along + v * board.half_width * along.perp());
        match leaving_point(&outline, &board) {
            None => prop_assert!(points.all(|point| outline.contains(point) || outline.distance_m(point) < 1e-9)),
            Some(point) if outline.distance_m(point) > 0.1 => prop_assert!(points.any(|point| !outline.contains(point))),
            Some(_) => {}
        }
    }
}

/// A border of each kind from the same corners. A star with the dragon in it would be no area to keep out of, so it is a small one.
fn borders(dragon: &Dragon, star_of: &(Vec<f64>, f64, bool)) -> Option<Vec<Border>> {
    let outline = star(dragon, star_of)?;
    let centre = outline.corners().iter().sum::<DVec2>() / outline.corners().len() as f64;
    let small: Vec<[f64; 2]> =
        outline.corners().iter().map(|&corner| (centre + 0.2 * (corner - centre)).to_array()).collect();
    let line: Vec<[f64; 2]> = outline.corners().iter().map(DVec2::to_array).collect();
    Some(vec![
        Border::keep_out(Outline::new(&small).ok()?),
        Border::crowd(&line).expect("a line"),
        Border::outline(outline),
    ])
}

/// The distances of the boards from a border at the samples of a run.
struct Sampled {
    /// The least distance of all boards.
    least_m: f64,
    /// The travel of the first sample with a distance under a limit.
    first_m: Option<f64>,
    /// Lower bounds on the distance of each board at the last sample, in metres.
    bounds: Vec<f64>,
}

impl Sampled {
    /// Adds a sample. `moved_m` has how far the corners of each board have moved since the last one: a distance changes by no more.
    /// So only boards that may be nearer than all before are measured.
    fn add(&mut self, travel_m: f64, border: &Border, clear_m: f64, boards: &[Board], moved_m: &[f64]) {
        for ((board, bound_m), moved_m) in boards.iter().zip(&mut self.bounds).zip(moved_m) {
            *bound_m -= moved_m;
            if *bound_m <= self.least_m + ROUNDING_M {
                *bound_m = border.distance_m(board);
                self.least_m = bound_m.min(self.least_m);
            }
        }
        if self.least_m < clear_m {
            self.first_m = self.first_m.or(Some(travel_m));
        }
    }
}

/// The largest distance between the same corners of two boards.
fn moved_m(from: &Board, to: &Board) -> f64 {
    let corners = from.corners().into_iter().zip(to.corners());
    corners.map(|(from, to)| from.distance_squared(to)).fold(0.0, f64::max).sqrt()
}

/// Samples a run for all borders, with the first distances under `clear_m`.
fn sampled(dragon: &Dragon, borders: &[Border], clear_m: f64) -> Vec<Sampled> {
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let count = ((end_m - start_m) / STEP_M).ceil();
    let mut solver = ChainSolver::new(dragon);
    let mut before = boards_at(dragon, &mut solver, start_m);
    let unknown = || Sampled { least_m: f64::INFINITY, first_m: None, bounds: vec![0.0; before.len()] };
    let mut sampled: Vec<Sampled> = borders.iter().map(|_| unknown()).collect();
    for step in 0..=count as u32 {
        let travel_m = start_m + (end_m - start_m) * (f64::from(step) / count);
        let boards = boards_at(dragon, &mut solver, travel_m);
        let moved_m: Vec<f64> = before.iter().zip(&boards).map(|(from, to)| moved_m(from, to)).collect();
        for (border, sampled) in borders.iter().zip(&mut sampled) {
            sampled.add(travel_m, border, clear_m, &boards, &moved_m);
        }
        before = boards;
    }
    sampled
}

/// Whether the board of a breach did not keep clear at the start, and since then for less than a sixteenth of its link before the
/// breach. A board that kept clear for longer is seen by each search, which looks at it 64 times a link.
fn came_in_briefly(dragon: &Dragon, border: &Border, clear_m: f64, breach: &Breach) -> bool {
    let mut solver = ChainSolver::new(dragon);
    let start_m = dragon.start_travel_m();
    let mut keeps_clear = |travel_m: f64| {
        let boards = boards_at(dragon, &mut solver, travel_m.max(start_m));
        border.distance_m(&boards[breach.bench]) >= clear_m - ROUNDING_M
    };
    let part_m = dragon.dimensions().link_m(breach.bench) / 16.0 / 32.0;
    !keeps_clear(start_m) && !(1..=32).all(|part| keeps_clear(breach.travel_m - part_m * f64::from(part)))
}

proptest! {
    #![proptest_config(random_cases(200))]

    #[test]
    fn the_least_distance_is_that_of_dense_samples(dragon in dragons(), star_of in outlines()) {
        let Some(borders) = borders(&dragon, &star_of) else { return Ok(()) };
        for (border, Sampled { least_m: sampled_m, .. }) in borders.iter().zip(sampled(&dragon, &borders, 0.0)) {
            let kind = border.kind();
            let stage = Stage::new(vec![border.clone()], 0.0);
            let least = least_distance(&dragon, &stage, kind).expect("no limit");
            let Some(least) = least else {
                prop_assert!(kind == BorderKind::Outline && sampled_m == 0.0, "no board counts");
                continue;
            };
            if kind == BorderKind::Outline && standing_outside(&dragon, &star(&dragon, &star_of).expect("simple")) > 0 {
                continue;
            }
            prop_assert!(least.distance_m <= sampled_m + 1e-6, "{kind:?} {least:?}, sampled {sampled_m}");
            let boards = boards_at(&dragon, &mut ChainSolver::new(&dragon), least.travel_m);
            let there_m = border.distance_m(&boards[least.bench]);
            prop_assert!((there_m - least.distance_m).abs() <= 1e-8, "{kind:?} {least:?}, there {there_m}");
        }
    }

    #[test]
    fn the_first_board_too_near_is_that_of_dense_samples_and_the_proof_ends_there(
        dragon in dragons(), star_of in outlines(), clear_m in 0.01..1.0_f64,
    ) {
        let Some(borders) = borders(&dragon, &star_of) else { return Ok(()) };
        for (border, Sampled { first_m: sampled_m, .. }) in borders.iter().zip(sampled(&dragon, &borders, clear_m)) {
            let (kind, stage) = (border.kind(), Stage::new(vec![border.clone()], clear_m));
            let breach = first_breach(&dragon, &stage, clear_m).expect("no limit");
            // Boards that come in count from a look on.
            let comes_in = kind == BorderKind::Outline
                && boards_at(&dragon, &mut ChainSolver::new(&dragon), dragon.start_travel_m())
                    .iter()
                    .any(|board| border.breach(board, clear_m).is_some());
            if !comes_in {
                match (breach, sampled_m) {
                    (None, sampled_m) => prop_assert!(sampled_m.is_none(), "{kind:?}: too near at {sampled_m:?}"),
                    (Some(breach), Some(at_m)) => prop_assert!(breach.travel_m <= at_m + 1e-7, "{kind:?}: {breach:?}, {at_m}"),
                    (Some(_), None) => {}
                }
            }
            if let Some(breach) = breach {
                let mut solver = ChainSolver::new(&dragon);
                let mut distance_at = |travel_m: f64| {
                    let boards = boards_at(&dragon, &mut solver, travel_m.max(dragon.start_travel_m()));
                    border.distance_m(&boards[breach.bench])
                };
                prop_assert!(distance_at(breach.travel_m) < clear_m, "{kind:?}: {breach:?}");
                let begins = breach.travel_m == dragon.start_travel_m();
                prop_assert!(begins || distance_at(breach.travel_m - 1e-6) >= clear_m - 1e-9, "{kind:?}: {breach:?} is late");
            }
            let Ok(pairs) = ProvenTravel::at(&dragon, MARGIN_M, dragon.start_travel_m()) else { continue };
            match (pairs.clone().within_borders(&stage), breach) {
                (Err(at), Some(breach)) => prop_assert_eq!(at.travel_m, breach.travel_m),
                (Err(at), None) => prop_assert!(false, "{kind:?}: {at:?}"),
                (Ok(mut proven), breach) => {
                    let mut pairs = pairs;
                    pairs.extend(f64::INFINITY, usize::MAX);
                    proven.extend(f64::INFINITY, usize::MAX);
                    let end_m = breach.map_or(pairs.end_m(), |breach| pairs.end_m().min(breach.travel_m));
                    // The two proofs walk in different strides, whose bounds hold up to different travels. Neither passes a place where
                    // a clearance is under the margin, up to rounding.
                    let boards = boards_at(&dragon, &mut ChainSolver::new(&dragon), proven.end_m());
                    prop_assert!(
                        proven.end_m() <= pairs.end_m() || least_clearance_m(&boards) >= MARGIN_M - CLEARANCE_ROUNDING_M,
                        "{kind:?}: {} passes {}", proven.end_m(), pairs.end_m()
                    );
                    // A board that leaves and returns within 10⁻⁹ m of its walk is not found, and one within 10⁻⁹ m of the border keeps
                    // clear: no corner of these boards walks nine times as far as its pole. So the proof passes no other breach, but
                    // that of a board that came in between two of its looks.
                    let is_passed = |breach: &Breach| {
                        breach.travel_m < proven.end_m() && !came_in_briefly(&dragon, border, clear_m, breach)
                    };
                    if let Some(breach) = breach.filter(is_passed) {
                        let mut solver = ChainSolver::new(&dragon);
                        for part in 0..=32 {
                            let travel_m = breach.travel_m + (proven.end_m() - breach.travel_m) * f64::from(part) / 32.0;
                            let there_m = border.distance_m(&boards_at(&dragon, &mut solver, travel_m)[breach.bench]);
                            prop_assert!(there_m >= clear_m - 1e-8, "{kind:?}: {breach:?} is passed, {there_m} at {travel_m}");
                        }
                    }
                    // The two searches look at other places whether a board has come in.
                    prop_assert!(comes_in || proven.end_m() >= end_m - 1e-8, "{kind:?}: {}, {end_m}", proven.end_m());
                }
            }
        }
    }

    /// A proof that begins anywhere holds as far as one from the start.
    #[test]
    fn a_proof_from_the_middle_of_a_run_ends_at_the_next_breach(
        dragon in dragons(), star_of in outlines(), clear_m in 0.01..0.6_f64, share in 0.0..1.0_f64,
    ) {
        let Some(borders) = borders(&dragon, &star_of) else { return Ok(()) };
        let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
        let from_m = start_m + share * (end_m - start_m);
        for border in borders {
            let stage = Stage::new(vec![border.clone()], clear_m);
            let Ok(proven) = ProvenTravel::at(&dragon, 1e-6, from_m) else { continue };
            let Ok(mut proven) = proven.within_borders(&stage) else {
                let boards = boards_at(&dragon, &mut ChainSolver::new(&dragon), from_m);
                prop_assert!(boards.iter().any(|board| border.breach(board, clear_m).is_some()));
                continue;
            };
            proven.extend(f64::INFINITY, usize::MAX);
            let count = ((proven.end_m() - from_m) / STEP_M).floor() as u32;
            let mut solver = ChainSolver::new(&dragon);
            let mut has_kept = vec![false; dragon.dimensions().benches()];
            for step in 0..=count {
                let travel_m = from_m + STEP_M * f64::from(step);
                for (bench, board) in boards_at(&dragon, &mut solver, travel_m.min(end_m)).iter().enumerate() {
                    let keeps = border.breach(board, clear_m).is_none();
                    prop_assert!(keeps || !has_kept[bench] || border.kind() == BorderKind::Outline && border.distance_m(board) > clear_m - 0.05, "{:?}: bench {bench} at {travel_m} m", border.kind());
                    has_kept[bench] |= keeps;
                }
            }
        }
    }
}

/// The tail keeps clear of the outline for 17 mm of travel, which is less than the 64th of its link from one look to the next.
#[test]
fn a_board_that_comes_in_between_two_looks_may_count_in_one_search_alone() {
    let dimensions = Dimensions::new(10, 2.466_419, 1.738_264, 0.1, 0.120_661);
    let dimensions = dimensions.expect("benches");
    let bend = PathSegment::Arc { radius_m: 1.712_486, turn: 0.5 * PI };
    let lines = [3.523_381, 1.808_382].map(|length_m| PathSegment::Line { length_m });
    let half = [lines[0], bend, lines[1], bend];
    let path = PathSpec { segments: [half, half].concat(), laps: Some(1) };
    let route = RouteSpec::from(path).build(1.0, dimensions.links_m()).expect("valid");
    let dragon = Dragon::new(dimensions, Arc::new(route)).expect("it stands");
    let star_of = (vec![0.553_404, 0.495_134, 1.189_065], 1.976_673, false);
    let (outline, clear_m) = (star(&dragon, &star_of).expect("a triangle"), 0.925_371);
    let (border, stage) = (Border::outline(outline.clone()), Stage::new(vec![Border::outline(outline)], clear_m));
    let breach = first_breach(&dragon, &stage, clear_m).expect("no limit").expect("the tail leaves");
    assert!(breach.bench == 9 && (breach.travel_m - 1.309_141).abs() < 1e-6, "{breach:?}");
    let look_m = dragon.dimensions().link_m(9) / 64.0;
    let mut solver = ChainSolver::new(&dragon);
    let mut distance_at = |travel_m: f64| border.distance_m(&boards_at(&dragon, &mut solver, travel_m)[9]);
    assert!(distance_at(breach.travel_m - 0.016) > clear_m && distance_at(breach.travel_m - look_m) < clear_m);
    assert!(came_in_briefly(&dragon, &border, clear_m, &breach));
}

fn square(half_m: f64) -> Outline {
    Outline::new(&[[-half_m, -half_m], [half_m, -half_m], [half_m, half_m], [-half_m, half_m]]).expect("a square")
}

#[test]
fn boards_outside_at_the_start_are_counted_and_do_not_leave_as_they_come_in() {
    // The paper's dragon walks in from the turns outside a circle of 10 m.
    assert!((1..223).contains(&standing_outside(&paper_dragon(), &square(10.0))));
    assert_eq!(standing_outside(&paper_dragon(), &square(20.0)), 0);
    assert_eq!(first_exit(&paper_dragon(), &square(20.0)).expect("no limit"), None);
    // A dragon whose tail is off the stage crosses the stage.
    let dimensions = paper_benches(10);
    let line = PathSpec { segments: vec![PathSegment::Line { length_m: 60.0 }], laps: None };
    let route = RouteSpec::from(line).build(1.0, dimensions.links_m()).expect("valid");
    let dragon = Dragon::new(dimensions, Arc::new(route)).expect("it stands");
    let stage = Outline::new(&[[-5.0, -5.0], [40.0, -5.0], [40.0, 5.0], [-5.0, 5.0]]).expect("a stage");
    assert_eq!(standing_outside(&dragon, &stage), 8);
    let exit = first_exit(&dragon, &stage).expect("no limit").expect("the head leaves");
    assert!(exit.bench == 0 && (exit.travel_m - 39.725).abs() < 1e-8, "{exit:?}");
}

/// The board's sides slide along two edges of the stage for the whole run.
#[test]
fn a_board_that_slides_along_an_edge_does_not_leave() {
    let dimensions = Dimensions::new(5, 3.0, 2.0, 0.4, 0.25).expect("valid");
    let route = Route::clone(
        &RouteSpec::from(PathSpec { segments: vec![PathSegment::Line { length_m: 30.0 }], laps: None })
            .build(1.0, dimensions.links_m())
            .expect("valid"),
    );
    let dragon = Dragon::new(dimensions, Arc::new(route)).expect("it stands").metered(&Meter::of(1_000_000));
    let aisle = |length_m: f64| {
        Outline::new(&[[-20.0, -0.2], [length_m, -0.2], [length_m, 0.2], [-20.0, 0.2]]).expect("an aisle")
    };
    assert_eq!(first_exit(&dragon, &aisle(40.0)), Ok(None));
    let exit = first_exit(&dragon, &aisle(12.0)).expect("enough work").expect("the head leaves");
    assert!((exit.travel_m - 11.75).abs() < 2e-9 && exit.bench == 0, "{exit:?}");
    assert!((exit.point.x - 12.0).abs() < 2e-9, "{exit:?}");
}

#[test]
fn a_corner_of_a_concave_stage_enters_the_side_of_a_board() {
    let arc = PathSegment::Arc { radius_m: 5.0, turn: 3.0 };
    let dimensions = Dimensions::new(3, 3.0, 3.0, 0.4, 0.25).expect("valid");
    let route =
        RouteSpec::from(PathSpec { segments: vec![arc], laps: None }).build(1.0, dimensions.links_m()).expect("valid");
    let dragon = Dragon::new(dimensions, Arc::new(route)).expect("it stands");
    // A spike whose tip lies inside the arc, where only the middle of a board reaches.
    let tip = [4.7, 5.0];
    let outline =
        Outline::new(&[[-12.0, -3.0], [9.0, -3.0], [9.0, 12.0], [-12.0, 12.0], [-12.0, 5.1], tip, [-12.0, 4.9]]);
    let outline = outline.expect("simple");
    let exit = first_exit(&dragon, &outline).expect("no limit").expect("the spike meets a board");
    assert!(exit.point.distance(tip.into()) < 1e-6, "{exit:?}");
}

#[test]
fn outlines_that_are_not_simple_polygons_are_rejected() {
    let of = |corners: &[[f64; 2]]| Outline::new(corners).expect_err("not simple");
    assert_eq!(of(&[[0.0, 0.0], [1.0, 0.0]]), OutlineError::Points { points: 2 });
    assert_eq!(of(&[[0.0, 0.0]; 257]), OutlineError::Points { points: 257 });
    assert_eq!(of(&[[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [4.0, 3.0]]), OutlineError::Crossing { first: 2, second: 4 });
    assert_eq!(of(&[[0.0, 0.0], [4.0, 0.0], [2.0, 0.0]]), OutlineError::Crossing { first: 1, second: 2 });
    assert_eq!(of(&[[0.0, 0.0], [4.0, 0.0], [4.0, 0.0], [0.0, 3.0]]), OutlineError::Repeated { first: 2, second: 3 });
    assert_eq!(of(&[[0.0, 0.0], [4.0, 0.0], [0.0, 3.0], [0.0, 0.0]]), OutlineError::Repeated { first: 1, second: 4 });
    // A corner on another edge.
    let bow = of(&[[0.0, 0.0], [4.0, 0.0], [4.0, 2.0], [2.0, 0.0], [0.0, 2.0]]);
    assert_eq!(bow, OutlineError::Crossing { first: 1, second: 3 });
    assert!(matches!(of(&[[0.0, 0.0], [f64::NAN, 0.0], [0.0, 1.0]]), OutlineError::Coordinate { point: 2, .. }));
}

#[test]
fn a_limit_of_work_ends_the_search() {
    let dragon = paper_dragon().metered(&Meter::of(1000));
    assert!(first_exit(&dragon, &square(14.0)).is_err());
}

fn on_a_line(length_m: f64) -> Dragon {
    let dimensions = Dimensions::new(5, 3.0, 2.0, 0.4, 0.25).expect("valid");
    let line = PathSpec { segments: vec![PathSegment::Line { length_m }], laps: None };
    let route = RouteSpec::from(line).build(1.0, dimensions.links_m()).expect("valid");
    Dragon::new(dimensions, Arc::new(route)).expect("it stands")
}

/// Boards of a straight dragon, 0.4 m wide, are 0.2 m to either side of the line, and reach 0.25 m over the head's handle.
#[test]
fn distances_on_a_straight_line_are_exact() {
    let dragon = on_a_line(30.0);
    let crowd = Border::crowd(&[[-20.0, 2.0], [40.0, 2.0]]).expect("a line");
    let area = |x_m: f64| {
        Border::keep_out(
            Outline::new(&[[x_m, -1.0], [x_m + 1.0, -1.0], [x_m + 1.0, 1.0], [x_m, 1.0]]).expect("an area"),
        )
    };
    let stage = Stage::new(vec![crowd, area(50.0), area(31.25), Border::outline(square(45.0))], 0.5);
    let least = |kind| least_distance(&dragon, &stage, kind).expect("no limit").expect("a board");
    let of_crowd = least(BorderKind::Crowd);
    assert!((of_crowd.distance_m - 1.8).abs() < 1e-12 && of_crowd.border == 3, "{of_crowd:?}");
    let of_area = least(BorderKind::KeepOut);
    assert!((of_area.distance_m - 1.0).abs() < 1e-12 && (of_area.travel_m - 30.0).abs() < 1e-9, "{of_area:?}");
    assert_eq!((of_area.border, of_area.bench, stage.name(of_area.border)), (2, 0, "keep_out area 2".to_owned()));
    let of_outline = least(BorderKind::Outline);
    assert!((of_outline.distance_m - 14.75).abs() < 1e-12, "{of_outline:?}");
    // 2 m before the area the front corners are at 29.25 m.
    let breach = first_breach(&dragon, &stage, 2.0).expect("no limit").expect("too near");
    assert_eq!(
        (breach.border, breach.bench, breach.travel_m),
        (3, 0, 0.0),
        "1.8 m from the crowd from the beginning on"
    );
    let apart = Stage::new(vec![area(31.25)], 2.0);
    let breach = first_breach(&dragon, &apart, 2.0).expect("no limit").expect("too near");
    assert!((breach.travel_m - 29.0).abs() < 1e-8 && (breach.point.x - 29.25).abs() < 1e-8, "{breach:?}");
    assert_eq!(first_breach(&dragon, &apart, 1.0), Ok(None), "exactly as near as allowed");
}

#[test]
fn lines_of_a_crowd_are_rejected_if_they_have_one_point_or_stand_still() {
    let of = |points: &[[f64; 2]]| Border::crowd(points).expect_err("not a line");
    assert_eq!(of(&[[0.0, 0.0]]), OutlineError::LinePoints { points: 1 });
    assert_eq!(of(&[[0.0, 0.0]; 257]), OutlineError::LinePoints { points: 257 });
    assert_eq!(of(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]]), OutlineError::Repeated { first: 2, second: 3 });
    assert!(matches!(of(&[[0.0, 0.0], [1.0, 1e7]]), OutlineError::Coordinate { point: 2, .. }));
    // It may cross itself.
    assert!(Border::crowd(&[[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, -1.0]]).is_ok());
}

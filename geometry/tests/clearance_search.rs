//! The search for near pairs, compared with all pairs. Its result must not depend on earlier searches.

use std::f64::consts::TAU;
use std::sync::Arc;

use bench_dragon_geometry::clearance::{ClearanceSearch, PairClearance};
use bench_dragon_geometry::dragon::{Board, ChainSolver, Dragon};
use bench_dragon_geometry::formation::Layout;
use bench_dragon_geometry::route::{Route, Turnaround};
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::{boards, paper_benches};
use test_support::property::random_cases;

/// Largest clearance of the pairs to compare for a dragon, in metres. Some pair is always nearer.
const FAR_M: f64 = 3.0;

/// Sets of boards, from a heap in which most boards overlap to a few boards far apart.
fn board_sets() -> impl Strategy<Value = Vec<Board>> {
    (0.5..60.0_f64).prop_flat_map(|spread_m| prop::collection::vec(boards(spread_m), 0..60))
}

/// Moves of the boards from one search to the next: largest distance, and turn.
fn moves() -> impl Strategy<Value = Vec<(f64, f64)>> {
    prop::collection::vec((prop_oneof![Just(0.0), 1e-6..1e-2_f64, 1e-2..10.0_f64], 0.0..TAU), 1..40)
}

/// Moves each board in its own direction, and rotates it about its centre.
fn moved(boards: &mut [Board], far_m: f64, turn: f64) {
    for (board, i) in boards.iter_mut().zip(0..) {
        let direction = DVec2::from_angle(turn * f64::from(i));
        board.centre += far_m * direction;
        board.heading = board.heading.rotate(DVec2::from_angle(far_m * direction.y));
    }
}

/// All pairs of the boards of one dragon.
fn all_pairs(boards: &[Board], far_m: f64) -> Vec<PairClearance> {
    all_pairs_of(boards, far_m, |first, second| second == first + 1)
}

/// All pairs but those that share a hinge.
fn all_pairs_of(boards: &[Board], far_m: f64, share_a_hinge: impl Fn(usize, usize) -> bool) -> Vec<PairClearance> {
    let mut pairs = Vec::new();
    for first in 0..boards.len() {
        for second in (first + 1..boards.len()).filter(|&second| !share_a_hinge(first, second)) {
            let (ours, theirs) = (&boards[first], &boards[second]);
            if ours.centre.distance(theirs.centre) - ours.radius_m() - theirs.radius_m() <= far_m {
                let approach = ours.approach(theirs);
                let benches = [first, second];
                pairs.push(PairClearance { benches, clearance_m: approach.clearance_m, point: approach.point });
            }
        }
    }
    pairs.sort_by(|a, b| a.clearance_m.total_cmp(&b.clearance_m));
    let equal = |a: &PairClearance, b: &PairClearance| b.clearance_m - a.clearance_m <= EQUAL_M;
    let mut begin = 0;
    while begin < pairs.len() {
        let count = pairs[begin..].iter().take_while(|pair| equal(&pairs[begin], pair)).count();
        pairs[begin..begin + count].sort_by_key(|pair| pair.benches);
        begin += count;
    }
    pairs
}

/// Clearances that differ by less are equal: then the order of pairs is that of their indices.
const EQUAL_M: f64 = 1e-10;

fn assert_finds_all(search: &mut ClearanceSearch, boards: &[Board], reach_m: f64, far_m: f64) {
    assert_finds(search, boards, reach_m, &all_pairs(boards, far_m));
}

/// Compares all three methods with all pairs, in an order that must not affect the results.
fn assert_finds(search: &mut ClearanceSearch, boards: &[Board], reach_m: f64, pairs: &[PairClearance]) {
    let within: Vec<_> = pairs.iter().filter(|pair| pair.clearance_m <= reach_m).copied().collect();
    let nearest = pairs.first().copied();
    let both = if within.is_empty() { nearest.into_iter().collect() } else { within.clone() };
    assert_eq!(search.nearest_and_within(boards, reach_m), &both[..], "nearest and within {reach_m} m");
    assert_eq!(search.within(boards, reach_m), &within[..], "within {reach_m} m");
    assert_eq!(search.nearest(boards), nearest, "nearest");
}

proptest! {
    #![proptest_config(random_cases(256))]

    #[test]
    fn search_finds_the_same_as_all_pairs(
        sets in prop::collection::vec(board_sets(), 1..4),
        reach_m in -0.2..3.0_f64,
    ) {
        let mut search = ClearanceSearch::default();
        for boards in &sets {
            assert_finds_all(&mut search, boards, reach_m, f64::INFINITY);
        }
    }

    #[test]
    fn boards_that_move_are_found_after_any_earlier_position(
        mut boards in board_sets(),
        moves in moves(),
        reach_m in -0.2..1.0_f64,
    ) {
        let mut search = ClearanceSearch::default();
        for (far_m, turn) in moves {
            moved(&mut boards, far_m, turn);
            assert_finds_all(&mut search, &boards, reach_m, f64::INFINITY);
        }
    }

    #[test]
    fn pairs_within_and_between_dragons_are_found(
        dragons in prop::collection::vec(1..12_usize, 1..8),
        spread_m in 0.5..60.0_f64,
        moves in moves(),
        reach_m in -0.2..1.0_f64,
        boards in prop::collection::vec(boards(1.0), 77),
    ) {
        let layout = Layout::of(dragons.iter().copied());
        let dragon_of: Vec<usize> = (0..).zip(&dragons).flat_map(|(dragon, &benches)| vec![dragon; benches]).collect();
        prop_assert_eq!((layout.benches(), layout.dragons()), (dragon_of.len(), dragons.len()));
        let spread = |board: Board| Board { centre: spread_m * board.centre, ..board };
        let mut boards: Vec<Board> = boards.into_iter().take(layout.benches()).map(spread).collect();
        let mut search = ClearanceSearch::of(&layout);
        for (far_m, turn) in moves {
            moved(&mut boards, far_m, turn);
            let share_a_hinge = |first, second| second == first + 1 && dragon_of[first] == dragon_of[second];
            assert_finds(&mut search, &boards, reach_m, &all_pairs_of(&boards, f64::INFINITY, share_a_hinge));
        }
    }

    #[test]
    fn boards_far_from_the_origin_are_found_too(
        mut boards in board_sets(),
        moves in moves(),
        exponent in 2.0..9.0_f64,
    ) {
        let mut search = ClearanceSearch::default();
        for board in &mut boards {
            board.centre += 10.0_f64.powf(exponent) * DVec2::new(1.0, -0.7);
        }
        for (far_m, turn) in moves {
            moved(&mut boards, far_m, turn);
            assert_finds_all(&mut search, &boards, 0.025, f64::INFINITY);
        }
    }

    #[test]
    fn a_change_of_sizes_or_number_starts_a_new_list(boards in board_sets(), grown in 1.0..2.0_f64, fewer in 0..60_usize) {
        let mut search = ClearanceSearch::default();
        assert_finds_all(&mut search, &boards, 0.1, f64::INFINITY);
        let larger: Vec<Board> = boards.iter().map(|&board| Board { half_width: grown * board.half_width, ..board }).collect();
        assert_finds_all(&mut search, &larger, 0.1, f64::INFINITY);
        assert_finds_all(&mut search, &larger[..fewer.min(larger.len())], 0.1, f64::INFINITY);
    }
}

/// Walks one millimetre per step, then twenty times as fast, and seeks in between.
fn assert_finds_all_of(benches: usize, route: Arc<Route>, stands_m: &[f64]) {
    let dimensions = paper_benches(benches);
    let dragon = Dragon::new(dimensions, route).expect("the dragon stands on its route");
    let (mut solver, mut boards) = (ChainSolver::new(&dragon), Vec::new());
    let mut search = ClearanceSearch::default();
    for stand_m in stands_m {
        for step in 0..20 {
            let walked_m = 0.001 * f64::from(step) + 0.02 * f64::from((step - 14).max(0));
            let handles = solver.solve(&dragon, stand_m + walked_m).expect("the stands lie within the run");
            dragon.place_boards(handles, &mut boards);
            assert_finds_all(&mut search, &boards, 0.025, FAR_M);
        }
    }
}

#[test]
fn every_pair_of_a_spiral_is_found() {
    for benches in [3, 4, 12, 223] {
        let spiral = Route::spiral(0.55, 16.0).expect("the paper's spiral is valid");
        assert_finds_all_of(benches, Arc::new(spiral), &[0.0, 409.82, 200.0, 412.46, 411.0, 425.0]);
    }
}

#[test]
fn every_pair_of_a_turnaround_is_found() {
    for benches in [3, 60, 223] {
        let turnaround = Turnaround::new(1.7, 9.0, 2.0).expect("the paper's turnaround is valid");
        assert_finds_all_of(benches, Arc::new(turnaround.route()), &[-90.0, 14.48, 0.0, 60.0]);
    }
}

/// Rounding differs between a solved chain, a stepped one and a part of one. It moves the boards here by up to 10⁻¹² m.
#[test]
fn of_boards_that_overlap_alike_the_first_are_named_whatever_the_rounding() {
    let board = |index: u32, nudge_m: f64| {
        let angle = |index: u32| DVec2::from_angle(TAU * f64::from(index) / 22.5);
        let nudge = nudge_m * DVec2::from_angle(f64::from(index) * nudge_m * 1e15);
        Board::from_handles(6.0 * angle(index) + nudge, 6.0 * angle(index + 1) + nudge, 2.2, 0.3)
    };
    for step in 0..100 {
        let boards: Vec<Board> = (0..60).map(|index| board(index, 1e-14 * f64::from(step))).collect();
        let mut search = ClearanceSearch::default();
        let nearest = search.nearest(&boards).expect("many pairs");
        assert!(nearest.clearance_m < -0.1, "{nearest:?}");
        // Half a board further on a lap, boards lie askew and overlap deeper than in the same place.
        assert_eq!(nearest.benches, [0, 22], "at step {step}");
        let overlaps = search.within(&boards, 0.0);
        assert_eq!(overlaps[0].benches, nearest.benches, "at step {step}");
        assert!(overlaps.len() > 30, "{}", overlaps.len());
    }
}

#[test]
fn every_pair_of_a_long_dragon_is_found() {
    let spiral = Route::spiral(0.55, 16.0).expect("the paper's spiral is valid");
    assert_finds_all_of(2_230, Arc::new(spiral), &[410.0]);
}

#[test]
fn neighbours_are_not_a_pair() {
    let board = |x| Board::from_handles(DVec2::new(x, 0.0), DVec2::new(x - 1.0, 0.0), 1.4, 0.3);
    let mut search = ClearanceSearch::default();
    assert_eq!(search.nearest(&[board(1.0), board(0.0)]), None);
    let nearest = search.nearest(&[board(2.0), board(1.0), board(0.0)]).expect("one pair");
    assert_eq!(nearest.benches, [0, 2]);
    assert!((nearest.clearance_m - 0.6).abs() < 1e-15);
}

#[test]
fn a_board_without_a_position_is_in_no_pair_until_it_has_one() {
    let board = |x| Board::from_handles(DVec2::new(x, 0.0), DVec2::new(x - 1.0, 0.0), 1.4, 0.3);
    let boards = [3.0, 2.0, 1.0, 0.0].map(board);
    let nowhere = Board { centre: DVec2::NAN, ..boards[3] };
    let mut search = ClearanceSearch::default();
    let mut nearest = |boards: &[Board]| search.nearest_and_within(boards, 1.0).to_vec();
    assert_eq!(nearest(&[nowhere; 4]), []);
    for _ in 0..3 {
        assert_eq!(nearest(&[boards[0], boards[1], boards[2], nowhere]).len(), 1, "0 with 2");
        assert_eq!(nearest(&boards).len(), 2, "0 with 2, 1 with 3");
    }
}

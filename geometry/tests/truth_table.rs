//! The known values of the paper's dragon. The head walks at 1 m/s, so travel in metres is time in seconds.

use bench_dragon_geometry::clearance::{ClearanceSearch, PairClearance, first_contact};
use bench_dragon_geometry::dragon::{ChainSolver, Dragon, FeasibleEnd};
use test_support::dragons::{assert_near, boards_at, paper_dragon};

fn nearest_pair(dragon: &Dragon, travel_m: f64) -> PairClearance {
    ClearanceSearch::default().nearest(&boards_at(dragon, travel_m)).expect("the dragon has pairs")
}

#[test]
fn head_has_the_positions_of_the_table() {
    let dragon = paper_dragon();
    let table = [
        (0.0, 8.800_000, 0.000_000),
        (60.0, 5.799_209, -5.771_092),
        (120.0, -4.084_887, -6.304_479),
        (180.0, -2.963_609, 6.094_780),
        (240.0, 2.594_494, -5.356_743),
        (300.0, 4.420_274, 2.320_429),
    ];
    for (time_s, x, y) in table {
        let head = dragon.chain(time_s).expect("within the run").next().expect("a head");
        assert_near(head.position, x, y, &format!("the head at {time_s} s"));
        assert_eq!(head.speed_ratio, 1.0);
    }
}

#[test]
fn handles_behind_have_the_positions_and_speeds_of_the_table() {
    let dragon = paper_dragon();
    let mut solver = ChainSolver::new(&dragon);
    let handles = solver.solve(&dragon, 300.0).expect("within the run");
    let table = [(1, 2.459_489, 4.402_476, 0.999_709), (223, 1.785_033, 9.301_164, 0.996_478)];
    for (index, x, y, speed) in table {
        assert_near(handles[index].position, x, y, &format!("handle {index}"));
        let actual = handles[index].speed_ratio;
        assert!((actual - speed).abs() <= 5.001e-7, "handle {index} has speed {actual}, not {speed}");
    }
}

#[test]
fn head_first_touches_bench_8() {
    let dragon = paper_dragon();
    let contact =
        first_contact(&dragon, 0.0, dragon.end_travel_m()).expect("no limit").expect("the dragon touches itself");
    assert_eq!(contact.benches, [0, 8]);
    assert!((contact.travel_m - 412.473_838).abs() <= 5.001e-7, "first contact at {} m", contact.travel_m);
    let boards = nearest_pair(&dragon, contact.travel_m);
    assert!(boards.clearance_m.abs() < 1e-10, "clearance at the contact is {} m", boards.clearance_m);
}

#[test]
fn near_miss_of_bench_11_is_not_a_contact() {
    let dragon = paper_dragon();
    assert_eq!(first_contact(&dragon, 0.0, 412.47).expect("no limit"), None);
    let least = (0..=2000)
        .map(|step| 408.832 + 0.001 * f64::from(step))
        .map(|travel_m| (travel_m, nearest_pair(&dragon, travel_m)))
        .filter(|(travel_m, _)| *travel_m < 410.832)
        .min_by(|(_, a), (_, b)| a.clearance_m.total_cmp(&b.clearance_m))
        .expect("there are samples");
    assert_eq!(least.1.benches, [0, 11]);
    assert!((least.0 - 409.832).abs() < 1.5e-3, "near miss at {} m", least.0);
    assert!((least.1.clearance_m - 0.000_865).abs() <= 5.1e-7, "near miss of {} m", least.1.clearance_m);
}

#[test]
fn clearances_equal_the_table() {
    let dragon = paper_dragon();
    let table = [
        (0.0, 0.169_279, None),
        (100.0, 0.157_908, None),
        (200.0, 0.164_999, Some([5, 32])),
        (300.0, 0.120_694, Some([0, 21])),
        (400.0, 0.025_533, Some([0, 10])),
    ];
    for (time_s, clearance_m, benches) in table {
        let nearest = nearest_pair(&dragon, time_s);
        let actual = nearest.clearance_m;
        assert!((actual - clearance_m).abs() <= 5.001e-7, "clearance at {time_s} s is {actual}, not {clearance_m}");
        assert!(
            benches.is_none_or(|benches| benches == nearest.benches),
            "the nearest pair at {time_s} s is {nearest:?}"
        );
    }
}

#[test]
fn feasible_travel_ends_at_the_stop_of_handle_1() {
    let dragon = paper_dragon();
    assert_eq!(dragon.feasible_end(), FeasibleEnd::HandleStops { handle: 1 });
    assert!((dragon.end_travel_m() - 432.758_134).abs() <= 5.001e-7, "the run ends at {} m", dragon.end_travel_m());
    assert!(dragon.chain(dragon.end_travel_m()).is_ok());
    let error = dragon.chain(440.0).expect_err("beyond the run's end");
    assert!(error.to_string().starts_with("travel_m is 440, must be from 0 to 432.7"), "{error}");
}

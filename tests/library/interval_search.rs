//! The report of a search that finds no frame in a recording.

use std::path::Path;

use bench_dragon::recording::{Flaws, IntervalSearch, ShowInterval};

#[test]
fn a_search_without_a_result_reports_the_recorded_show_times() {
    let mut search = IntervalSearch::new(ShowInterval { from_ns: 5_000_000_000, to_ns: i64::MAX });
    let path = Path::new("dance.mcap");
    let told = |flaws| IntervalSearch::new(ShowInterval::ALL).nothing_found(path, flaws).to_string();
    assert_eq!(told(Flaws::default()), "dance.mcap holds no frames");
    let flaws = Flaws { cut: true, skipped_bytes: 7 };
    assert_eq!(told(flaws), "dance.mcap holds no frames: 7 bytes of it are damaged, and it stops in the middle");
    assert!(!search.comes_by(3_000_000_000) && !search.comes_by(1_000_000_000));
    let told = "dance.mcap holds no frames from 5 s: its show times are from 1 s to 3 s";
    assert_eq!(search.nothing_found(path, Flaws::default()).to_string(), told);
    assert!(search.comes_by(5_000_000_000));
}

//! The reports of a receiver's outage.

use bench_dragon::bridge::{Outage, OutageChange};

/// Time without an error after which the outage counts as over.
const CALM_NS: u64 = 3_000_000_000;

#[test]
fn an_outage_is_reported_once_and_its_end_after_a_time_without_errors() {
    let mut outage = Outage::default();
    assert_eq!(outage.note(false, 0), None);
    assert_eq!(outage.note(true, 1), Some(OutageChange::Began));
    assert_eq!(outage.note(true, 2), None);
    assert_eq!(outage.note(false, 3), None);
    assert_eq!(outage.note(true, 4), None, "a short time without errors does not end the outage");
    assert_eq!(outage.note(false, 3 + CALM_NS), None);
    assert_eq!(outage.note(false, 4 + CALM_NS), Some(OutageChange::Ended { failed_frames: 3 }));
    assert_eq!(outage.note(false, 5 + CALM_NS), None);
    assert_eq!(outage.note(true, 6 + CALM_NS), Some(OutageChange::Began));
}

//! Due times of a server's ticks.

use bench_dragon::source::server::schedule::Schedule;

#[test]
fn periods_are_counted_from_the_epoch_without_drift() {
    let mut schedule = Schedule::new(5, 3);
    assert_eq!((schedule.rate_hz(), schedule.due_ns()), (3, 5));
    let mut next_due_ns = || {
        assert_eq!(schedule.advance(0), 0);
        schedule.due_ns()
    };
    let due: Vec<u64> = (0..6).map(|_| next_due_ns()).collect();
    assert_eq!(due, [333_333_338, 666_666_671, 1_000_000_005, 1_333_333_338, 1_666_666_671, 2_000_000_005]);
    assert_eq!(schedule.overruns(), 0);
}

#[test]
fn the_number_of_a_period_follows_from_its_due_instant() {
    for rate_hz in [1, 3, 60, 1000, 99_991, 100_000] {
        for period in [0, 1, 2, 59, 1_000_003, 8_640_000_000] {
            let since_epoch_ns = (u128::from(period) * 1_000_000_000 / u128::from(rate_hz)) as u64;
            let due_ns = 77 + since_epoch_ns;
            assert_eq!(Schedule::nearest_period(77, rate_hz, due_ns), Some((period, 0)), "{rate_hz} Hz");
            assert_eq!(Schedule::nearest_period(77, rate_hz, due_ns + 1), Some((period, 1)), "{rate_hz} Hz");
            assert_eq!(Schedule::from_epoch_ns(period, rate_hz), Some(since_epoch_ns), "{rate_hz} Hz");
        }
    }
    assert_eq!(Schedule::nearest_period(77, 1000, 76), None, "before the epoch");
    assert_eq!(Schedule::nearest_period(0, 1, u64::MAX), Some((18_446_744_074, 290_448_385)));
    assert_eq!(Schedule::from_epoch_ns(u64::MAX, 1), None);
}

#[test]
fn a_long_tick_misses_the_periods_that_have_begun_and_counts_them() {
    let mut schedule = Schedule::new(0, 1000);
    assert_eq!((schedule.advance(2_500_000), schedule.due_ns()), (2, 3_000_000), "periods 1 and 2 have begun");
    assert_eq!(schedule.overruns(), 2);
    assert_eq!((schedule.advance(3_000_001), schedule.due_ns()), (0, 4_000_000));
    assert_eq!(schedule.overruns(), 2);
}

#[test]
fn a_period_that_begins_now_is_not_missed() {
    let mut schedule = Schedule::new(0, 3);
    let due = schedule.due_ns() + 333_333_333;
    assert_eq!((schedule.advance(due), schedule.due_ns()), (0, due));
    assert_eq!(schedule.overruns(), 0);
}

#[test]
fn hours_of_suspension_are_skipped_at_once() {
    let mut schedule = Schedule::new(0, 10_000);
    let now = 7_200_000_000_000;
    assert_eq!((schedule.advance(now), schedule.due_ns()), (71_999_999, now));
    assert_eq!(schedule.overruns(), 71_999_999);
}

#[test]
#[should_panic(expected = "the rate must be above 0")]
fn a_schedule_without_periods_is_a_fault_of_the_caller() {
    let _ = Schedule::new(0, 0);
}

//! The clocks: `CLOCK_MONOTONIC` for all times that are compared, the wall clock only for dates.

use std::num::NonZeroU64;
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use rustix::io::Errno;
use rustix::thread::{clock_nanosleep_absolute, set_current_timer_slack};
use rustix::time::{ClockId, Timespec, clock_gettime};

use super::unix_offset::{OffsetBounds, UnixOffset};

const NANOS_PER_SECOND: u64 = 1_000_000_000;

/// `CLOCK_MONOTONIC`, in nanoseconds.
pub fn monotonic_ns() -> u64 {
    let now = clock_gettime(ClockId::Monotonic);
    now.tv_sec as u64 * NANOS_PER_SECOND + now.tv_nsec as u64
}

/// The wall clock: nanoseconds since 1970-01-01 00:00 UTC. From 2262 on, the greatest number of them.
pub fn unix_ns() -> i64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, whole_ns)
}

fn whole_ns(time: Duration) -> i64 {
    i64::try_from(time.as_nanos()).unwrap_or(i64::MAX)
}

/// Present difference of Unix time and `CLOCK_MONOTONIC`, in nanoseconds, to within the duration of a clock reading.
pub fn unix_minus_monotonic_ns() -> i64 {
    UnixOffset::measured().ns()
}

/// Reads the wall clock between two readings of `CLOCK_MONOTONIC`.
pub fn offset_bounds() -> OffsetBounds {
    let before_ns = monotonic_ns();
    let unix_ns = unix_ns();
    OffsetBounds::new(before_ns, unix_ns, monotonic_ns())
}

/// Makes the sleeps of this thread precise. By default, the kernel may add 50 µs to a sleep to save a wake-up.
pub fn sleep_precisely() {
    // If the kernel refuses, the sleeps stay imprecise, and the lateness shows this.
    let _ = set_current_timer_slack(NonZeroU64::new(1));
}

/// Keeps the processor busy until `CLOCK_MONOTONIC` reaches `deadline_ns`. Returns the clock at the end.
pub fn spin_until(deadline_ns: u64) -> u64 {
    loop {
        let now_ns = monotonic_ns();
        if now_ns >= deadline_ns {
            return now_ns;
        }
        std::hint::spin_loop();
    }
}

/// Sleeps until `CLOCK_MONOTONIC` reaches `deadline_ns`. Returns false if a signal ended the sleep early.
pub fn sleep_until(deadline_ns: u64) -> bool {
    let deadline =
        Timespec { tv_sec: (deadline_ns / NANOS_PER_SECOND) as i64, tv_nsec: (deadline_ns % NANOS_PER_SECOND) as i64 };
    !matches!(clock_nanosleep_absolute(ClockId::Monotonic, &deadline), Err(Errno::INTR))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wall_clock_beyond_2262_stands_at_the_last_time_that_fits() {
        assert_eq!(whole_ns(Duration::from_secs(1)), 1_000_000_000);
        assert_eq!(whole_ns(Duration::from_hours(300 * 365 * 24)), i64::MAX);
    }
}

//! Whether a sleep can end between two of the kernel's ticks.

use rustix::time::{ClockId, clock_getres};

use super::{Check, Finding, Patient};

/// A timer that is coarser than this makes ticks late.
const COARSEST_NS: i64 = 1_000;

/// The kernel's timers.
pub(super) struct Timers;

impl Check for Timers {
    fn name(&self) -> &'static str {
        "timers"
    }

    fn examine(&self, _: &Patient) -> Finding {
        let resolution = clock_getres(ClockId::Monotonic);
        judge(resolution.tv_sec * 1_000_000_000 + resolution.tv_nsec)
    }
}

fn judge(resolution_ns: i64) -> Finding {
    let value = format!("{resolution_ns} ns");
    if resolution_ns > COARSEST_NS {
        return Finding::problem(
            value,
            format!("sleeps end at multiples of {resolution_ns} ns"),
            "boot without highres=off, or a kernel that is built with CONFIG_HIGH_RES_TIMERS",
        );
    }
    Finding::ok(value, "sleeps end when they are due")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn timers_of_a_kernel_tick_are_a_problem() {
        assert_eq!(judge(4_000_000).status, Verdict::Problem);
        assert_eq!(judge(1).status, Verdict::Ok);
    }
}

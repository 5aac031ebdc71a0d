//! How much of each second the kernel lets real-time threads run.

use std::fs;

use super::{Check, Finding, Patient};

/// Below this part of the time a server that spins before its releases would be held up.
const LEAST_PART: f64 = 0.9;

/// Real-time throttling.
pub(super) struct Throttling;

impl Check for Throttling {
    fn name(&self) -> &'static str {
        "real-time throttling"
    }

    fn examine(&self, _: &Patient) -> Finding {
        let read = |name: &str| fs::read_to_string(format!("/proc/sys/kernel/{name}")).ok()?.trim().parse().ok();
        judge(read("sched_rt_runtime_us"), read("sched_rt_period_us"))
    }
}

fn judge(runtime_us: Option<i64>, period_us: Option<i64>) -> Finding {
    let (Some(runtime_us), Some(period_us)) = (runtime_us, period_us) else {
        return Finding::not_known("/proc/sys/kernel/sched_rt_runtime_us cannot be read");
    };
    if runtime_us < 0 {
        return Finding::ok("-1", "real-time threads are never held up");
    }
    let part = runtime_us as f64 / period_us as f64;
    let message = format!("real-time threads may run {:.0} % of the time", part * 100.0);
    if part < LEAST_PART {
        return Finding::warning(runtime_us.to_string(), message, "`sysctl kernel.sched_rt_runtime_us=950000`");
    }
    Finding::ok(runtime_us.to_string(), message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn the_kernels_own_share_is_well_and_a_half_is_not() {
        let judged = |runtime_us| judge(Some(runtime_us), Some(1_000_000)).status;
        assert_eq!(judged(950_000), Verdict::Ok);
        assert_eq!(judged(-1), Verdict::Ok);
        assert_eq!(judged(500_000), Verdict::Warning);
        assert_eq!(judge(None, None).status, Verdict::NotKnown);
    }
}

//! Checks of real-time scheduling: the priority that this user can get, and the time for which real-time threads may run.

use std::fs;
use std::io;
use std::thread;

use rustix::process::{Resource, getrlimit};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

use super::{Finding, Target};

/// Smallest share of the time for real-time threads. With less, the kernel would throttle a server that spins.
const LEAST_PART: f64 = 0.9;

/// Whether this user can get a real-time priority. The check requests one, because limits, capabilities and control groups all
/// affect the result.
pub(super) fn priority(_: &Target) -> Finding {
    let asking = thread::Builder::new().spawn(take_least_priority);
    let tried = asking.and_then(|asking| asking.join().expect("requesting a priority does not panic"));
    judge_priority(tried, getrlimit(Resource::Rtprio).current)
}

/// Requests the least priority of `SCHED_FIFO` for this thread.
fn take_least_priority() -> io::Result<()> {
    let least = ThreadPriorityValue::try_from(1_u8).expect("priority 1 is valid");
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(least), policy).map_err(|error| {
        match error {
            thread_priority::Error::OS(code) => io::Error::from_raw_os_error(code),
            other => io::Error::other(format!("{other:?}")),
        }
    })
}

fn judge_priority(tried: io::Result<()>, limit: Option<u64>) -> Finding {
    let limit = limit.map_or_else(|| "unlimited".to_owned(), |limit| limit.to_string());
    match tried {
        Ok(()) => Finding::ok(limit, "SCHED_FIFO was tried and granted"),
        Err(error) => Finding::warning(
            limit,
            format!("SCHED_FIFO was tried and refused ({error}): other programs can delay the server"),
            "set rtprio 80 in /etc/security/limits.d/ for this user and log in again, or LimitRTPRIO=80 in the unit",
        ),
    }
}

/// The share of the time for which the kernel lets real-time threads run.
pub(super) fn throttling(_: &Target) -> Finding {
    let read = |name: &str| fs::read_to_string(format!("/proc/sys/kernel/{name}")).ok()?.trim().parse().ok();
    judge_throttling(read("sched_rt_runtime_us"), read("sched_rt_period_us"))
}

fn judge_throttling(runtime_us: Option<i64>, period_us: Option<i64>) -> Finding {
    let (Some(runtime_us), Some(period_us)) = (runtime_us, period_us) else {
        return Finding::not_known("/proc/sys/kernel/sched_rt_runtime_us cannot be read");
    };
    if runtime_us < 0 {
        return Finding::ok("-1", "real-time threads are never throttled");
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
    use crate::cli::doctor::finding::Verdict;

    #[test]
    fn the_outcome_of_the_request_counts_and_not_the_limit() {
        assert_eq!(judge_priority(Ok(()), Some(0)).status, Verdict::Ok);
        let finding = judge_priority(Err(io::ErrorKind::PermissionDenied.into()), Some(99));
        assert_eq!((finding.status, finding.value.as_str()), (Verdict::Warning, "99"));
    }

    #[test]
    fn the_default_share_is_ok_and_a_half_is_a_warning() {
        let judged = |runtime_us| judge_throttling(Some(runtime_us), Some(1_000_000)).status;
        assert_eq!(judged(950_000), Verdict::Ok);
        assert_eq!(judged(-1), Verdict::Ok);
        assert_eq!(judged(500_000), Verdict::Warning);
        assert_eq!(judge_throttling(None, None).status, Verdict::NotKnown);
    }
}

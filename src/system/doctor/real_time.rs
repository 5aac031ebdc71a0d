//! Whether this user gets a real-time priority: tried out, because limits, capabilities and control groups all have a say.

use std::io;
use std::thread;

use rustix::process::{Resource, getrlimit};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

use super::{Check, Finding, Patient};

/// The real-time priority.
pub(super) struct RealTime;

impl Check for RealTime {
    fn name(&self) -> &'static str {
        "real-time priority"
    }

    fn examine(&self, _: &Patient) -> Finding {
        let asking = thread::Builder::new().spawn(take_least_priority);
        let tried = asking.and_then(|asking| asking.join().expect("asking for a priority does not panic"));
        judge(tried, getrlimit(Resource::Rtprio).current)
    }
}

/// Asks for the least priority of `SCHED_FIFO` for this thread.
fn take_least_priority() -> io::Result<()> {
    let least = ThreadPriorityValue::try_from(1_u8).expect("the least priority is one of the kernel's");
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Crossplatform(least), policy).map_err(|error| {
        match error {
            thread_priority::Error::OS(code) => io::Error::from_raw_os_error(code),
            other => io::Error::other(format!("{other:?}")),
        }
    })
}

fn judge(tried: io::Result<()>, limit: Option<u64>) -> Finding {
    let limit = limit.map_or_else(|| "unlimited".to_owned(), |limit| limit.to_string());
    match tried {
        Ok(()) => Finding::ok(limit, "SCHED_FIFO was tried and granted"),
        Err(error) => Finding::warning(
            limit,
            format!("SCHED_FIFO was tried and refused ({error}): other programs delay the server"),
            "rtprio 80 in /etc/security/limits.d/ for this user, then log in again, or LimitRTPRIO=80 in the unit",
        ),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::system::doctor::Verdict;

    #[test]
    fn what_was_granted_counts_and_not_the_limit() {
        assert_eq!(judge(Ok(()), Some(0)).status, Verdict::Ok);
        let finding = judge(Err(io::ErrorKind::PermissionDenied.into()), Some(99));
        assert_eq!((finding.status, finding.value.as_str()), (Verdict::Warning, "99"));
    }
}

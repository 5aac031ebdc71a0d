//! Requests to the kernel that help the loop to keep its schedule: a processor, a real-time priority, locked memory.
//!
//! The requests apply to the calling thread; locked memory applies to the whole process. A rejected request is
//! reported, and the loop runs without it: a show with occasional late frames is better than none.

use std::hint::black_box;
use std::io;

use rustix::mm::{MlockAllFlags, mlockall};
use rustix::process::{Resource, getrlimit};
use rustix::thread::{CapabilitySet, capabilities};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadPriorityValue, ThreadSchedulePolicy,
    set_thread_priority_and_policy, thread_native_id,
};

use crate::config::{Config, Priority};
use crate::system::clock::sleep_precisely;
use crate::system::processors::keep_on;

/// Stack that the loop may use without a page fault: several times the need of a seek, which uses the most.
const STACK_BYTES: usize = 256 << 10;

/// Requests the configured processor and priority for the calling thread, and locks memory for a real-time priority.
/// Reports all rejected requests in one warning.
pub(super) fn settle(config: &Config) {
    sleep_precisely();
    let mut refused = Vec::new();
    if let Some(cpu) = config.tables().serve.cpu {
        refused.extend(keep_on(cpu).err().map(|error| format!("cpu {cpu} ({error})")));
    }
    let mut missing = Vec::new();
    if let Some(level) = config.tables().serve.priority.real_time() {
        touch_stack();
        if let Err(error) = lock_memory() {
            refused.push(format!("locked memory ({error})"));
            missing.push("memlock unlimited (LimitMEMLOCK=infinity)".to_owned());
        }
        if let Err(error) = take_priority(config.tables().serve.priority, level) {
            refused.push(format!("priority {} ({error})", config.tables().serve.priority));
            missing.push(format!("rtprio {level} (LimitRTPRIO={level})"));
        }
    }
    if !refused.is_empty() {
        let refused = refused.join(" and ");
        let advice = match missing.join(" and ") {
            none if none.is_empty() => String::new(),
            limits => format!("; grant {limits}, as packaging/limits.conf and the systemd unit do"),
        };
        tracing::warn!("running without {refused}{advice}");
    }
}

/// Grows the stack and maps its pages before the first tick.
#[allow(clippy::large_stack_arrays, reason = "the function exists to use stack")]
fn touch_stack() {
    black_box(&[0_u8; STACK_BYTES]);
}

/// Locks all memory of the process, and maps every page of it now. Otherwise the loop would cause a page fault at each
/// new page of shared memory.
///
/// Later mappings are locked too, but only where the process has no limit of locked memory. Under a limit, the mapping
/// for a new reader could exceed it and fail.
fn lock_memory() -> io::Result<()> {
    let unlimited = getrlimit(Resource::Memlock).current.is_none()
        || capabilities(None).is_ok_and(|sets| sets.effective.contains(CapabilitySet::IPC_LOCK));
    let flags = if unlimited { MlockAllFlags::CURRENT | MlockAllFlags::FUTURE } else { MlockAllFlags::CURRENT };
    Ok(mlockall(flags)?)
}

fn take_priority(priority: Priority, level: u8) -> io::Result<()> {
    let policy = match priority {
        Priority::Other => return Ok(()),
        Priority::Fifo(_) => RealtimeThreadSchedulePolicy::Fifo,
        Priority::RoundRobin(_) => RealtimeThreadSchedulePolicy::RoundRobin,
    };
    let value = ThreadPriorityValue::try_from(level).expect("the kernel accepts every valid priority");
    set_thread_priority_and_policy(
        thread_native_id(),
        ThreadPriority::Crossplatform(value),
        ThreadSchedulePolicy::Realtime(policy),
    )
    .map_err(|error| match error {
        thread_priority::Error::OS(code) => io::Error::from_raw_os_error(code),
        other => io::Error::other(format!("{other:?}")),
    })
}

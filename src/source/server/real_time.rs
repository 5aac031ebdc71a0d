//! What the loop asks of the kernel to keep its schedule: a processor, a real-time priority, memory that stays.
//!
//! Everything here is about the thread that asks, but for the memory, which is the process's. What is not granted is reported,
//! and the loop runs without it: a show that is late now and then is better than none.

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

/// Stack that the loop may use without a page fault: several times what a seek takes, the deepest that it does.
const STACK_BYTES: usize = 256 << 10;

/// Asks for what the configuration says, for this thread, and warns in one line of what is not granted.
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

/// Grows the stack and has it in memory before the first tick.
#[allow(clippy::large_stack_arrays, reason = "the stack is what this is about")]
fn touch_stack() {
    black_box(&[0_u8; STACK_BYTES]);
}

/// Keeps all memory of the process where it is, and has every page of it there now: among it the samples of shared memory,
/// which the loop would otherwise meet one by one.
///
/// What is mapped later is locked too, unless there is a limit to it: under one a reader that comes would be too much some
/// time, and could not be served.
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
    let value = ThreadPriorityValue::try_from(level).expect("a valid priority is one of the kernel's");
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

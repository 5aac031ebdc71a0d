//! A child process that does not outlive its parent, however the parent ends and whatever the child is doing then.
//!
//! 1. The kernel sends the child SIGTERM at the parent's death (`PR_SET_PDEATHSIG`), and the child ends in order.
//! 2. A stopped process does not act on SIGTERM. So a thread postpones a timer once a second, whose signal is SIGCONT. In a
//!    stopped process nothing postpones it: after [`LONGEST_STOP`] the process continues, and finds the SIGTERM.
//! 3. A child that does not end is killed by the same thread, [`GRACE`] after the parent's death.
//!
//! Between its start and step 1 a child runs for some milliseconds. One that runs on then finds that its parent is gone, and
//! ends. One that is stopped there is continued and hung up by the kernel: its process group is its own, so the parent's
//! death orphans it (POSIX `_exit`; `kill_orphaned_pgrp` in Linux's `kernel/exit.c`). That needs a reaper in another session,
//! as init, systemd and container runtimes are.

use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use nix::sys::signal::{SigEvent, SigevNotify, Signal as TimerSignal};
use nix::sys::timer::{Expiration, Timer, TimerSetTimeFlags};
use nix::time::ClockId;
use rustix::process::{Pid, Signal, getpid, getppid, kill_process, set_parent_process_death_signal};

use crate::cli::ChildArgs;
use crate::command::BadInput;

/// How long a child may be stopped before it is continued: longer than `show` leaves a stopped child alone.
const LONGEST_STOP: Duration = Duration::from_secs(10);
/// How long a child may take to end after its parent's death: a recorder writes what is in flight.
const GRACE: Duration = Duration::from_secs(30);
/// How often the timer is postponed and the parent looked for.
const LOOK_PERIOD: Duration = Duration::from_secs(1);
/// Enough for a loop that calls the kernel.
const STACK_BYTES: usize = 64 << 10;

/// Ends this process soon after the parent that the arguments name, and fails where that has ended already.
///
/// Starts a thread that ends with the process.
pub(crate) fn follow_parent(args: ChildArgs) -> anyhow::Result<()> {
    let Some(parent) = args.parent else { return Ok(()) };
    set_parent_process_death_signal(Some(Signal::TERM)).context("cannot follow the parent process")?;
    if !is_child_of(parent) {
        return Err(BadInput(format!("--parent is {parent}, must be the parent process")).into());
    }
    let thread = thread::Builder::new().name("parent".to_owned()).stack_size(STACK_BYTES);
    thread.spawn(move || outlive_no_parent(parent)).context("cannot follow the parent process")?;
    Ok(())
}

fn is_child_of(parent: u32) -> bool {
    getppid().map(Pid::as_raw_pid) == i32::try_from(parent).ok()
}

/// Keeps this process from being stopped for long, and kills it where its end after the parent's takes too long.
fn outlive_no_parent(parent: u32) -> ! {
    let event = SigEvent::new(SigevNotify::SigevSignal { signal: TimerSignal::SIGCONT, si_value: 0 });
    let mut timer = Timer::new(ClockId::CLOCK_MONOTONIC, event);
    if let Err(error) = &timer {
        tracing::warn!("cannot make a timer, so this process may outlive its parent while it is stopped: {error}");
    }
    let mut orphaned: Option<Instant> = None;
    loop {
        if let Ok(timer) = &mut timer {
            // A timer that was made can be set.
            let _ = timer.set(Expiration::OneShot(LONGEST_STOP.into()), TimerSetTimeFlags::empty());
        }
        if !is_child_of(parent) && orphaned.get_or_insert_with(Instant::now).elapsed() > GRACE {
            // A process may always kill itself.
            let _ = kill_process(getpid(), Signal::KILL);
        }
        thread::sleep(LOOK_PERIOD);
    }
}

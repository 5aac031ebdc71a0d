//! A child process that does not outlive its parent, however the parent ends and whatever the child is doing then.
//!
//! 1. From its fork on, the kernel kills the child at the parent's death, also where the child is stopped (`PR_SET_PDEATHSIG`).
//! 2. When the next two steps are prepared, SIGTERM takes that signal's place, so that the child ends in order.
//! 3. A stopped process does not act on SIGTERM. So a thread postpones a timer once a second, whose signal is SIGCONT. In a
//!    stopped process nothing postpones it: after [`LONGEST_STOP`] the process continues, and finds the SIGTERM.
//! 4. A child that does not end is killed by the same thread, [`GRACE`] after the parent's death.
//!
//! The kernel continues some stopped orphans by itself (`kill_orphaned_pgrp` in Linux's `kernel/exit.c`), but none that is
//! stopped just then, and none that is inherited by a process of its own session.

use std::os::unix::process::CommandExt as _;
use std::process::Command;
use std::sync::mpsc::{self, SyncSender};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use nix::sys::signal::{SigEvent, SigevNotify, Signal as TimerSignal};
use nix::sys::timer::{Expiration, Timer, TimerSetTimeFlags};
use nix::time::ClockId;
use rustix::process::{Pid, Signal, getpid, getppid, kill_process, set_parent_process_death_signal};

use crate::command::flags::{BadInput, ChildArgs};

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
/// Starts a thread that ends with the process. Call it from the main thread, and first of all.
pub(crate) fn follow_parent(args: ChildArgs) -> anyhow::Result<()> {
    let Some(parent) = args.parent else { return Ok(()) };
    let cannot_follow = "cannot follow the parent process";
    let (sender, is_prepared) = mpsc::sync_channel(1);
    let thread = thread::Builder::new().name("parent".to_owned()).stack_size(STACK_BYTES);
    thread.spawn(move || outlive_no_parent(parent, &sender)).context(cannot_follow)?;
    is_prepared.recv().context(cannot_follow)?.context(cannot_follow)?;
    set_parent_process_death_signal(Some(Signal::TERM)).context(cannot_follow)?;
    if is_child_of(parent) {
        return Ok(());
    }
    Err(BadInput(format!("--parent is {parent}, must be the parent process")).into())
}

fn is_child_of(parent: u32) -> bool {
    getppid().map(Pid::as_raw_pid) == i32::try_from(parent).ok()
}

/// Keeps this process from being stopped for long, and kills it where its end after the parent's takes too long. Reports once
/// that it is prepared, or why it cannot be.
fn outlive_no_parent(parent: u32, prepared: &SyncSender<nix::Result<()>>) {
    let event = SigEvent::new(SigevNotify::SigevSignal { signal: TimerSignal::SIGCONT, si_value: 0 });
    let mut timer = match Timer::new(ClockId::CLOCK_MONOTONIC, event) {
        Ok(timer) => timer,
        Err(error) => {
            // The main thread waits for it.
            let _ = prepared.try_send(Err(error));
            return;
        }
    };
    let mut orphaned: Option<Instant> = None;
    loop {
        let is_set = timer.set(Expiration::OneShot(LONGEST_STOP.into()), TimerSetTimeFlags::empty());
        // The main thread takes the first report alone.
        let _ = prepared.try_send(is_set);
        if !is_child_of(parent) && orphaned.get_or_insert_with(Instant::now).elapsed() > GRACE {
            // A process may always kill itself.
            let _ = kill_process(getpid(), Signal::KILL);
        }
        thread::sleep(LOOK_PERIOD);
    }
}

/// Has the kernel kill the child, also a stopped one, where the thread that starts it ends before the child has called
/// [`follow_parent`], which asks for a gentler signal.
#[expect(unsafe_code, reason = "the child itself cannot ask before it is a program")]
pub(super) fn kill_with_parent(command: &mut Command) -> &mut Command {
    let ask = || Ok(set_parent_process_death_signal(Some(Signal::KILL))?);
    // SAFETY: between fork and exec the closure makes one system call. It neither allocates nor locks.
    unsafe { command.pre_exec(ask) }
}

//! Ends a child process soon after its parent, for every cause of the parent's end and every state of the child.
//!
//! 1. From the fork on, the kernel kills the child at the parent's death, even if the child is stopped (`PR_SET_PDEATHSIG`).
//! 2. Once steps 3 and 4 are prepared, SIGTERM replaces that signal, so that the child ends in order.
//! 3. A stopped process does not act on SIGTERM. So a thread restarts a timer once a second; the timer sends SIGCONT. In a
//!    stopped process the thread does not run: after [`LONGEST_STOP`] the process continues, and receives the SIGTERM.
//! 4. The same thread kills a child that has not ended [`GRACE`] after the parent's death.
//!
//! The kernel itself continues some stopped orphans (`kill_orphaned_pgrp` in Linux's `kernel/exit.c`). It misses a child that
//! is being stopped at that moment, and a child that a process of its own session inherits.

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

use crate::cli::flags::{BadInput, ChildArgs};

/// Longest stop of a child before it continues. A running `show` kills a stopped child earlier.
const LONGEST_STOP: Duration = Duration::from_secs(10);
/// Longest time from the parent's death to the child's end. A recorder writes its pending frames in this time.
const GRACE: Duration = Duration::from_secs(30);
/// Period at which the thread restarts the timer and checks the parent.
const LOOK_PERIOD: Duration = Duration::from_secs(1);
/// Stack of the thread, which only calls the kernel in a loop.
const STACK_BYTES: usize = 64 << 10;

/// Ends this process soon after the parent that the arguments name. Fails if that parent has already ended.
///
/// Starts a thread that ends with the process. Call this from the main thread, before anything else.
pub(crate) fn end_with_parent(args: ChildArgs) -> anyhow::Result<()> {
    let Some(parent) = args.parent else { return Ok(()) };
    let cannot_watch = "cannot watch the parent process";
    let (sender, is_prepared) = mpsc::sync_channel(1);
    let thread = thread::Builder::new().name("parent".to_owned()).stack_size(STACK_BYTES);
    thread.spawn(move || watch_parent(parent, &sender)).context(cannot_watch)?;
    is_prepared.recv().context(cannot_watch)?.context(cannot_watch)?;
    set_parent_process_death_signal(Some(Signal::TERM)).context(cannot_watch)?;
    if is_child_of(parent) {
        return Ok(());
    }
    Err(BadInput(format!("--parent is {parent}, must be the parent process")).into())
}

fn is_child_of(parent: u32) -> bool {
    getppid().map(Pid::as_raw_pid) == i32::try_from(parent).ok()
}

/// Continues this process if it is stopped for too long, and kills it if it ends too long after its parent. Reports once
/// through `prepared` that the timer is set, or the reason why it cannot be set.
fn watch_parent(parent: u32, prepared: &SyncSender<nix::Result<()>>) {
    let event = SigEvent::new(SigevNotify::SigevSignal { signal: TimerSignal::SIGCONT, si_value: 0 });
    let mut timer = match Timer::new(ClockId::CLOCK_MONOTONIC, event) {
        Ok(timer) => timer,
        Err(error) => {
            // The main thread waits for this report.
            let _ = prepared.try_send(Err(error));
            return;
        }
    };
    let mut orphaned: Option<Instant> = None;
    loop {
        let is_set = timer.set(Expiration::OneShot(LONGEST_STOP.into()), TimerSetTimeFlags::empty());
        // The main thread takes only the first report.
        let _ = prepared.try_send(is_set);
        if !is_child_of(parent) && orphaned.get_or_insert_with(Instant::now).elapsed() > GRACE {
            // A process may always kill itself.
            let _ = kill_process(getpid(), Signal::KILL);
        }
        thread::sleep(LOOK_PERIOD);
    }
}

/// Makes the kernel kill the child, even a stopped one, if the thread that starts it ends before the child has called
/// [`end_with_parent`]. That call replaces SIGKILL by SIGTERM.
#[expect(unsafe_code, reason = "the child cannot make this request itself before exec")]
pub(super) fn kill_with_parent(command: &mut Command) -> &mut Command {
    let ask = || Ok(set_parent_process_death_signal(Some(Signal::KILL))?);
    // SAFETY: between fork and exec the closure makes one system call. It neither allocates nor locks.
    unsafe { command.pre_exec(ask) }
}

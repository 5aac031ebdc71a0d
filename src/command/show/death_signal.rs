//! What the kernel does to a child whose show ends before the child can follow it by itself.

use std::os::unix::process::CommandExt as _;
use std::process::Command;

use rustix::process::{Signal, set_parent_process_death_signal};

/// Has the kernel kill the child, also a stopped one, where the thread that starts it ends before the child has called
/// [`follow_parent`](crate::command::parent::follow_parent), which asks for a gentler signal.
#[expect(unsafe_code, reason = "the child itself cannot ask before it is a program")]
pub(super) fn kill_with_parent(command: &mut Command) -> &mut Command {
    let ask = || Ok(set_parent_process_death_signal(Some(Signal::KILL))?);
    // SAFETY: between fork and exec the closure makes one system call. It neither allocates nor locks.
    unsafe { command.pre_exec(ask) }
}

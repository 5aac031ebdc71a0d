//! A child process that does not outlive its parent, however that ends.

use anyhow::Context as _;
use rustix::process::{Pid, Signal, getppid, set_parent_process_death_signal};

use crate::cli::ChildArgs;
use crate::command::BadInput;

/// Asks the kernel for SIGTERM when the parent that was named ends, and fails where it already has.
pub(crate) fn follow_parent(args: ChildArgs) -> anyhow::Result<()> {
    let Some(parent) = args.parent else { return Ok(()) };
    set_parent_process_death_signal(Some(Signal::TERM)).context("cannot follow the parent process")?;
    let is_parent = getppid().map(Pid::as_raw_pid) == i32::try_from(parent).ok();
    if is_parent { Ok(()) } else { Err(BadInput(format!("--parent is {parent}, must be the parent process")).into()) }
}

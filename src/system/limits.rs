//! The limits that a process is started with: raised where it may, and met as errors instead of signals.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rustix::process::{Resource, Rlimit, Signal, getrlimit, setrlimit};

/// Raises the number of files that this process may open to what it is allowed to allow itself, and has a write beyond the
/// largest size of a file fail, where otherwise a signal would end the process in the middle of one.
pub(crate) fn settle() {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if current != maximum {
        // Where that is refused, what is left has to do; who needs more says so.
        let _ = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum });
    }
    // Nobody asks whether it came: the write says it.
    let _ = signal_hook::flag::register(Signal::XFSZ.as_raw(), Arc::new(AtomicBool::new(false)));
}

/// Least stack of the thread that a process begins with, in bytes: several times what any command needs.
const LEAST_STACK: u64 = 1 << 20;

/// Raises the limit of the stack where it is too low. The kernel asks for the limit whenever the stack grows, so it holds at
/// once.
///
/// # Errors
/// What to do where it may not be raised so far.
pub(crate) fn require_stack() -> Result<(), String> {
    let Rlimit { current, maximum } = getrlimit(Resource::Stack);
    let is_enough = |limit: Option<u64>| limit.is_none_or(|bytes| bytes >= LEAST_STACK);
    if is_enough(current) {
        return Ok(());
    }
    if is_enough(maximum) && setrlimit(Resource::Stack, Rlimit { current: Some(LEAST_STACK), maximum }).is_ok() {
        return Ok(());
    }
    let (kib, least_kib) = (current.unwrap_or(0) >> 10, LEAST_STACK >> 10);
    Err(format!("the stack is limited to {kib} KiB, must be at least {least_kib}: raise the limit, `ulimit -s 8192`"))
}

/// What to do about an error that comes of a limit.
pub(crate) fn remedy(error: &io::Error) -> Option<String> {
    match rustix::io::Errno::from_io_error(error)? {
        rustix::io::Errno::MFILE => Some("raise the limit, `ulimit -n 1024`".to_owned()),
        rustix::io::Errno::FBIG => Some("raise the limit, `ulimit -f unlimited`".to_owned()),
        rustix::io::Errno::AGAIN => Some(thread_remedy()),
        rustix::io::Errno::NOMEM => {
            Some("raise the limit of memory, `ulimit -v unlimited`, or end other programs".to_owned())
        }
        _ => None,
    }
}

/// The same of an error that a library tells in words alone.
pub(crate) fn remedy_in_words(error: &str) -> Option<String> {
    let thread_refused = io::Error::from(rustix::io::Errno::AGAIN).to_string();
    error.contains(&thread_refused).then(thread_remedy)
}

/// What to do where no thread can be started, for which the kernel gives one error whatever the reason.
fn thread_remedy() -> String {
    let threads = getrlimit(Resource::Nproc).current;
    let memory = getrlimit(Resource::As).current;
    let threads = threads.map(|threads| format!("of this user's processes and threads, {threads}, with `ulimit -u`"));
    let memory = memory.map(|bytes| format!("of memory, {} KiB, with `ulimit -v`", bytes >> 10));
    let limits: Vec<String> = threads.into_iter().chain(memory).collect();
    if limits.is_empty() {
        return "end other programs".to_owned();
    }
    format!("raise the limit {}", limits.join(", or that "))
}

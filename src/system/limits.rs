//! Resource limits of the process: raises them if allowed, and turns signals at a limit into errors.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use rustix::process::{Resource, Rlimit, Signal, getrlimit, setrlimit};

/// Raises the limit of open files to its hard limit. Also makes a write beyond the file size limit return an error. Otherwise
/// SIGXFSZ would end the process during the write.
pub(crate) fn settle() {
    let Rlimit { current, maximum } = getrlimit(Resource::Nofile);
    if current != maximum {
        // If the kernel refuses, the old limit stays. Code that needs more files reports an error.
        let _ = setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum });
    }
    // The program does not read the flag: the write returns an error.
    let _ = signal_hook::flag::register(Signal::XFSZ.as_raw(), Arc::new(AtomicBool::new(false)));
}

/// Least stack of the main thread in bytes: several times the need of any command.
const LEAST_STACK: u64 = 1 << 20;

/// Raises the stack limit if it is too low. The kernel checks the limit whenever the stack grows, so the new limit is valid at
/// once.
///
/// # Errors
/// A message with the remedy, if the limit may not be raised far enough.
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
    Err(format!("the stack limit is {kib} KiB, must be at least {least_kib} KiB: raise the limit, `ulimit -s 8192`"))
}

/// Returns the remedy for an error that a limit caused.
pub(crate) fn remedy(error: &io::Error) -> Option<String> {
    match rustix::io::Errno::from_io_error(error)? {
        rustix::io::Errno::MFILE => Some("raise the limit, `ulimit -n 1024`".to_owned()),
        rustix::io::Errno::FBIG => Some("raise the limit, `ulimit -f unlimited`".to_owned()),
        rustix::io::Errno::AGAIN => Some(thread_remedy()),
        rustix::io::Errno::NOMEM => {
            Some("raise the memory limit, `ulimit -v unlimited`, or end other programs".to_owned())
        }
        _ => None,
    }
}

/// Returns the remedy for an error that a library reports only as text.
pub(crate) fn remedy_in_words(error: &str) -> Option<String> {
    let thread_refused = io::Error::from(rustix::io::Errno::AGAIN).to_string();
    error.contains(&thread_refused).then(thread_remedy)
}

/// Returns the remedy if no thread can be started. The kernel returns the same error for every limit.
fn thread_remedy() -> String {
    let threads = getrlimit(Resource::Nproc).current;
    let memory = getrlimit(Resource::As).current;
    let threads = threads.map(|threads| format!("the limit of {threads} processes and threads per user, `ulimit -u`"));
    let memory = memory.map(|bytes| format!("the memory limit of {} KiB, `ulimit -v`", bytes >> 10));
    let limits: Vec<String> = threads.into_iter().chain(memory).collect();
    if limits.is_empty() {
        return "end other programs".to_owned();
    }
    format!("raise {}", limits.join(", or "))
}

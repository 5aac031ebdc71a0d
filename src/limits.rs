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

/// What to do about an error that comes of a limit.
pub(crate) fn remedy(error: &io::Error) -> Option<&'static str> {
    match rustix::io::Errno::from_io_error(error)? {
        rustix::io::Errno::MFILE => Some("raise the limit, `ulimit -n 1024`"),
        rustix::io::Errno::FBIG => Some("raise the limit, `ulimit -f unlimited`"),
        _ => None,
    }
}

//! The signals that end a process cleanly, as a flag that loops check: SIGINT (Ctrl-C), SIGTERM, and SIGHUP (closed terminal).

use std::fs;
use std::io;
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

/// Exit status after a second signal, as in shells.
const FORCED_EXIT_STATUS: i32 = 130;
/// Time after the first signal in which further signals count as the same request. Some tools signal both a process and its
/// group.
const GRACE: Duration = Duration::from_secs(1);

/// A flag that the first signal sets. A SIGINT or SIGTERM more than a second after the first one ends the process at once. A
/// SIGHUP does not: when a terminal is closed, the shell and the kernel each send one.
#[derive(Clone, Debug)]
pub struct StopFlag(Arc<Stop>);

#[derive(Debug, Default)]
struct Stop {
    is_set: AtomicBool,
    /// Number of the first signal; 0 before it.
    signal: AtomicI32,
}

impl StopFlag {
    /// Handles SIGINT and SIGTERM for the rest of the process, and SIGHUP unless `nohup` ignores it.
    ///
    /// # Errors
    /// The error of the operating system.
    pub fn on_signals() -> io::Result<Self> {
        let stop = Self(Arc::default());
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        if !is_hangup_ignored() {
            signals.add_signal(SIGHUP)?;
        }
        let Self(flag) = stop.clone();
        thread::Builder::new().name("signals".to_owned()).spawn(move || {
            let mut first = None;
            for signal in signals.forever() {
                // The first signal stays. The flag is set after it, so that its readers know the signal.
                let _ = flag.signal.compare_exchange(0, signal, Ordering::Relaxed, Ordering::Relaxed);
                flag.is_set.store(true, Ordering::Release);
                if signal != SIGHUP && first.get_or_insert_with(Instant::now).elapsed() > GRACE {
                    process::exit(FORCED_EXIT_STATUS);
                }
            }
        })?;
        Ok(stop)
    }

    /// Whether a signal has arrived.
    pub fn is_set(&self) -> bool {
        self.0.is_set.load(Ordering::Acquire)
    }

    /// The signal that has arrived first, in words; `None` before it.
    pub fn signal(&self) -> Option<&'static str> {
        match self.0.signal.load(Ordering::Relaxed) {
            0 => None,
            SIGINT => Some("Ctrl-C"),
            SIGHUP => Some("The end of its terminal"),
            _ => Some("SIGTERM"),
        }
    }

    /// Returns the underlying atomic flag.
    pub fn as_atomic(&self) -> &AtomicBool {
        &self.0.is_set
    }
}

/// Whether this process was started with SIGHUP ignored, as by `nohup`. It then stays ignored.
pub fn is_hangup_ignored() -> bool {
    // Without /proc, SIGHUP counts as not ignored.
    fs::read_to_string("/proc/self/status").is_ok_and(|status| ignores(&status, SIGHUP))
}

/// Whether the status of a process lists a signal as ignored (`proc_pid_status(5)`).
fn ignores(status: &str, signal: i32) -> bool {
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    mask & 1 << (signal - 1) != 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ignored_signals_are_read_from_the_status_of_a_process() {
        let status = "Name:\tshow\nSigBlk:\t0000000000000001\nSigIgn:\t0000000000001001\nSigCgt:\t0000000000004002\n";
        assert_eq!([SIGHUP, SIGINT, 13, SIGTERM].map(|signal| ignores(status, signal)), [true, false, true, false]);
        assert!(!ignores("", SIGHUP));
    }
}

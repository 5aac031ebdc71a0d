//! The signals that end a process cleanly, as a flag that loops look at: Ctrl-C (SIGINT), SIGTERM, and SIGHUP, which comes when
//! the terminal is closed.

use std::fs;
use std::io;
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

/// Exit status of a process that a second signal ends, as shells number it.
const FORCED_EXIT_STATUS: i32 = 130;
/// A signal this soon after the first is the same wish: some tools signal a process and its group.
const GRACE: Duration = Duration::from_secs(1);

/// Set by the first signal. A SIGINT or SIGTERM over a second after another ends the process at once; a SIGHUP does not, for
/// the shell and the kernel each send one when a terminal is closed.
#[derive(Clone, Debug)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// Takes over SIGINT, SIGTERM and, unless `nohup` has it ignored, SIGHUP for the rest of the process.
    ///
    /// # Errors
    /// The operating system's reason.
    pub fn on_signals() -> io::Result<Self> {
        let stop = Self(Arc::new(AtomicBool::new(false)));
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        if !is_hangup_ignored() {
            signals.add_signal(SIGHUP)?;
        }
        let flag = Arc::clone(&stop.0);
        thread::Builder::new().name("signals".to_owned()).spawn(move || {
            let mut first = None;
            for signal in signals.forever() {
                flag.store(true, Ordering::Relaxed);
                if signal != SIGHUP && first.get_or_insert_with(Instant::now).elapsed() > GRACE {
                    process::exit(FORCED_EXIT_STATUS);
                }
            }
        })?;
        Ok(stop)
    }

    /// Whether a signal has come.
    pub fn is_set(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// The flag itself.
    pub fn as_atomic(&self) -> &AtomicBool {
        &self.0
    }
}

/// Whether this process was started with SIGHUP ignored, as `nohup` does: then it stays so.
pub fn is_hangup_ignored() -> bool {
    // Where there is no /proc, nothing says so.
    fs::read_to_string("/proc/self/status").is_ok_and(|status| ignores(&status, SIGHUP))
}

/// Whether a process's status has a signal among those that it ignores (`proc_pid_status(5)`).
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

//! Ctrl-C and SIGTERM as a flag that loops look at.

use std::io;
use std::process;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::iterator::Signals;

/// Exit status of a process that a second signal ends, as shells number it.
const FORCED_EXIT_STATUS: i32 = 130;
/// A signal this soon after the first is the same wish: some tools signal a process and its group.
const GRACE: Duration = Duration::from_secs(1);

/// Set by the first signal; one that comes over a second later ends the process at once.
#[derive(Clone, Debug)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// Takes over SIGINT and SIGTERM for the rest of the process.
    ///
    /// # Errors
    /// The operating system's reason.
    pub fn on_signals() -> io::Result<Self> {
        let stop = Self(Arc::new(AtomicBool::new(false)));
        let mut signals = Signals::new([SIGINT, SIGTERM])?;
        let flag = Arc::clone(&stop.0);
        thread::Builder::new().name("signals".to_owned()).spawn(move || {
            let mut first = None;
            for _ in signals.forever() {
                flag.store(true, Ordering::Relaxed);
                if first.get_or_insert_with(Instant::now).elapsed() > GRACE {
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

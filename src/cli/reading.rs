//! Limits of reading a configuration with its drawing and its map.
//!
//! The readers bound their work as far as they can. This watches over all of them, since a file may hold anything: once reading has
//! used too much processor time or memory, the process ends with one line. Nothing has been started by then.

use std::fs;
use std::path::Path;
use std::process;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::thread;
use std::time::Duration;

use rustix::param::page_size;
use rustix::time::{ClockId, clock_gettime};

use super::exit_status::BAD_INPUT;
use crate::output::terminal_text::Printable;
use crate::output::{finish_stderr, print_to_stderr};

/// Most processor time of reading.
const MAX_TIME: Duration = Duration::from_secs(10);
/// Most memory of reading, in bytes.
const MAX_MEMORY: u64 = 1 << 30;
/// Time between two looks.
const PERIOD: Duration = Duration::from_millis(20);

/// Reads a file. Ends the process with one line if reading takes too much time or memory.
pub(super) fn within_limits<T>(file: Option<&Path>, read: impl FnOnce() -> T) -> T {
    let Some(file) = file else { return read() };
    let (done, is_done) = channel::<()>();
    thread::scope(|scope| {
        let watch = thread::Builder::new().name("limits of reading".to_owned());
        // Without a thread, the readers' own limits remain.
        let _ = watch.spawn_scoped(scope, move || watch_over(file, &is_done));
        let content = read();
        drop(done);
        content
    })
}

fn watch_over(file: &Path, is_done: &Receiver<()>) {
    let (begun, held) = (processor_time(), memory());
    while let Err(RecvTimeoutError::Timeout) = is_done.recv_timeout(PERIOD) {
        let time = processor_time().saturating_sub(begun);
        let reason = if time > MAX_TIME {
            format!("more than {} s of work", MAX_TIME.as_secs())
        } else if memory().saturating_sub(held) > MAX_MEMORY {
            format!("more than {} MiB of memory", MAX_MEMORY >> 20)
        } else {
            continue;
        };
        let file = Printable(file);
        print_to_stderr(&format!(
            "error: {file}: reading it and its drawing or map takes {reason}, the most that is allowed"
        ));
        finish_stderr();
        process::exit(BAD_INPUT.into());
    }
}

/// Processor time of this process.
fn processor_time() -> Duration {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    Duration::new(time.tv_sec.unsigned_abs(), time.tv_nsec.unsigned_abs() as u32)
}

/// Memory of this process, in bytes; 0 if the kernel does not say.
fn memory() -> u64 {
    let pages = fs::read_to_string("/proc/self/statm").ok();
    let resident = pages.and_then(|pages| pages.split(' ').nth(1)?.parse::<u64>().ok());
    resident.unwrap_or(0) * page_size() as u64
}

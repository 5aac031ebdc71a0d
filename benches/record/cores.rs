//! Processor time of cores and processes, counted by the kernel.

use std::fs;
use std::process::Child;
use std::thread;
use std::time::Duration;

/// The kernel's unit in `/proc`. It is the same on every machine that Rust's standard library supports.
const TICKS_PER_SECOND: f64 = 100.0;
/// Period of checks whether a child has ended.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// Busy ticks and all ticks of each core since the start of the machine.
#[derive(Debug)]
pub(crate) struct CoreTimes(Vec<[f64; 2]>);

impl CoreTimes {
    /// Returns the current counts.
    pub(crate) fn now() -> Self {
        let text = fs::read_to_string("/proc/stat").expect("/proc/stat is readable");
        let is_core = |line: &&str| line.starts_with("cpu") && !line.starts_with("cpu ");
        Self(text.lines().filter(is_core).map(counts_of).collect())
    }

    /// Returns the share of time that each core was busy since `earlier`.
    pub(crate) fn busy_shares_since(&self, earlier: &Self) -> Vec<f64> {
        let pairs = self.0.iter().zip(&earlier.0);
        pairs.map(|([busy, all], [busy_before, all_before])| (busy - busy_before) / (all - all_before)).collect()
    }
}

/// Parses a line `cpu0 user nice system idle iowait irq softirq steal …`. `user` already includes the time of guests.
fn counts_of(line: &str) -> [f64; 2] {
    const COUNTS: usize = 8;
    const RESTING: [usize; 2] = [3, 4];
    let counts: Vec<f64> =
        line.split_whitespace().skip(1).take(COUNTS).filter_map(|count| count.parse().ok()).collect();
    let all = counts.iter().sum::<f64>();
    [all - RESTING.iter().filter_map(|&index| counts.get(index)).sum::<f64>(), all]
}

/// Waits for a child's end. Returns the processor seconds that the child has used in total.
pub(crate) fn cpu_seconds_at_end(child: &mut Child) -> f64 {
    // The counts exist until the parent waits for the child.
    let fields = loop {
        let fields = stat_fields(child.id());
        if fields.first().is_some_and(|state| state == "Z") {
            break fields;
        }
        thread::sleep(LOOK_PERIOD);
    };
    assert!(child.wait().expect("a child can be waited for").success(), "a process failed");
    // `utime` and `stime`: fields 14 and 15 of the line. `fields` begins at field 3.
    fields[11..13].iter().map(|ticks| ticks.parse::<f64>().expect("a count")).sum::<f64>() / TICKS_PER_SECOND
}

/// Returns the fields of `/proc/PID/stat` from the state on. The name before the state is in brackets and may contain any
/// character.
fn stat_fields(pid: u32) -> Vec<String> {
    let text = fs::read_to_string(format!("/proc/{pid}/stat")).expect("a child exists until its parent waits for it");
    let (_, fields) = text.rsplit_once(')').expect("the name is in brackets");
    fields.split_whitespace().map(str::to_owned).collect()
}

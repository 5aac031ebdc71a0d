//! Who uses the processor, as the kernel counts it.

use std::fs;
use std::process::Child;
use std::thread;
use std::time::Duration;

/// The kernel's unit in `/proc`, the same on every machine that Rust's standard library runs on.
const TICKS_PER_SECOND: f64 = 100.0;
/// How often a child is asked whether it has ended.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// Busy and all ticks of each core since the machine was started.
#[derive(Debug)]
pub(crate) struct CoreTimes(Vec<[f64; 2]>);

impl CoreTimes {
    /// The present counts.
    pub(crate) fn now() -> Self {
        let text = fs::read_to_string("/proc/stat").expect("the kernel tells its counts");
        let is_core = |line: &&str| line.starts_with("cpu") && !line.starts_with("cpu ");
        Self(text.lines().filter(is_core).map(counts_of).collect())
    }

    /// The share of its time that each core has been busy since.
    pub(crate) fn busy_shares_since(&self, earlier: &Self) -> Vec<f64> {
        let pairs = self.0.iter().zip(&earlier.0);
        pairs.map(|([busy, all], [busy_before, all_before])| (busy - busy_before) / (all - all_before)).collect()
    }
}

/// A line is `cpu0 user nice system idle iowait irq softirq steal …`; what a guest uses is counted in `user` already.
fn counts_of(line: &str) -> [f64; 2] {
    const COUNTS: usize = 8;
    const RESTING: [usize; 2] = [3, 4];
    let counts: Vec<f64> =
        line.split_whitespace().skip(1).take(COUNTS).filter_map(|count| count.parse().ok()).collect();
    let all = counts.iter().sum::<f64>();
    [all - RESTING.iter().filter_map(|&index| counts.get(index)).sum::<f64>(), all]
}

/// Waits for a child's end. Returns the processor seconds that it used in all its life.
pub(crate) fn cpu_seconds_at_end(child: &mut Child) -> f64 {
    // The counts stay until the child has been waited for.
    let fields = loop {
        let fields = stat_fields(child.id());
        if fields.first().is_some_and(|state| state == "Z") {
            break fields;
        }
        thread::sleep(LOOK_PERIOD);
    };
    assert!(child.wait().expect("a child can be waited for").success(), "a process has failed");
    // `utime` and `stime`, the 14th and the 15th field of all, of which the first two are not here.
    fields[11..13].iter().map(|ticks| ticks.parse::<f64>().expect("a count")).sum::<f64>() / TICKS_PER_SECOND
}

/// The fields of `/proc/PID/stat` from the state on: what comes before, a name in brackets, may hold anything.
fn stat_fields(pid: u32) -> Vec<String> {
    let text = fs::read_to_string(format!("/proc/{pid}/stat")).expect("a child is there until it is waited for");
    let (_, fields) = text.rsplit_once(')').expect("the name is in brackets");
    fields.split_whitespace().map(str::to_owned).collect()
}

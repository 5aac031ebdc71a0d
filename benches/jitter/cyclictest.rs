//! cyclictest, run with one thread, and the histogram that it prints.

use std::io::{BufRead, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread;
use std::time::Duration;

use bench_dragon_ipc::TimeHistogram;

use crate::setting::{LEVEL, RATE_HZ, Setting, TICKS};

/// Range of its histogram in nanoseconds: two periods. For longer latencies it prints their number and the longest.
const BUCKETS_NS: u64 = 2_000_000;
/// cyclictest has set its priority after this time.
const START_UP_TIME: Duration = Duration::from_secs(1);

/// Returns the version of cyclictest; `None` if it is not on the PATH.
pub(crate) fn version() -> Option<String> {
    let output = Command::new("cyclictest").arg("--help").output().ok()?;
    let text = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    text.lines().find(|line| line.starts_with("cyclictest ")).map(str::to_owned)
}

/// Returns the latencies of all cycles of one turn.
pub(crate) fn measure(setting: &Setting) -> TimeHistogram {
    let mut cyclictest = Command::new("cyclictest")
        .args(["--quiet", "--nsecs", "--mlockall", "--default-system", "--threads=1", "--policy=fifo"])
        .arg(format!("--affinity={}", setting.cpu))
        .arg(format!("--priority={LEVEL}"))
        .arg(format!("--interval={}", 1_000_000 / RATE_HZ))
        .arg(format!("--loops={TICKS}"))
        .arg(format!("--histogram={BUCKETS_NS}"))
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        // Suppresses its warning that processors may sleep, which `--default-system` intends.
        .stderr(Stdio::null())
        .spawn()
        .expect("cyclictest is on the PATH");
    thread::sleep(START_UP_TIME);
    setting.assert_taken(cyclictest.id());
    let histogram = histogram(cyclictest.stdout.take().expect("stdout is piped"));
    end(cyclictest);
    assert_eq!(histogram.count(), TICKS, "every cycle is counted");
    histogram
}

fn end(mut cyclictest: Child) {
    let status = cyclictest.wait().expect("cyclictest is our child");
    assert!(status.success(), "cyclictest ended with {status}");
}

/// Parses lines of a latency and its count. Later lines contain the longest latency and the number of latencies beyond the
/// histogram's range.
fn histogram(stdout: ChildStdout) -> TimeHistogram {
    let mut histogram = TimeHistogram::default();
    let (mut max_ns, mut beyond) = (0, 0);
    for line in BufReader::new(stdout).lines() {
        let line = line.expect("a pipe of text");
        let number = |text: &str| text.trim().parse::<u64>().unwrap_or_else(|_| panic!("no number in {line}"));
        if let Some(text) = line.strip_prefix("# Max Latencies:") {
            max_ns = number(text);
        } else if let Some(text) = line.strip_prefix("# Histogram Overflows:") {
            beyond = number(text);
        } else if let Some((latency_ns, count)) = line.split_once(' ').filter(|_| !line.starts_with('#')) {
            let count = number(count);
            histogram.counts[TimeHistogram::bucket_of(number(latency_ns))] += count;
        }
    }
    histogram.counts[TimeHistogram::bucket_of(max_ns)] += beyond;
    histogram.max_ns = max_ns;
    histogram
}

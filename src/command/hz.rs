//! `hz`: rate, gaps and latency of the frames that arrive.

use std::process::ExitCode;

use bench_dragon_ipc::{Continuity, Domain, FrameSubscriber};
use serde::Serialize;

use crate::cli::HzArgs;
use crate::command::follow::{WAIT_PERIOD, open_when_there};
use crate::command::print::print_report;
use crate::output::histogram::{LatencyHistogram, Percentiles};
use crate::output::wait_for_reader;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

const SECOND_NS: u64 = 1_000_000_000;

/// A second of frames.
#[derive(Serialize)]
struct HzLine {
    rate_hz: f64,
    frames: u64,
    lost: u64,
    restarts: u64,
    /// From the instant a frame was due to the instant it was read.
    latency_us: Percentiles,
}

/// What has arrived since the last line.
#[derive(Default)]
struct Interval {
    frames: u64,
    lost: u64,
    restarts: u64,
    latency: LatencyHistogram,
}

impl Interval {
    fn count(&mut self, continuity: Continuity, latency_ns: u64) {
        self.frames += 1;
        match continuity {
            Continuity::Lost(frames) => self.lost += frames,
            Continuity::Restarted => self.restarts += 1,
            Continuity::First | Continuity::Next => {}
        }
        self.latency.record(latency_ns);
    }

    fn line(&self, elapsed_ns: u64) -> HzLine {
        HzLine {
            rate_hz: self.frames as f64 * SECOND_NS as f64 / elapsed_ns as f64,
            frames: self.frames,
            lost: self.lost,
            restarts: self.restarts,
            latency_us: self.latency.percentiles(),
        }
    }
}

pub(crate) fn run(args: &HzArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    wait_for_reader(Some(&stop));
    let opened = open_when_there(domain.instance(), &stop, || FrameSubscriber::open(&domain, "hz"))?;
    let Some(mut frames) = opened else { return Ok(ExitCode::SUCCESS) };
    let mut left = args.seconds.unwrap_or(u64::MAX);
    let (mut window, mut begun_ns) = (Interval::default(), monotonic_ns());
    while left > 0 && !stop.is_set() {
        if let Some(frame) = frames.wait(WAIT_PERIOD)? {
            window.count(frame.continuity(), monotonic_ns().saturating_sub(frame.header().scheduled_ns));
        }
        let elapsed_ns = monotonic_ns() - begun_ns;
        if elapsed_ns >= SECOND_NS {
            let line = window.line(elapsed_ns);
            print_report(args.format.format, &line, text(&line))?;
            (window, begun_ns) = (Interval::default(), begun_ns + elapsed_ns);
            left -= 1;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn text(line: &HzLine) -> String {
    let HzLine { rate_hz, lost, restarts, latency_us: Percentiles { p50, p99, p999, max }, .. } = line;
    format!(
        "{rate_hz:>9.1} Hz  lost {lost}  restarts {restarts}  \
         latency p50 {p50:.1} p99 {p99:.1} p99.9 {p999:.1} max {max:.1} \u{b5}s"
    )
}

//! `hz`: rate, gaps and latency of the frames that arrive.

use std::process::ExitCode;

use bench_dragon_ipc::{Domain, FrameSubscriber};
use serde::Serialize;

use crate::cli::HzArgs;
use crate::command::follow::{FrameCounts, WAIT_PERIOD, open_when_there};
use crate::command::print::{percentiles, print_report};
use crate::output::histogram::{LatencyHistogram, Percentiles};
use crate::output::wait_for_reader;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

const SECOND_NS: u64 = 1_000_000_000;

#[derive(Serialize)]
struct HzLine {
    rate_hz: f64,
    frames: u64,
    lost: u64,
    restarts: u64,
    /// From the instant a frame was due to the instant it was read.
    latency_us: Percentiles,
}

pub(crate) fn run(args: &HzArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    wait_for_reader(Some(&stop));
    let opened = open_when_there(domain.instance(), &stop, || FrameSubscriber::open(&domain, "hz"))?;
    let Some(mut frames) = opened else { return Ok(ExitCode::SUCCESS) };
    let mut left = args.seconds.unwrap_or(u64::MAX);
    let (mut counts, mut latency) = (FrameCounts::default(), LatencyHistogram::default());
    let mut begun_ns = monotonic_ns();
    while left > 0 && !stop.is_set() {
        if let Some(frame) = frames.wait(WAIT_PERIOD)? {
            counts.count(&frame);
            latency.record(monotonic_ns().saturating_sub(frame.header().scheduled_ns));
        }
        let elapsed_ns = monotonic_ns() - begun_ns;
        if elapsed_ns >= SECOND_NS {
            let FrameCounts { frames, lost, restarts } = std::mem::take(&mut counts);
            let rate_hz = frames as f64 * SECOND_NS as f64 / elapsed_ns as f64;
            let line = HzLine { rate_hz, frames, lost, restarts, latency_us: latency.percentiles() };
            print_report(args.format.format, &line, text(&line))?;
            (latency, begun_ns) = (LatencyHistogram::default(), begun_ns + elapsed_ns);
            left -= 1;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn text(line: &HzLine) -> String {
    let HzLine { rate_hz, lost, restarts, latency_us, .. } = line;
    let latency = percentiles(*latency_us);
    format!("{rate_hz:>9.1} Hz  lost {lost}  restarts {restarts}  latency {latency} \u{b5}s")
}

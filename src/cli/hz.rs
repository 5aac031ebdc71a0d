//! `hz`: prints rate, losses and latency of the arriving frames.

use std::process::ExitCode;

use clap::Args;
use serde::Serialize;

use crate::cli::bus_readers::{FrameCounts, WAIT_PERIOD, open_frames};
use crate::cli::flags::{BusArgs, FormatArgs, count};
use crate::cli::print::{percentiles, print_report};
use crate::output::histogram::{LatencyHistogram, Percentiles};
use crate::system::clock::monotonic_ns;

/// Print rate, losses and latency of the arriving frames, once a second.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon hz
  bench-dragon hz --seconds 10 --format json")]
pub(crate) struct HzArgs {
    /// Number of lines to print, one per second [default: until Ctrl-C].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = count())]
    pub(crate) seconds: Option<u64>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

const SECOND_NS: u64 = 1_000_000_000;

#[derive(Serialize)]
struct HzLine {
    rate_hz: f64,
    #[serde(flatten)]
    counts: FrameCounts,
    /// Time from the instant at which a frame was due to the instant at which it was read; `None` without a frame.
    latency_us: Option<Percentiles>,
}

pub(crate) fn run(args: &HzArgs) -> anyhow::Result<ExitCode> {
    let Some((mut frames, stop)) = open_frames(&args.bus, "hz")? else { return Ok(ExitCode::SUCCESS) };
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
            let counts = std::mem::take(&mut counts);
            let rate_hz = counts.frames as f64 * SECOND_NS as f64 / elapsed_ns as f64;
            let latency_us = (counts.frames > 0).then(|| latency.percentiles());
            let line = HzLine { rate_hz, counts, latency_us };
            print_report(args.format.format, &line, text(&line))?;
            (latency, begun_ns) = (LatencyHistogram::default(), begun_ns + elapsed_ns);
            left -= 1;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn text(line: &HzLine) -> String {
    let HzLine { rate_hz, counts: FrameCounts { lost, restarts, .. }, latency_us } = line;
    let latency = latency_us.map_or("unknown".to_owned(), |latency_us| percentiles(latency_us) + " \u{b5}s");
    format!("{rate_hz:>9.1} Hz  lost {lost}  restarts {restarts}  latency {latency}")
}

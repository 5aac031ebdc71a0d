//! `latency`: measures the latency and the loss of frames.

use std::hint;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use bench_dragon_ipc::{BusError, Frame, FrameSubscriber, HandleState};
use clap::{Args, ValueHint};
use serde::Serialize;

use crate::cli::bus_readers::{FrameCounts, WAIT_PERIOD, open_frames};
use crate::cli::flags::{BusArgs, Format, FormatArgs, SpinArgs, within};
use crate::cli::print::{print_bytes, print_json, print_line};
use crate::output::Counted;
use crate::output::histogram::{Bars, LatencyHistogram, PercentileText, Percentiles};
use crate::output::table::{Cell, Column, Table, text};
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;
use crate::system::whole_file;

/// Measure the latency and the loss of frames on the running bus.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon latency
  bench-dragon latency --spin-us 100
  bench-dragon latency --poll --seconds 60 --hgrm tonight.hgrm
  bench-dragon latency --format json | jq .sent_us.p99

A frame is due when the server planned to begin it, sent when it was ready, and read when this command has read every handle \
of it. --poll fully occupies one processor; --spin-us takes up to twice its time in each period.")]
pub(crate) struct LatencyArgs {
    /// Seconds to measure, 0.01 to 1000000; Ctrl-C ends earlier, with the report.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, allow_negative_numbers = true, value_parser = within(0.01..=1e6))]
    pub(crate) seconds: f64,
    /// Poll for frames without a pause, instead of being woken by the server.
    #[arg(long, conflicts_with = "spin_us")]
    pub(crate) poll: bool,
    #[command(flatten)]
    pub(crate) clock: SpinArgs,
    /// Write the distribution of the latency from due to read, in microseconds, as .hgrm for the HDR histogram plotter.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) hgrm: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// The results of `latency`.
#[derive(Serialize)]
struct LatencyReport {
    #[serde(flatten)]
    counts: FrameCounts,
    seconds: f64,
    /// `polling`, `woken` or `clock`.
    mode: &'static str,
    /// Time from the instant at which a frame was due to the instant at which every handle had been read, in microseconds;
    /// `None` if no frame was read.
    due_us: Option<Percentiles>,
    /// The same time from the instant at which the frame was sent.
    sent_us: Option<Percentiles>,
}

/// How the reader notices a new frame.
#[derive(Clone, Copy, Debug)]
enum ReadMode {
    Polling,
    Woken,
    /// With the time of the busy loop.
    Clock(Duration),
}

impl ReadMode {
    fn name(self) -> &'static str {
        match self {
            Self::Polling => "polling",
            Self::Woken => "woken",
            Self::Clock(_) => "clock",
        }
    }
}

#[derive(Default)]
struct Measured {
    counts: FrameCounts,
    due: LatencyHistogram,
    sent: LatencyHistogram,
}

impl Measured {
    /// Reads every handle of a frame, then reads the clock.
    fn read(&mut self, frame: &Frame) {
        hint::black_box(sum_of_bits(frame.handles()));
        let (read_ns, header) = (monotonic_ns(), frame.header());
        self.due.record(read_ns.saturating_sub(header.scheduled_ns));
        self.sent.record(read_ns.saturating_sub(header.published_ns));
        self.counts.count(frame);
    }
}

pub(crate) fn run(args: &LatencyArgs) -> anyhow::Result<ExitCode> {
    if let Some(path) = &args.hgrm {
        whole_file::check(path)?;
    }
    let Some((mut frames, stop)) = open_frames(&args.bus, "latency")? else { return Ok(ExitCode::SUCCESS) };
    let mode = match args.clock.spin() {
        Some(spin) => ReadMode::Clock(spin),
        None if args.poll => ReadMode::Polling,
        None => ReadMode::Woken,
    };
    let (mut measured, begun_ns) = (Measured::default(), monotonic_ns());
    let end_ns = measure(&mut frames, mode, begun_ns + (args.seconds * 1e9) as u64, &stop, &mut measured)?;
    let counts = measured.counts;
    let has_frames = counts.frames > 0;
    let report = LatencyReport {
        counts,
        seconds: (end_ns - begun_ns) as f64 / 1e9,
        mode: mode.name(),
        due_us: has_frames.then(|| measured.due.percentiles()),
        sent_us: has_frames.then(|| measured.sent.percentiles()),
    };
    match args.format.format {
        Format::Json => print_json(&report)?,
        Format::Text => print_text(&report, &measured.due)?,
    }
    // Last, so that the report is printed even if this file cannot be written.
    if let Some(path) = &args.hgrm {
        whole_file::write(path, PercentileText(&measured.due).to_string().as_bytes())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Reads all frames that are sent until `end_ns` or until a signal. Returns the instant of that end.
fn measure(
    frames: &mut FrameSubscriber,
    mode: ReadMode,
    mut end_ns: u64,
    stop: &StopFlag,
    measured: &mut Measured,
) -> Result<u64, BusError> {
    loop {
        match next(frames, mode)? {
            Some(frame) if frame.header().published_ns <= end_ns => measured.read(&frame),
            Some(_) => return Ok(end_ns),
            // All frames that were sent in time have been read.
            None if monotonic_ns() >= end_ns => return Ok(end_ns),
            None => {}
        }
        if stop.is_set() {
            end_ns = end_ns.min(monotonic_ns());
        }
    }
}

fn next(frames: &mut FrameSubscriber, mode: ReadMode) -> Result<Option<Frame>, BusError> {
    match mode {
        ReadMode::Woken => frames.wait(WAIT_PERIOD),
        ReadMode::Clock(spin) => frames.wait_until_due(WAIT_PERIOD, spin),
        ReadMode::Polling => {
            hint::spin_loop();
            frames.receive()
        }
    }
}

/// A sum over all bytes of the handles. It can be computed in any order, so the compiler may choose the fastest.
fn sum_of_bits(handles: &[HandleState]) -> u64 {
    let sum = |values: [f64; 3]| values.map(f64::to_bits).into_iter().fold(0, u64::wrapping_add);
    handles
        .iter()
        .fold(0, |all, handle| all.wrapping_add(sum(handle.position_m)).wrapping_add(sum(handle.velocity_mps)))
}

fn print_text(report: &LatencyReport, due: &LatencyHistogram) -> anyhow::Result<()> {
    let LatencyReport { counts: FrameCounts { frames, lost, restarts }, seconds, mode, due_us, sent_us } = report;
    let (frames, restarts) = (Counted(*frames, "frame"), Counted(*restarts, "restart"));
    print_line(format_args!("{frames} in {seconds:.1} s, {lost} lost, {restarts}, {mode}\n"))?;
    let (Some(due_us), Some(sent_us)) = (due_us, sent_us) else {
        return Ok(print_line("no latency: no frame was read")?);
    };
    let title = |percentile: &str| Column::number(percentile, 1);
    let mut table = Table::new(
        "latency in \u{b5}s",
        vec![Column::text(""), title("p50"), title("p99"), title("p99.9"), title("max")],
    );
    for (way, Percentiles { p50, p99, p999, max }) in [("due to read", due_us), ("sent to read", sent_us)] {
        let mut row = vec![Cell::from(way)];
        row.extend([p50, p99, p999, max].map(|&micros| Cell::from(micros)));
        table.push(row);
    }
    print_bytes(text(&[table]))?;
    print_bytes(format!("\nframes by latency from due to read in \u{b5}s\n{}", Bars(due)))
}

//! The commands about recordings: `record`, `replay`, `export`.

use std::path::PathBuf;

use bench_dragon_geometry::number::Number;
use bench_dragon_ipc::service::MAX_READERS;
use clap::{ArgGroup, Args, ValueHint};

use super::flags::{BadInput, BusArgs, FormatArgs, count, nanoseconds, step, within};
use crate::recording::ShowInterval;
use crate::recording::export::ExportSubject;
use crate::source::replay::RATE;

#[derive(Clone, Debug, Args)]
pub(crate) struct RecordArgs {
    /// The recording to write, or with --repair to finish.
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) file: PathBuf,
    /// Finish a recording whose recorder was killed, in place and without reading its chunks, instead of recording.
    #[arg(long, conflicts_with_all = ["rotate_mb", "max_total_mb"])]
    pub(crate) repair: bool,
    /// With --repair: read every chunk; of a damaged recording save what is sound, and keep the old file as FILE.damaged.
    #[arg(long, requires = "repair")]
    pub(crate) check: bool,
    /// Begin a new file after this many megabytes.
    #[arg(long, value_name = "MB", allow_negative_numbers = true, value_parser = within(1..=1_000_000_u64))]
    pub(crate) rotate_mb: Option<u64>,
    /// Remove the oldest files of this recording over this many megabytes in all.
    #[arg(long, value_name = "MB", allow_negative_numbers = true, value_parser = within(4..=1_000_000_000_u64))]
    pub(crate) max_total_mb: Option<u64>,
    /// Leave what killed recorders left in the folder as it is: `show` finishes it.
    #[arg(long, hide = true)]
    pub(crate) no_repair: bool,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct ReplayArgs {
    /// The recording; with --verify all of its files, oldest first.
    #[arg(value_name = "FILE", required = true, num_args = 1.., value_hint = ValueHint::FilePath)]
    pub(crate) files: Vec<PathBuf>,
    /// Play nothing: simulate the recorded runs again, compare every frame bit for bit, and report the first difference.
    /// Needs no server. Exit status 0: all is as simulated; 1: a frame differs; 2: something cannot be verified.
    #[arg(long, conflicts_with_all = ["from", "to", "rate", "repeat", "readers", "instance"])]
    pub(crate) verify: bool,
    #[command(flatten)]
    pub(crate) interval: IntervalArgs,
    /// Recorded seconds to play per second, 0.01 to 100.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true, value_parser = within(RATE))]
    pub(crate) rate: f64,
    /// Play it so many times; without a number, until Ctrl-C.
    #[arg(long = "loop", value_name = "TIMES", num_args = 0..=1, allow_negative_numbers = true, value_parser = count())]
    #[allow(clippy::option_option, reason = "not given, given without a number, given with one")]
    pub(crate) repeat: Option<Option<u64>>,
    /// Begin once this many readers are connected, after ten seconds at the latest.
    #[arg(long, value_name = "COUNT", default_value_t = 0, allow_negative_numbers = true, value_parser = within(0..=MAX_READERS))]
    pub(crate) readers: usize,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

#[derive(Clone, Debug, Args)]
#[command(group(ArgGroup::new("subject").args(["handles", "benches", "frames", "alerts", "commands"])))]
#[allow(clippy::struct_excessive_bools, reason = "flags of which one may be given")]
pub(crate) struct ExportArgs {
    /// The recording.
    #[arg(value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) file: PathBuf,
    /// The file to write, .csv or .xlsx; - prints comma-separated values.
    #[arg(value_name = "OUT", value_hint = ValueHint::FilePath, value_parser = table_file)]
    pub(crate) out: TableFile,
    /// Positions, velocities and speeds of every handle [default].
    #[arg(long)]
    handles: bool,
    /// Centres, headings, velocities and speeds of every bench.
    #[arg(long)]
    benches: bool,
    /// Frames alone: show time, state, travel and speed of the head.
    #[arg(long)]
    frames: bool,
    /// Alerts alone.
    #[arg(long)]
    alerts: bool,
    /// The record of commands alone: who sent what and when, and what became of it.
    #[arg(long)]
    commands: bool,
    /// Seconds of show time from one row, or column, to the next; 0 for every frame.
    #[arg(long, value_name = "SECONDS", default_value = "1", allow_negative_numbers = true, value_parser = |text: &str| step(text, 0, "from 0 to"))]
    pub(crate) every: i64,
    #[command(flatten)]
    pub(crate) interval: IntervalArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

impl ExportArgs {
    /// What the rows are about.
    pub(crate) fn subject(&self) -> ExportSubject {
        match self {
            Self { benches: true, .. } => ExportSubject::Benches,
            Self { frames: true, .. } => ExportSubject::Frames,
            Self { alerts: true, .. } => ExportSubject::Alerts,
            Self { commands: true, .. } => ExportSubject::Commands,
            _ => ExportSubject::Handles,
        }
    }
}

/// Where a table goes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum TableFile {
    /// Comma-separated values to stdout.
    Stdout,
    /// Comma-separated values.
    Csv(PathBuf),
    /// A workbook.
    Xlsx(PathBuf),
}

fn table_file(text: &str) -> Result<TableFile, String> {
    let path = PathBuf::from(text);
    match path.extension().and_then(|suffix| suffix.to_str()).map(str::to_ascii_lowercase).as_deref() {
        _ if text == "-" => Ok(TableFile::Stdout),
        Some("csv") => Ok(TableFile::Csv(path)),
        Some("xlsx") => Ok(TableFile::Xlsx(path)),
        _ => Err("must end in .csv or .xlsx, or be -".to_owned()),
    }
}

/// Which frames of a recording.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct IntervalArgs {
    /// Show time in seconds: only frames from here on.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = nanoseconds)]
    from: Option<i64>,
    /// Show time in seconds: only frames up to here.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = nanoseconds)]
    to: Option<i64>,
}

impl IntervalArgs {
    /// The interval.
    ///
    /// # Errors
    /// One that ends before it begins.
    pub(crate) fn interval(self) -> Result<ShowInterval, BadInput> {
        let ShowInterval { from_ns: first_ns, to_ns: last_ns } = ShowInterval::ALL;
        let interval = ShowInterval { from_ns: self.from.unwrap_or(first_ns), to_ns: self.to.unwrap_or(last_ns) };
        if interval.from_ns <= interval.to_ns {
            return Ok(interval);
        }
        let [from_s, to_s] = [interval.from_ns, interval.to_ns].map(|time_ns| Number(time_ns as f64 / 1e9));
        Err(BadInput(format!("--to is {to_s}, must be at least --from, which is {from_s}")))
    }
}

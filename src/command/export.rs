//! `export`: a recording as a table.

use std::fmt::Display;
use std::fs;
use std::io::BufWriter;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::{ArgGroup, Args, ValueHint};
use serde::Serialize;

use crate::command::flags::{BadInput, FormatArgs, IntervalArgs, step};
use crate::command::print::{Progress, complain_of_flaws, print_report};
use crate::output::Counted;
use crate::output::Stream;
use crate::output::terminal_text::Printable;
use crate::recording::Flaws;
use crate::recording::export::{
    ExportCounts, ExportError, ExportSettings, ExportSubject, Selection, Workbook, write_csv,
};
use crate::system::whole_file::{self, WholeFile};

/// Write a recording as a table, .csv or .xlsx.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon export rehearsal.mcap rehearsal.xlsx
  bench-dragon export rehearsal.mcap dance.csv --benches --from 60 --to 90 --every 0.04
  bench-dragon export rehearsal.mcap - --alerts | grep contact

A frame of every second of show time, or every --every. Numbers are whole. A workbook has sheets of frames, of positions \
and speeds with a column for each frame, of alerts and of the configuration; whether it fits is known before it is begun. \
Of several recorded runs and after a seek, each begins with a frame; the column run_id parts the runs.")]
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
    Csv(PathBuf),
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

/// What `export` wrote.
#[derive(Serialize)]
struct ExportReport<'a> {
    file: &'a Path,
    #[serde(flatten)]
    counts: ExportCounts,
    /// What could not be read of the recording.
    #[serde(flatten)]
    flaws: Flaws,
}

const WRITE_BUFFER_BYTES: usize = 1 << 20;

pub(crate) fn run(args: &ExportArgs) -> anyhow::Result<ExitCode> {
    let (file, interval, every_ns) = (args.file.clone(), args.interval.interval()?, args.every);
    let with_events = matches!(args.out, TableFile::Xlsx(_));
    let settings = ExportSettings { file, interval, every_ns, subject: args.subject(), with_events };
    let mut selection = Selection::open(settings)?;
    require_another_file(&args.file, &args.out)?;
    let mut reading = Reading::of(&args.file);
    let (counts, flaws) = match &args.out {
        TableFile::Stdout => {
            let sink = BufWriter::with_capacity(WRITE_BUFFER_BYTES, Stream::Stdout);
            let written = write_csv(&mut selection, sink, |selection| reading.show(selection));
            written.map_err(|error| named(error, "to stdout"))?;
            drop(reading);
            (selection.counts, selection.reader.flaws())
        }
        TableFile::Csv(path) => {
            let mut file = WholeFile::create(path)?;
            let sink = BufWriter::with_capacity(WRITE_BUFFER_BYTES, &mut file);
            let written = write_csv(&mut selection, sink, |selection| reading.show(selection));
            written.map_err(|error| named(error, path.display()))?;
            file.finish()?;
            drop(reading);
            (selection.counts, selection.reader.flaws())
        }
        TableFile::Xlsx(path) => {
            whole_file::check(path)?;
            let workbook = Workbook::read(selection, |selection| reading.show(selection))?;
            drop(reading);
            let writing = Progress::new("writing", 1.0);
            whole_file::write(path, &workbook.to_bytes(|rows| writing.add(1.0 / rows as f64))?)?;
            (workbook.counts, workbook.flaws)
        }
    };
    complain_of_flaws(&args.file, flaws, "exported");
    let (TableFile::Csv(file) | TableFile::Xlsx(file)) = &args.out else { return Ok(ExitCode::SUCCESS) };
    let text = format!("{} written to {}", written_text(args.subject(), counts), Printable(file));
    print_report(args.format.format, &ExportReport { file, counts, flaws }, text)?;
    Ok(ExitCode::SUCCESS)
}

/// Refuses to write over the recording, by whatever name.
fn require_another_file(recording: &Path, out: &TableFile) -> anyhow::Result<()> {
    let (TableFile::Csv(path) | TableFile::Xlsx(path)) = out else { return Ok(()) };
    let inode = |path: &Path| fs::metadata(path).ok().map(|metadata| (metadata.dev(), metadata.ino()));
    if inode(recording).is_some() && inode(recording) == inode(path) {
        return Err(BadInput(format!("OUT is {}, must not be the recording itself", path.display())).into());
    }
    Ok(())
}

/// An error in writing names what was written, and keeps its kind: nobody reading any more is none for `head`.
fn named(error: ExportError, what: impl Display) -> anyhow::Error {
    match error {
        ExportError::Write(source) => anyhow::Error::new(source).context(format!("cannot write {what}")),
        other => other.into(),
    }
}

/// The bar that shows how far the recording has been read.
struct Reading {
    bar: Progress,
    position: u64,
}

impl Reading {
    fn of(file: &Path) -> Self {
        let bytes = fs::metadata(file).map_or(0, |metadata| metadata.len());
        Self { bar: Progress::new("exporting", bytes as f64), position: 0 }
    }

    fn show(&mut self, selection: &Selection) {
        let before = std::mem::replace(&mut self.position, selection.reader.position());
        if self.position > before {
            self.bar.add((self.position - before) as f64);
        }
    }
}

/// What was written: of comma-separated values the rows, of a workbook what its sheets hold.
fn written_text(subject: ExportSubject, counts: ExportCounts) -> String {
    let ExportCounts { runs, frames, alerts, commands, rows } = counts;
    let runs = if runs > 1 { format!(" of {runs} runs") } else { String::new() };
    let frames = format!("{}{runs}", Counted(frames, "frame"));
    match (rows, subject) {
        (Some(rows), ExportSubject::Handles | ExportSubject::Benches) => {
            format!("{} of {}, from {frames},", Counted(rows, "row"), subject.name())
        }
        (Some(_), ExportSubject::Frames) => frames,
        (Some(_), ExportSubject::Alerts) => Counted(alerts, "alert").to_string(),
        (Some(_), ExportSubject::Commands) => Counted(commands, "command event").to_string(),
        (None, _) if subject.has_frames() => {
            format!("{frames}, {} and {}", Counted(alerts, "alert"), Counted(commands, "command event"))
        }
        (None, _) => format!("{} and {}", Counted(alerts, "alert"), Counted(commands, "command event")),
    }
}

//! `export`: writes a recording as a table.

use std::fmt::Display;
use std::fs;
use std::io::BufWriter;
use std::os::unix::fs::MetadataExt as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

use clap::{ArgGroup, Args, ValueHint};
use serde::Serialize;

use crate::cli::flags::{BadInput, FormatArgs, IntervalArgs, step};
use crate::cli::parts::{find_parts, warn_of_gaps, warn_of_part};
use crate::cli::print::{Progress, print_report, warn_of_flaws};
use crate::output::Counted;
use crate::output::Stream;
use crate::output::terminal_text::Printable;
use crate::recording::export::{
    ExportCounts, ExportError, ExportSettings, ExportSubject, Selection, Workbook, write_csv,
};
use crate::recording::{Coverage, Flaws, Parts};
use crate::system::whole_file::{self, WholeFile};

/// Write a recording as a table, .csv or .xlsx.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon export tonight tonight.xlsx                     the folder of a show
  bench-dragon export rehearsal.mcap rehearsal.xlsx
  bench-dragon export rehearsal.mcap dance.csv --benches --from 60 --to 90 --every 0.04
  bench-dragon export rehearsal.mcap - --alerts | grep contact

The table has one frame per second of show time, or per --every. A .csv file has all digits of each number. A workbook has \
sheets of frames, of positions and speeds with one column per frame, of alerts, of commands and of the configuration; if it \
would be too large, the command fails before it writes. Each recorded run, and each part after a seek, begins with a frame. \
The column run_id separates the runs. wall_time is UTC: of a frame, when it was sent; of an alert, when the recorder received \
it. A folder stands for all its recordings, whose parts are joined; gaps between them are named.")]
#[command(group(ArgGroup::new("subject").args(["handles", "benches", "frames", "alerts", "commands"])))]
#[allow(clippy::struct_excessive_bools, reason = "flags of which one may be given")]
pub(crate) struct ExportArgs {
    /// Recording to read, or the folder of a show.
    #[arg(value_name = "FILE|FOLDER", value_hint = ValueHint::AnyPath)]
    pub(crate) file: PathBuf,
    /// File to write, .csv or .xlsx; - prints comma-separated values to stdout.
    #[arg(value_name = "OUT", value_hint = ValueHint::FilePath, value_parser = table_file)]
    pub(crate) out: TableFile,
    /// Export positions, velocities and speeds of every handle [default].
    #[arg(long)]
    handles: bool,
    /// Export centres, headings, velocities and speeds of every bench.
    #[arg(long)]
    benches: bool,
    /// Export only frames: show time, state, travel and speed of the head.
    #[arg(long)]
    frames: bool,
    /// Export only alerts.
    #[arg(long)]
    alerts: bool,
    /// Export only the record of commands: time, sender, command and outcome.
    #[arg(long)]
    commands: bool,
    /// List a guard's accepted grants among the commands, too: about ten a second.
    #[arg(long)]
    grants: bool,
    /// Overwrite OUT if it exists. It keeps its mode.
    #[arg(long)]
    force: bool,
    /// Seconds of show time between exported frames; 0 exports every frame.
    #[arg(long, value_name = "SECONDS", default_value = "1", allow_negative_numbers = true, value_parser = |text: &str| step(text, 0, "from 0 to"))]
    pub(crate) every: i64,
    #[command(flatten)]
    pub(crate) interval: IntervalArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

impl ExportArgs {
    /// The subject of the rows.
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

/// The destination of a table.
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

/// The report of `export`.
#[derive(Serialize)]
struct ExportReport<'a> {
    file: &'a Path,
    #[serde(flatten)]
    counts: ExportCounts,
    /// The parts of the recording that could not be read.
    #[serde(flatten)]
    flaws: Flaws,
    /// The frames of the parts, and the gaps.
    #[serde(flatten)]
    coverage: &'a Coverage,
}

const WRITE_BUFFER_BYTES: usize = 1 << 20;

pub(crate) fn run(args: &ExportArgs) -> anyhow::Result<ExitCode> {
    let (interval, every_ns) = (args.interval.interval()?, args.every);
    let parts = Arc::new(find_parts(std::slice::from_ref(&args.file))?);
    let has_events = matches!(args.out, TableFile::Xlsx(_));
    let settings = ExportSettings {
        parts: Arc::clone(&parts),
        interval,
        every_ns,
        subject: args.subject(),
        has_events,
        has_grants: args.grants,
    };
    let mut selection = Selection::open(settings);
    require_another_file(&parts, &args.out)?;
    require_no_file(&args.out, args.force)?;
    warn_of_part(&parts);
    let mut reading = Reading::of(&parts);
    let (counts, findings) = match &args.out {
        TableFile::Stdout => {
            let sink = BufWriter::with_capacity(WRITE_BUFFER_BYTES, Stream::Stdout);
            let written = write_csv(&mut selection, sink, |selection| reading.show(selection));
            written.map_err(|error| named(error, "to stdout"))?;
            drop(reading);
            (selection.counts, selection.into_findings())
        }
        TableFile::Csv(path) => {
            let mut file = WholeFile::create(path)?;
            let sink = BufWriter::with_capacity(WRITE_BUFFER_BYTES, &mut file);
            let written = write_csv(&mut selection, sink, |selection| reading.show(selection));
            written.map_err(|error| named(error, path.display()))?;
            file.finish()?;
            drop(reading);
            (selection.counts, selection.into_findings())
        }
        TableFile::Xlsx(path) => {
            whole_file::check(path)?;
            let workbook = Workbook::read(selection, |selection| reading.show(selection))?;
            drop(reading);
            let writing = Progress::new("writing", 1.0);
            whole_file::write(path, &workbook.to_bytes(|rows| writing.add(1.0 / rows as f64))?)?;
            (workbook.counts, workbook.findings)
        }
    };
    for file in &findings.flawed {
        warn_of_flaws(&file.file, file.flaws, "exported");
    }
    if parts.are_joined() {
        warn_of_gaps(&findings.coverage);
    }
    let (TableFile::Csv(file) | TableFile::Xlsx(file)) = &args.out else { return Ok(ExitCode::SUCCESS) };
    let text = format!("{} written to {}", written_text(args.subject(), counts), Printable(file));
    print_report(
        args.format.format,
        &ExportReport { file, counts, flaws: findings.flaws(), coverage: &findings.coverage },
        text,
    )?;
    Ok(ExitCode::SUCCESS)
}

/// Refuses to overwrite a part of the recording, also through another name or a link.
fn require_another_file(parts: &Parts, out: &TableFile) -> anyhow::Result<()> {
    let (TableFile::Csv(path) | TableFile::Xlsx(path)) = out else { return Ok(()) };
    let inode = |path: &Path| fs::metadata(path).ok().map(|metadata| (metadata.dev(), metadata.ino()));
    let is_out = |part: &PathBuf| inode(part).is_some() && inode(part) == inode(path);
    if parts.files.iter().any(is_out) {
        return Err(BadInput(format!("OUT is {}, must not be the recording itself", path.display())).into());
    }
    Ok(())
}

/// Refuses to overwrite a file. A pipe or a device is no file.
fn require_no_file(out: &TableFile, is_forced: bool) -> anyhow::Result<()> {
    match out {
        TableFile::Csv(path) | TableFile::Xlsx(path) if path.is_file() && !is_forced => {
            let path = path.display();
            let text = format!("{path} already exists and is not overwritten: choose another name, or give --force");
            Err(BadInput(text).into())
        }
        _ => Ok(()),
    }
}

/// Adds the destination to a write error. The kind of the error stays: a broken pipe, as with `head`, is not a failure.
fn named(error: ExportError, what: impl Display) -> anyhow::Error {
    match error {
        ExportError::Write(source) => anyhow::Error::new(source).context(format!("cannot write {what}")),
        other => other.into(),
    }
}

/// The progress bar of reading the recording.
struct Reading {
    bar: Progress,
    position: u64,
}

impl Reading {
    fn of(parts: &Parts) -> Self {
        Self { bar: Progress::new("exporting", parts.bytes() as f64), position: 0 }
    }

    fn show(&mut self, selection: &Selection) {
        let before = std::mem::replace(&mut self.position, selection.reader.bytes_read());
        if self.position > before {
            self.bar.add((self.position - before) as f64);
        }
    }
}

/// The written data in words: the rows of comma-separated values, or the contents of a workbook's sheets.
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

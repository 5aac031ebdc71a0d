//! `export`: a recording as a table.

use std::fmt::Display;
use std::fs;
use std::io::BufWriter;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;
use std::process::ExitCode;

use crate::cli::{BadInput, ExportArgs, Format, TableFile};
use crate::command::print::{Progress, complain_of_flaws, print_json, print_line};
use crate::output::Counted;
use crate::output::Stream;
use crate::output::report::ExportReport;
use crate::output::terminal_text::Printable;
use crate::recording::export::{
    ExportCounts, ExportError, ExportSettings, ExportSubject, Selection, Workbook, write_csv,
};
use crate::system::whole_file::{self, WholeFile};

const WRITE_BUFFER_BYTES: usize = 1 << 20;

pub(crate) fn run(args: &ExportArgs) -> anyhow::Result<ExitCode> {
    let (file, interval, every_ns) = (args.file.clone(), args.interval.interval()?, args.every);
    let with_events = matches!(args.out, TableFile::Xlsx(_));
    let settings = ExportSettings { file, interval, every_ns, subject: args.subject(), with_events };
    let mut selection = Selection::open(settings)?;
    require_another_file(&args.file, &args.out)?;
    let mut reading = Reading::of(&args.file);
    match &args.out {
        TableFile::Stdout => {
            let sink = BufWriter::with_capacity(WRITE_BUFFER_BYTES, Stream::Stdout);
            let written = write_csv(&mut selection, sink, |selection| reading.show(selection));
            written.map_err(|error| named(error, "to stdout"))?;
            drop(reading);
            complain_of_flaws(&args.file, selection.reader().flaws(), "exported");
        }
        TableFile::Csv(path) => {
            let mut file = WholeFile::create(path)?;
            let sink = BufWriter::with_capacity(WRITE_BUFFER_BYTES, &mut file);
            let written = write_csv(&mut selection, sink, |selection| reading.show(selection));
            written.map_err(|error| named(error, path.display()))?;
            file.finish()?;
            drop(reading);
            tell(
                args,
                &ExportReport { file: path.clone(), counts: selection.counts(), flaws: selection.reader().flaws() },
            )?;
        }
        TableFile::Xlsx(path) => {
            whole_file::check(path)?;
            let workbook = Workbook::read(selection, |selection| reading.show(selection))?;
            drop(reading);
            let writing = Progress::new("writing", 1.0);
            whole_file::write(path, &workbook.to_bytes(|rows| writing.add(1.0 / rows as f64))?)?;
            drop(writing);
            tell(args, &ExportReport { file: path.clone(), counts: workbook.counts, flaws: workbook.flaws })?;
        }
    }
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
        let before = std::mem::replace(&mut self.position, selection.reader().position());
        if self.position > before {
            self.bar.add((self.position - before) as f64);
        }
    }
}

fn tell(args: &ExportArgs, report: &ExportReport) -> anyhow::Result<()> {
    complain_of_flaws(&args.file, report.flaws, "exported");
    if args.format.format == Format::Json {
        return print_json(report);
    }
    let written = written_text(args.subject(), report.counts);
    Ok(print_line(format_args!("{written} written to {}", Printable(&report.file)))?)
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

//! `record`: the recorder's process, and the repair of recordings that killed recorders left.

mod repair;
mod session;

use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

use bench_dragon_ipc::Domain;
use clap::{Args, ValueHint};
use serde::{Deserialize, Serialize};

use self::repair::{begin_repairs, repair_all, repair_one};
use self::session::{RecordPorts, RecordSession};
use crate::cli::bus_readers::open_when_there;
use crate::cli::exit_status::is_disk_full;
use crate::cli::flags::{BadInput, BusArgs, Format, FormatArgs, within};
use crate::cli::print::{print_json, print_report};
use crate::output::Counted;
use crate::output::terminal_text::Printable;
use crate::recording::{Recorder, RecorderSettings, Size};
use crate::system::clock::unix_minus_monotonic_ns;
use crate::system::stop::StopFlag;
use crate::system::whole_file::folder_of;

/// Record every frame, alert and command into an MCAP file.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon record rehearsal.mcap
  bench-dragon record rehearsal.mcap --rotate-mb 1000 --max-total-mb 20000
  bench-dragon record --repair rehearsal.mcap
  bench-dragon record --repair tonight                  all recordings of the folder of a show
  bench-dragon record --repair --check rehearsal.mcap")]
pub(crate) struct RecordArgs {
    /// Recording to write; with --repair, recording to finish, or a folder of recordings.
    #[arg(value_name = "FILE", value_hint = ValueHint::AnyPath)]
    pub(crate) file: PathBuf,
    /// Instead of recording, finish a recording whose recorder was killed, in place and without reading its chunks.
    #[arg(long, conflicts_with_all = ["rotate_mb", "max_total_mb"])]
    pub(crate) repair: bool,
    /// With --repair, read every chunk; if the recording is damaged, save its sound part and keep the old file as
    /// FILE.damaged.
    #[arg(long, requires = "repair")]
    pub(crate) check: bool,
    /// Begin a new file after this many megabytes, 1 to 1000000 [default: one file].
    #[arg(long, value_name = "MB", allow_negative_numbers = true, value_parser = within(1..=1_000_000_u64))]
    pub(crate) rotate_mb: Option<u64>,
    /// Remove the oldest files of this recording when all its files exceed this many megabytes, 4 to 1000000000 [default: keep
    /// all].
    #[arg(long, value_name = "MB", allow_negative_numbers = true, value_parser = within(4..=1_000_000_000_u64))]
    pub(crate) max_total_mb: Option<u64>,
    /// Do not finish recordings that killed recorders left in the folder, because `show` finishes them.
    #[arg(long, hide = true)]
    pub(crate) no_repair: bool,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// A line that `record` prints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum RecordLine {
    /// The recorder has opened its file.
    Started {
        /// The recording.
        file: PathBuf,
    },
    /// A problem that may come later.
    Warning {
        /// The problem, in words.
        message: String,
    },
    /// The recorder has ended.
    Summary(RecordSummary),
}

/// Totals of a recorder.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct RecordSummary {
    /// Frames written.
    pub frames: u64,
    /// Frames lost between the first and the last written frame.
    pub lost: u64,
    /// Alerts written.
    pub alerts: u64,
    /// Events of commands written.
    #[serde(default)]
    pub commands: u64,
    /// Events of commands lost, including events from long before the recording began.
    #[serde(default)]
    pub commands_lost: u64,
    /// Bytes written.
    pub bytes: u64,
    /// Files that the recorder removed to stay under the allowed total.
    pub removed: u64,
    /// The remaining files, oldest first.
    pub files: Vec<PathBuf>,
}

const MEGABYTE: u64 = 1_000_000;
/// Longest wait for running repairs at the end of a recording. The next recorder repeats an interrupted repair.
const REPAIR_TIMEOUT: Duration = Duration::from_secs(2);
/// Longest wait for them where the recorder has nothing else to do, because it could not begin. They have the lowest priority.
const LONE_REPAIR_TIMEOUT: Duration = Duration::from_secs(30);

pub(crate) fn run(args: &RecordArgs) -> anyhow::Result<ExitCode> {
    if args.repair && args.file.is_dir() {
        return repair_all(args);
    }
    if args.repair {
        return repair_one(args, &args.file);
    }
    check_sizes(args)?;
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let recorder = Recorder::start(RecorderSettings {
        rotate_bytes: args.rotate_mb.map(|megabytes| megabytes * MEGABYTE),
        max_total_bytes: args.max_total_mb.map(|megabytes| megabytes * MEGABYTE),
        ..RecorderSettings::new(&args.file, unix_minus_monotonic_ns())
    });
    // The repair begins after the recorder has opened its file. If that failed because the file exists, the repair may finish
    // that file.
    let leftovers = if args.no_repair { None } else { begin_repairs(folder_of(&args.file)) };
    let repair_timeout = if recorder.is_ok() { REPAIR_TIMEOUT } else { LONE_REPAIR_TIMEOUT };
    let recorded = recorder.map_err(anyhow::Error::from).and_then(|recorder| record(args, recorder, &domain, &stop));
    if let Some(leftovers) = leftovers {
        leftovers.finish(repair_timeout);
    }
    recorded.map(|()| ExitCode::SUCCESS)
}

fn record(args: &RecordArgs, recorder: Recorder, domain: &Domain, stop: &StopFlag) -> anyhow::Result<()> {
    if args.format.format == Format::Json {
        print_json(&RecordLine::Started { file: args.file.clone() })?;
    }
    let mut session = RecordSession::new(args.format.format, recorder);
    let mut ports = open_when_there(domain.instance(), stop, || RecordPorts::open(domain, stop))?;
    let recorded = match &mut ports {
        Some(ports) => session.read_frames(ports, stop).and_then(|()| session.take_last_commands(ports)),
        None => Ok(()),
    };
    let finished = recorded.and_then(|()| session.finish());
    if let Some(ports) = &mut ports {
        // The ports send this with the reader's last report, when they are dropped.
        match &finished {
            Ok(summary) => ports.run.frames.set_bytes_written(summary.bytes),
            Err(error) if is_disk_full(error) => ports.run.frames.set_disk_full(),
            Err(_) => {}
        }
    }
    drop(ports);
    let summary = finished?;
    let text = summary_text(&summary);
    print_report(args.format.format, &RecordLine::Summary(summary), text)
}

fn check_sizes(args: &RecordArgs) -> Result<(), BadInput> {
    match (args.rotate_mb, args.max_total_mb) {
        (Some(rotate), Some(total)) if total < rotate => {
            Err(BadInput(format!("--max-total-mb is {total}, must be at least --rotate-mb, which is {rotate}")))
        }
        _ => Ok(()),
    }
}

fn summary_text(summary: &RecordSummary) -> String {
    let &RecordSummary { frames, lost, alerts, commands, commands_lost, bytes, removed, ref files } = summary;
    let files: Vec<String> = files.iter().map(|file| Printable(file).to_string()).collect();
    let removed = match removed {
        0 => String::new(),
        removed => format!(", {} removed", Counted(removed, "older file")),
    };
    let (frames, alerts) = (Counted(frames, "frame"), Counted(alerts, "alert"));
    let commands = Counted(commands, "command event");
    format!(
        "{frames}, {lost} lost; {alerts}; {commands}, {commands_lost} lost; {} in {}{removed}",
        Size(bytes),
        files.join(", ")
    )
}

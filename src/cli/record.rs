//! `record`: the recorder's process, and the repair of recordings that killed recorders left.

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use std::{fs, thread};

use bench_dragon_geometry::formation::Layout;
use bench_dragon_ipc::{AlertSubscriber, BusError, Domain, FrameHeader, FrameSubscriber, ReaderReport};
use clap::{Args, ValueHint};
use serde::{Deserialize, Serialize};

use crate::cli::bus_readers::{FrameReading, Next, RunPorts, open_when_there};
use crate::cli::exit_status::is_disk_full;
use crate::cli::flags::{BadInput, BusArgs, Format, FormatArgs, within};
use crate::cli::print::{Progress, complain, print_json, print_notice, print_report};
use crate::output::Counted;
use crate::output::terminal_text::Printable;
use crate::recording::{
    BackgroundRepair, Recorder, RecorderSettings, Repair, RepairError, Size, SpaceWarning, recordings_in, repair,
    repair_checked, walking_bytes_per_s,
};
use crate::source::described_rate_hz;
use crate::system::clock::{monotonic_ns, unix_minus_monotonic_ns};
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
/// Period at which the recorder checks the written bytes and the room on the disk.
const PROGRESS_PERIOD: Duration = Duration::from_secs(1);
/// Period at which the recorder repeats a warning whose cause persists.
const WARNING_PERIOD: Duration = Duration::from_mins(1);
/// Longest wait for running repairs at the end of a recording. The next recorder repeats an interrupted repair.
const REPAIR_TIMEOUT: Duration = Duration::from_secs(2);
/// Longest wait at the end of a recording for the command events of its last frames. A source sends events ten times a second.
const COMMAND_TIMEOUT: Duration = Duration::from_secs(2);
const LOOK_PERIOD: Duration = Duration::from_millis(1);

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
    let recorded = recorder.map_err(anyhow::Error::from).and_then(|recorder| record(args, recorder, &domain, &stop));
    if let Some(leftovers) = leftovers {
        leftovers.finish(REPAIR_TIMEOUT);
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

/// Repairs all recordings of a folder. A failure does not stop the other repairs; the last one is the error of the subcommand.
fn repair_all(args: &RecordArgs) -> anyhow::Result<ExitCode> {
    let mut failure = None;
    for file in recordings_in(&args.file).map_err(|error| BadInput(format!("{:#}", anyhow::Error::from(error))))? {
        if let Err(error) = repair_one(args, &file)
            && let Some(earlier) = failure.replace(error)
        {
            complain(&format!("error: {earlier:#}"));
        }
    }
    failure.map_or(Ok(ExitCode::SUCCESS), Err)
}

fn repair_one(args: &RecordArgs, file: &Path) -> anyhow::Result<ExitCode> {
    let repaired = if args.check { check_one(file) } else { repair(file) };
    let Repair { path, frames, was_unfinished, skipped_bytes, kept } = repaired?;
    let done = if was_unfinished { "finished" } else { "was finished already" };
    let found = match &kept {
        Some(kept) => kept_text(skipped_bytes, kept),
        None if args.check => "; every chunk was read and is sound".to_owned(),
        None => String::new(),
    };
    let text = format!("{} {done}: {}{found}", Printable(&path), Counted(frames, "frame"));
    let value = serde_json::json!({ "file": path, "frames": frames, "repaired": was_unfinished,
            "skipped_bytes": skipped_bytes, "kept": kept });
    print_report(args.format.format, &value, text)?;
    Ok(ExitCode::SUCCESS)
}

fn check_one(file: &Path) -> Result<Repair, RepairError> {
    let bar = Progress::new("checking", fs::metadata(file).map_or(0, |metadata| metadata.len()) as f64);
    repair_checked(file, |bytes| bar.set(bytes as f64))
}

/// The part of the report about a damaged file that the repair kept.
fn kept_text(skipped_bytes: u64, kept: &Path) -> String {
    let damage = match skipped_bytes {
        0 => "its records or its indexes are damaged".to_owned(),
        bytes => format!("{bytes} bytes are damaged and were skipped"),
    };
    format!("; {damage}, so the old file is kept as {}", Printable(kept))
}

/// Starts a thread that finishes the recordings that killed recorders left in a folder. It reports each file in one line. A
/// failure to start it does not stop the recording.
fn begin_repairs(folder: &Path) -> Option<BackgroundRepair> {
    let repairs = BackgroundRepair::start(report_repair);
    let repairs =
        repairs.inspect_err(|error| tracing::warn!("cannot finish recordings of killed recorders: {error}")).ok()?;
    // The recorder itself reports a missing folder.
    if folder.is_dir() {
        repairs.repair(folder.into());
    }
    Some(repairs)
}

fn report_repair(repaired: Result<Repair, RepairError>) {
    match repaired {
        Ok(Repair { path, frames, .. }) => {
            complain(&format!(
                "finished {}, which a killed recorder left: {}",
                Printable(&path),
                Counted(frames, "frame")
            ));
        }
        Err(error) => tracing::warn!("{:#}", anyhow::Error::from(error)),
    }
}

struct RecordPorts {
    run: RunPorts,
    alerts: AlertSubscriber,
}

impl RecordPorts {
    fn open(domain: &Domain, stop: &StopFlag) -> Result<Self, BusError> {
        let (run, alerts) = RunPorts::open(domain, "record", stop, || AlertSubscriber::open(domain, "record-alerts"))?;
        Ok(Self { run, alerts })
    }
}

/// A running recorder, over any number of runs.
struct RecordSession {
    format: Format,
    recorder: Recorder,
    /// Run id and tick of the newest frame.
    newest: Option<(u64, u64)>,
    /// The part of the summary that is known before the end.
    summary: RecordSummary,
    progress_due: Instant,
    warning_due: Instant,
}

impl RecordSession {
    fn new(format: Format, recorder: Recorder) -> Self {
        let now = Instant::now();
        Self { format, recorder, newest: None, summary: RecordSummary::default(), progress_due: now, warning_due: now }
    }

    /// Records frame after frame; after a signal, only frames that were published before it.
    fn read_frames(&mut self, ports: &mut RecordPorts, stop: &StopFlag) -> anyhow::Result<()> {
        let mut reading = FrameReading::until(stop);
        loop {
            let next = reading.poll(&mut ports.run.frames)?;
            if let Next::Frame(frame) = &next {
                self.describe(frame.header(), ports, stop)?;
            } else if self.newest.is_none() && matches!(next, Next::Nothing) {
                // The channels of a file depend on the description, which comes with the first frame.
                continue;
            }
            while let Some(alert) = ports.alerts.receive()? {
                self.recorder.record(&alert, monotonic_ns())?;
            }
            self.take_commands(ports)?;
            match next {
                Next::Frame(frame) => self.recorder.frame(frame.header(), frame.handles())?,
                Next::Nothing => {}
                Next::End => return Ok(()),
            }
            self.summary.lost = ports.run.frames.lost();
            self.look_at_progress(&mut ports.run.frames)?;
        }
    }

    /// Records the description of a frame's run before the first frame.
    fn describe(&mut self, header: &FrameHeader, ports: &mut RecordPorts, stop: &StopFlag) -> anyhow::Result<()> {
        let FrameHeader { run_id, tick, .. } = *header;
        if self.newest.is_none_or(|(known, _)| known != run_id)
            && let Some(description) = ports.run.descriptions.of(run_id, stop)?
        {
            self.recorder.describe(run_id, &description.toml)?;
            let layout = Layout::of(header.dragons().iter().map(|dragon| dragon.bench_count as usize));
            self.recorder.expect_growth(walking_bytes_per_s(&layout, described_rate_hz(&description.toml)));
        }
        self.newest = Some((run_id, tick));
        Ok(())
    }

    fn take_commands(&mut self, ports: &mut RecordPorts) -> anyhow::Result<()> {
        let Some(commands) = &mut ports.run.commands else { return Ok(()) };
        while let Some(event) = commands.receive()? {
            self.recorder.record(&event, monotonic_ns())?;
        }
        self.summary.commands_lost = commands.lost;
        Ok(())
    }

    /// Records the command events up to the last frame, which arrive after that frame. `replay --verify` needs them for the
    /// last frames.
    fn take_last_commands(&mut self, ports: &mut RecordPorts) -> anyhow::Result<()> {
        let Some((run_id, tick)) = self.newest else { return Ok(()) };
        let deadline = Instant::now() + COMMAND_TIMEOUT;
        loop {
            // The check comes first: if it succeeds, all events are in the buffer, and `take_commands` receives them.
            let is_complete =
                ports.run.commands.as_mut().map_or(Ok(true), |commands| commands.is_complete(run_id, tick))?;
            self.take_commands(ports)?;
            if is_complete {
                return Ok(());
            }
            if Instant::now() >= deadline {
                tracing::warn!(
                    "commands of the last frames may be missing: the server has published no status up to tick {tick}"
                );
                return Ok(());
            }
            thread::sleep(LOOK_PERIOD);
        }
    }

    /// Reports the written bytes to the bus, and prints a warning if the disk is filling up.
    fn look_at_progress(&mut self, frames: &mut FrameSubscriber) -> anyhow::Result<()> {
        let now = Instant::now();
        if now < self.progress_due {
            return Ok(());
        }
        self.progress_due = now + PROGRESS_PERIOD;
        let progress = self.recorder.progress();
        frames.set_bytes_written(progress.bytes_written);
        frames.set_room(progress.seconds_until_full.unwrap_or(ReaderReport::NO_ROOM));
        match progress.warning {
            Some(warning) if now >= self.warning_due => {
                self.warning_due = now + WARNING_PERIOD;
                self.print_warning(&warning)
            }
            _ => Ok(()),
        }
    }

    fn print_warning(&self, warning: &SpaceWarning) -> anyhow::Result<()> {
        let text = format!("warning: {warning}");
        print_notice(self.format, &RecordLine::Warning { message: warning.to_string() }, &text)
    }

    fn finish(self) -> anyhow::Result<RecordSummary> {
        let begun = self.recorder.progress().files;
        let summary = self.recorder.finish()?;
        Ok(RecordSummary {
            frames: summary.frames,
            alerts: summary.alerts,
            commands: summary.commands,
            bytes: summary.bytes,
            removed: begun.saturating_sub(summary.files.len() as u64),
            files: summary.files,
            ..self.summary
        })
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

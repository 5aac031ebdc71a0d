//! `show`: serve, monitor and record as child processes, looked after until the end, then a report.
//!
//! The order matters at both ends. At the start the server waits for its three readers (monitor, recorder and the show
//! itself), so that tick 0 reaches all. At the end the server stops first, and only then are the two readers asked to
//! finish what is still in their buffers.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use bench_dragon::config::Config;
use bench_dragon::histogram::Percentiles;
use bench_dragon::record::repair;
use bench_dragon::report::{ContactReport, MonitorLine, MonitorProgress, RecordLine, ServeLine, ShowSummary};
use bench_dragon::stop::StopFlag;
use bench_dragon_ipc::{AlertKind, Domain, FrameHeader, FrameSubscriber, ShowState, StatusReader};
use crossbeam::channel::{self, Receiver, RecvTimeoutError, Sender};

use crate::cli::{Format, ShowArgs};
use crate::command::output::{complain, print_line};
use crate::command::record::repair_around;
use crate::command::serve::{check_pace, configure};
use crate::command::{BadInput, CONTACT};

mod child;
mod live_line;
mod tally;

use child::{Child, Event, Role};
use live_line::LiveLine;
use tally::Tally;

/// Readers that the server waits for: the monitor, the recorder and the show itself.
const READERS: usize = 3;
/// How often the show looks at the bus.
const LOOK_PERIOD: Duration = Duration::from_millis(50);
/// How often the monitor says how it stands, in seconds.
const PROGRESS_PERIOD_S: &str = "0.2";
/// How long a child may take to end: a recorder has to write what is in flight.
const PATIENCE: Duration = Duration::from_secs(30);
/// How often one child is started again before the show gives up.
const MAX_RESTARTS: u32 = 5;

/// How the name of a show's folder begins that was not given one.
const FOLDER_PREFIX: &str = "show-";

pub(crate) fn run(args: &ShowArgs) -> anyhow::Result<ExitCode> {
    let config = configure(&args.config, &args.pace)?;
    check_pace(&config, &args.pace)?;
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    repair_earlier_shows();
    let folder = make_folder(args.out.as_deref())?;
    fs::write(folder.join("config.toml"), config.to_toml()).context("cannot write into the show's folder")?;
    let mut show = Show::start(args, &config, domain, folder)?;
    let outcome = show.follow(&stop);
    let summary = show.finish(outcome)?;
    print_report(args.format.format, &summary, &show.folder)?;
    let failed = args.fail_on_contact && summary.contact.is_some();
    Ok(if failed { ExitCode::from(CONTACT) } else { ExitCode::SUCCESS })
}

/// Finishes what killed shows left in the current folder. The show's own folder is its recorder's affair.
fn repair_earlier_shows() {
    let Ok(entries) = fs::read_dir(".") else { return };
    for folder in entries.flatten().map(|entry| entry.path()).filter(|path| path.is_dir()) {
        if folder.file_name().is_some_and(|name| name.to_string_lossy().starts_with(FOLDER_PREFIX)) {
            repair_around(&folder.join("recording.mcap"));
        }
    }
}

/// The folder of the show's files: made where it is missing.
fn make_folder(out: Option<&Path>) -> anyhow::Result<PathBuf> {
    let folder = out.map_or_else(
        || PathBuf::from(format!("{FOLDER_PREFIX}{}", jiff::Zoned::now().strftime("%Y%m%d-%H%M%S"))),
        Path::to_owned,
    );
    fs::create_dir_all(&folder).map_err(|error| {
        BadInput(format!("--out is {}, must be a folder that can be made: {error}", folder.display()))
    })?;
    Ok(folder)
}

/// A show in progress.
struct Show<'a> {
    args: &'a ShowArgs,
    domain: Domain,
    folder: PathBuf,
    events: Receiver<Event>,
    sender: Sender<Event>,
    serve: Option<Child>,
    monitor: Option<Child>,
    record: Option<Child>,
    /// The recordings, oldest first.
    recordings: Vec<PathBuf>,
    frames: Option<FrameSubscriber>,
    status: Option<StatusReader>,
    last: Option<FrameHeader>,
    walking_speed_mps: Option<f64>,
    progress: MonitorProgress,
    tally: Tally,
    line: LiveLine,
}

impl<'a> Show<'a> {
    fn start(args: &'a ShowArgs, config: &Config, domain: Domain, folder: PathBuf) -> anyhow::Result<Self> {
        let (sender, events) = channel::unbounded();
        let end_s = args.pace.until.unwrap_or_else(|| config.end_s());
        let mut show = Self {
            args,
            domain,
            folder,
            events,
            sender,
            serve: None,
            monitor: None,
            record: None,
            recordings: Vec::new(),
            frames: None,
            status: None,
            last: None,
            walking_speed_mps: None,
            progress: MonitorProgress::default(),
            tally: Tally::default(),
            line: LiveLine::new(end_s),
        };
        show.start_server()?;
        show.await_server()?;
        show.start_monitor()?;
        show.start_recorder()?;
        Ok(show)
    }

    /// Follows the show until a contact, the end or a signal.
    fn follow(&mut self, stop: &StopFlag) -> anyhow::Result<()> {
        while !stop.is_set() && self.tally.contact.is_none() {
            match self.events.recv_timeout(LOOK_PERIOD) {
                Ok(Event::Line(role, line)) => self.take_line(role, &line)?,
                Ok(Event::Closed(role)) => self.restart(role)?,
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => unreachable!("the show holds a sender itself"),
            }
            self.look_at_bus()?;
            if self.last.is_some_and(|header| header.show_state() == Some(ShowState::Finished)) {
                break;
            }
        }
        Ok(())
    }

    /// Ends the children in order and writes the summary, also where `outcome` says that the show went wrong.
    fn finish(&mut self, outcome: anyhow::Result<()>) -> anyhow::Result<ShowSummary> {
        self.end_children([Role::Serve])?;
        // Late news of the last tick may still be in the buffers.
        self.look_at_bus()?;
        self.frames = None;
        self.status = None;
        self.end_children([Role::Monitor, Role::Record])?;
        self.line.clear();
        outcome?;
        let recording = self.recordings.first().cloned().unwrap_or_default();
        let summary = self.tally.summary(recording);
        let path = self.folder.join("summary.json");
        let text = serde_json::to_string_pretty(&summary)? + "\n";
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(summary)
    }

    fn end_children<const COUNT: usize>(&mut self, roles: [Role; COUNT]) -> anyhow::Result<()> {
        let children: Vec<(Role, Child)> =
            roles.into_iter().filter_map(|role| self.child(role).take().map(|child| (role, child))).collect();
        for (_, child) in &children {
            child.terminate();
        }
        let mut open: Vec<Role> = children.iter().map(|(role, _)| *role).collect();
        let deadline = Instant::now() + PATIENCE;
        while !open.is_empty() && Instant::now() < deadline {
            match self.events.recv_timeout(LOOK_PERIOD) {
                Ok(Event::Line(role, line)) => self.take_line(role, &line)?,
                Ok(Event::Closed(role)) => open.retain(|&other| other != role),
                Err(_) => {}
            }
        }
        for (role, child) in children {
            let status = child.wait(deadline.saturating_duration_since(Instant::now()))?;
            if !status.success() {
                complain(&format!("{} ended with {status}", role.name()));
            }
        }
        Ok(())
    }

    fn child(&mut self, role: Role) -> &mut Option<Child> {
        match role {
            Role::Serve => &mut self.serve,
            Role::Monitor => &mut self.monitor,
            Role::Record => &mut self.record,
        }
    }

    fn take_line(&mut self, role: Role, line: &str) -> anyhow::Result<()> {
        let unreadable = || format!("{} printed {line:?}", role.name());
        match role {
            Role::Serve => {
                if let ServeLine::Summary(summary) = serde_json::from_str(line).with_context(unreadable)? {
                    self.tally.add_server(&summary);
                }
            }
            Role::Monitor => self.take_monitor_line(serde_json::from_str(line).with_context(unreadable)?),
            Role::Record => match serde_json::from_str(line).with_context(unreadable)? {
                RecordLine::Started { .. } => {}
                RecordLine::Warning { message } => self.line.say(&format!("warning: {message}")),
                RecordLine::Summary(summary) => self.tally.add_recorder(&summary),
            },
        }
        Ok(())
    }

    fn take_monitor_line(&mut self, line: MonitorLine) {
        match line {
            MonitorLine::Progress(progress) => self.progress = progress,
            MonitorLine::Summary(summary) => {
                self.tally.add_monitor(&summary);
                self.progress = MonitorProgress::default();
            }
            MonitorLine::Alert(alert) => {
                let benches = alert.benches.map_or(String::new(), |[a, b]| format!(", benches {a} and {b}"));
                self.line.say(&format!("{:.6} s: {}{benches}", alert.time_s, alert.kind));
                if let (true, Some(benches)) = (alert.kind == AlertKind::Contact.name(), alert.benches) {
                    self.tally.contact.get_or_insert(ContactReport { time_s: alert.time_s, benches });
                }
            }
        }
    }

    fn look_at_bus(&mut self) -> anyhow::Result<()> {
        let newest = self.frames.as_mut().map(FrameSubscriber::latest).transpose()?.flatten();
        if let Some(frame) = newest {
            let header = *frame.header();
            self.tally.see_frame(&header);
            self.line.update(&header, &self.progress);
            if header.show_state() == Some(ShowState::Running) {
                self.walking_speed_mps = Some(header.head_speed_mps);
            }
            self.last = Some(header);
        }
        if let Some(status) = self.status.as_ref().map(StatusReader::poll).transpose()?.flatten() {
            self.tally.see_status(&status);
        }
        Ok(())
    }

    /// Starts a child again that has ended before the show.
    fn restart(&mut self, role: Role) -> anyhow::Result<()> {
        let Some(child) = self.child(role).take() else { return Ok(()) };
        let status = child.wait(PATIENCE)?;
        self.look_at_bus()?;
        if role == Role::Serve && status.success() {
            // Somebody asked the server to stop, or it has reached the time asked for.
            return self.end_with_server();
        }
        let restarts = match role {
            Role::Serve => &mut self.tally.restarts.serve,
            Role::Monitor => &mut self.tally.restarts.monitor,
            Role::Record => &mut self.tally.restarts.record,
        };
        *restarts += 1;
        if *restarts > MAX_RESTARTS {
            bail!("{} has ended {restarts} times, the last time with {status}: giving up", role.name());
        }
        self.line.say(&format!("{} ended with {status}: starting it again", role.name()));
        match role {
            Role::Serve => self.start_server(),
            Role::Monitor => {
                // What a killed monitor had read since its last word is counted as missed.
                self.tally.add_monitor_progress(&std::mem::take(&mut self.progress));
                self.start_monitor()
            }
            Role::Record => {
                self.recover_recording()?;
                self.start_recorder()
            }
        }
    }

    fn start_server(&mut self) -> anyhow::Result<()> {
        let mut args = self.bus_args();
        args.extend(["--config".to_owned(), self.folder.join("config.toml").display().to_string()]);
        args.extend(["--readers".to_owned(), READERS.to_string()]);
        if let Some(until_s) = self.args.pace.until {
            args.push(format!("--until={until_s}"));
        }
        match self.last {
            None => args.push(format!("--start-at={}", self.args.pace.start_at)),
            Some(header) => {
                args.push(format!("--start-at={}", header.sim_time_s()));
                args.push(format!("--start-travel={}", header.head_travel_m));
                args.extend(self.walking_speed_mps.map(|speed_mps| format!("--start-speed={speed_mps}")));
                let walked = header.show_state() == Some(ShowState::Running);
                if !(self.args.auto_resume && walked) {
                    args.push("--held".to_owned());
                    self.line.say("the dragon stands where it was, held: `bench-dragon ctl release` lets it walk");
                }
            }
        }
        self.serve = Some(Child::start(Role::Serve, &args, self.sender.clone())?);
        Ok(())
    }

    /// Waits for the first server to be there, and joins its bus.
    fn await_server(&mut self) -> anyhow::Result<()> {
        loop {
            match self.events.recv().expect("the show holds a sender itself") {
                Event::Line(Role::Serve, _) => break,
                Event::Closed(Role::Serve) => bail!("the server does not start"),
                _ => {}
            }
        }
        self.frames = Some(FrameSubscriber::open(&self.domain, "show")?);
        self.status = Some(StatusReader::open(&self.domain, "show-status")?);
        Ok(())
    }

    fn start_monitor(&mut self) -> anyhow::Result<()> {
        let mut args = self.bus_args();
        args.extend(["--progress".to_owned(), PROGRESS_PERIOD_S.to_owned()]);
        self.monitor = Some(Child::start(Role::Monitor, &args, self.sender.clone())?);
        Ok(())
    }

    fn start_recorder(&mut self) -> anyhow::Result<()> {
        let recording = free_recording(&self.folder);
        let args = [vec![recording.display().to_string()], self.bus_args()].concat();
        self.recordings.push(recording);
        self.record = Some(Child::start(Role::Record, &args, self.sender.clone())?);
        Ok(())
    }

    /// Finishes the file of a recorder that was killed, and counts the frames in it.
    fn recover_recording(&mut self) -> anyhow::Result<()> {
        let Some(recording) = self.recordings.last().filter(|recording| recording.exists()) else { return Ok(()) };
        let repaired = repair(recording)?;
        self.tally.add_recovered(repaired.frames);
        Ok(())
    }

    fn end_with_server(&mut self) -> anyhow::Result<()> {
        if let Some(header) = &mut self.last {
            header.state = ShowState::Finished.to_wire();
            return Ok(());
        }
        bail!("the server ended before its first frame")
    }

    fn bus_args(&self) -> Vec<String> {
        vec!["--instance".to_owned(), self.domain.instance().to_string()]
    }
}

/// A name for a recording that is not taken: `recording.mcap`, `recording-2.mcap` and so on.
fn free_recording(folder: &Path) -> PathBuf {
    let name = |number: u32| match number {
        1 => folder.join("recording.mcap"),
        number => folder.join(format!("recording-{number}.mcap")),
    };
    (1..=u32::MAX).map(name).find(|path| !path.exists()).expect("a folder holds fewer files than that")
}

fn print_report(format: Format, summary: &ShowSummary, folder: &Path) -> anyhow::Result<()> {
    if format == Format::Json {
        return Ok(print_line(serde_json::to_string(summary)?)?);
    }
    let frames = &summary.frames;
    match summary.contact {
        Some(ContactReport { time_s, benches: [a, b] }) => {
            print_line(format_args!("first contact   {time_s:.6} s, benches {a} and {b}"))?;
        }
        None => print_line("first contact   none")?,
    }
    print_line(format_args!(
        "frames          {} published, {} monitored ({} missed), {} recorded ({} missed)",
        frames.published, frames.monitored, frames.missed_by_monitor, frames.recorded, frames.missed_by_recorder
    ))?;
    print_line(format_args!("lateness        {}", percentiles(&summary.lateness_us)))?;
    print_line(format_args!("latency         {}, frame due to frame monitored", percentiles(&summary.latency_us)))?;
    print_line(format_args!("overruns        {}", summary.overruns))?;
    print_line(format_args!("in              {}", folder.display()))?;
    Ok(())
}

fn percentiles(Percentiles { p50, p99, p999, max }: &Percentiles) -> String {
    format!("p50 {p50:.1}  p99 {p99:.1}  p99.9 {p999:.1}  max {max:.1} \u{b5}s")
}

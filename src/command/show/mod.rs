//! `show`: runs serve, monitor and record, and optionally a page and configured commands, as child processes. Supervises them
//! until the end, then prints a report.
//!
//! The order matters at the start and at the end. At the start the page comes first, so that people can open it early. The
//! server waits for its three readers (monitor, recorder and the show itself), so that tick 0 reaches all of them. The
//! configured commands start with the first frame. At the end the server stops first; then its readers process the frames in
//! their buffers; the page ends last. A thread finishes unfinished recordings meanwhile; only the summary waits for it.

use std::fs;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use bench_dragon_ipc::{Domain, Request};
use clap::{Args, ValueHint};

use crate::command::exit_status::CONTACT;
use crate::command::flags::{FormatArgs, listen_address};
use crate::command::serve::{RunArgs, check_pace, configure, end_s};
use crate::command::timecode;
use crate::config::Config;
use crate::output::set_live_line;
use crate::system::machine::Machine;
use crate::system::stop::StopFlag;

mod also;
mod bus;
mod children;
mod course;
mod files;
mod holds;
mod live_line;
mod liveness;
mod outcome;
mod process;
mod report;
mod reports;
mod start;
mod summary;
mod supervise;
mod timeline;
mod wall_time;

use also::AlsoCommand;
use bus::{LastSeen, ShowPorts};
use children::{ChildNews, ChildRole, Children};
use files::{Folder, Repairs};
use process::END_TIMEOUT;
use report::ReportSource;
use reports::ChildReports;
use start::Page;
use summary::{ShowSummary, print_summary};
use wall_time::WallTime;

/// Run a show: serve, monitor and record until the first contact, the end or Ctrl-C, then print a report.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon show --time-scale 20
  bench-dragon show --config stage.toml --out rehearsal-3 --fail-on-contact
  bench-dragon show --held --view             waits at the start for `ctl release`
  bench-dragon show --guard --start-at 405
  bench-dragon show --view --time-scale 20    with a page for the browser; prints its address

With --timecode the show continues until Ctrl-C or `ctl stop`, because the timecode may move back from the end.

The configuration may list up to eight commands that run beside the show and restart like its own processes: [[show.also]] \
command = \"bridge psn --interface 10.0.0.5\". Allowed are bridge, view, metrics, monitor, hz and echo.")]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag")]
pub(crate) struct ShowArgs {
    #[command(flatten)]
    pub(crate) run: RunArgs,
    /// Folder for the recording and summary.json; it must not contain an earlier show [default: show-DATE-TIME in the current
    /// folder].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    /// Start held: the dragon stands still until `ctl release`.
    #[arg(long)]
    pub(crate) held: bool,
    /// After a restart of the server, let the dragon walk on at once, instead of holding it until `ctl release`.
    #[arg(long)]
    pub(crate) auto_resume: bool,
    /// Keep benches from touching: a guard stops the head before a contact, and the show ends there.
    #[arg(long)]
    pub(crate) guard: bool,
    /// Exit with status 3 if benches touched.
    #[arg(long)]
    pub(crate) fail_on_contact: bool,
    /// Serve a page that shows and steers the show, and print its address; port 0 takes a free one [without a value:
    /// 127.0.0.1:8223].
    #[arg(
        long,
        value_name = "ADDRESS:PORT",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "127.0.0.1:8223",
        value_parser = listen_address
    )]
    pub(crate) view: Option<SocketAddr>,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Period at which the show reads the bus.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

pub(crate) fn run(args: &ShowArgs) -> anyhow::Result<ExitCode> {
    let config = configure(&args.run.config, &args.run.pace, args.guard)?;
    check_pace(&config, &args.run.pace)?;
    timecode::check(&args.run.timecode, &config)?;
    let also = AlsoCommand::read_all(&config.also(), &args.run.bus.instance)?;
    let domain = args.run.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let page = args.view.map(Page::new).transpose()?;
    let folder = Folder::claim(args.out.as_deref(), &config)?;
    let mut show = Show::new(args, &config, domain, folder, page, also);
    let played = show.play(&stop);
    let (summary, result) = show.finish(played);
    // The summary comes first, so that an error is the last line.
    if let Some(summary) = &summary {
        print_summary(args.format.format, summary, &show.folder)?;
    }
    result?;
    let summary = summary.expect("only a show with an error has none");
    let touched = args.fail_on_contact && summary.contact.is_some();
    Ok(match (touched, show.reports.has_given_up) {
        (true, _) => ExitCode::from(CONTACT),
        (false, true) => ExitCode::FAILURE,
        (false, false) => ExitCode::SUCCESS,
    })
}

/// A running show.
struct Show<'a> {
    args: &'a ShowArgs,
    config: &'a Config,
    domain: Domain,
    folder: Folder,
    /// Whether a guard keeps the benches from touching.
    is_guarded: bool,
    /// Longest time for which the head may brake before the server ends.
    braking: Duration,
    children: Children,
    /// The page; `None` without `--view`.
    page: Option<Page>,
    /// The configured commands.
    also: Vec<AlsoCommand>,
    /// The bus, after the first server has started.
    bus: Option<ShowPorts>,
    seen: LastSeen,
    reports: ChildReports,
    repairs: Repairs,
    /// Instant of the next check for room on a full disk.
    room_due: Instant,
    /// Whether frames have arrived.
    has_begun: bool,
    /// Whether the server has ended as requested.
    is_stopped: bool,
}

impl<'a> Show<'a> {
    fn new(
        args: &'a ShowArgs,
        config: &'a Config,
        domain: Domain,
        folder: Folder,
        page: Option<Page>,
        also: Vec<AlsoCommand>,
    ) -> Self {
        let start_s = args.run.pace.start_at.unwrap_or_else(|| config.start_s());
        let end_s = args.run.pace.until.unwrap_or_else(|| end_s(config, start_s));
        let mut children = Children::new();
        for (role, name) in
            [(ChildRole::Serve, "serve"), (ChildRole::Monitor, "monitor"), (ChildRole::Record, "record")]
        {
            children.register(role, name);
        }
        if page.is_some() {
            children.register(ChildRole::View, "view");
        }
        for (number, command) in also.iter().enumerate() {
            children.register(ChildRole::Also(number), &*command.name);
        }
        Self {
            args,
            config,
            domain,
            folder,
            is_guarded: config.tables().monitor.guard,
            braking: longest_braking(config),
            children,
            page,
            also,
            bus: None,
            seen: LastSeen::default(),
            reports: ChildReports::new(start_s, end_s, args.format.format),
            repairs: Repairs::new(),
            room_due: Instant::now(),
            has_begun: false,
            is_stopped: false,
        }
    }

    /// Plays the show until it is over, or until a signal.
    fn play(&mut self, stop: &StopFlag) -> anyhow::Result<()> {
        self.start(if self.page.is_some() { ChildRole::View } else { ChildRole::Serve })?;
        while !stop.is_set() && !self.is_over() {
            match self.children.next(LOOK_PERIOD)? {
                Some(ChildNews::Line(role, line)) => self.take_line(role, &line)?,
                Some(ChildNews::Ended(role, end)) => self.take_end(role, &end)?,
                None => {}
            }
            self.supervise()?;
        }
        Ok(())
    }

    /// Whether the show is over: after a contact, a permanent stop by the guard, or the end of the run. A show that follows
    /// timecode is over only when its server ends, because the timecode may move back.
    fn is_over(&self) -> bool {
        let known = &self.reports.totals.summary;
        let is_at_its_end = known.contact.is_some() || known.guard.is_some() || self.seen.is_finished();
        self.is_stopped || is_at_its_end && self.args.run.timecode.source.is_none()
    }

    /// Ends the children in order, and writes the summary and the report. `played` is the result of [`Show::play`]. Returns the
    /// summary, unless the show has not begun, and the first error of the show and of its end.
    fn finish(&mut self, played: anyhow::Result<()>) -> (Option<ShowSummary>, anyhow::Result<()>) {
        let ended = self.end_all(&played);
        let result = played.and(ended);
        if result.is_err() && self.seen.header.is_none() {
            self.folder.remove_unused();
            return (None, result);
        }
        let course = self.reports.course.report(WallTime::now());
        let summary = ShowSummary { course, ..self.reports.totals.summary() };
        let written = self.folder.write_summary(&summary).and(self.write_report(&summary));
        (Some(summary), result.and(written))
    }

    /// Ends the children in order, all of them also after an error. Returns the first error.
    fn end_all(&mut self, _played: &anyhow::Result<()>) -> anyhow::Result<()> {
        let stopped = self.end_children(|role| role == ChildRole::Serve, END_TIMEOUT + self.braking);
        // The last frame and status may still be in the buffers.
        let looked = self.look_at_bus();
        self.reports.totals.summary.outcome = Some(outcome::Ending::ServerEnded.into());
        self.bus = None;
        let read = self.end_children(|role| role != ChildRole::View, END_TIMEOUT);
        // A child that was killed during its end has printed no summary.
        self.reports.close_monitor();
        self.finish_recording();
        set_live_line(None);
        let closed = self.end_children(|_| true, END_TIMEOUT);
        self.repairs.finish().into_iter().for_each(|repaired| self.count_repaired(repaired));
        stopped.and(looked).and(read).and(closed)
    }

    fn write_report(&self, summary: &ShowSummary) -> anyhow::Result<()> {
        let size = |path: &PathBuf| fs::metadata(path).ok().map(|file| file.len());
        let recordings: Vec<_> = summary.recordings.iter().map(|path| (path.clone(), size(path))).collect();
        let source = ReportSource {
            summary,
            config: self.config,
            config_file: self.args.run.config.config.as_deref(),
            folder: &fs::canonicalize(&self.folder.path).unwrap_or_else(|_| self.folder.path.clone()),
            instance: &self.domain.instance().to_string(),
            machine: &Machine::read(),
            recordings: &recordings,
        };
        self.folder.write_report(&source.report().html())
    }

    fn end_children(&mut self, is_meant: impl Fn(ChildRole) -> bool, timeout: Duration) -> anyhow::Result<()> {
        let Self { children, reports, .. } = self;
        children.end(is_meant, timeout, |role, line| reports.take_line(role, line))
    }
}

/// Longest braking of the head. After this time the show kills the server.
const LONGEST_BRAKING: Duration = Duration::from_hours(1);

/// Wall time in which the head brakes from the greatest allowed speed to rest.
fn longest_braking(config: &Config) -> Duration {
    let braking_s = config.tables().head.accel_mps2.map_or(0.0, |accel_mps2| Request::MAX_SPEED_MPS / accel_mps2);
    Duration::try_from_secs_f64(braking_s / config.tables().serve.time_scale)
        .unwrap_or(LONGEST_BRAKING)
        .min(LONGEST_BRAKING)
}

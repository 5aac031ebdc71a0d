//! `show`: runs serve, monitor and record, and optionally a page and configured commands, as child processes. Supervises them
//! until the end, then prints a report.
//!
//! The order matters at the start and at the end. At the start the page comes first, so that people can open it early. The
//! server waits for its three readers (monitor, recorder and the show itself), so that tick 0 reaches all of them. The
//! configured commands start with the first frame. At the end the server stops first; then its readers process the frames in
//! their buffers; the page ends last. A thread finishes unfinished recordings meanwhile; only the summary waits for it.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use bench_dragon_ipc::source::ShowLock;
use bench_dragon_ipc::{Domain, Request};
use clap::{Args, ValueHint};

use crate::cli::exit_status::CONTACT;
use crate::cli::flags::{FormatArgs, ReaderWaitArgs, listen_address, within};
use crate::cli::serve::{RunArgs, check_pace, configure, end_s};
use crate::cli::timecode;
use crate::config::Config;
use crate::system::stop::StopFlag;

mod also;
mod auto_go;
mod bus;
mod children;
mod course;
mod cue_log;
mod files;
mod finish;
mod holds;
mod live_line;
mod liveness;
mod outcome;
mod printed;
mod process;
mod report;
mod reports;
mod resumption;
mod start;
mod summary;
mod supervise;
mod timeline;
mod wall_time;

pub use bus::LastSeen;
pub use liveness::{LONGEST_DISK_SILENCE, LONGEST_LOOK, LONGEST_SILENCE, Liveness, Look, MAX_RESTARTS, Phase};
pub use resumption::{Resumption, ResumptionSettings};
pub use supervise::LEAST_ROOM_BYTES;

pub(crate) use also::AlsoCommand;
use auto_go::AutoGo;
use bus::ShowPorts;
use children::{ChildNews, ChildRole, Children};
use files::{Folder, Repairs};
pub(crate) use files::{SUMMARY, create_private, used_before};
use live_line::ShowEnd;
use outcome::Ending;
use printed::print_summary;
use reports::ChildReports;
use start::Page;
use wall_time::log;

/// Run a show: serve, monitor and record, as a rehearsal or as a performance (--stay), then print a report.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon show --time-scale 20
  bench-dragon show --config stage.toml --out rehearsal-3 --fail-on-contact
  bench-dragon show --held --stay --view      a performance: waits for `ctl release`, ends by `ctl stop`
  bench-dragon show --guard --start-at 405
  bench-dragon show --config night.toml --auto-go 5 --time-scale 20      all cues, without an operator
  bench-dragon show --view --time-scale 20    with a page for the browser; prints its address

A rehearsal ends itself: at the first contact, where the guard holds the dragon permanently, at the end of the run, or after \
a process has ended too often. Its report names the reason. A performance (--stay) ends by Ctrl-C or `ctl stop` alone, and \
restarts its processes for ever. At the guard's stop the dragon stands held, at the end of the run it stands finished; after a \
contact it walks on. A seek moves it from there.

With --timecode a rehearsal also continues until Ctrl-C or `ctl stop`, because the timecode may move back from the end.

The configuration may list up to eight commands that run beside the show and restart like its own processes: [[show.also]] \
command = \"bridge psn --interface 10.0.0.5\". Allowed are bridge, view, metrics, monitor, hz and echo.")]
pub(crate) struct ShowArgs {
    #[command(flatten)]
    pub(crate) run: RunArgs,
    /// Folder for the recording, report.html and summary.json; it must not contain an earlier show [default: show-DATE-TIME in
    /// the current folder].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) manner: MannerArgs,
    #[command(flatten)]
    pub(crate) wait: ReaderWaitArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// The flags for how a show is played. `doctor --tonight` takes them, too.
#[derive(Clone, Copy, Debug, Args)]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag")]
pub(crate) struct MannerArgs {
    /// Wait at the start: the dragon stands still until `ctl release`.
    #[arg(long)]
    pub(crate) held: bool,
    /// Play a performance: only `ctl stop` or Ctrl-C ends the show [also by configuration: `[show] stay = true`].
    #[arg(long)]
    pub(crate) stay: bool,
    /// After a restart of the server, let the dragon walk on at once, instead of holding it until `ctl release`.
    #[arg(long)]
    pub(crate) auto_resume: bool,
    /// Rehearse alone: give GO this many seconds of wall time after the show has begun to wait at a cue, 0 to 3600.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = within(0.0..=3600.0))]
    pub(crate) auto_go: Option<f64>,
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
}

/// Period at which the show reads the bus.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

pub(crate) fn run(args: &ShowArgs) -> anyhow::Result<ExitCode> {
    let config = configure(&args.run.config, &args.run.pace, args.manner.guard)?;
    check_pace(&config, &args.run.pace)?;
    timecode::check_show(&args.run.timecode, &config)?;
    let also = AlsoCommand::read_all(&config.also(), &args.run.bus.instance)?;
    let domain = args.run.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    // Held until the end: while this show restarts its server, no other one takes its place.
    let _lock = ShowLock::take(&domain)?;
    let page = args.manner.view.map(Page::new).transpose()?;
    let folder = Folder::claim(args.out.as_deref(), &config)?;
    let mut show = Show::new(args, &config, domain, folder, page, also, stop);
    let played = show.play();
    let (summary, result) = show.finish(played);
    // The summary comes first, so that an error of the show is the last line.
    let print = |summary| print_summary(args.format.format, summary, &show.folder);
    let printed = summary.as_ref().map_or(Ok(()), print);
    result.and(printed)?;
    let summary = summary.expect("only a show with an error has none");
    let has_touched = args.manner.fail_on_contact && summary.contact.is_some();
    Ok(match (has_touched, show.reports.has_given_up) {
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
    /// Whether only the operator ends the show.
    is_performance: bool,
    /// Longest time for which the head may brake before the server ends.
    braking: Duration,
    children: Children,
    /// The page; `None` without `--view`.
    page: Option<Page>,
    /// The configured commands.
    also: Vec<AlsoCommand>,
    /// The bus, after the first server has started.
    bus: Option<ShowPorts>,
    auto_go: Option<AutoGo>,
    seen: LastSeen,
    reports: ChildReports,
    repairs: Repairs,
    /// Instant of the next check for room on a full disk.
    room_due: Instant,
    /// Whether frames have arrived.
    has_begun: bool,
    /// Whether the server has ended as requested.
    is_stopped: bool,
    /// Why the show cannot go on.
    failure: Option<Ending>,
    /// The last error after which the performance went on.
    borne: Option<String>,
    stop: StopFlag,
}

impl<'a> Show<'a> {
    fn new(
        args: &'a ShowArgs,
        config: &'a Config,
        domain: Domain,
        folder: Folder,
        page: Option<Page>,
        also: Vec<AlsoCommand>,
        stop: StopFlag,
    ) -> Self {
        let start_s = args.run.pace.start_at.unwrap_or_else(|| config.start_s());
        let end = ShowEnd {
            planned_s: args.run.pace.until.unwrap_or_else(|| end_s(config, start_s)),
            travel_m: args.run.pace.until.is_none().then(|| config.formation().end_m()),
            // A plan has its own ramps.
            accel_mps2: config.tables().head.accel_mps2.filter(|_| !config.formation().has_plan_course()),
        };
        let is_performance = args.manner.stay || config.stays();
        let mut children = Children::new(is_performance);
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
            is_performance,
            braking: longest_braking(config),
            children,
            page,
            also,
            bus: None,
            auto_go: None,
            seen: LastSeen::default(),
            reports: ChildReports::new(config.cues(), start_s, end, args.format.format),
            repairs: Repairs::new(),
            room_due: Instant::now(),
            has_begun: false,
            is_stopped: false,
            failure: None,
            borne: None,
            stop,
        }
    }

    /// Whether a guard keeps the benches from touching.
    fn is_guarded(&self) -> bool {
        self.config.tables().monitor.guard
    }

    /// Plays the show until it is over, or until a signal.
    fn play(&mut self) -> anyhow::Result<()> {
        self.start(if self.page.is_some() { ChildRole::View } else { ChildRole::Serve })?;
        while !self.stop.is_set() && self.over().is_none() {
            self.take_turn().or_else(|error| self.bear(error))?;
        }
        Ok(())
    }

    /// Handles the next event, then looks after all children.
    fn take_turn(&mut self) -> anyhow::Result<()> {
        let taken = match self.children.next(LOOK_PERIOD)? {
            Some(ChildNews::Line(role, line)) => self.take_line(role, &line),
            Some(ChildNews::Ended(role, end)) => self.take_end(role, &end),
            None => Ok(()),
        };
        taken.and(self.supervise())
    }

    /// A performance on stage goes on after an error of the show itself, and reports it once.
    fn bear(&mut self, error: anyhow::Error) -> anyhow::Result<()> {
        if !self.is_performance || self.bus.is_none() {
            return Err(error);
        }
        let text = format!("{error:#}: the performance goes on");
        if self.borne.as_ref() != Some(&text) {
            log(&text);
            self.borne = Some(text);
        }
        Ok(())
    }
}

/// Longest braking of the head. After this time the show kills the server.
const LONGEST_BRAKING: Duration = Duration::from_hours(1);

/// Wall time in which the head brakes from the greatest allowed speed to rest.
fn longest_braking(config: &Config) -> Duration {
    let braking_s = config.accel_mps2().map_or(0.0, |accel_mps2| Request::MAX_SPEED_MPS / accel_mps2);
    Duration::try_from_secs_f64(braking_s / config.tables().serve.time_scale)
        .unwrap_or(LONGEST_BRAKING)
        .min(LONGEST_BRAKING)
}

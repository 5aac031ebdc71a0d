//! `show`: serve, monitor, record, perhaps a page and configured commands as child processes, supervised until the end, then a
//! report.
//!
//! The order matters at both ends. At the start the server waits for its three readers (monitor, recorder and the show
//! itself), so that tick 0 reaches all; the page is there before it, to be opened meanwhile, and the configured commands come
//! with the first frame. At the end the server stops first, and only then do its readers finish what is still in their
//! buffers; the page ends last. Unfinished recordings are finished meanwhile, by a thread that nothing here waits for but the
//! summary.

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
use crate::system::stop::StopFlag;

mod also;
mod bus;
mod children;
mod files;
mod live_line;
mod liveness;
mod process;
mod reports;
mod start;
mod summary;
mod supervise;

use also::AlsoCommand;
use bus::{LastSeen, ShowPorts};
use children::{ChildNews, ChildRole, Children};
use files::{Folder, Repairs};
use process::PATIENCE;
use reports::ChildReports;
use start::Page;
use summary::{ShowSummary, print_summary};

/// Play a show: serve, monitor and record until contact, the end or Ctrl-C, then report.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon show --time-scale 20
  bench-dragon show --config stage.toml --out rehearsal-3 --fail-on-contact
  bench-dragon show --guard --start-at 405
  bench-dragon show --view --time-scale 20    with a page for the browser, whose address is printed

With --timecode it goes on until Ctrl-C or `ctl stop`: the timecode may come back from wherever it has gone.

The configuration may name up to eight commands that run beside the show and are started again as its own children are: \
[[show.also]] command = \"bridge psn --interface 10.0.0.5\". They may be bridge, view, metrics, monitor, hz and echo.")]
pub(crate) struct ShowArgs {
    #[command(flatten)]
    pub(crate) run: RunArgs,
    /// Folder for the recording and summary.json, without those of an earlier show [default: show-DATE-TIME in the current folder].
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
    /// Let a restarted server walk on at once, instead of standing held until `ctl release`.
    #[arg(long)]
    pub(crate) auto_resume: bool,
    /// Keep benches from touching: the head rests before they would, and the show ends there.
    #[arg(long)]
    pub(crate) guard: bool,
    /// Exit with status 3 where benches touched.
    #[arg(long)]
    pub(crate) fail_on_contact: bool,
    /// Serve the page on which the show is seen and steered, and print its address; port 0 takes a free one.
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

/// How often the show looks at the bus.
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
    let outcome = show.play(&stop);
    let summary = show.finish(outcome)?;
    print_summary(args.format.format, &summary, &show.folder.path)?;
    let touched = args.fail_on_contact && summary.contact.is_some();
    Ok(match (touched, show.reports.has_given_up) {
        (true, _) => ExitCode::from(CONTACT),
        (false, true) => ExitCode::FAILURE,
        (false, false) => ExitCode::SUCCESS,
    })
}

/// A show in progress.
struct Show<'a> {
    args: &'a ShowArgs,
    domain: Domain,
    folder: Folder,
    /// Whether a guard keeps the benches from touching.
    is_guarded: bool,
    /// How long a server that is asked to end may brake.
    braking: Duration,
    children: Children,
    /// The page, where one was asked for.
    page: Option<Page>,
    /// The configured commands.
    also: Vec<AlsoCommand>,
    /// The bus, once there is a server.
    bus: Option<ShowPorts>,
    seen: LastSeen,
    reports: ChildReports,
    repairs: Repairs,
    /// When room on a full disk is looked for next.
    room_due: Instant,
    /// Whether frames have come.
    has_begun: bool,
    /// Whether the server has ended as it was asked to.
    is_stopped: bool,
}

impl<'a> Show<'a> {
    fn new(
        args: &'a ShowArgs,
        config: &Config,
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

    /// Plays the show until it is over, or a signal.
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

    /// Whether there was a contact, the guard's last word, or the end. A show that follows timecode is over when its server is:
    /// the timecode may come back from wherever it has gone.
    fn is_over(&self) -> bool {
        let known = &self.reports.totals.summary;
        let is_at_its_end = known.contact.is_some() || known.guard.is_some() || self.seen.is_finished();
        self.is_stopped || is_at_its_end && self.args.run.timecode.source.is_none()
    }

    /// Ends the children in order and writes the summary, also where `outcome` says that the show went wrong.
    fn finish(&mut self, outcome: anyhow::Result<()>) -> anyhow::Result<ShowSummary> {
        self.end_children(|role| role == ChildRole::Serve, PATIENCE + self.braking)?;
        // Late news of the last tick may still be in the buffers.
        self.look_at_bus()?;
        self.bus = None;
        self.end_children(|role| role != ChildRole::View, PATIENCE)?;
        // Of a child that was killed at the very end, what is known.
        self.reports.close_monitor();
        self.finish_recording();
        set_live_line(None);
        self.end_children(|_| true, PATIENCE)?;
        self.repairs.finish().into_iter().for_each(|repaired| self.count_repaired(repaired));
        if outcome.is_err() && self.seen.header.is_none() {
            self.folder.remove_unused();
        }
        outcome?;
        let summary = self.reports.totals.summary();
        self.folder.write_summary(&summary)?;
        Ok(summary)
    }

    fn end_children(&mut self, is_meant: impl Fn(ChildRole) -> bool, patience: Duration) -> anyhow::Result<()> {
        let Self { children, reports, .. } = self;
        children.end(is_meant, patience, |role, line| reports.take_line(role, line))
    }
}

/// A head that brakes for longer is stopped hard.
const LONGEST_BRAKING: Duration = Duration::from_hours(1);

/// Wall time in which the head comes to rest from the greatest speed that may be asked for.
fn longest_braking(config: &Config) -> Duration {
    let braking_s = config.tables().head.accel_mps2.map_or(0.0, |accel_mps2| Request::MAX_SPEED_MPS / accel_mps2);
    Duration::try_from_secs_f64(braking_s / config.tables().serve.time_scale)
        .unwrap_or(LONGEST_BRAKING)
        .min(LONGEST_BRAKING)
}

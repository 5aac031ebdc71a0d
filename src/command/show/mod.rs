//! `show`: serve, monitor, record and perhaps a page as child processes, looked after until the end, then a report.
//!
//! The order matters at both ends. At the start the server waits for its three readers (monitor, recorder and the show
//! itself), so that tick 0 reaches all; the page is there before it, to be opened meanwhile. At the end the server stops
//! first, and only then are the two readers asked to finish what is still in their buffers; the page ends last.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use bench_dragon::config::Config;
use bench_dragon::report::ShowSummary;
use bench_dragon::stop::StopFlag;
use bench_dragon_ipc::{BusError, Domain, FrameHeader, FrameSubscriber, ShowState, Status, StatusReader};

use crate::cli::ShowArgs;
use crate::command::serve::{check_pace, configure};
use crate::command::{CONTACT, timecode};

mod account;
mod child;
mod children;
mod folder;
mod live_line;
mod page;
mod patience;
mod report;
mod starting;
mod tally;
mod watch;

use account::Account;
use child::{Event, Role};
use children::Children;
use folder::{make_folder, remove_unused, repair_earlier_shows, write_config};
use page::Page;
use patience::{MAX_RESTARTS, WINDOW};
use report::print_report;
use watch::Watch;

/// How often the show looks at the bus.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

pub(crate) fn run(args: &ShowArgs) -> anyhow::Result<ExitCode> {
    let config = configure(&args.config, &args.pace, args.guard)?;
    check_pace(&config, &args.pace)?;
    timecode::check(&args.timecode, &config)?;
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    repair_earlier_shows();
    let folder = make_folder(args.out.as_deref())?;
    let _in_use = write_config(&folder, &config)?;
    let mut show = Show::new(args, &config, domain, folder)?;
    let outcome = show.play(&stop);
    let summary = show.finish(outcome)?;
    print_report(args.format.format, &summary, &show.folder)?;
    let touched = args.fail_on_contact && summary.contact.is_some();
    Ok(match (touched, show.account.has_given_up) {
        (true, _) => ExitCode::from(CONTACT),
        (false, true) => ExitCode::FAILURE,
        (false, false) => ExitCode::SUCCESS,
    })
}

/// How often a child has ended that the show gives up.
fn too_often() -> String {
    format!("has ended {MAX_RESTARTS} times again within {} minutes, the last time with", WINDOW.as_secs() / 60)
}

/// A show in progress.
struct Show<'a> {
    args: &'a ShowArgs,
    domain: Domain,
    folder: PathBuf,
    /// Whether a guard keeps the benches from touching.
    guarded: bool,
    children: Children,
    /// The page, where one was asked for.
    page: Option<Page>,
    frames: Option<FrameSubscriber>,
    status: Option<StatusReader>,
    last: Option<FrameHeader>,
    /// Travel up to which the guard has last let the head walk; not a number without one.
    granted_to_m: f64,
    /// Speed at which the head last walked.
    walking_speed_mps: Option<f64>,
    /// Whether the show was paused when it was last not held.
    paused: bool,
    account: Account,
    /// Which children are to be started again, and when.
    restarts: Vec<(Role, Instant)>,
    watch: Watch,
    /// Whether the server has ended as it was asked to.
    is_stopped: bool,
}

impl<'a> Show<'a> {
    fn new(args: &'a ShowArgs, config: &Config, domain: Domain, folder: PathBuf) -> anyhow::Result<Self> {
        let start_s = args.pace.start_at.unwrap_or_else(|| config.start_s());
        let end_s = args.pace.until.unwrap_or_else(|| config.end_s());
        Ok(Self {
            args,
            domain,
            folder,
            guarded: config.is_guarded(),
            children: Children::new(),
            page: args.view.map(Page::new).transpose()?,
            frames: None,
            status: None,
            last: None,
            granted_to_m: Status::NONE,
            walking_speed_mps: None,
            paused: false,
            account: Account::new(start_s, end_s, args.format.format),
            restarts: Vec::new(),
            watch: Watch::new(Instant::now()),
            is_stopped: false,
        })
    }

    /// Plays the show until it is over, or a signal.
    fn play(&mut self, stop: &StopFlag) -> anyhow::Result<()> {
        self.open_page(stop)?;
        self.start_server()?;
        self.await_server(stop)?;
        self.start_monitor()?;
        self.start_recorder()?;
        while !stop.is_set() && !self.is_over() {
            match self.children.next_event(LOOK_PERIOD) {
                Some(Event::Line(role, line)) => {
                    self.watch.hear(role);
                    self.account.take_line(role, &line)?;
                }
                Some(Event::Closed(role)) => self.take_end(role)?,
                None => {}
            }
            self.restart_due()?;
            self.look_at_bus()?;
            self.kill_silent();
        }
        Ok(())
    }

    /// Whether there was a contact, the guard's last word, or the end. A show that follows timecode is over when its server is:
    /// the timecode may come back from wherever it has gone.
    fn is_over(&self) -> bool {
        let is_finished = self.last.is_some_and(|header| header.show_state() == Some(ShowState::Finished));
        let is_at_its_end = self.account.tally.contact.is_some() || self.account.tally.guard.is_some() || is_finished;
        self.is_stopped || is_at_its_end && self.args.timecode.source.is_none()
    }

    /// Ends the children in order and writes the summary, also where `outcome` says that the show went wrong.
    fn finish(&mut self, outcome: anyhow::Result<()>) -> anyhow::Result<ShowSummary> {
        self.end_children(&[Role::Serve])?;
        // Late news of the last tick may still be in the buffers.
        self.look_at_bus()?;
        self.frames = None;
        self.status = None;
        self.end_children(&[Role::Monitor, Role::Record])?;
        // Of a child that was killed at the very end, what is known.
        self.account.close_monitor();
        self.account.close_recorder();
        self.account.line.clear();
        self.end_children(&[Role::View])?;
        if outcome.is_err() && self.last.is_none() && self.args.out.is_none() {
            remove_unused(&self.folder);
        }
        outcome?;
        let summary = self.account.summary();
        let path = self.folder.join("summary.json");
        let text = serde_json::to_string_pretty(&summary)? + "\n";
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))?;
        Ok(summary)
    }

    fn end_children(&mut self, roles: &[Role]) -> anyhow::Result<()> {
        let Self { children, account, .. } = self;
        children.end(roles, |role, line| account.take_line(role, line))
    }

    fn look_at_bus(&mut self) -> anyhow::Result<()> {
        let newest = self.frames.as_mut().map(FrameSubscriber::latest).transpose()?.flatten();
        if let Some(frame) = newest {
            let header = *frame.header();
            self.watch.hear(Role::Serve);
            self.account.tally.see_frame(&header);
            self.account.line.update(&header, &self.account.progress);
            match header.show_state() {
                Some(ShowState::Running) => {
                    (self.walking_speed_mps, self.paused) = (Some(header.head_speed_mps), false);
                }
                Some(ShowState::Paused) => self.paused = true,
                _ => {}
            }
            self.last = Some(header);
        }
        if let Some(status) = self.status.as_ref().map(StatusReader::poll).transpose()?.flatten() {
            self.account.tally.see_status(&status);
            self.granted_to_m = status.granted_to_m;
        }
        Ok(())
    }

    /// Takes note of a child that has ended before the show, and plans when to start it again.
    fn take_end(&mut self, role: Role) -> anyhow::Result<()> {
        let Some(status) = self.children.reap(role)? else { return Ok(()) };
        self.look_at_bus()?;
        if role == Role::Serve && status.success() {
            // Somebody asked the server to stop, or it has reached the time asked for.
            return self.end_with_server();
        }
        match role {
            Role::Serve | Role::View => {}
            Role::Monitor => self.account.close_monitor(),
            Role::Record => self.account.close_recorder(),
        }
        let now = Instant::now();
        let what = match (self.watch.after_end(role, now), role) {
            (Some(backoff), _) => {
                self.restarts.push((role, now + backoff));
                *self.account.tally.restarts(role) += 1;
                "starting it again"
            }
            (None, Role::Serve) => bail!("serve {} {status}: giving up", too_often()),
            // Without its guard the dragon stands for good.
            (None, Role::Monitor) if self.guarded => bail!("the guard {} {status}: giving up", too_often()),
            (None, Role::Monitor | Role::Record | Role::View) => {
                self.account.has_given_up = true;
                "the show goes on without it"
            }
        };
        self.account.line.say(&format!("{} ended with {status}: {what}", role.name()));
        Ok(())
    }

    /// Kills a child that has stopped without having ended; what follows is as after any other end.
    fn kill_silent(&mut self) {
        for role in self.watch.silent(Instant::now()) {
            let seconds = watch::LONGEST_SILENCE.as_secs();
            self.account.line.say(&format!("{} has shown no sign of life for {seconds} s: killing it", role.name()));
            self.children.kill(role);
        }
    }

    /// Starts the children again whose time has come.
    fn restart_due(&mut self) -> anyhow::Result<()> {
        let now = Instant::now();
        let due: Vec<Role> = self.restarts.iter().filter(|(_, at)| *at <= now).map(|(role, _)| *role).collect();
        self.restarts.retain(|(_, at)| *at > now);
        for role in due {
            match role {
                Role::Serve => self.start_server()?,
                Role::Monitor => self.start_monitor()?,
                Role::Record => self.start_recorder()?,
                Role::View => self.start_page()?,
            }
        }
        Ok(())
    }

    /// Waits for the first server to be there, and joins its bus. A signal ends the wait.
    fn await_server(&mut self, stop: &StopFlag) -> anyhow::Result<()> {
        while !stop.is_set() {
            match self.children.next_event(LOOK_PERIOD) {
                Some(Event::Line(Role::Serve, _)) => match self.join_bus() {
                    // It was killed as soon as it was there: its end comes next.
                    Err(error) if error.is_absent() => {}
                    joined => return Ok(joined?),
                },
                Some(Event::Closed(Role::Serve)) => self.take_early_end()?,
                Some(Event::Closed(role)) => self.take_end(role)?,
                _ => {}
            }
        }
        Ok(())
    }

    fn join_bus(&mut self) -> Result<(), BusError> {
        self.frames = Some(FrameSubscriber::open(&self.domain, "show")?);
        self.status = Some(StatusReader::open(&self.domain, "show-status")?);
        Ok(())
    }

    /// Starts a server again that was killed before it was there; one that has given its reason on stderr is not.
    fn take_early_end(&mut self) -> anyhow::Result<()> {
        match self.children.reap(Role::Serve)? {
            Some(status) if status.code().is_none() && self.watch.after_end(Role::Serve, Instant::now()).is_some() => {
                self.account.line.say(&format!("serve ended with {status}: starting it again"));
                *self.account.tally.restarts(Role::Serve) += 1;
                self.start_server()
            }
            Some(status) => bail!("the server does not start: it ended with {status}"),
            None => Ok(()),
        }
    }

    fn end_with_server(&mut self) -> anyhow::Result<()> {
        if self.last.is_none() {
            bail!("the server ended before its first frame");
        }
        self.is_stopped = true;
        Ok(())
    }
}

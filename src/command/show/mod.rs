//! `show`: serve, monitor and record as child processes, looked after until the end, then a report.
//!
//! The order matters at both ends. At the start the server waits for its three readers (monitor, recorder and the show
//! itself), so that tick 0 reaches all. At the end the server stops first, and only then are the two readers asked to
//! finish what is still in their buffers.

use std::fs;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::{Duration, Instant};

use anyhow::{Context as _, bail};
use bench_dragon::config::Config;
use bench_dragon::report::ShowSummary;
use bench_dragon::stop::StopFlag;
use bench_dragon::timecode::FrameRate;
use bench_dragon_ipc::{BusError, Domain, FrameHeader, FrameSubscriber, ShowState, Status, StatusReader};

use crate::cli::{ShowArgs, TimecodeArgs};
use crate::command::CONTACT;
use crate::command::serve::{check_pace, configure};
use crate::command::timecode::check_time_scale;

mod account;
mod child;
mod children;
mod folder;
mod live_line;
mod patience;
mod report;
mod tally;
mod watch;

use account::Account;
use child::{Event, Role};
use children::Children;
use folder::{free_recording, make_folder, repair_earlier_shows, write_config};
use patience::{MAX_RESTARTS, WINDOW};
use report::print_report;
use watch::Watch;

/// Readers that the server waits for: the monitor, the recorder and the show itself.
const READERS: usize = 3;
/// How often the show looks at the bus.
const LOOK_PERIOD: Duration = Duration::from_millis(50);
/// How often the monitor says how it stands, in seconds.
const PROGRESS_PERIOD_S: &str = "0.2";

/// What is told when a restarted server stands held.
const HELD: &str = "the dragon stands where it was, held: `bench-dragon ctl release` lets it walk";
pub(crate) fn run(args: &ShowArgs) -> anyhow::Result<ExitCode> {
    let config = configure(&args.config, &args.pace, args.guard)?;
    check_pace(&config, &args.pace)?;
    check_time_scale(&args.timecode, &config)?;
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    repair_earlier_shows();
    let folder = make_folder(args.out.as_deref())?;
    let _in_use = write_config(&folder, &config)?;
    let mut show = Show::new(args, &config, domain, folder);
    let outcome = show.play(&stop);
    let summary = show.finish(outcome)?;
    print_report(args.format.format, &summary, &show.folder)?;
    let touched = args.fail_on_contact && summary.contact.is_some();
    Ok(match (touched, show.given_up) {
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
    /// Whether a child ended so often that the show went on without it.
    given_up: bool,
}

impl<'a> Show<'a> {
    fn new(args: &'a ShowArgs, config: &Config, domain: Domain, folder: PathBuf) -> Self {
        let start_s = args.pace.start_at.unwrap_or_else(|| config.start_s());
        let end_s = args.pace.until.unwrap_or_else(|| config.end_s());
        Self {
            args,
            domain,
            folder,
            guarded: config.is_guarded(),
            children: Children::new(),
            frames: None,
            status: None,
            last: None,
            granted_to_m: Status::NONE,
            walking_speed_mps: None,
            paused: false,
            account: Account::new(start_s, end_s),
            restarts: Vec::new(),
            watch: Watch::new(Instant::now()),
            given_up: false,
        }
    }

    /// Plays the show until a contact, the guard's last word, the end or a signal.
    fn play(&mut self, stop: &StopFlag) -> anyhow::Result<()> {
        self.start_server()?;
        self.await_server(stop)?;
        self.start_monitor()?;
        self.start_recorder()?;
        while !stop.is_set() && self.account.tally.contact.is_none() && self.account.tally.guard.is_none() {
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
            if self.last.is_some_and(|header| header.show_state() == Some(ShowState::Finished)) {
                break;
            }
        }
        Ok(())
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
            Role::Serve => {}
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
            (None, Role::Monitor | Role::Record) => {
                self.given_up = true;
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
            }
        }
        Ok(())
    }

    fn start_server(&mut self) -> anyhow::Result<()> {
        let mut args = self.bus_args();
        args.extend(self.timecode_args());
        args.extend(["--config".to_owned(), self.folder.join("config.toml").display().to_string()]);
        args.extend(["--readers".to_owned(), READERS.to_string()]);
        if let Some(until_s) = self.args.pace.until {
            args.push(format!("--until={until_s}"));
        }
        match self.last {
            None => args.extend(self.args.pace.start_at.map(|start_s| format!("--start-at={start_s}"))),
            Some(header) => {
                args.push(format!("--start-at={}", header.sim_time_s()));
                args.push(format!("--start-travel={}", header.head_travel_m));
                args.extend(self.walking_speed_mps.map(|speed_mps| format!("--start-speed={speed_mps}")));
                // A show that follows timecode may only have stood with it; whoever paused it is asked once more.
                let was_paused = self.paused && self.args.timecode.source.is_some();
                if self.paused && !was_paused {
                    args.push("--paused".to_owned());
                }
                // A guard's stop is no hold: the next grant lifts it.
                let held_by_guard = header.head_travel_m == self.granted_to_m;
                let is_held = header.show_state() == Some(ShowState::Held) && !held_by_guard;
                if !self.args.auto_resume || is_held || was_paused {
                    args.push("--held".to_owned());
                    self.account.line.say(HELD);
                }
            }
        }
        self.children.start(Role::Serve, &args)
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

    fn start_monitor(&mut self) -> anyhow::Result<()> {
        let mut args = self.bus_args();
        args.extend(["--progress".to_owned(), PROGRESS_PERIOD_S.to_owned()]);
        if self.guarded {
            args.push("--guard".to_owned());
        }
        self.children.start(Role::Monitor, &args)
    }

    fn start_recorder(&mut self) -> anyhow::Result<()> {
        let recording = free_recording(&self.folder);
        let args = [vec![recording.display().to_string()], self.bus_args()].concat();
        self.children.start(Role::Record, &args)
    }

    fn end_with_server(&mut self) -> anyhow::Result<()> {
        if let Some(header) = &mut self.last {
            header.state = ShowState::Finished.to_wire();
            return Ok(());
        }
        bail!("the server ended before its first frame")
    }

    fn timecode_args(&self) -> Vec<String> {
        let TimecodeArgs { source, offset_s, timeout_s, frame_rate } = &self.args.timecode;
        let frames_per_second = frame_rate.map(FrameRate::frames_per_second);
        [
            source.as_ref().map(|source| format!("--timecode={source}")),
            offset_s.map(|offset_s| format!("--timecode-offset={offset_s}")),
            timeout_s.map(|timeout_s| format!("--timecode-timeout={timeout_s}")),
            frames_per_second.map(|fps| format!("--timecode-fps={fps}")),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    fn bus_args(&self) -> Vec<String> {
        vec!["--instance".to_owned(), self.domain.instance().to_string()]
    }
}

//! `monitor`: the process of the collision monitor.

use std::process::ExitCode;

use anyhow::{Context as _, ensure};
use bench_dragon_ipc::guard::GuardLock;
use bench_dragon_ipc::{Alert, AlertKind, BusError, Continuity, Domain, Frame, FrameHeader, Sender, ShowState};
use clap::Args;

use crate::cli::bus_readers::{FrameReading, Next, RunPorts, open_when_there};
use crate::cli::exit_status::CONTACT;
use crate::cli::flags::{BusArgs, FormatArgs, SpinArgs, within};
use crate::config::Config;
use crate::safety::alerts::{ALERTS_PER_S, AlertPublisher};
use crate::safety::forecast::Forecaster;
use crate::safety::monitor::{Monitor, run_alert};
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

mod guard_thread;
pub(super) mod lines;
mod report;

use guard_thread::{GuardNews, GuardThread};
use report::MonitorReport;

/// Measure the clearance of all benches, and send an alert when benches come near, touch or part.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon monitor
  bench-dragon monitor --format json --fail-on-contact
  bench-dragon monitor --guard                for a server that was started with --guarded")]
pub(crate) struct MonitorArgs {
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    /// Be the guard of a guarded server: grant its head only travel that is proved free of contact.
    #[arg(long)]
    pub(crate) guard: bool,
    /// End with exit status 3 at the first contact.
    #[arg(long)]
    pub(crate) fail_on_contact: bool,
    /// With --format json, seconds between two lines of progress, 0.01 to 3600 [default: no lines].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = within(0.01..=3600.0))]
    pub(crate) progress: Option<f64>,
    #[command(flatten)]
    pub(crate) clock: SpinArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

pub(super) fn run(args: &MonitorArgs) -> anyhow::Result<ExitCode> {
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let opened = open_when_there(domain.instance(), &stop, || MonitorPorts::open(&domain, args.guard, &stop))?;
    let mut session =
        MonitorSession { args, domain: &domain, stop: &stop, watched: None, report: MonitorReport::new(args) };
    if let Some(mut ports) = opened {
        session.read_frames(&mut ports)?;
        session.take_commands(&mut ports)?;
    }
    session.end_run();
    session.report.print_summary()?;
    let has_failed = args.fail_on_contact && session.report.summary.contact.is_some();
    Ok(if has_failed { ExitCode::from(CONTACT) } else { ExitCode::SUCCESS })
}

struct MonitorPorts {
    run: RunPorts,
    alerts: AlertPublisher,
    // Dropped last, so that a second guard starts only after the ports are closed.
    _lock: Option<GuardLock>,
}

impl MonitorPorts {
    fn open(domain: &Domain, is_guard: bool, stop: &StopFlag) -> Result<Self, BusError> {
        let open_others = || {
            let lock = is_guard.then(|| GuardLock::take(domain)).transpose()?;
            Ok((AlertPublisher::open(domain)?, lock))
        };
        let (run, (alerts, lock)) = RunPorts::open(domain, "monitor", stop, open_others)?;
        Ok(Self { run, alerts, _lock: lock })
    }
}

struct WatchedRun {
    run_id: u64,
    config: Config,
    monitor: Monitor,
    forecaster: Forecaster,
    state: Option<ShowState>,
    guard: Option<GuardThread>,
}

/// A running monitor, over any number of runs.
struct MonitorSession<'a> {
    args: &'a MonitorArgs,
    domain: &'a Domain,
    stop: &'a StopFlag,
    watched: Option<WatchedRun>,
    report: MonitorReport,
}

impl MonitorSession<'_> {
    /// Watches frame after frame; after a signal, only frames that were published before it.
    fn read_frames(&mut self, ports: &mut MonitorPorts) -> anyhow::Result<()> {
        let mut reading = FrameReading::until(self.stop).by_clock(self.args.clock.spin());
        loop {
            match reading.wait(&mut ports.run.frames)? {
                Next::Frame(frame) => self.take(&frame, ports)?,
                Next::Nothing => {}
                Next::End => return Ok(()),
            }
            ports.alerts.deliver_to_late_joiners();
            self.report.summary.lost = ports.run.frames.lost();
            if self.args.fail_on_contact && self.report.summary.contact.is_some() {
                return Ok(());
            }
            self.take_commands(ports)?;
            self.take_guard_news()?;
            self.report.print_progress()?;
        }
    }

    fn take(&mut self, frame: &Frame, ports: &mut MonitorPorts) -> anyhow::Result<()> {
        let header = frame.header();
        self.report.count_frame(monotonic_ns().saturating_sub(header.scheduled_ns));
        if frame.continuity() == Continuity::Restarted {
            self.send_alert(&run_alert(header, AlertKind::Restarted), ports)?;
        }
        if self.watched.as_ref().is_none_or(|watched| watched.run_id != header.run_id) {
            // The last run's guard ends first.
            self.end_run();
            let Some(watched) = self.begin_run(header, ports)? else { return Ok(()) };
            self.watched = Some(watched);
        }
        let watched = self.watched.as_mut().expect("begun where it was missing");
        if self.stop.is_set() {
            watched.monitor.end_soon();
        }
        let forecast = watched.forecaster.latest();
        let had_suppressed = watched.monitor.suppressed() > 0;
        let nearest = watched.monitor.observe(header, frame.handles(), Some(&forecast));
        watched.forecaster.advance(&forecast, header.course_m, watched.monitor.is_touching());
        let fault = watched.guard.as_mut().and_then(|guard| guard.show(header, nearest));
        if !had_suppressed && watched.monitor.suppressed() > 0 {
            tracing::warn!(
                "over {ALERTS_PER_S} alerts a second: only the most important are sent, the rest are counted"
            );
        }
        self.report.summary.faults += u64::from(fault.is_some());
        let alerts = [fault.as_slice(), watched.state_alert(header).as_slice(), watched.monitor.alerts()].concat();
        alerts.iter().try_for_each(|alert| self.send_alert(alert, ports))?;
        if let Some(watched) = &self.watched {
            self.report.note(header, nearest, &forecast, &watched.config);
        }
        Ok(())
    }

    fn begin_run(&self, header: &FrameHeader, ports: &mut MonitorPorts) -> anyhow::Result<Option<WatchedRun>> {
        let Some(description) = ports.run.descriptions.of(header.run_id, self.stop)? else {
            return Ok(None);
        };
        let config = Config::from_toml(&description.toml).context("the description on the bus")?;
        if let Some(fact) = config.under_play("margin_m", config.tables().monitor.margin_m).filter(|_| self.args.guard)
        {
            tracing::warn!(
                "{fact}: the guard keeps the margin in every pose that the play allows, so it may stop early"
            );
        }
        let (described, sent) = (config.formation().layout().benches(), header.bench_count as usize);
        ensure!(described == sent, "the description on the bus has {described} benches, the frames have {sent}");
        let monitor = Monitor::new(&config);
        let run_id = header.run_id;
        let forecaster = Forecaster::start(&monitor.formation, 0.0, header.course_m);
        let forecaster = forecaster.context("cannot start the forecast's thread")?;
        if self.args.guard && !config.tables().monitor.guard {
            tracing::warn!("the server is not guarded: the head walks without grants; start the server with --guarded");
        }
        let is_guarded = self.args.guard && config.tables().monitor.guard;
        let guard = is_guarded.then(|| GuardThread::start(self.domain, config.clone(), run_id)).transpose();
        let guard = guard.context("cannot start the guard's thread")?;
        Ok(Some(WatchedRun { run_id, config, monitor, forecaster, state: None, guard }))
    }

    /// Ends the watch of a run, and adds its suppressed alerts and unswept frames to the summary.
    fn end_run(&mut self) {
        if let Some(watched) = self.watched.take() {
            self.report.summary.suppressed_alerts += watched.monitor.suppressed();
            self.report.summary.unswept_frames += watched.monitor.unswept;
        }
    }

    /// Reports commands and their outcomes, beginning with up to 128 from before the monitor started.
    fn take_commands(&mut self, ports: &mut MonitorPorts) -> anyhow::Result<()> {
        let Some(commands) = &mut ports.run.commands else { return Ok(()) };
        while let Some(event) = commands.receive()? {
            self.report.summary.commands.count(&event);
            // This guard's own grants are not reported.
            if event.sent_by() != Some(Sender::Guard) || event.pid != std::process::id() {
                self.report.print_command(&event)?;
            }
        }
        self.report.summary.commands.lost = commands.lost;
        Ok(())
    }

    fn take_guard_news(&mut self) -> anyhow::Result<()> {
        let Some(watched) = &self.watched else { return Ok(()) };
        match watched.guard.as_ref().and_then(GuardThread::news) {
            None => Ok(()),
            Some(GuardNews::FinalRest(rest)) => {
                if !rest.is_free {
                    tracing::warn!(
                        "{} not proved to be kept where the head stands: seek to another show time",
                        if rest.border.is_some() { "clear_m is" } else { "margin_m is" }
                    );
                }
                self.report.print_rest(&rest, &watched.config)
            }
            Some(GuardNews::GaveUp(held)) => {
                let held =
                    held.map_or("it has held the show".to_owned(), |error| format!("it cannot hold the show: {error}"));
                tracing::warn!("the frames differ from the guard's proof: it grants no more, and {held}");
                Ok(())
            }
            Some(GuardNews::Failed(error)) => Err(error).context("the guard"),
        }
    }

    fn send_alert(&mut self, alert: &Alert, ports: &MonitorPorts) -> anyhow::Result<()> {
        ports.alerts.publish(alert)?;
        self.report.print_alert(alert, self.watched.as_ref().map(|watched| &watched.config))
    }
}

impl WatchedRun {
    /// The alert of a hold that begins with this frame. The first frame of a guarded show raises none: the show begins held,
    /// until its first grant.
    fn state_alert(&mut self, header: &FrameHeader) -> Option<Alert> {
        let state = header.show_state();
        let last = std::mem::replace(&mut self.state, state);
        let begins = last != state && (last.is_some() || self.guard.is_none());
        (begins && state == Some(ShowState::Held)).then(|| run_alert(header, AlertKind::Held))
    }
}

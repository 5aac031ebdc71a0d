//! `monitor`: the collision monitor's process.

use std::fmt::Write as _;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::{Context as _, ensure};
use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_ipc::{
    Alert, AlertKind, BusError, CommandEvent, Continuity, Domain, EventKind, Frame, FrameHeader, FrameSubscriber,
    GuardLock, Sender, ShowState, TimeHistogram,
};

use crate::cli::{Format, MonitorArgs};
use crate::command::exit_status::CONTACT;
use crate::command::follow::{CommandTrail, Descriptions, Following, Next, open_when_there};
use crate::command::guarding::{Guarding, News};
use crate::command::print::{print_json, print_line};
use crate::config::Config;
use crate::output::Counted;
use crate::output::report::{
    AlertLine, ClearanceReport, CommandCounts, CommandLine, ContactReport, GuardReport, MonitorLine, MonitorProgress,
    MonitorSummary, TimesReport, local_time,
};
use crate::safety::alerts::{ALERTS_PER_S, AlertPublisher};
use crate::safety::forecast::{Forecast, Forecaster};
use crate::safety::guard::ClearanceCheck;
use crate::safety::monitor::{Monitor, fault_alert, run_alert};
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

pub(crate) fn run(args: &MonitorArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let opened = open_when_there(domain.instance(), &stop, || Ports::open(&domain, args.guard, &stop))?;
    let mut session = Session::new(args, &domain, &stop);
    if let Some(mut ports) = opened {
        session.follow(&mut ports)?;
        session.take_commands(&mut ports)?;
    }
    session.print_summary()?;
    let failed = args.fail_on_contact && session.summary.contact.is_some();
    Ok(if failed { ExitCode::from(CONTACT) } else { ExitCode::SUCCESS })
}

/// Everything of the bus that a monitor uses.
struct Ports {
    frames: FrameSubscriber,
    descriptions: Descriptions,
    alerts: AlertPublisher,
    commands: Option<CommandTrail>,
    // Given up last.
    _lock: Option<GuardLock>,
}

impl Ports {
    /// Opens the frames last, so that from their first one on everything else is there.
    fn open(domain: &Domain, guard: bool, stop: &StopFlag) -> Result<Self, BusError> {
        let descriptions = Descriptions::open(domain, "monitor-description", stop)?;
        let lock = guard.then(|| GuardLock::take(domain)).transpose()?;
        let alerts = AlertPublisher::open(domain)?;
        let commands = CommandTrail::open(domain, "monitor")?;
        let frames = FrameSubscriber::open(domain, "monitor")?;
        // A source that was just starting has its record by now.
        let commands = commands.map_or_else(|| CommandTrail::open(domain, "monitor"), |commands| Ok(Some(commands)))?;
        Ok(Self { frames, descriptions, alerts, commands, _lock: lock })
    }
}

/// The run that is being watched.
struct Watch {
    run_id: u64,
    monitor: Monitor,
    forecaster: Forecaster,
    /// Travel from which the forecast was last asked for.
    asked_from_m: f64,
    state: Option<ShowState>,
    keeper: Option<Keeper>,
}

/// The guard of the run, and whether the frames are what it proves.
struct Keeper {
    guarding: Guarding,
    check: ClearanceCheck,
    has_fault: bool,
}

/// A monitor's life, over any number of runs.
struct Session<'a> {
    args: &'a MonitorArgs,
    domain: &'a Domain,
    stop: &'a StopFlag,
    watch: Option<Watch>,
    summary: MonitorSummary,
    latency: TimeHistogram,
    nearest: Option<PairClearance>,
    forecast_s: Option<f64>,
    progress_due: Instant,
}

impl<'a> Session<'a> {
    fn new(args: &'a MonitorArgs, domain: &'a Domain, stop: &'a StopFlag) -> Self {
        Self {
            args,
            domain,
            stop,
            watch: None,
            summary: MonitorSummary::default(),
            latency: TimeHistogram::default(),
            nearest: None,
            forecast_s: None,
            progress_due: Instant::now(),
        }
    }

    /// Watches frame after frame; after a signal, those that are there already.
    fn follow(&mut self, ports: &mut Ports) -> anyhow::Result<()> {
        let mut following = Following::until(self.stop);
        loop {
            match following.wait(&mut ports.frames)? {
                Next::Frame(frame) => self.take(&frame, ports)?,
                Next::Nothing => {}
                Next::End => return Ok(()),
            }
            self.summary.lost = ports.frames.lost();
            if self.args.fail_on_contact && self.summary.contact.is_some() {
                return Ok(());
            }
            self.take_commands(ports)?;
            self.take_news()?;
            self.print_progress()?;
        }
    }

    fn take(&mut self, frame: &Frame, ports: &mut Ports) -> anyhow::Result<()> {
        let header = frame.header();
        self.latency.record(monotonic_ns().saturating_sub(header.scheduled_ns));
        self.summary.frames += 1;
        if frame.continuity() == Continuity::Restarted {
            self.tell(&run_alert(header, AlertKind::Restarted), ports)?;
        }
        if self.watch.as_ref().is_none_or(|watch| watch.run_id != header.run_id) {
            // The last run's guard ends first.
            self.end_watch();
            let Some(watch) = self.begin(header, ports)? else { return Ok(()) };
            self.watch = Some(watch);
        }
        let watch = self.watch.as_mut().expect("begun where it was missing");
        if self.stop.is_set() {
            watch.monitor.end_soon();
        }
        let forecast = watch.forecaster.latest();
        let had_suppressed = watch.monitor.suppressed() > 0;
        let nearest = watch.monitor.observe(header, frame.handles(), Some(&forecast));
        watch.follow_forecast(header, &forecast);
        let fault = watch.guard(header, nearest);
        if !had_suppressed && watch.monitor.suppressed() > 0 {
            tracing::warn!("over {ALERTS_PER_S} alerts a second: only the most important are sent, the others counted");
        }
        self.summary.faults += fault.iter().len() as u64;
        let alerts = [fault.as_slice(), watch.state_alert(header).as_slice(), watch.monitor.alerts()].concat();
        for alert in &alerts {
            self.tell(alert, ports)?;
        }
        self.note(header, nearest, &forecast);
        Ok(())
    }

    /// Ends the watch of a run, and adds what it has left out.
    fn end_watch(&mut self) {
        if let Some(watch) = self.watch.take() {
            self.summary.suppressed_alerts += watch.monitor.suppressed();
            self.summary.unswept_frames += watch.monitor.unswept();
        }
    }

    fn begin(&self, header: &FrameHeader, ports: &mut Ports) -> anyhow::Result<Option<Watch>> {
        let Some(description) = ports.descriptions.of(header.run_id, self.stop)? else {
            return Ok(None);
        };
        let config = Config::from_toml(&description.toml).context("the description on the bus")?;
        let (described, sent) = (config.dragon().dimensions().benches(), header.bench_count as usize);
        ensure!(described == sent, "the description on the bus is of {described} benches, the frames are of {sent}");
        let monitor = Monitor::new(&config);
        let from_m = header.head_travel_m;
        let forecaster = Forecaster::start(monitor.dragon(), from_m).context("cannot start the forecast's thread")?;
        if self.args.guard && !config.is_guarded() {
            tracing::warn!("the server is not guarded: it walks on without grants; start it with --guarded");
        }
        let is_kept = self.args.guard && config.is_guarded();
        let keeper = is_kept.then(|| Keeper::start(self.domain, config, header.run_id)).transpose()?;
        Ok(Some(Watch { run_id: header.run_id, monitor, forecaster, asked_from_m: from_m, state: None, keeper }))
    }

    /// Reports what has become of commands: first of up to the last 128 from before it was there.
    fn take_commands(&mut self, ports: &mut Ports) -> anyhow::Result<()> {
        let Some(commands) = &mut ports.commands else { return Ok(()) };
        while let Some(event) = commands.receive()? {
            self.summary.commands.count(&event);
            // Its own grants are no news.
            if event.sent_by() != Some(Sender::Guard) || event.pid != std::process::id() {
                self.tell_command(&event)?;
            }
        }
        self.summary.commands.lost = commands.lost();
        Ok(())
    }

    fn tell_command(&self, event: &CommandEvent) -> anyhow::Result<()> {
        let line = CommandLine::from(event);
        let is_grant = event.event_kind() == Some(EventKind::Grant) && line.accepted;
        match self.args.format.format {
            Format::Json => print_json(&MonitorLine::Command(line)),
            // Some ten a second.
            Format::Text if is_grant => {
                tracing::debug!("{}", line.text);
                Ok(())
            }
            Format::Text => {
                let (time_s, text) = (line.time_s, line.text);
                Ok(print_line(format_args!("{time_s:>12.6} s  command    {}  {text}", local_time(event)))?)
            }
        }
    }

    /// Takes what the guard has to tell.
    fn take_news(&mut self) -> anyhow::Result<()> {
        let keeper = self.watch.as_ref().and_then(|watch| watch.keeper.as_ref());
        match keeper.and_then(|keeper| keeper.guarding.news()) {
            None => Ok(()),
            Some(News::FinalRest(rest)) => {
                if !rest.is_free {
                    tracing::warn!("the benches are nearer than margin_m where the head is: seek to free ground");
                }
                self.tell_rest(GuardReport {
                    held_at_s: rest.sim_time_s,
                    clearance_m: self.nearest.map(|pair| pair.clearance_m),
                    forecast_contact_s: rest.forecast_s,
                })
            }
            Some(News::GaveUp(held)) => {
                let held = held.map_or("it has held the show".to_owned(), |error| error.to_string());
                tracing::warn!("the frames are not what the guard has proved: it grants no more, and {held}");
                Ok(())
            }
            Some(News::Failed(error)) => Err(error).context("the guard"),
        }
    }

    fn tell_rest(&mut self, report: GuardReport) -> anyhow::Result<()> {
        self.summary.guard = Some(report);
        match self.args.format.format {
            Format::Json => print_json(&MonitorLine::Guard(report)),
            Format::Text => Ok(print_line(rest_text(&report))?),
        }
    }

    fn note(&mut self, header: &FrameHeader, nearest: Option<PairClearance>, forecast: &Forecast) {
        self.nearest = nearest;
        let ahead_m = forecast
            .contact
            .filter(|_| forecast.covers(header.head_travel_m))
            .map(|contact| contact.travel_m - header.head_travel_m);
        self.forecast_s = ahead_m
            .filter(|_| header.head_speed_mps > 0.0)
            .map(|ahead_m| header.sim_time_s() + ahead_m / header.head_speed_mps);
        let Some(pair) = nearest else { return };
        if self.summary.least_clearance.is_none_or(|least| pair.clearance_m < least.clearance_m) {
            self.summary.least_clearance = Some(ClearanceReport {
                time_s: header.sim_time_s(),
                benches: pair.benches.map(|bench| bench as u32),
                clearance_m: pair.clearance_m,
            });
        }
    }

    fn tell(&mut self, alert: &Alert, ports: &Ports) -> anyhow::Result<()> {
        ports.alerts.publish(alert)?;
        let line = AlertLine::from(alert);
        if alert.alert_kind() == Some(AlertKind::Contact) && self.summary.contact.is_none() {
            let benches = alert.pair().expect("a contact is of two benches");
            self.summary.contact = Some(ContactReport { time_s: line.time_s, benches });
        }
        match self.args.format.format {
            Format::Json => print_json(&MonitorLine::Alert(line)),
            Format::Text => Ok(print_line(alert_text(&line))?),
        }
    }

    fn print_progress(&mut self) -> anyhow::Result<()> {
        let Some(period_s) = self.args.progress.filter(|_| self.args.format.format == Format::Json) else {
            return Ok(());
        };
        let now = Instant::now();
        if now < self.progress_due {
            return Ok(());
        }
        self.progress_due = now + Duration::from_secs_f64(period_s);
        print_json(&MonitorLine::Progress(MonitorProgress {
            frames: self.summary.frames,
            lost: self.summary.lost,
            clearance_m: self.nearest.map(|pair| pair.clearance_m),
            forecast_s: self.forecast_s,
            latency: TimesReport::from(&self.latency),
        }))
    }

    fn print_summary(&mut self) -> anyhow::Result<()> {
        self.end_watch();
        self.summary.latency_us = (&self.latency).into();
        self.summary.latency = (&self.latency).into();
        if self.args.format.format == Format::Json {
            return print_json(&MonitorLine::Summary(self.summary.clone()));
        }
        let MonitorSummary { frames, lost, contact, least_clearance, commands, .. } = &self.summary;
        print_line(format_args!("{}, {lost} lost", Counted(*frames, "frame")))?;
        let CommandCounts { accepted, refused, grants, lost } = commands;
        let grants = Counted(*grants, "grant");
        print_line(format_args!("commands: {accepted} accepted, {refused} refused, {grants}, {lost} lost"))?;
        if let Some(ClearanceReport { time_s, benches: [a, b], clearance_m }) = least_clearance {
            print_line(format_args!("least clearance {clearance_m:.6} m at {time_s:.6} s, benches {a} and {b}"))?;
        }
        match contact {
            Some(ContactReport { time_s, benches: [a, b] }) => {
                print_line(format_args!("first contact at {time_s:.6} s, benches {a} and {b}"))?;
            }
            None => print_line("no contact")?,
        }
        if self.summary.faults > 0 {
            let faults = Counted(self.summary.faults, "fault");
            print_line(format_args!("{faults}: frames were not as published"))?;
        }
        if self.summary.suppressed_alerts > 0 {
            let count = Counted(self.summary.suppressed_alerts, "alert");
            print_line(format_args!("{count} not sent: over {ALERTS_PER_S} a second"))?;
        }
        if self.summary.unswept_frames > 0 {
            let count = Counted(self.summary.unswept_frames, "frame");
            print_line(format_args!("{count} not swept whole: the way there takes too much work"))?;
        }
        Ok(())
    }
}

impl Watch {
    /// Asks for a new forecast where the head is on ground of which the present one says nothing.
    fn follow_forecast(&mut self, header: &FrameHeader, forecast: &Forecast) {
        let travel_m = header.head_travel_m;
        let asked = self.asked_from_m != forecast.from_m;
        if !asked && !forecast.covers(travel_m) && !self.monitor.is_touching() {
            self.forecaster.restart(travel_m);
            self.asked_from_m = travel_m;
        }
    }

    /// The alert of a hold that begins with this frame. A guarded show begins held, until its guard has looked at it.
    fn state_alert(&mut self, header: &FrameHeader) -> Option<Alert> {
        let state = header.show_state();
        let last = std::mem::replace(&mut self.state, state);
        let begins = last != state && (last.is_some() || self.keeper.is_none());
        (begins && state == Some(ShowState::Held)).then(|| run_alert(header, AlertKind::Held))
    }

    /// Shows the guard, where there is one, a frame and what was measured in it. Returns the alert of a fault that begins
    /// with this frame.
    fn guard(&mut self, header: &FrameHeader, nearest: Option<PairClearance>) -> Option<Alert> {
        let keeper = self.keeper.as_mut()?;
        keeper.guarding.show(header);
        let has_fault = !keeper.check.agrees(header, nearest);
        let begins = has_fault && !std::mem::replace(&mut keeper.has_fault, has_fault);
        begins.then(|| {
            keeper.guarding.give_up();
            fault_alert(header, nearest)
        })
    }
}

impl Keeper {
    fn start(domain: &Domain, config: Config, run_id: u64) -> anyhow::Result<Self> {
        let check = ClearanceCheck::new(Arc::clone(config.dragon()));
        let guarding = Guarding::start(domain, config, run_id).context("cannot start the guard's thread")?;
        Ok(Self { guarding, check, has_fault: false })
    }
}

fn rest_text(report: &GuardReport) -> String {
    let mut text = format!("{:>12.6} s  held by the guard for good", report.held_at_s);
    if let Some(clearance_m) = report.clearance_m {
        // Writing into a String cannot fail, here and below.
        let _ = write!(text, ", clearance {clearance_m:.6} m");
    }
    if let Some(forecast_s) = report.forecast_contact_s {
        let _ = write!(text, ", contact forecast at {forecast_s:.6} s");
    }
    text
}

fn alert_text(line: &AlertLine) -> String {
    let mut text = format!("{:>12.6} s  {:<9}", line.time_s, line.kind);
    if let (Some([a, b]), Some(clearance_m), Some([x, y])) = (line.benches, line.clearance_m, line.point_m) {
        // Writing into a String cannot fail, here and below.
        let _ = write!(text, "  benches {a} and {b}, clearance {clearance_m:.6} m at ({x:.3}, {y:.3})");
    }
    if let Some(forecast_s) = line.forecast_s.filter(|_| line.kind == AlertKind::Near.name()) {
        let _ = write!(text, ", contact forecast at {forecast_s:.6} s");
    }
    text
}

//! `monitor`: the collision monitor's process.

use std::fmt::Write as _;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::{Duration, Instant};

use anyhow::Context as _;
use bench_dragon::clock::monotonic_ns;
use bench_dragon::config::Config;
use bench_dragon::dragon::PairClearance;
use bench_dragon::histogram::LatencyHistogram;
use bench_dragon::monitor::forecast::{Forecast, Forecaster};
use bench_dragon::monitor::{AlertPublisher, Monitor, run_alert};
use bench_dragon::report::{AlertLine, ClearanceReport, ContactReport, MonitorLine, MonitorProgress, MonitorSummary};
use bench_dragon::stop::StopFlag;
use bench_dragon_ipc::{Alert, AlertKind, Continuity, Domain, Frame, FrameHeader, FrameSubscriber, ShowState};

use crate::cli::{Format, MonitorArgs};
use crate::command::CONTACT;
use crate::command::description::Descriptions;
use crate::command::follow::{Following, Next, open_when_there};
use crate::command::output::{print_json, print_line};
use crate::command::parent::follow_parent;

pub(crate) fn run(args: &MonitorArgs) -> anyhow::Result<ExitCode> {
    follow_parent(args.child)?;
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let opened = open_when_there(domain.instance(), &stop, || Ports::open(&domain, &stop))?;
    let mut session = Session::new(args, &stop);
    if let Some(mut ports) = opened {
        session.follow(&mut ports)?;
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
}

impl Ports {
    /// Opens the frames last, so that from their first one on everything else is there.
    fn open(domain: &Domain, stop: &StopFlag) -> Result<Self, bench_dragon_ipc::BusError> {
        let descriptions = Descriptions::open(domain, "monitor-description", stop)?;
        let alerts = AlertPublisher::open(domain)?;
        Ok(Self { frames: FrameSubscriber::open(domain, "monitor")?, descriptions, alerts })
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
}

/// A monitor's life, over any number of runs.
struct Session<'a> {
    args: &'a MonitorArgs,
    stop: &'a StopFlag,
    watch: Option<Watch>,
    summary: MonitorSummary,
    latency: LatencyHistogram,
    nearest: Option<PairClearance>,
    forecast_s: Option<f64>,
    progress_due: Instant,
}

impl<'a> Session<'a> {
    fn new(args: &'a MonitorArgs, stop: &'a StopFlag) -> Self {
        Self {
            args,
            stop,
            watch: None,
            summary: MonitorSummary::default(),
            latency: LatencyHistogram::new(),
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
            let Some(watch) = self.begin(header, ports)? else { return Ok(()) };
            self.watch = Some(watch);
        }
        let watch = self.watch.as_mut().expect("begun where it was missing");
        let forecast = watch.forecaster.latest();
        let nearest = watch.monitor.observe(header, frame.handles(), Some(&forecast));
        watch.follow_forecast(header, &forecast);
        let alerts = [watch.state_alert(header).as_slice(), watch.monitor.alerts()].concat();
        for alert in &alerts {
            self.tell(alert, ports)?;
        }
        self.note(header, nearest, &forecast);
        Ok(())
    }

    fn begin(&self, header: &FrameHeader, ports: &mut Ports) -> anyhow::Result<Option<Watch>> {
        let Some(description) = ports.descriptions.of(header.run_id, self.stop)? else {
            return Ok(None);
        };
        let config = Config::from_toml(&description.toml).context("the description on the bus")?;
        let monitor = Monitor::new(&config);
        let from_m = header.head_travel_m;
        let forecaster = Forecaster::start(Arc::clone(monitor.dragon()), from_m);
        Ok(Some(Watch { run_id: header.run_id, monitor, forecaster, asked_from_m: from_m, state: None }))
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
        }))
    }

    fn print_summary(&mut self) -> anyhow::Result<()> {
        self.summary.latency_us = self.latency.percentiles();
        if self.args.format.format == Format::Json {
            return print_json(&MonitorLine::Summary(self.summary.clone()));
        }
        let MonitorSummary { frames, lost, contact, least_clearance, .. } = &self.summary;
        print_line(format_args!("{frames} frames, {lost} lost"))?;
        if let Some(ClearanceReport { time_s, benches: [a, b], clearance_m }) = least_clearance {
            print_line(format_args!("least clearance {clearance_m:.6} m at {time_s:.6} s, benches {a} and {b}"))?;
        }
        match contact {
            Some(ContactReport { time_s, benches: [a, b] }) => {
                print_line(format_args!("first contact at {time_s:.6} s, benches {a} and {b}"))?;
            }
            None => print_line("no contact")?,
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

    /// The alert of a hold that begins with this frame.
    fn state_alert(&mut self, header: &FrameHeader) -> Option<Alert> {
        let state = header.show_state();
        let begins = std::mem::replace(&mut self.state, state) != state;
        (begins && state == Some(ShowState::Held)).then(|| run_alert(header, AlertKind::Held))
    }
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

//! The reports of a monitor: alerts, commands and progress during the run, and the summary at its end.

use std::fmt::Write as _;
use std::time::{Duration, Instant};

use bench_dragon_geometry::clearance::PairClearance;
use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::{Alert, AlertKind, CommandEvent, EventKind, FrameHeader, TimeHistogram};

use super::MonitorArgs;
use super::lines::{
    AlertLine, AtBorder, BorderStop, ClearanceReport, CommandCounts, ContactReport, GuardReport, MonitorLine,
    MonitorProgress, MonitorSummary, TimesReport,
};
use crate::cli::flags::Format;
use crate::cli::print::{print_json, print_line, print_report};
use crate::config::{Config, FORECAST_SPEED_MPS};
use crate::output::Counted;
use crate::output::command_words::{CommandLine, local_time};
use crate::safety::alerts::ALERTS_PER_S;
use crate::safety::forecast::Forecast;
use crate::safety::guard::FinalRest;

pub(super) struct MonitorReport {
    format: Format,
    pub(super) summary: MonitorSummary,
    latency: TimeHistogram,
    nearest: Option<PairClearance>,
    /// Least clearance since the last progress.
    least: Option<ClearanceReport>,
    forecast_s: Option<f64>,
    /// Period at which progress is printed; `None` if it is not printed.
    progress_period: Option<Duration>,
    progress_due: Instant,
}

impl MonitorReport {
    pub(super) fn new(args: &MonitorArgs) -> Self {
        let format = args.format.format;
        Self {
            format,
            summary: MonitorSummary::default(),
            latency: TimeHistogram::default(),
            nearest: None,
            least: None,
            forecast_s: None,
            progress_period: args.progress.filter(|_| format == Format::Json).map(Duration::from_secs_f64),
            progress_due: Instant::now(),
        }
    }

    pub(super) fn count_frame(&mut self, latency_ns: u64) {
        self.latency.record(latency_ns);
        self.summary.frames += 1;
    }

    /// Stores the measurements of a frame.
    pub(super) fn note(
        &mut self,
        header: &FrameHeader,
        nearest: Option<PairClearance>,
        forecast: &Forecast,
        config: &Config,
    ) {
        let time_s = header.show_time_s();
        self.nearest = nearest;
        let is_valid = forecast.covers(header.course_m) && header.course_mps >= FORECAST_SPEED_MPS;
        let arrival_s = |travel_m| time_s + (travel_m - header.course_m) / header.course_mps;
        self.forecast_s = forecast.contact.filter(|_| is_valid).map(|contact| arrival_s(contact.travel_m));
        if let Some(possible) = forecast.possible_touch().filter(|_| is_valid) {
            self.summary.earliest_s = Some(arrival_s(possible.travel_m));
        }
        let Some(PairClearance { clearance_m, benches, point }) = nearest else { return };
        let report = || ClearanceReport {
            time_s,
            benches: benches.map(|bench| bench as u32),
            named: config.named_benches(benches),
            clearance_m,
            point_m: point.to_array(),
            travel_m: header.course_m,
        };
        for least in [&mut self.least, &mut self.summary.least_clearance] {
            if least.as_ref().is_none_or(|least| clearance_m < least.clearance_m) {
                *least = Some(report());
            }
        }
    }

    pub(super) fn print_alert(&mut self, alert: &Alert, config: Option<&Config>) -> anyhow::Result<()> {
        let line = AlertLine::of(alert, config);
        if alert.alert_kind() == Some(AlertKind::Contact) && self.summary.contact.is_none() {
            let benches = alert.pair().expect("a contact has two benches");
            let named = line.named.clone();
            self.summary.contact = Some(ContactReport { time_s: line.time_s, benches, named });
        }
        let text = alert_text(&line);
        print_report(self.format, &MonitorLine::Alert(line), text)
    }

    pub(super) fn print_command(&self, event: &CommandEvent) -> anyhow::Result<()> {
        let line = CommandLine::from(event);
        // The guard sends some ten grants per second.
        if self.format == Format::Text && event.event_kind() == Some(EventKind::Grant) && line.accepted {
            tracing::debug!("{}", line.text);
            return Ok(());
        }
        let text = format!("{:>12} s  command    {}  {}", Fixed::<6>(line.time_s), local_time(event), line.text);
        print_report(self.format, &MonitorLine::Command(line), text)
    }

    /// Reports a permanent stop of the head by the guard.
    pub(super) fn print_rest(&mut self, rest: &FinalRest, config: &Config) -> anyhow::Result<()> {
        let report = GuardReport {
            held_at_s: rest.show_time_s,
            clearance_m: self.nearest.map(|pair| pair.clearance_m),
            forecast_contact_s: rest.forecast_s,
            is_margin_kept: rest.is_free,
            border: rest.border.map(|standing| BorderStop::of(&standing, config)),
        };
        self.summary.guard = Some(report.clone());
        let text = format!("{:>12} s  held by the guard permanently{}", Fixed::<6>(report.held_at_s), report.details());
        print_report(self.format, &MonitorLine::Guard(report), text)
    }

    pub(super) fn print_progress(&mut self) -> anyhow::Result<()> {
        if Instant::now() < self.progress_due { Ok(()) } else { self.print_progress_now() }
    }

    /// Prints the progress, if it is printed at all, and begins the next period.
    fn print_progress_now(&mut self) -> anyhow::Result<()> {
        let Some(period) = self.progress_period else { return Ok(()) };
        self.progress_due = Instant::now() + period;
        print_json(&MonitorLine::Progress(MonitorProgress {
            frames: self.summary.frames,
            lost: self.summary.lost,
            clearance_m: self.nearest.map(|pair| pair.clearance_m),
            least: self.least.take(),
            forecast_s: self.forecast_s,
            earliest_s: self.summary.earliest_s,
            latency: TimesReport::from(&self.latency),
        }))
    }

    pub(super) fn print_summary(&mut self) -> anyhow::Result<()> {
        // The progress since the last line is not lost.
        self.print_progress_now()?;
        self.summary.latency_us = (&self.latency).into();
        self.summary.latency = (&self.latency).into();
        if self.format == Format::Json {
            return print_json(&MonitorLine::Summary(self.summary.clone()));
        }
        let MonitorSummary { frames, lost, contact, least_clearance, commands, .. } = &self.summary;
        print_line(format_args!("{}, {lost} lost", Counted(*frames, "frame")))?;
        let CommandCounts { accepted, refused, grants, lost } = commands;
        let grants = Counted(*grants, "grant");
        print_line(format_args!("commands: {accepted} accepted, {refused} refused, {grants}, {lost} lost"))?;
        if let Some(least) = least_clearance {
            let (clearance_m, time_s) = (Fixed::<6>(least.clearance_m), Fixed::<6>(least.time_s));
            print_line(format_args!("least clearance {clearance_m} m at {time_s} s, {}", least.who()))?;
        }
        match contact {
            Some(contact) => {
                print_line(format_args!("first contact at {} s, {}", Fixed::<6>(contact.time_s), contact.who()))?;
            }
            None => print_line("no contact")?,
        }
        if let Some(earliest_s) = self.summary.earliest_s {
            print_line(format_args!(
                "earliest contact that the play of the hinges allows: {} s",
                Fixed::<6>(earliest_s)
            ))?;
        }
        let MonitorSummary { faults, suppressed_alerts, unswept_frames, .. } = &self.summary;
        let left_out = [
            (faults, "fault", ": frames disagreed with the description".to_owned()),
            (suppressed_alerts, "alert", format!(" not sent: over {ALERTS_PER_S} a second")),
            (unswept_frames, "frame", " not swept completely: too much work".to_owned()),
        ];
        for (count, noun, what) in left_out.into_iter().filter(|(count, ..)| **count > 0) {
            print_line(format_args!("{}{what}", Counted(*count, noun)))?;
        }
        Ok(())
    }
}

fn alert_text(line: &AlertLine) -> String {
    let mut text = format!("{:>12} s  {:<9}", Fixed::<6>(line.time_s), line.kind);
    let who = line.who().unwrap_or_default();
    if let (Some(_), Some(clearance_m), Some([x, y])) = (line.benches, line.clearance_m, line.point_m) {
        // Writing into a String cannot fail, here and below.
        let _ =
            write!(text, "  {who}, clearance {} m at ({}, {})", Fixed::<6>(clearance_m), Fixed::<3>(x), Fixed::<3>(y));
    }
    if let (Some(AtBorder { border, distance_m }), Some([x, y])) = (&line.at_border, line.point_m) {
        let (distance, at) = (Fixed::<3>(*distance_m), format_args!("at ({}, {})", Fixed::<3>(x), Fixed::<3>(y)));
        let _ = match AlertKind::ALL.into_iter().find(|kind| kind.name() == line.kind) {
            Some(AlertKind::Outside) => write!(text, "  {who} leaves the stage {at}"),
            Some(AlertKind::Inside) => write!(text, "  {who} is on the stage again {at}"),
            Some(AlertKind::KeepOut) => write!(text, "  {who} enters {border} {at}"),
            _ => write!(text, "  {who}, {distance} m from {border} {at}"),
        };
    }
    if let Some(forecast_s) = line.forecast_s.filter(|_| line.kind == AlertKind::Near.name()) {
        let _ = write!(text, ", contact forecast at {} s", Fixed::<6>(forecast_s));
    }
    text
}

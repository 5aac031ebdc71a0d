//! The pictures of a report: the dragon at its nearest approach, and the timeline.

use super::ReportSource;
use super::words::{clock, millimetres, seconds_of_day};
use crate::cli::monitor::lines::ClearanceReport;
use crate::cli::show::course::{CourseReport, LeastReport};
use crate::cli::show::wall_time::WallTime;
use crate::cli::solve::pair;
use crate::config::{Config, FormationDocument};
use crate::output::figure::{Caption, ContactView, Drawing, FormationView, ShowTimeline};
use crate::output::in_plan::{dragons_in_plan, in_plan};
use crate::output::report::Block;
use bench_dragon_geometry::number::Fixed;

/// Most benches of a dragon in the picture of the nearest approach.
const MOST_DRAWN: usize = 2000;

impl ReportSource<'_> {
    /// The nearest approach in words, and its picture.
    pub(super) fn nearest(&self) -> Vec<Block> {
        let Some(LeastReport { at, pair: report }) = &self.summary.course.least_clearance else {
            return vec![Block::Words("No monitor has measured a frame.".to_owned())];
        };
        let ClearanceReport { time_s, clearance_m, point_m: [x, y], .. } = *report;
        let (clearance, benches, time) = (millimetres(clearance_m), report.who(), clock(&at.local()));
        let words = format!(
            "{clearance} between {benches}, at show time {} s ({time}), near ({}, {}) m.",
            Fixed::<3>(time_s),
            Fixed::<3>(x),
            Fixed::<3>(y)
        );
        let picture = picture(self.config, report).map(|drawing| {
            Block::Figure(
                drawing,
                if self.config.named().is_some() {
                    format!("Plan of all dragons at {} s, with {benches} marked", Fixed::<3>(time_s))
                } else {
                    format!("Plan of the dragon at {} s, with the surroundings of {benches}", Fixed::<3>(time_s))
                },
            )
        });
        std::iter::once(Block::Words(words)).chain(picture).collect()
    }

    pub(super) fn timeline(&self) -> Block {
        let CourseReport { begin, end, least_clearance, cues, alerts, commands, timeline, .. } = &self.summary.course;
        let second = |at: WallTime| at.seconds_since(*begin);
        let known = |text: &str| WallTime::parse(text).map(second);
        let monitor = &self.config.tables().monitor;
        let margin = monitor.guard.then(|| (monitor.margin_m, "margin of the guard".to_owned()));
        let reached = cues.iter().flat_map(|cue| &cue.reached).map(|time| second(time.at));
        let planned = (!cues.is_empty()).then(|| ("cues".to_owned(), reached.collect()));
        let others = [
            ("commands".to_owned(), commands.iter().filter_map(|line| known(&line.wall_time)).collect()),
            ("alerts".to_owned(), alerts.iter().map(|alert| second(alert.at)).collect()),
            ("restarts".to_owned(), self.summary.restart_log.iter().filter_map(|end| known(&end.at)).collect()),
        ];
        let drawing = ShowTimeline {
            caption: Caption::new("Clearance, states and events by the time of day"),
            clock_s: seconds_of_day(&begin.local()),
            end_s: second(*end),
            clearance: timeline.clearance(),
            limits: std::iter::once((monitor.near_m, "near".to_owned())).chain(margin).collect(),
            states: timeline.states(),
            lanes: planned.into_iter().chain(others).collect(),
            least: least_clearance.as_ref().map(|least| glam::DVec2::new(second(least.at), least.pair.clearance_m)),
        };
        Block::Figure(
            drawing.draw(),
            "The clearance, the states and the events of the show over the time of day".to_owned(),
        )
    }
}

/// The dragon at its nearest approach; `None` for a dragon that is too long for a picture, or values out of its range.
fn picture(config: &Config, report: &ClearanceReport) -> Option<Drawing> {
    if let Some(named) = config.named() {
        return formation_picture(config, named, report);
    }
    let dragon = config.lead();
    let benches = report.benches.map(|bench| bench as usize);
    let count = dragon.dimensions().benches();
    if count > MOST_DRAWN || benches.iter().any(|bench| *bench >= count) || !report.travel_m.is_finite() {
        return None;
    }
    let travel_m = report.travel_m.clamp(dragon.start_travel_m(), dragon.end_travel_m());
    let pair = pair(dragon, travel_m, Some(benches))?;
    let [a, b] = benches;
    let title = format!("Benches {a} and {b} at show time {} s", Fixed::<3>(report.time_s));
    Some(ContactView { caption: Caption::new(title), dragon: in_plan(config, dragon, travel_m), pair }.draw())
}

/// All dragons at the nearest approach; `None` for dragons that are too long for a picture.
fn formation_picture(config: &Config, named: &FormationDocument, report: &ClearanceReport) -> Option<Drawing> {
    if named.formation().layout().benches() > MOST_DRAWN || !report.travel_m.is_finite() {
        return None;
    }
    let title = format!("{} at show time {} s", report.who(), Fixed::<3>(report.time_s));
    let dragons = dragons_in_plan(named, config.formation().plan_s(report.travel_m));
    Some(
        FormationView { caption: Caption::new(title), dragons, mark: Some(report.point_m.into()), shows_routes: true }
            .draw(),
    )
}

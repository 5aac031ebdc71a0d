//! The answers that take longer than a drag allows: the contact of a long route, speeds, borders, the clearance over time.
//!
//! A study works in steps. A newer plan takes its place: it cancels the study, whose step then ends at once and reports nothing.

use std::time::Duration;

use bench_dragon_geometry::clearance::{ClearanceSearch, first_breach, least_distance};
use bench_dragon_geometry::dragon::{ChainSolver, Handle, Question};
use bench_dragon_geometry::formation::Planned;
use bench_dragon_geometry::planner::{ClosestApproach, largest_speed_ratio, near_misses, on_one_core};
use bench_dragon_geometry::stage::{BorderKind, Stage};
use glam::DVec3;
use rustix::process::setpriority_process;
use serde_json::{Value, json};

use super::fix::fixes;
use super::newest::Newest;
use super::plan::{Plan, Touch};
use super::plan_folder::PlanFolder;

/// Parts of a run in the search for the contact.
const PARTS: usize = 64;
/// Most work for a part, and for each other answer, in steps of the meter: seconds.
const WORK: u64 = 20_000_000;
/// Points of the clearance over time, and points of one message. The first message has one in so many of the whole run.
const POINTS: usize = 480;
const POINTS_AT_ONCE: usize = 48;
const COARSE: usize = 10;
/// Time in which a dragging hand gives the next plan, and the niceness of the thread.
const PAUSE: Duration = Duration::from_millis(40);
const NICE: i32 = 5;
/// Most near misses that are listed.
const MOST_MISSES: usize = 20;

/// A plan to study.
#[derive(Clone, Debug)]
pub(super) struct Study {
    pub(super) number: u64,
    pub(super) plan: Plan,
    pub(super) touch: Touch,
    /// Cancelled by the next plan.
    pub(super) question: Question,
}

/// A study that has ended early: a newer one waits, or the page has gone.
struct Ended;

/// Studies the newest plans until the place is closed. `send` returns whether the page is still there.
pub(super) fn study_all(folder: &PlanFolder, studies: &Newest<Study>, mut send: impl FnMut(&Value) -> bool) {
    // It gives way to the answers for a hand. Without a lower priority, it only takes more of their time.
    let _ = setpriority_process(None, NICE);
    while let Some(study) = studies.take() {
        // While a hand drags, the next plan is here before this one could be studied.
        if studies.is_outdated_within(PAUSE) {
            continue;
        }
        let mut report = |mut answer: Value| {
            answer["number"] = study.number.into();
            let is_wanted = !study.question.is_cancelled() && !studies.is_outdated();
            if is_wanted && send(&answer) { Ok(()) } else { Err(Ended) }
        };
        // One core stays free for the answers while a hand drags.
        let _ = on_one_core(|| study.run(folder, &mut report));
    }
}

type Report<'a> = &'a mut dyn FnMut(Value) -> Result<(), Ended>;

impl Study {
    fn run(&self, folder: &PlanFolder, report: Report<'_>) -> Result<(), Ended> {
        let touch = self.contact(report)?;
        let end_s = match touch {
            Touch::Found { time_s, .. } => time_s,
            Touch::Free { to_s } => to_s,
        };
        self.curve(end_s, report)?;
        report(json!({ "type": "borders", "borders": self.borders() }))?;
        report(json!({ "type": "fixes", "fixes": fixes(&self.plan, folder, touch, &self.question) }))?;
        self.misses(end_s, report)?;
        report(json!({ "type": "speeds", "speeds": self.speeds() }))
    }

    /// Finishes the search for the first contact.
    fn contact(&self, report: Report<'_>) -> Result<Touch, Ended> {
        let [start_s, end_s] = self.plan.times_s();
        let Touch::Free { to_s: reached_s } = self.touch else { return Ok(self.touch) };
        if reached_s >= end_s {
            return Ok(self.touch);
        }
        let from_s = reached_s.max(start_s);
        let at =
            |part: usize| if part == PARTS { end_s } else { from_s + (end_s - from_s) * part as f64 / PARTS as f64 };
        for part in 0..PARTS {
            let touch = self.plan.touch([at(part), at(part + 1)], &self.question.meter(WORK));
            let is_done = matches!(touch, Touch::Found { .. }) || part + 1 == PARTS;
            let is_stuck = matches!(touch, Touch::Free { to_s } if to_s < at(part + 1));
            let mut contact = self.plan.contact(touch);
            if is_stuck {
                contact["state"] = "unfinished".into();
            }
            report(json!({ "type": "contact", "contact": contact }))?;
            if is_done || is_stuck {
                return Ok(touch);
            }
        }
        Ok(self.touch)
    }

    /// The least clearance over time, in parts: first a coarse curve of the whole run, then the points between.
    fn curve(&self, end_s: f64, report: Report<'_>) -> Result<(), Ended> {
        let (plan, formation) = (&self.plan, self.plan.config.formation());
        let start_s = plan.times_s()[0];
        let mut search = ClearanceSearch::of(formation.layout());
        let mut solvers: Vec<ChainSolver> =
            plan.planned().iter().map(|planned| ChainSolver::new(&planned.dragon)).collect();
        let (mut boards, mut points) = (Vec::new(), Vec::new());
        for (number, point) in coarse_first().enumerate() {
            let time_s = start_s + (end_s - start_s) * point as f64 / (POINTS - 1) as f64;
            let mut handles: Vec<DVec3> = Vec::with_capacity(formation.layout().handles());
            for (planned, solver) in plan.planned().iter().zip(&mut solvers) {
                let chain = solver.solve(&planned.dragon, planned.travel_m(time_s)).expect("the travel is in the run");
                handles.extend(chain.iter().map(Handle::in_space));
            }
            formation.place_boards(&handles, |&at| at, &mut boards);
            let nearest = search.nearest(&boards);
            points.extend(nearest.into_iter().flat_map(|pair| [time_s, (pair.clearance_m * 1e6).round() / 1e6]));
            let is_last = number + 1 == POINTS;
            if is_last || (number + 1) % POINTS_AT_ONCE == 0 {
                let part = std::mem::take(&mut points);
                report(json!({ "type": "curve", "points": part, "is_complete": is_last }))?;
            }
        }
        Ok(())
    }

    /// The near misses before the contact, in parts; of one dragon only.
    fn misses(&self, end_s: f64, report: Report<'_>) -> Result<(), Ended> {
        let config = &self.plan.config;
        if config.named().is_some() {
            return Ok(());
        }
        let (dragon, planned) = (config.lead().metered(&self.question.meter(WORK)), &self.plan.planned()[0]);
        let (start_m, to_m) = (dragon.start_travel_m(), planned.travel_m(end_s));
        let at =
            |part: usize| if part == PARTS { to_m } else { start_m + (to_m - start_m) * part as f64 / PARTS as f64 };
        let near_m = config.tables().monitor.near_m;
        // No minimum is lost where two parts meet.
        let overlap_m = dragon.dimensions().link_m(0);
        let mut misses: Vec<ClosestApproach> = Vec::new();
        for part in 0..PARTS {
            let (from_m, until_m) = (at(part), at(part + 1));
            dragon.meter().restart();
            let span_m = [(from_m - overlap_m).max(start_m), (until_m + overlap_m).min(to_m)];
            let found = near_misses(&dragon, span_m[0], span_m[1].max(span_m[0]), near_m, |_| ());
            misses.extend(found.approaches.into_iter().filter(|miss| (from_m..until_m).contains(&miss.travel_m)));
            keep_nearest(&mut misses);
            let known = misses.iter().map(|miss| self.miss(miss)).collect::<Vec<_>>();
            report(json!({ "type": "misses", "misses": known }))?;
        }
        Ok(())
    }

    fn miss(&self, miss: &ClosestApproach) -> Value {
        json!({
            "time_s": self.plan.config.timetable().time_s(miss.travel_m),
            "clearance_m": miss.pair.clearance_m,
            "pair": self.plan.benches(miss.pair.benches),
            "point_m": miss.pair.point.to_array(),
        })
    }

    /// The largest speed of a handle of each dragon.
    fn speeds(&self) -> Vec<Value> {
        let speed = |planned: &Planned| match largest_speed_ratio(&planned.dragon.metered(&self.question.meter(WORK))) {
            Ok(largest) => json!({
                "ratio": largest.ratio,
                "handle": largest.handle,
                "time_s": planned.timetable.time_s(largest.travel_m),
            }),
            Err(reason) => json!({ "unknown": reason.to_string() }),
        };
        self.plan.planned().iter().map(speed).collect()
    }

    /// The first board of each dragon that passes a border of each kind, and the least distance from the crowd.
    fn borders(&self) -> Vec<Value> {
        let stage = self.plan.config.stage();
        let mut found = Vec::new();
        for (number, planned) in self.plan.planned().iter().enumerate() {
            let first_bench = self.plan.config.formation().layout().benches_of(number).start;
            let dragon = planned.dragon.metered(&self.question.meter(WORK));
            for (kind, word) in [(BorderKind::Outline, "outline"), (BorderKind::KeepOut, "keep_out")] {
                let only = Stage::new(stage.of_kind(kind).to_vec(), 0.0);
                let breach = if stage.of_kind(kind).is_empty() { Ok(None) } else { first_breach(&dragon, &only, 0.0) };
                found.extend(breach.ok().flatten().map(|breach| {
                    json!({
                        "kind": word,
                        "time_s": planned.timetable.time_s(breach.travel_m),
                        "bench": self.plan.bench_name(first_bench + breach.bench),
                        "point_m": breach.point.to_array(),
                    })
                }));
            }
            let nearest = least_distance(&dragon, stage, BorderKind::Crowd).ok().flatten();
            found.extend(nearest.map(|nearest| {
                json!({
                    "kind": "crowd",
                    "time_s": planned.timetable.time_s(nearest.travel_m),
                    "bench": self.plan.bench_name(first_bench + nearest.bench),
                    "point_m": nearest.point.to_array(),
                    "distance_m": nearest.distance_m,
                    "clear_m": stage.clear_m(),
                })
            }));
        }
        found
    }
}

/// The numbers of all points of a curve: first every so many, then those between.
fn coarse_first() -> impl Iterator<Item = usize> {
    let is_coarse = |point: &usize| point.is_multiple_of(COARSE);
    (0..POINTS).filter(is_coarse).chain((0..POINTS).filter(move |point| !is_coarse(point)))
}

/// Keeps the nearest ones, in the order of travel.
fn keep_nearest(misses: &mut Vec<ClosestApproach>) {
    misses.sort_by(|one, other| one.pair.clearance_m.total_cmp(&other.pair.clearance_m));
    misses.truncate(MOST_MISSES);
    misses.sort_by(|one, other| one.travel_m.total_cmp(&other.travel_m));
}

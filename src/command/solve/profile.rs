//! The clearance over time and its near misses, as `solve contact --profile` tells them.

use std::fmt::Write as _;

use bench_dragon_geometry::planner::{ClosestApproach, clearance_profile, near_misses};
use serde::Serialize;

use super::times::coarser_step_s;
use crate::cli::ContactArgs;
use crate::command::BadInput;
use crate::command::progress::Progress;
use crate::config::Config;
use crate::output::number::Counted;

/// Most times of a profile: each is a chain and a search through all pairs.
const MAX_TIMES: usize = 1_000_000;

const NANOSECONDS: f64 = 1e9;

#[derive(Serialize)]
pub(super) struct Profile {
    #[serde(rename = "profile")]
    points: Vec<Point>,
    pub(super) near_misses: Vec<NearMiss>,
    /// Where the profile ends, if the work for it was too much.
    #[serde(rename = "profile_to_s", skip_serializing_if = "Option::is_none")]
    points_to_s: Option<f64>,
    /// Where the near misses end, if the work for them was too much.
    #[serde(skip_serializing_if = "Option::is_none")]
    near_misses_to_s: Option<f64>,
}

#[derive(Serialize)]
struct Point {
    time_s: f64,
    clearance_m: f64,
    benches: [usize; 2],
}

#[derive(Serialize)]
pub(super) struct NearMiss {
    pub(super) time_s: f64,
    pub(super) clearance_m: f64,
    pub(super) benches: [usize; 2],
    point_m: [f64; 2],
}

impl Profile {
    /// The profile up to a travel, which is its last time: the contact, the run's end, or where the search for the contact
    /// ended.
    pub(super) fn of(config: &Config, to_m: f64, args: &ContactArgs) -> Result<Self, BadInput> {
        let (dragon, timetable) = (config.dragon(), config.timetable());
        let from_m = dragon.start_travel_m();
        let step_s = args.step as f64 / NANOSECONDS;
        let count = ((timetable.time_s(to_m) - config.start_s()) / step_s).ceil();
        if count >= MAX_TIMES as f64 {
            let coarser_s = coarser_step_s(count * step_s, MAX_TIMES);
            return Err(BadInput(format!(
                "--step is {step_s}, which makes {count} times, must make at most {MAX_TIMES}: try --step {coarser_s}"
            )));
        }
        let time_s = |i: usize| config.start_s() + (i as f64 * args.step as f64) / NANOSECONDS;
        let times_m = (0..count as usize).map(|i| timetable.travel_m(time_s(i))).filter(|&travel_m| travel_m < to_m);
        let travels_m: Vec<f64> = times_m.chain([to_m]).collect();
        let progress = Progress::new("near misses", 1.0);
        let limit_m = args.near.unwrap_or_else(|| config.near_m());
        let metered = dragon.metered(&args.work.meter());
        let misses = near_misses(&metered, from_m, to_m, limit_m, |share| progress.add(share));
        drop(progress);
        let progress = Progress::new("profile", travels_m.len() as f64);
        let metered = dragon.metered(&args.work.meter());
        let points = clearance_profile(&metered, &travels_m, || progress.add(1.0));
        let at = |approach: &ClosestApproach| timetable.time_s(approach.travel_m);
        Ok(Self {
            points_to_s: points.ends_early_m.map(|travel_m| timetable.time_s(travel_m)),
            near_misses_to_s: misses.ends_early_m.map(|travel_m| timetable.time_s(travel_m)),
            points: points
                .approaches
                .iter()
                .map(|point| Point {
                    time_s: at(point),
                    clearance_m: point.pair.clearance_m,
                    benches: point.pair.benches,
                })
                .collect(),
            near_misses: misses
                .approaches
                .iter()
                .map(|miss| NearMiss {
                    time_s: at(miss),
                    clearance_m: miss.pair.clearance_m,
                    benches: miss.pair.benches,
                    point_m: miss.pair.point.to_array(),
                })
                .collect(),
        })
    }

    /// Whether there is a clearance at all: a dragon with fewer than three benches has none.
    pub(super) fn has_points(&self) -> bool {
        !self.points.is_empty()
    }

    /// The near misses, which are few, and below them the profile.
    pub(super) fn text(&self) -> String {
        let mut text = String::new();
        self.write_near_misses(&mut text);
        let _ = writeln!(text, "\n{:>12} {:>14} {:>14}", "s", "clearance m", "benches");
        // Writing into a String cannot fail.
        for Point { time_s, clearance_m, benches: [first, second] } in &self.points {
            // The last one, at a contact, may be 0 from either side.
            let clearance_m = if clearance_m.abs() < 5e-10 { 0.0 } else { *clearance_m };
            let _ = writeln!(text, "{time_s:>12.6} {clearance_m:>14.9} {first:>6} {second:>7}");
        }
        if let Some(time_s) = self.points_to_s {
            let _ = writeln!(
                text,
                "the profile is given up to {time_s:.6} s: more takes too much work, --work allows more"
            );
        }
        text
    }

    fn write_near_misses(&self, text: &mut String) {
        // Writing into a String cannot fail.
        let _ = writeln!(text, "{}", Counted(self.near_misses.len() as u64, "near miss"));
        for NearMiss { time_s, clearance_m, benches: [first, second], point_m: [x, y] } in &self.near_misses {
            let _ = writeln!(text, "{time_s:>12.6} {clearance_m:>14.9} {first:>6} {second:>7}  at ({x:.6}, {y:.6}) m");
        }
        if let Some(time_s) = self.near_misses_to_s {
            let _ = writeln!(
                text,
                "near misses are given up to {time_s:.6} s: more takes too much work, --work allows more"
            );
        }
    }
}

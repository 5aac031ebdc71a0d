//! A run as its description defines it, and the clearance measured in it so far.

use bench_dragon_geometry::clearance::{most_play_reach_m, standing_at};
use bench_dragon_geometry::dragon::Dragon;
use bench_dragon_geometry::stage::{Border, BorderKind, Stage};
use glam::DVec2;

use crate::config::Config;
use crate::output::visible_box;

/// Greatest distance of the drawn line from the route, in metres.
const SAGITTA_M: f64 = 0.002;
/// Greatest distance between two points of the drawn line, in metres.
const LONGEST_STEP_M: f64 = 1.0;
/// Greatest number of points of the drawn line. On a longer route the points are further apart.
const MAX_POINTS: usize = 20_000;

/// A run's number, its configuration, and the curve that its head follows.
#[derive(Clone, Debug)]
pub struct DescribedRun {
    /// The run's number.
    pub run_id: u64,
    /// The configuration.
    pub config: Config,
    /// Points of each dragon's route in metres, from its length behind the start to the route's end.
    pub routes: Vec<Vec<DVec2>>,
    /// Low and high corner of the part of the plane that a plan shows at first: the walked routes, the borders of the stage, and
    /// the parts behind the starts that are not far from them.
    pub view: [DVec2; 2],
}

impl DescribedRun {
    /// Returns the run of this number, with this configuration.
    pub fn new(run_id: u64, config: Config) -> Self {
        let dragons = config.formation().dragons();
        let most_points = MAX_POINTS / dragons.len();
        let curves: Vec<Curve> = dragons.iter().map(|planned| Curve::of(&planned.dragon, most_points)).collect();
        let corners = config.stage().borders().iter().flat_map(Border::corners);
        let core = curves.iter().flat_map(Curve::core).chain(corners);
        let behind = curves.iter().flat_map(|curve| &curve.behind);
        let view = visible_box(core.copied(), behind.copied()).expect("a route has points");
        let routes = curves.into_iter().map(|Curve { behind, walked, .. }| [behind, walked].concat()).collect();
        Self { run_id, config, routes, view }
    }

    /// Whether a board is too near to an area or to the crowd for a guard that keeps clear of them, at a place of the course.
    pub(super) fn is_too_near_at(&self, course_m: f64) -> bool {
        let formation = self.config.formation();
        let course_m = course_m.clamp(formation.begin_m(), formation.end_m());
        let reach_m = most_play_reach_m(formation.lead());
        let is_near =
            |stage: &Stage, kind| !standing_at(formation, stage, kind, stage.clear_m() + reach_m, course_m).is_empty();
        let kinds = [BorderKind::KeepOut, BorderKind::Crowd];
        self.config.guarded_stage().is_some_and(|stage| kinds.into_iter().any(|kind| is_near(stage, kind)))
    }
}

/// The curve of a route, as points.
struct Curve {
    /// The part behind the start.
    behind: Vec<DVec2>,
    /// The part that the head walks.
    walked: Vec<DVec2>,
    is_coiled: bool,
}

impl Curve {
    fn of(dragon: &Dragon, most_points: usize) -> Self {
        let (start_m, end_m) = (dragon.start_travel_m(), dragon.route().end_travel_m());
        let from_m = start_m - dragon.dimensions().links_m();
        let least_step_m = (end_m - from_m) / (most_points - 3) as f64;
        let polyline = |from_m, to_m| dragon.route().polyline(from_m, to_m, SAGITTA_M, least_step_m..=LONGEST_STEP_M);
        let is_coiled = dragon.route().is_coiled();
        Self { behind: polyline(from_m, start_m), walked: polyline(start_m, end_m), is_coiled }
    }

    /// The points that a plan shows at first.
    fn core(&self) -> impl Iterator<Item = &DVec2> {
        // On a coil, the dragon stands around the route.
        let around = if self.is_coiled { &self.behind[..] } else { &[] };
        self.walked.iter().chain(around)
    }
}

/// Number of equal parts of a run.
const BINS: usize = 480;

/// The least measured clearance of each part of a run. All parts are equally long.
#[derive(Clone, Debug, PartialEq)]
pub struct ClearanceChart {
    /// Show time at which the first part begins, in seconds.
    pub start_s: f64,
    /// Length of a part in seconds.
    pub step_s: f64,
    /// The least clearance of each part in metres; `None` if no frame of that part was measured.
    pub least_m: Vec<Option<f64>>,
    revision: Vec<u64>,
    /// Number of changes to the chart so far.
    pub revisions: u64,
}

impl ClearanceChart {
    /// Returns an empty chart from one show time to another, in seconds.
    pub fn new(start_s: f64, end_s: f64) -> Self {
        let step_s = ((end_s - start_s) / BINS as f64).max(f64::MIN_POSITIVE);
        Self { start_s, step_s, least_m: vec![None; BINS], revision: vec![0; BINS], revisions: 0 }
    }

    /// Records a clearance at a show time. A show time outside the run counts for the first or last part.
    pub fn note(&mut self, time_s: f64, clearance_m: f64) {
        let bin = (((time_s - self.start_s) / self.step_s) as usize).min(BINS - 1);
        if self.least_m[bin].is_none_or(|least_m| clearance_m < least_m) {
            self.least_m[bin] = Some(clearance_m);
            self.revisions += 1;
            self.revision[bin] = self.revisions;
        }
    }

    /// Takes over the parts of another chart of the same run that this chart lacks.
    pub(super) fn recall(&mut self, least_m: &[Option<f64>]) {
        for (bin, least_m) in least_m.iter().enumerate() {
            if let Some(least_m) = least_m {
                self.note(self.start_s + (bin as f64 + 0.5) * self.step_s, *least_m);
            }
        }
    }

    /// Returns the parts that have changed since a revision: index and least clearance in metres.
    pub fn since(&self, revision: u64) -> impl Iterator<Item = (usize, f64)> {
        let bins = self.revision.iter().zip(&self.least_m).enumerate();
        bins.filter(move |(_, (changed, _))| **changed > revision)
            .filter_map(|(bin, (_, least_m))| least_m.map(|least_m| (bin, least_m)))
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;

    #[test]
    fn the_drawn_route_leads_from_behind_the_tail_through_the_start_to_the_end() {
        let config = Config::load(None, |_| ()).expect("the paper's");
        let run = DescribedRun::new(7, config);
        let nearest_m = |point: DVec2| run.routes[0].iter().map(|at| at.distance(point)).fold(f64::INFINITY, f64::min);
        assert!(nearest_m(DVec2::new(8.8, 0.0)) < 0.5, "the head starts on it");
        assert!(run.routes[0].len() <= MAX_POINTS);
        let middles = run.routes[0].windows(2).map(|ends| (ends[0] + ends[1]) / 2.0);
        // In the innermost turn, a difference of radii does not approximate the distance from the curve.
        for middle in middles.filter(|middle| middle.length() > 0.55) {
            // On the spiral r = b θ, the angle determines the number of turns up to an integer, and the radius determines that
            // integer.
            let turns = (middle.length() / 0.55 - middle.to_angle() / TAU).round();
            let beside_m = middle.length() - 0.55 * (turns + middle.to_angle() / TAU);
            assert!(beside_m.abs() < 2.0 * SAGITTA_M, "{beside_m} m beside the route at {middle}");
        }
    }

    #[test]
    fn the_view_has_the_route_and_the_stage_without_a_long_run_up() {
        let path = "[route]\nkind = \"path\"\nsegments = [{ kind = \"line\", length_m = 40 }]\n";
        let stage = "[stage]\noutline = [[-1, -20], [60, -20], [60, 20], [-1, 20]]\n";
        let view = |text: &str| DescribedRun::new(7, Config::from_toml(text).expect("valid")).view;
        let [low, high] = view(path);
        assert!(low.x < 0.0 && low.x > -6.0 && high.x == 40.0, "{low} to {high}");
        assert_eq!(view(&format!("{path}{stage}"))[1], DVec2::new(60.0, 20.0));
        let [low, high] = view("");
        assert!((high - low).min_element() > 2.0 * 11.0, "the outer turns are in view: {low} to {high}");
    }

    #[test]
    fn each_part_keeps_its_least_clearance_and_reports_changes_since_a_revision() {
        let mut chart = ClearanceChart::new(-100.0, 100.0);
        chart.note(-100.0, 0.3);
        chart.note(-100.0, 0.2);
        let seen = chart.revisions;
        chart.note(-100.0, 0.25);
        chart.note(1e9, 0.1);
        chart.note(-1e9, 0.05);
        let changed: Vec<(usize, f64)> = chart.since(seen).collect();
        assert_eq!(changed, [(0, 0.05), (BINS - 1, 0.1)]);
        assert_eq!(chart.least_m.iter().flatten().count(), 2);
    }
}

//! The configuration: one TOML document, validated once. Its values need no further check.
//!
//! Missing keys have the values of the paper's dragon or of the paper's turnaround. Unknown keys, values out of range
//! and impossible geometry are errors. They name the key, the value and the allowed values.

mod config_document;
mod cue;
mod document;
mod dragon_entry;
mod drawn_route;
mod formation_document;
mod ground_table;
mod named_benches;
mod named_layout;
mod origin_table;
mod plan_document;
mod planned_cues;
mod priority;
mod ranges;
mod route_table;
mod segment_table;
mod stage_table;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::sync::Arc;

use bench_dragon_geometry::clearance::standing_at;
use bench_dragon_geometry::dragon::{Dragon, FeasibleEnd};
use bench_dragon_geometry::formation::{Formation, Timetable};
use bench_dragon_geometry::number::{Fixed, Number};
use bench_dragon_geometry::route::{RouteShape, RouteSpec};
use bench_dragon_geometry::stage::{BorderKind, Stage};

pub use config_document::{ConfigDocument, unplaced};
pub use cue::{Cue, MAX_CUES};
pub use document::{Document, HeadTable, MAX_CONFIG_BYTES, MonitorTable, ServeTable, read_document};
pub use drawn_route::DrawingFit;
pub use formation_document::{FormationDocument, NamedDragon};
pub use named_benches::NamedBenches;
pub use named_layout::NamedLayout;
pub use plan_document::PlanDocument;
pub use planned_cues::{PlannedCue, PlannedCues};
pub use priority::{Priority, PriorityError, REAL_TIME_PRIORITY};
pub use ranges::{
    CATCH_UP_S, CPU, FORECAST_SPEED_MPS, HEAD_ACCEL_MPS2, HEAD_SPEED_MPS, HOLE_DIAMETER_M, MARGIN_M, MAX_ALSO, NEAR_M,
    RATE_HZ, SPIN_US, TIME_SCALE,
};
use ranges::{require, require_whole};

/// Reason why a configuration is not valid, in one line: table, key, value, and allowed values. The caller adds the
/// file name.
#[derive(Debug, thiserror::Error)]
#[error("{0}")]
pub struct ConfigError(String);

/// A valid configuration: the document's tables, and the formation of its dragons.
#[derive(Clone, Debug)]
pub struct Config {
    /// The document of the dragon that leads, with the tables that all dragons share.
    document: ConfigDocument,
    formation: Arc<Formation>,
    cues: Arc<[Cue]>,
    /// The dragons of `[[dragons]]`; none for the short form.
    named: Option<Arc<FormationDocument>>,
}

impl Config {
    /// Combines [`PlanDocument::load`] and [`PlanDocument::build`].
    ///
    /// # Errors
    /// The errors of both.
    pub fn load(path: Option<&Path>, set_flags: impl FnOnce(&mut Document)) -> Result<Self, ConfigError> {
        PlanDocument::load(path, set_flags, None)?.build()
    }

    fn of_formation(named: FormationDocument) -> Self {
        let document = named.dragons()[0].config.document.clone();
        let (formation, cues) = (Arc::clone(named.formation()), Arc::clone(named.cues()));
        Self { document, formation, cues, named: Some(Arc::new(named)) }
    }

    /// Parses the text of a description, and places the dragons on their routes.
    ///
    /// # Errors
    /// The text or a value is not valid, or a dragon does not fit on its route.
    pub fn from_toml(text: &str) -> Result<Self, ConfigError> {
        PlanDocument::from_toml(text)?.build()
    }

    /// The whole configuration as TOML, with every key that applies.
    pub fn to_toml(&self) -> String {
        self.named.as_ref().map_or_else(|| self.document.to_toml(), |named| named.to_toml())
    }

    /// The dragons with their names; `None` for the short form for one dragon.
    pub fn named(&self) -> Option<&FormationDocument> {
        self.named.as_deref()
    }

    /// The checked document.
    pub fn document(&self) -> &ConfigDocument {
        &self.document
    }

    /// The values of the document.
    pub fn tables(&self) -> &Document {
        &self.document.tables
    }

    /// All dragons of the show.
    pub fn formation(&self) -> &Arc<Formation> {
        &self.formation
    }

    /// The cues, in the order of plan time.
    pub fn cues(&self) -> &[Cue] {
        &self.cues
    }

    /// Places of the course at which the show waits until GO, in their order.
    pub fn waits_m(&self) -> Arc<[f64]> {
        self.cues.iter().filter(|cue| cue.waits).map(|cue| self.formation.course_m(cue.at_s)).collect()
    }

    /// The dragon that leads, on its route.
    pub fn lead(&self) -> &Arc<Dragon> {
        self.formation.lead()
    }

    /// Show seconds that one running tick advances.
    pub fn tick_s(&self) -> f64 {
        self.tables().serve.time_scale / f64::from(self.tables().serve.rate_hz)
    }

    /// Greatest number of missed periods after which the show jumps at once.
    pub fn most_jumped(&self) -> u64 {
        // Rounding may make the product slightly smaller than a whole number of periods.
        (self.tables().serve.catch_up_s * f64::from(self.tables().serve.rate_hz) * (1.0 + 2.0 * f64::EPSILON)) as u64
    }

    /// Whether the subcommand `show` plays a performance, which only its operator ends.
    pub fn stays(&self) -> bool {
        self.tables().show.stay
    }

    /// Command lines of `[[show.also]]`, in their order. The subcommand `show` checks them.
    pub fn also(&self) -> Vec<&str> {
        self.tables().show.also.iter().map(|also| also.command.as_str()).collect()
    }

    /// The route as planned.
    pub fn route(&self) -> &RouteSpec {
        &self.document.route
    }

    /// The borders of the stage.
    pub fn stage(&self) -> &Stage {
        self.document.stage()
    }

    /// The stage whose borders a guard keeps clear; `None` without one.
    pub fn guarded_stage(&self) -> Option<&Stage> {
        self.tables().stage.guard.then(|| self.stage())
    }

    /// Fails for a formation that no server can play from its start: dragons that stand in each other, a board in an area to keep out
    /// of, or one that is too near to a border for its guard. The planner answers questions about such a formation.
    ///
    /// # Errors
    /// The benches, and what is in their way.
    pub fn require_start(&self) -> Result<(), ConfigError> {
        self.named().map_or(Ok(()), FormationDocument::require_apart)?;
        let stage = self.stage();
        let standing = |kind, clear_m| {
            let found = standing_at(&self.formation, stage, kind, clear_m, self.formation.begin_m());
            found.first().map(|found| (self.bench_words(found.bench), stage.name(found.border), found.distance_m))
        };
        if let Some((bench, border, _)) = standing(BorderKind::KeepOut, 0.0) {
            return Err(ConfigError(format!("[stage] {border} holds {bench} at the start: begin its route elsewhere")));
        }
        let has_guard = self.tables().monitor.guard && self.guarded_stage().is_some();
        for kind in [BorderKind::KeepOut, BorderKind::Crowd].into_iter().filter(|_| has_guard) {
            if let Some((bench, border, distance_m)) = standing(kind, stage.clear_m()) {
                let (distance, clear) = (Fixed::<3>(distance_m), Number(stage.clear_m()));
                return Err(ConfigError(format!(
                    "[stage] {border} is {distance} m from {bench} at the start, must be at least clear_m {clear} from it with guard"
                )));
            }
        }
        Ok(())
    }

    /// That a clearance is less than the play of the hinges, in words; `None` if it is not.
    pub fn under_play(&self, name: &str, clearance_m: f64) -> Option<String> {
        let play_m = self.lead().dimensions().play_m();
        let [clearance, play] = [clearance_m, (play_m * 1e9).round() / 1e9].map(Number);
        (clearance_m < play_m).then(|| format!("{name} is {clearance}, less than the play of the hinges, {play} m"))
    }

    /// Show time in seconds at which the planned run starts.
    pub fn start_s(&self) -> f64 {
        if self.formation.has_plan_course() { self.formation.begin_s() } else { self.document.route.start_s }
    }

    /// Timetable of the leading head on a run from the start.
    pub fn timetable(&self) -> &Timetable {
        self.formation.timetable()
    }

    /// The same for a run that begins at a later show time, at the travel of the planned speed.
    pub fn timetable_from(&self, start_s: f64) -> Timetable {
        self.tables().head.timetable(start_s, self.lead().end_travel_m())
    }

    /// Show time in seconds at which a run ends that begins at a show time.
    pub fn end_from_s(&self, start_s: f64) -> f64 {
        let is_whole = start_s == self.start_s() || self.formation.has_plan_course();
        if is_whole { self.end_s() } else { self.timetable_from(start_s).end_s() }
    }

    /// Place on the course at a show time, as planned without ramps at the ends. Rounding does not put it past the end.
    pub fn course_m(&self, show_time_s: f64) -> f64 {
        (self.tables().head.speed_mps * show_time_s).min(self.formation.end_m())
    }

    /// Greatest change of the speed along the course, in m/s²; without one the show starts and stops at once.
    pub fn accel_mps2(&self) -> Option<f64> {
        if self.formation.has_plan_course() { self.formation.accel_mps2() } else { self.tables().head.accel_mps2 }
    }

    /// The same for a show that stands at a place or passes it; `None` where the plan itself rests, which the show leaves at once.
    pub fn accel_mps2_at(&self, course_m: f64) -> Option<f64> {
        let is_plan = self.formation.has_plan_course();
        let is_rest = course_m == self.formation.begin_m() || self.waits_m().contains(&course_m);
        self.accel_mps2().filter(|_| !is_plan || !is_rest)
    }

    /// Show time in seconds at which a run from the start ends: at the planned end, or where the dragon can walk no
    /// further. With ramps the head reaches that point later.
    pub fn end_s(&self) -> f64 {
        let has_ramps = self.tables().head.accel_mps2.is_some() && !self.formation.has_plan_course();
        if has_ramps { self.timetable().end_s() } else { self.last_seek_s() }
    }

    /// Latest show time that a seek may request, in seconds: the end of the run. A seek moves the head to the travel of
    /// the planned speed without ramps.
    pub fn last_seek_s(&self) -> f64 {
        if self.formation.has_plan_course() {
            return self.formation.end_s();
        }
        match (self.document.route.end_s, self.lead().feasible_end()) {
            (Some(end_s), FeasibleEnd::RouteEnd) => end_s,
            _ => self.lead().end_travel_m() / self.tables().head.speed_mps,
        }
    }

    /// Returns the same configuration with another spiral or turnaround, without cues. The heights under the route are those of the
    /// same map.
    ///
    /// # Errors
    /// The route is not valid, this dragon does not fit on it, or the ground ends.
    pub fn with_shape(&self, shape: &RouteShape) -> Result<Self, ConfigError> {
        let mut tables = self.tables().clone();
        tables.route = tables.route.with_shape(shape);
        // Their places may lie beyond the end of the other route.
        tables.cues.clear();
        self.rebuilt(self.document.with_route_of(tables)?)
    }

    /// Places the dragon of another document with the same limit of steps.
    fn rebuilt(&self, document: ConfigDocument) -> Result<Self, ConfigError> {
        ConfigDocument { placing_steps: self.document.placing_steps, ..document }.build()
    }

    /// Returns the same configuration with another planned speed of the head, in metres per show second. The head walks the same
    /// part of the route, so the times at which the plan begins and ends change; those of a turnaround, which has no end, do not. It has no
    /// cues.
    ///
    /// # Errors
    /// The speed is out of range, or the route is not valid with it.
    pub fn with_head_speed(&self, speed_mps: f64) -> Result<Self, ConfigError> {
        let mut tables = self.tables().clone();
        tables.route = tables.route.clone().with_times_scaled(tables.head.speed_mps / speed_mps);
        tables.head.speed_mps = speed_mps;
        // Their places may lie beyond the end of the other run.
        tables.cues.clear();
        self.with_tables(tables)
    }

    /// Returns the same configuration whose head walks from one travel to another with this planned speed, in m/s, and this
    /// acceleration, in m/s², and follows these cues. A run without a planned end still ends with the route.
    ///
    /// # Errors
    /// A value is out of range, or the route is not valid with it.
    pub fn with_run(
        &self,
        speed_mps: f64,
        accel_mps2: f64,
        ends_m: [f64; 2],
        cues: &[Cue],
    ) -> Result<Self, ConfigError> {
        let mut tables = self.tables().clone();
        tables.route = tables.route.clone().with_times(ends_m.map(|travel_m| travel_m / speed_mps));
        tables.head = HeadTable { speed_mps, accel_mps2: Some(accel_mps2) };
        tables.cues = cues.iter().map(|cue| cue.table(&[])).collect();
        self.with_tables(tables)
    }

    /// The dragon with other tables on the same drawing.
    fn with_tables(&self, tables: Document) -> Result<Self, ConfigError> {
        let ConfigDocument { drawing, map, .. } = self.document.clone();
        self.rebuilt(ConfigDocument { drawing, map, ..ConfigDocument::check(tables)? })
    }
}

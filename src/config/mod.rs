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
mod route_table;
mod segment_table;
mod stage_table;

use std::ops::RangeInclusive;
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

/// Allowed rates of a server, in ticks a second.
pub const RATE_HZ: RangeInclusive<u32> = 1..=100_000;
/// Allowed time scales of a server, in show seconds per second of wall time.
pub const TIME_SCALE: RangeInclusive<f64> = 0.001..=1000.0;
/// Allowed processors of a server, as the kernel numbers them: the range of a CPU set.
pub const CPU: RangeInclusive<u32> = 0..=1023;
/// Allowed spin times of a server before each due instant, in microseconds.
pub const SPIN_US: RangeInclusive<u32> = 0..=1000;
/// Allowed values of the longest standstill after which a show jumps, in seconds of wall time.
pub const CATCH_UP_S: RangeInclusive<f64> = 0.0..=10.0;
/// Allowed planned speeds of the head, in metres per show second.
pub const HEAD_SPEED_MPS: RangeInclusive<f64> = 0.001..=10.0;
/// Speed in metres per show second from which on times of arrival are forecast. An ordered speed may be slower, down to 0: then the
/// head counts as one that stands.
pub const FORECAST_SPEED_MPS: f64 = 1e-6;
/// Allowed values of the head's greatest acceleration, in m/s².
pub const HEAD_ACCEL_MPS2: RangeInclusive<f64> = 0.001..=1000.0;
/// Allowed clearances of the monitor's warning, in metres.
pub const NEAR_M: RangeInclusive<f64> = 0.0..=10.0;
/// Allowed margins of the guard, in metres.
pub const MARGIN_M: RangeInclusive<f64> = 0.000_001..=10.0;

/// Diameter of the hinge holes without a configured one: the paper's.
pub const HOLE_DIAMETER_M: f64 = 0.055;

/// Greatest number of commands in `[[show.also]]`: the bus has capacity for these and as many other commands.
pub const MAX_ALSO: usize = 8;

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

    /// Returns the same configuration with another spiral or turnaround, without cues.
    ///
    /// # Errors
    /// The route is not valid, or this dragon does not fit on it.
    pub fn with_shape(&self, shape: &RouteShape) -> Result<Self, ConfigError> {
        let mut tables = self.tables().clone();
        tables.route = tables.route.with_shape(shape);
        // Their places may lie beyond the end of the other route.
        tables.cues.clear();
        self.rebuilt(ConfigDocument::check(tables)?)
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
        let drawing = self.document.drawing.clone();
        self.rebuilt(ConfigDocument { drawing, ..ConfigDocument::check(tables)? })
    }
}

fn require_whole(
    table: &'static str,
    key: &'static str,
    value: u32,
    allowed: &RangeInclusive<u32>,
) -> Result<(), ConfigError> {
    require(table, key, f64::from(value), &(f64::from(*allowed.start())..=f64::from(*allowed.end())))
}

fn require(
    table: &'static str,
    key: &'static str,
    value: f64,
    allowed: &RangeInclusive<f64>,
) -> Result<(), ConfigError> {
    if allowed.contains(&value) {
        return Ok(());
    }
    let (value, lowest, highest) = (Number(value), allowed.start(), allowed.end());
    Err(ConfigError(format!("[{table}] {key} is {value}, must be from {lowest} to {highest}")))
}

#[cfg(test)]
mod tests {
    use bench_dragon_geometry::route::TurnaroundSpec;

    use super::*;

    fn error_of(text: &str) -> String {
        Config::from_toml(text).expect_err(text).to_string()
    }

    #[test]
    fn the_document_without_keys_is_the_papers_dragon() {
        let config = Config::from_toml("").expect("every key has a default");
        assert_eq!(config.lead().dimensions().benches(), 223);
        assert_eq!(
            (config.tables().serve.rate_hz, config.tables().serve.time_scale, config.tables().head.speed_mps),
            (1000, 1.0, 1.0)
        );
        assert_eq!((config.tables().serve.catch_up_s, config.most_jumped()), (0.25, 250));
    }

    #[test]
    fn a_document_is_read_without_a_dragon_on_its_route() {
        let document = ConfigDocument::from_toml("[route]\npitch_m = 0.2").expect("each value is in its range");
        let error = document.build().expect_err("the boards are wider than the pitch").to_string();
        assert!(error.starts_with("pitch_m is 0.2, must be above width_m"), "{error}");
    }

    #[test]
    fn the_written_document_reads_back_the_same() {
        let text = "[route]\npitch_m = 0.6000000000000001\n[serve]\nrate_hz = 250\ncpu = 3\npriority = \"fifo:80\"\nspin_us = 9\ncatch_up_s = 0.5\n";
        let config = Config::from_toml(text).expect("the text is valid");
        let again = Config::from_toml(&config.to_toml()).expect("its own text is valid");
        assert_eq!(again.document.tables, config.document.tables);
    }

    #[test]
    fn the_commands_of_a_show_are_kept_in_their_order() {
        let text = "[[show.also]]\ncommand = \"hz\"\n[[show.also]]\ncommand = \"bridge psn --name 'a b'\"\n";
        let config = Config::from_toml(text).expect("the text is valid");
        assert_eq!(config.also(), ["hz", "bridge psn --name 'a b'"]);
        let again = Config::from_toml(&config.to_toml()).expect("its own text is valid");
        assert_eq!(again.document.tables, config.document.tables);
        assert!(!Config::from_toml("").expect("every key has a default").to_toml().contains("show"));
    }

    #[test]
    fn missing_keys_of_a_turnaround_have_the_papers_values() {
        let config = Config::from_toml("[route]\nkind = \"turnaround\"\nend_s = 60").expect("the text is valid");
        let plan = RouteSpec { end_s: Some(60.0), ..RouteSpec::from(TurnaroundSpec::default()) };
        assert_eq!(config.route(), &plan);
        assert_eq!((config.start_s(), config.end_s()), (-100.0, 60.0));
        let again = Config::from_toml(&config.to_toml()).expect("its own text is valid");
        assert_eq!(again.document.tables, config.document.tables);
    }

    #[test]
    fn flags_override_the_document() {
        let flags = |tables: &mut Document| (tables.serve.rate_hz, tables.serve.time_scale) = (50, 20.0);
        let config = Config::load(None, flags).expect("both are in range");
        assert_eq!((config.tables().serve.rate_hz, config.tables().serve.time_scale), (50, 20.0));
    }

    #[test]
    fn the_jump_limit_is_the_number_of_periods_within_catch_up_s() {
        for (catch_up_s, rate_hz, most) in [(0.0, 1000, 0), (0.25, 50, 12), (0.29, 100, 29), (10.0, 100_000, 1_000_000)]
        {
            let text = format!("[serve]\nrate_hz = {rate_hz}\ncatch_up_s = {catch_up_s:?}\n");
            assert_eq!(Config::from_toml(&text).expect("a valid text").most_jumped(), most, "{text}");
        }
    }

    #[test]
    fn the_error_of_an_unknown_key_names_the_key_and_its_line() {
        let error = error_of("[route]\npitch_m = 0.55\npitsch = 1\n");
        assert!(error.starts_with("line 3, `pitsch = 1`: unknown field `pitsch`, expected one of"), "{error}");
    }

    #[test]
    fn a_show_runs_a_bounded_number_of_commands() {
        let text = "[[show.also]]\ncommand = \"hz\"\n".repeat(MAX_ALSO + 1);
        assert_eq!(error_of(&text), "[[show.also]] occurs 9 times, at most 8 are allowed");
    }

    #[test]
    fn areas_to_keep_out_of_are_bounded_in_number() {
        let area = "[[0, 0], [1, 0], [0, 1]]";
        let text = |count| format!("[stage]\nkeep_out = [{}]\n", vec![area; count].join(", "));
        assert_eq!(error_of(&text(33)), "[stage] keep_out has 33 areas, at most 32 are allowed");
        let config = Config::from_toml(&text(32)).expect("as many as are allowed");
        assert_eq!(config.stage().keep_out().len(), 32);
        assert_eq!(Config::from_toml(&config.to_toml()).expect("written and read").stage(), config.stage());
    }

    #[test]
    fn a_formation_that_stands_in_the_way_of_its_stage_cannot_start() {
        let text = |stage: &str, guard: bool| format!("[monitor]\nguard = {guard}\n[stage]\n{stage}\n");
        let error = |stage: &str, guard| {
            let config = Config::from_toml(&text(stage, guard)).expect("a valid text");
            config.require_start().map_err(|error| error.to_string())
        };
        let area = "keep_out = [[[50, 0], [51, 0], [51, 1]], [[8, 0], [9, 0], [9, -1]]]";
        assert_eq!(
            error(area, false),
            Err("[stage] keep_out area 2 holds bench 0 at the start: begin its route elsewhere".to_owned())
        );
        let crowd = "crowd = [[-20, 20], [20, 20]]\nclear_m = 9\nguard = true";
        assert_eq!(error(crowd, false), Ok(()));
        let near = error(crowd, true).expect_err("nearer than 9 m");
        assert!(near.starts_with("[stage] crowd is 8.") && near.contains(" m from bench "), "{near}");
        assert!(near.ends_with(" at the start, must be at least clear_m 9 from it with guard"), "{near}");
        assert_eq!(error(&crowd.replace("= 9", "= 2"), true), Ok(()));
    }

    #[track_caller]
    fn assert_one_line(text: &str, start: &str) {
        let error = error_of(text);
        assert!(error.starts_with(start) && !error.contains('\n'), "{text:?} gives {error:?}");
    }

    #[test]
    fn every_error_of_the_stage_is_one_line_that_names_key_value_and_range() {
        for (text, start) in [
            ("[stage]\noutline = [[0, 0], [1, 0]]", "[stage] outline has 2 points, must have from 3 to 256"),
            (
                "[stage]\noutline = [[0, 0], [1, 0], [inf, 1]]",
                "[stage] outline point 3 has the coordinate inf, must be from -",
            ),
            (
                "[stage]\noutline = [[0, 0], [1, 1], [1, 0], [0, 1]]",
                "[stage] outline crosses or touches itself: the edges from points 1 and 3 meet",
            ),
            ("[stage]\noutline = [[0, 0], [1e-4, 0], [0, 1e-4]]", "[stage] outline encloses 5e-9 m², must enclose"),
            ("[stage]\noutline = [[0, 0], [1, 0], [2]]", "[stage] outline point 3 is [2], must be two numbers, [x, y]"),
            (
                "[stage]\noutline = [[0, 0], [1, 0, 3], [1, 1]]",
                "[stage] outline point 2 is [1, 0, 3], must be two numbers, [x, y]",
            ),
            (
                "[stage]\noutline = [[0, 0], [1, 0], [1, 1], [0, 0]]",
                "[stage] outline points 1 and 4 are the same, must differ: leave out one of them",
            ),
            (
                "[stage]\nkeep_out = [[[0, 0], [1, 0], [0, 1]], [[0, 0], [1, 1], [1, 0], [0, 1]]]",
                "[stage] keep_out area 2 crosses or touches itself: the edges from points 1 and 3 meet",
            ),
            (
                "[stage]\nkeep_out = [[0, 0], [1, 0], [0, 1]]",
                "line 2, `keep_out = [[0, 0], [1, 0], [0, 1]]`: invalid type",
            ),
            (
                "[stage]\nkeep_out = [[[0, 0], [1, 0], [0]]]",
                "[stage] keep_out area 1 point 3 is [0], must be two numbers",
            ),
            ("[stage]\ncrowd = [[0, 0]]", "[stage] crowd has 1 points, must have from 2 to 256"),
            ("[stage]\ncrowd = [[0, 0], [0, 0]]", "[stage] crowd points 1 and 2 are the same, must differ: leave out"),
            ("[stage]\ncrowd = [[0, 0], [0, inf]]", "[stage] crowd point 2 has the coordinate inf, must be from -"),
            ("[stage]\ncrowd = [[0, 9], [9, 9]]\nclear_m = -1", "[stage] clear_m is -1, must be from 0 to 100"),
            ("[stage]\ncrowd = [[0, 9], [9, 9]]\nclear_m = nan", "[stage] clear_m is NaN, must be from 0 to 100"),
            ("[stage]\nclear_m = 2", "[stage] clear_m is 2, only allowed with outline, keep_out or crowd"),
            ("[stage]\ncrowd = [[0, 9], [9, 9]]\nguard = true", "[stage] guard is true, needs clear_m: the distance"),
            (
                "[dragon]\npole_diameter_m = 0.05\n[stage]\ncrowd = [[0, 9], [9, 9]]\nclear_m = 2\nguard = true",
                "[stage] guard is true, needs wider bends than this run has, with play in the hinges: end it earlier ([route] end_s)",
            ),
            (
                "[dragon]\npole_diameter_m = 0.05\n[route]\nend_s = 300\n[ground]\nrise_x = 0.01\n[stage]\ncrowd = [[0, 9], [9, 9]]\n\
                 clear_m = 2\nguard = true",
                "[stage] guard is true, needs hinges without play on ground: remove [dragon] pole_diameter_m, or guard",
            ),
        ] {
            assert_one_line(text, start);
        }
    }

    #[test]
    fn every_error_is_one_line_that_names_key_value_and_range() {
        for (text, start) in [
            ("[serve]\nrate_hz = 0", "[serve] rate_hz is 0, must be from 1 to 100000"),
            ("[serve]\nrate_hz = 10000000", "[serve] rate_hz is 10000000, must be from 1 to 100000"),
            ("[serve]\ntime_scale = nan", "[serve] time_scale is NaN, must be from 0.001 to 1000"),
            ("[serve]\ncpu = 1024", "[serve] cpu is 1024, must be from 0 to 1023"),
            ("[serve]\ncatch_up_s = -0.25", "[serve] catch_up_s is -0.25, must be from 0 to 10"),
            ("[serve]\ncatch_up_s = nan", "[serve] catch_up_s is NaN, must be from 0 to 10"),
            ("[serve]\nspin_us = 1001", "[serve] spin_us is 1001, must be from 0 to 1000"),
            (
                "[serve]\npriority = \"fifo\"",
                "line 2, `priority = \"fifo\"`: priority is \"fifo\", must be other, fifo:N or rr:N, N from 1 to 99",
            ),
            ("[head]\nspeed_mps = -1.0", "[head] speed_mps is -1, must be from 0.001 to 10"),
            ("[dragon]\nbenches = 0", "[dragon] benches is 0, must be"),
            ("[dragon]\nhole_offset_m = 1.2", "[dragon] hole_offset_m is 1.2, must be"),
            ("[dragon]\nwidth_m = inf", "[dragon] width_m is inf, must be"),
            ("[route]\npitch_m = 0.2", "pitch_m is 0.2, must be above width_m"),
            ("[route]\npitch_m = nan", "[route] pitch_m is NaN, must be"),
            (
                "[route]\nkind = \"ring\"",
                "line 2, `kind = \"ring\"`: unknown variant `ring`, expected one of `spiral`, `turnaround`",
            ),
            ("[route]\nradius_ratio = 2", "[route] radius_ratio is 2, only allowed with kind = \"turnaround\""),
            (
                "[route]\nkind = \"turnaround\"\nstart_turns = 16",
                "[route] start_turns is 16, only allowed with kind = \"spiral\"",
            ),
            ("[route]\nkind = \"turnaround\"\nradius_ratio = 0", "[route] radius_ratio is 0, must be from 0.01 to 100"),
            ("[route]\nturn_line_m = 1", "[route] turn_line_m is 1, only allowed with kind = \"turnaround\""),
            (
                "[route]\nkind = \"turnaround\"\nturn_line_m = 9",
                "[route] turn_line_m is 9, must be 0 or more, and under turn_diameter_m 9",
            ),
            (
                "[route]\nkind = \"turnaround\"\nturn_diameter_m = -9",
                "[route] turn_diameter_m is -9, must be above 0 and at most 34000",
            ),
            (
                "[route]\nkind = \"turnaround\"\nturn_diameter_m = 5e-324",
                "[route] turn_diameter_m is 5e-324, must be above 0 and at most 34000",
            ),
            ("[route]\nkind = \"turnaround\"\nstart_s = 5\nend_s = 5", "[route] end_s is 5, must be above start_s 5"),
            (
                "[route]\nkind = \"turnaround\"\nend_s = 1e9",
                "[route] end_s is 1000000000, must be from -1000000 to 1000000",
            ),
            ("[dragon]\nbenches = -3", "line 2, `benches = -3`: "),
            ("[dragon", "line 1, `[dragon`: "),
            (
                "[serve]\nrate_hz = 1e3",
                "line 2, `rate_hz = 1e3`: invalid type: floating point `1000.0`, expected a whole number",
            ),
            ("[route]\npitch_m = \"x\"", "line 2, `pitch_m = \"x\"`: invalid type: string \"x\", expected a number"),
            ("[show]\nalso = 3", "line 2, `also = 3`: invalid type: integer `3`, expected a sequence"),
            ("[[show.also]]\nname = \"x\"", "line 2, `name = \"x\"`: unknown field `name`, expected `command`"),
            ("[[show.also]]", "line 1, `[[show.also]]`: missing field `command`"),
            ("[show]\nalos = []", "line 2, `alos = []`: unknown field `alos`, expected `stay` or `also`"),
            ("dragon = 3", "line 1, `dragon = 3`: invalid type: integer `3`, expected a table"),
            ("[route]\npitch_m = 1e308", "[route] pitch_m is 1e308, must be"),
        ] {
            assert_one_line(text, start);
        }
    }
}

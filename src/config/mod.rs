//! The configuration: one TOML document, validated once. Its values need no further check.
//!
//! Missing keys have the values of the paper's dragon or of the paper's turnaround. Unknown keys, values out of range
//! and impossible geometry are errors. They name the key, the value and the allowed values.

mod document;
mod drawn_route;
mod formation_document;
mod ground_table;
mod origin_table;
mod priority;
mod route_table;
mod segment_table;
mod stage_table;

use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;

use bench_dragon_geometry::dragon::{Dimensions, Dragon, DragonError, FeasibleEnd, Meter};
use bench_dragon_geometry::formation::{Formation, Layout, Planned, Timetable};
use bench_dragon_geometry::ground::{Ground, HeightMap};
use bench_dragon_geometry::number::{Fixed, Number};
use bench_dragon_geometry::outline::Outline;
use bench_dragon_geometry::route::{Route, RouteError, RouteShape, RouteSpec};
use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;
use glam::DVec2;

pub use document::{Document, HeadTable, MonitorTable, ServeTable};
pub use drawn_route::DrawingFit;
pub use formation_document::{FormationDocument, NamedDragon};
pub use priority::{Priority, PriorityError, REAL_TIME_PRIORITY};

use document::{DragonTable, parse, read};

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
/// Distance of a map from (0, 0), in metres, from which on its coordinates are those of a survey.
const SURVEY_M: f64 = 10_000.0;
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

/// A parsed document. All values except those of `[route]` are in range. [`build`](Self::build) checks the route and
/// places the dragon.
#[derive(Clone, Debug)]
pub struct ConfigDocument {
    tables: Document,
    dimensions: Dimensions,
    route: RouteSpec,
    drawing: Option<DrawingFit>,
    outline: Option<Outline>,
    /// Limit of steps for finding the end of the dragon's run, if not that of [`Dragon::new`].
    placing_steps: Option<u64>,
}

/// A valid configuration: the document's tables, and the formation of its dragon.
#[derive(Clone, Debug)]
pub struct Config {
    document: ConfigDocument,
    formation: Arc<Formation>,
}

/// A checked document of one dragon, or a configuration of several.
#[derive(Clone, Debug)]
pub enum PlanDocument {
    /// A document with the short form for one dragon.
    OneDragon(Box<ConfigDocument>),
    /// A document with `[[dragons]]`.
    Formation(FormationDocument),
}

impl PlanDocument {
    /// Reads a file, or uses the paper's dragon without a file. Then `set_flags` overrides values. `placing_steps`: as for
    /// [`ConfigDocument::with_placing_steps`].
    ///
    /// # Errors
    /// A file cannot be read, a value is not valid, a drawing has no path, or a dragon of several does not fit on its route.
    pub fn load(
        path: Option<&Path>,
        set_flags: impl FnOnce(&mut Document),
        placing_steps: Option<u64>,
    ) -> Result<Self, ConfigError> {
        let mut tables = path.map_or_else(|| Ok(Document::default()), |path| parse(&read(path)?))?;
        set_flags(&mut tables);
        let folder = path.and_then(Path::parent).unwrap_or(Path::new(""));
        if !tables.dragons.is_empty() {
            return FormationDocument::build(tables, folder, placing_steps).map(Self::Formation);
        }
        let document = ConfigDocument::of_tables(tables, folder)?;
        let document = placing_steps.into_iter().fold(document, ConfigDocument::with_placing_steps);
        Ok(Self::OneDragon(Box::new(document)))
    }
}

impl ConfigDocument {
    /// Reads a file, or uses the paper's dragon without a file. Then `set_flags` overrides values. A drawn route is read from its
    /// own file, and becomes a path: the written document needs no drawing.
    ///
    /// # Errors
    /// A file cannot be read, a value is not valid, or a drawing has no path.
    pub fn load(path: Option<&Path>, set_flags: impl FnOnce(&mut Document)) -> Result<Self, ConfigError> {
        match PlanDocument::load(path, set_flags, None)? {
            PlanDocument::OneDragon(document) => Ok(*document),
            PlanDocument::Formation(formation) => {
                let names: Vec<&str> = formation.dragons().iter().map(|dragon| &*dragon.name).collect();
                let (count, names) = (names.len(), names.join(", "));
                Err(ConfigError(format!("[[dragons]] has {count} dragons, {names}: only one is allowed here")))
            }
        }
    }

    /// The checked document of tables without `[[dragons]]`.
    fn of_tables(mut tables: Document, folder: &Path) -> Result<Self, ConfigError> {
        let origin = std::mem::take(&mut tables.origin);
        origin.check(tables.route.is_drawing() || tables.ground.is_file())?;
        let drawing = drawn_route::read(&mut tables.route, &origin, folder)?;
        let document = match tables.ground.read(&origin, folder)? {
            None => Self::check(tables)?,
            Some(ground) => Self::with_heights_under_route(tables, ground)?,
        };
        let document = Self { drawing, ..document };
        document.require_short()?;
        Ok(document)
    }

    /// A document whose ground is a map, of which it keeps the heights under the route.
    fn with_heights_under_route(mut tables: Document, ground: Ground) -> Result<Self, ConfigError> {
        let table = std::mem::take(&mut tables.ground);
        let mut document = Self::check(tables)?;
        let ground = Arc::new(ground);
        document.route.ground = Some(Arc::clone(&ground));
        let mut tables = document.tables.clone();
        tables.ground = table.with_heights_under(&ground, &document.curve()?);
        Self::check(tables)
    }

    /// Parses the text of a description.
    ///
    /// # Errors
    /// The text or a value is not valid.
    pub fn from_toml(text: &str) -> Result<Self, ConfigError> {
        Self::check(parse(text)?)
    }

    /// The route as planned.
    pub fn route(&self) -> &RouteSpec {
        &self.route
    }

    /// The outline of the stage, if there is one.
    pub fn outline(&self) -> Option<&Outline> {
        self.outline.as_ref()
    }

    /// The kind of route, as the file has it.
    pub fn route_kind(&self) -> &'static str {
        if self.drawing.is_some() { "drawing" } else { self.route.shape.kind() }
    }

    /// How the route follows its drawing; `None` for a route that is not drawn.
    pub fn drawing(&self) -> Option<&DrawingFit> {
        self.drawing.as_ref()
    }

    /// The tables of the document. Their values, except those of the route, are in range.
    pub fn tables(&self) -> &Document {
        &self.tables
    }

    /// The benches.
    pub fn dimensions(&self) -> &Dimensions {
        &self.dimensions
    }

    /// The numbers of all benches and handles.
    pub fn layout(&self) -> Layout {
        Layout::of([self.dimensions.benches()])
    }

    /// The curve of the route, with room for the dragon behind its beginning.
    ///
    /// # Errors
    /// The route is not valid.
    pub fn curve(&self) -> Result<Route, ConfigError> {
        let route = self.route.build(self.tables.head.speed_mps, self.dimensions.longest_m());
        route.map_err(|error| {
            let (table, hint) = match error {
                RouteError::Ground(_) => ("ground", self.origin_hint()),
                RouteError::LongOnGround => ("ground", String::new()),
                _ => ("route", String::new()),
            };
            ConfigError(format!("[{table}] {error}{hint}"))
        })
    }

    /// The remedy for a map in the coordinates of a survey, under a route that is about (0, 0).
    fn origin_hint(&self) -> String {
        let first = self.route.ground.as_ref().and_then(|ground| ground.height_map()).map(HeightMap::first);
        let is_far = |first: &DVec2| first.length() > SURVEY_M;
        first.filter(is_far).map_or_else(String::new, |DVec2 { x, y }| {
            let at = format!("({}, {})", Fixed::<0>(x), Fixed::<0>(y));
            format!("; the map begins at {at} m: set [origin] to the point of it that is (0, 0) of the route")
        })
    }

    /// The same document with a limit of steps for finding the end of the dragon's run.
    #[must_use]
    pub fn with_placing_steps(self, steps: u64) -> Self {
        Self { placing_steps: Some(steps), ..self }
    }

    /// Places the dragon on its route, and computes how far it can walk.
    ///
    /// # Errors
    /// The route is not valid, or this dragon does not fit on it.
    pub fn build(self) -> Result<Config, ConfigError> {
        let route = Arc::new(self.curve()?);
        let dragon = self.place(route).map_err(|error| match error {
            DragonError::Ground(gap) => ConfigError(format!("[ground] {gap}{}", self.origin_hint())),
            error => ConfigError(unplaced(&error)),
        })?;
        let timetable = self.tables.head.timetable(self.route.start_s, dragon.end_travel_m());
        let formation = Formation::new(vec![Planned { dragon: Arc::new(dragon), timetable }]);
        Ok(Config { document: self, formation: Arc::new(formation) })
    }

    /// Places the dragon on the curve of its route.
    ///
    /// # Errors
    /// The dragon does not fit on it.
    pub fn place(&self, route: Arc<Route>) -> Result<Dragon, DragonError> {
        let Some(steps) = self.placing_steps else { return Dragon::new(self.dimensions, route) };
        let dragon = Dragon::with_meter(self.dimensions, route, Meter::of(steps))?;
        Ok(dragon.metered(&Meter::unlimited()))
    }

    fn check(mut tables: Document) -> Result<Self, ConfigError> {
        if !tables.dragons.is_empty() {
            return Err(ConfigError("[[dragons]] is present, only one dragon is allowed here".to_owned()));
        }
        let serve = &tables.serve;
        require_whole("serve", "rate_hz", serve.rate_hz, &RATE_HZ)?;
        require("serve", "time_scale", serve.time_scale, &TIME_SCALE)?;
        serve.cpu.map_or(Ok(()), |cpu| require_whole("serve", "cpu", cpu, &CPU))?;
        require_whole("serve", "spin_us", serve.spin_us, &SPIN_US)?;
        require("serve", "catch_up_s", serve.catch_up_s, &CATCH_UP_S)?;
        require("head", "speed_mps", tables.head.speed_mps, &HEAD_SPEED_MPS)?;
        if let Some(accel_mps2) = tables.head.accel_mps2 {
            require("head", "accel_mps2", accel_mps2, &HEAD_ACCEL_MPS2)?;
        }
        require("monitor", "near_m", tables.monitor.near_m, &NEAR_M)?;
        require("monitor", "margin_m", tables.monitor.margin_m, &MARGIN_M)?;
        let count = tables.show.also.len();
        if count > MAX_ALSO {
            return Err(ConfigError(format!("[[show.also]] occurs {count} times, at most {MAX_ALSO} are allowed")));
        }
        tables.origin.check(false)?;
        tables.route = tables.route.completed();
        let ground = tables.ground.ground()?.map(Arc::new);
        let route = RouteSpec { ground, ..tables.route.plan()? };
        let dimensions = dimensions(&tables.dragon)?;
        let outline = tables.stage.outline()?;
        Ok(Self { tables, dimensions, route, drawing: None, outline, placing_steps: None })
    }

    /// The whole document as TOML, with every key that applies.
    fn to_toml(&self) -> String {
        toml::to_string(&self.tables).expect("the document has only tables of numbers and strings")
    }

    /// Fails if the written document is longer than a description may be.
    fn require_short(&self) -> Result<(), ConfigError> {
        let written = self.to_toml().len();
        if written <= MAX_DESCRIPTION_LEN {
            return Ok(());
        }
        let heights = self.tables.ground.heights();
        if heights > 0 {
            return Err(ConfigError(format!(
                "[ground] the {heights} heights under the route and the rest of the configuration take {written} bytes, at most \
                 {MAX_DESCRIPTION_LEN} are allowed: use heights with a larger spacing"
            )));
        }
        let segments = self.route.shape.segments();
        let (what, remedy) = match &self.drawing {
            Some(drawing) => ("drawing needs", format!("set tolerance_m, {}, to more", drawing.tolerance_m)),
            None => ("route has", "use fewer".to_owned()),
        };
        Err(ConfigError(format!(
            "[route] the {what} {segments} segments, which take {written} bytes, at most {MAX_DESCRIPTION_LEN} are allowed: \
             {remedy}"
        )))
    }
}

/// Why a dragon cannot be placed on its route, and the remedy if there is one.
pub fn unplaced(error: &DragonError) -> String {
    match error {
        DragonError::TooMuchWork(_) => format!("{error}; --work of `bench-dragon solve` allows more"),
        _ => error.to_string(),
    }
}

impl Config {
    /// Combines [`ConfigDocument::load`] and [`ConfigDocument::build`].
    ///
    /// # Errors
    /// The errors of both.
    pub fn load(path: Option<&Path>, set_flags: impl FnOnce(&mut Document)) -> Result<Self, ConfigError> {
        ConfigDocument::load(path, set_flags)?.build()
    }

    /// Combines [`ConfigDocument::from_toml`] and [`ConfigDocument::build`].
    ///
    /// # Errors
    /// The errors of both.
    pub fn from_toml(text: &str) -> Result<Self, ConfigError> {
        ConfigDocument::from_toml(text)?.build()
    }

    /// The whole configuration as TOML, with every key that applies.
    pub fn to_toml(&self) -> String {
        self.document.to_toml()
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

    /// The outline of the stage, if there is one.
    pub fn outline(&self) -> Option<&Outline> {
        self.document.outline()
    }

    /// That a clearance is less than the play of the hinges, in words; `None` if it is not.
    pub fn under_play(&self, name: &str, clearance_m: f64) -> Option<String> {
        let play_m = self.lead().dimensions().play_m();
        let [clearance, play] = [clearance_m, (play_m * 1e9).round() / 1e9].map(Number);
        (clearance_m < play_m).then(|| format!("{name} is {clearance}, less than the play of the hinges, {play} m"))
    }

    /// Show time in seconds at which the planned run starts.
    pub fn start_s(&self) -> f64 {
        self.document.route.start_s
    }

    /// Timetable of the leading head on a run from the start.
    pub fn timetable(&self) -> &Timetable {
        self.formation.timetable()
    }

    /// The same for a run that begins at a later show time, at the travel of the planned speed.
    pub fn timetable_from(&self, start_s: f64) -> Timetable {
        self.tables().head.timetable(start_s, self.lead().end_travel_m())
    }

    /// Show time in seconds at which a run from the start ends: at the planned end, or where the dragon can walk no
    /// further. With ramps the head reaches that point later.
    pub fn end_s(&self) -> f64 {
        if self.tables().head.accel_mps2.is_some() { self.timetable().end_s() } else { self.last_seek_s() }
    }

    /// Latest show time that a seek may request, in seconds: the end of the run. A seek moves the head to the travel of
    /// the planned speed without ramps.
    pub fn last_seek_s(&self) -> f64 {
        match (self.document.route.end_s, self.lead().feasible_end()) {
            (Some(end_s), FeasibleEnd::RouteEnd) => end_s,
            _ => self.lead().end_travel_m() / self.tables().head.speed_mps,
        }
    }

    /// Returns the same configuration with another spiral or turnaround.
    ///
    /// # Errors
    /// The route is not valid, or this dragon does not fit on it.
    pub fn with_shape(&self, shape: &RouteShape) -> Result<Self, ConfigError> {
        let mut tables = self.tables().clone();
        tables.route = tables.route.with_shape(shape);
        self.rebuilt(ConfigDocument::check(tables)?)
    }

    /// Places the dragon of another document with the same limit of steps.
    fn rebuilt(&self, document: ConfigDocument) -> Result<Self, ConfigError> {
        ConfigDocument { placing_steps: self.document.placing_steps, ..document }.build()
    }

    /// Returns the same configuration with another planned speed of the head, in metres per show second. The head walks the same
    /// part of the route, so the times at which the plan begins and ends change; those of a turnaround, which has no end, do not.
    ///
    /// # Errors
    /// The speed is out of range, or the route is not valid with it.
    pub fn with_head_speed(&self, speed_mps: f64) -> Result<Self, ConfigError> {
        let mut tables = self.tables().clone();
        tables.route = tables.route.clone().with_times_scaled(tables.head.speed_mps / speed_mps);
        tables.head.speed_mps = speed_mps;
        let drawing = self.document.drawing.clone();
        self.rebuilt(ConfigDocument { drawing, ..ConfigDocument::check(tables)? })
    }
}

fn dimensions(table: &DragonTable) -> Result<Dimensions, ConfigError> {
    let DragonTable { benches, head_length_m, body_length_m, width_m, hole_offset_m, .. } = *table;
    let benches = usize::try_from(benches).unwrap_or(usize::MAX);
    let rigid = Dimensions::new(benches, head_length_m, body_length_m, width_m, hole_offset_m);
    let dimensions = rigid.and_then(|rigid| match (table.hole_diameter_m, table.pole_diameter_m) {
        (None, None) => Ok(rigid),
        (hole_m, None) => rigid.with_poles(hole_m.unwrap_or(HOLE_DIAMETER_M), hole_m.unwrap_or(HOLE_DIAMETER_M)),
        (hole_m, Some(pole_m)) => rigid.with_poles(hole_m.unwrap_or(HOLE_DIAMETER_M), pole_m),
    });
    dimensions.map_err(|error| ConfigError(format!("[dragon] {error}")))
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
    fn every_error_is_one_line_that_names_key_value_and_range() {
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
            let error = error_of(text);
            assert!(error.starts_with(start) && !error.contains('\n'), "{text:?} gives {error:?}");
        }
    }
}

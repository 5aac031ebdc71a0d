//! The checked document of one dragon.

use std::path::Path;
use std::sync::Arc;

use bench_dragon_geometry::clearance::play_reach_m;
use bench_dragon_geometry::dragon::{Dimensions, Dragon, DragonError, Meter};
use bench_dragon_geometry::formation::{Formation, Layout, Planned};
use bench_dragon_geometry::ground::{Ground, HeightMap};
use bench_dragon_geometry::number::Fixed;
use bench_dragon_geometry::route::{Route, RouteError, RouteSpec};
use bench_dragon_geometry::stage::Stage;
use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;
use glam::DVec2;

use super::cue;
use super::document::{Document, DragonTable, parse};
use super::drawn_route::{self, DrawingFit};
use super::ground_table::GroundTable;
use super::plan_document::PlanDocument;
use super::{
    CATCH_UP_S, CPU, Config, ConfigError, HEAD_ACCEL_MPS2, HEAD_SPEED_MPS, HOLE_DIAMETER_M, MARGIN_M, MAX_ALSO, NEAR_M,
    RATE_HZ, SPIN_US, TIME_SCALE, require, require_whole,
};

/// Distance of a map from (0, 0), in metres, from which on its coordinates are those of a survey.
const SURVEY_M: f64 = 10_000.0;

/// A parsed document. All values except those of `[route]` are in range. [`build`](Self::build) checks the route and
/// places the dragon.
#[derive(Clone, Debug)]
pub struct ConfigDocument {
    pub(super) tables: Document,
    pub(super) dimensions: Dimensions,
    pub(super) route: RouteSpec,
    pub(super) drawing: Option<DrawingFit>,
    /// The whole map of heights of a file. The tables have only the heights under the route.
    pub(super) map: Option<Arc<Ground>>,
    pub(super) stage: Arc<Stage>,
    /// Limit of steps for finding the end of the dragon's run, if not that of [`Dragon::new`].
    pub(super) placing_steps: Option<u64>,
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
                let text = format!("[[dragons]] is present ({}), only one dragon is allowed here", names.join(", "));
                Err(ConfigError(format!("{text}: use [dragon], [route] and [head]")))
            }
        }
    }

    /// The checked document of tables without `[[dragons]]`.
    pub(super) fn of_tables(mut tables: Document, folder: &Path) -> Result<Self, ConfigError> {
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

    /// A document whose ground is a map, of which its tables keep the heights under the route.
    fn with_heights_under_route(mut tables: Document, ground: Ground) -> Result<Self, ConfigError> {
        let table = std::mem::take(&mut tables.ground);
        Self::on_map(tables, &table, Arc::new(ground))
    }

    /// The document of other tables on the same map, if the document has one.
    ///
    /// # Errors
    /// A value is not valid.
    pub(super) fn with_route_of(&self, mut tables: Document) -> Result<Self, ConfigError> {
        let Some(map) = &self.map else { return Self::check(tables) };
        let table = std::mem::take(&mut tables.ground);
        let document = Self::on_map(tables, &table, Arc::clone(map))?;
        document.require_short()?;
        Ok(document)
    }

    fn on_map(tables: Document, table: &GroundTable, map: Arc<Ground>) -> Result<Self, ConfigError> {
        let mut document = Self::check(tables)?;
        document.route.ground = Some(Arc::clone(&map));
        let mut tables = document.tables.clone();
        tables.ground = table.with_heights_under(&map, &document.curve()?);
        Ok(Self { map: Some(map), ..Self::check(tables)? })
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

    /// The same route with all heights that are known, also those beyond the route: for questions about other routes.
    pub fn route_on_map(&self) -> RouteSpec {
        RouteSpec { ground: self.map.clone().or(self.route.ground.clone()), ..self.route.clone() }
    }

    /// The borders of the stage.
    pub fn stage(&self) -> &Stage {
        &self.stage
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
    pub fn build(mut self) -> Result<Config, ConfigError> {
        let route = Arc::new(self.curve()?);
        let dragon = self.place(route).map_err(|error| match error {
            DragonError::Ground(gap) => ConfigError(format!("[ground] {gap}{}", self.origin_hint())),
            error => ConfigError(unplaced(&error)),
        })?;
        self.require_bounded_play(&dragon)?;
        let timetable = self.tables.head.timetable(self.route.start_s, dragon.end_travel_m());
        let planned = Planned { dragon: Arc::new(dragon), timetable };
        let (cues, mut timetables) = cue::apply(&self.tables.cues, &[(None, &planned)])?;
        self.tables.cues = cues.iter().map(|cue| cue.table(&[])).collect();
        let formation = match timetables.pop() {
            Some(timetable) if !cues.is_empty() => {
                Formation::beginning_at(self.route.start_s, vec![Planned { timetable, ..planned }])
            }
            _ => Formation::of_one(planned),
        };
        Ok(Config { document: self, formation: Arc::new(formation), cues: cues.into(), named: None })
    }

    /// Fails for a guard of borders that could prove nothing about the poses that the play of the hinges allows.
    fn require_bounded_play(&self, dragon: &Dragon) -> Result<(), ConfigError> {
        let benches = 0..dragon.dimensions().benches().min(2);
        if !self.tables.stage.guard || benches.clone().all(|bench| play_reach_m(dragon, bench).is_some()) {
            return Ok(());
        }
        let needed = if dragon.route().is_on_ground() {
            "hinges without play on ground: remove [dragon] pole_diameter_m"
        } else {
            "wider bends than this run has, with play in the hinges: end it earlier ([route] end_s), remove [dragon] pole_diameter_m"
        };
        Err(ConfigError(format!("[stage] guard is true, needs {needed}, or guard")))
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

    pub(super) fn check(mut tables: Document) -> Result<Self, ConfigError> {
        if tables.dragons.is_some() {
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
        let stage = Arc::new(tables.stage.stage()?);
        Ok(Self { tables, dimensions, route, drawing: None, map: None, stage, placing_steps: None })
    }

    /// The whole document as TOML, with every key that applies.
    pub(super) fn to_toml(&self) -> String {
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
            // A corner is an arc and a line of its own, whatever the tolerance.
            Some(drawing) if 4 * drawing.corners > segments => {
                let corners = drawing.corners;
                (
                    "drawing needs",
                    format!("{corners} rounded corners need most of them: draw a path with fewer corners"),
                )
            }
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

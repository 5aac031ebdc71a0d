//! The table `[ground]`, not yet checked: a plane, a file of heights, or heights in the document itself.
//!
//! The heights of a file that lie under the route take the place of the file. So the written document needs no file, and all
//! readers of a bus or a recording have the same ground.

use std::path::{Path, PathBuf};

use bench_dragon_geometry::ground::{Ground, HeightMap, HeightRun};
use bench_dragon_geometry::number::Number;
use bench_dragon_geometry::route::Route;
use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::drawn_route::METRES_PER_UNIT;
use super::origin_table::OriginTable;
use super::{ConfigError, require};
use crate::height_map::{self, Placing};

/// Steps to which the heights of a file are rounded, per metre. Micrometres are finer than any survey, and short as text.
const STEPS_PER_M: f64 = 1e6;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct GroundTable {
    #[serde(skip_serializing_if = "Option::is_none")]
    rise_x: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rise_y: Option<f64>,
    /// File of heights, relative to the configuration.
    #[serde(skip_serializing_if = "Option::is_none")]
    heights: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    metres_per_unit: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    x_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    metres_per_pixel: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    carry_height_m: Option<f64>,
    /// Position of column 0 of row 0.
    #[serde(skip_serializing_if = "Option::is_none")]
    first_m: Option<[f64; 2]>,
    /// Distance of neighbouring heights in x and y.
    #[serde(skip_serializing_if = "Option::is_none")]
    spacing_m: Option<[f64; 2]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    runs: Option<Vec<RunTable>>,
}

/// A part of a row of heights.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a table")]
struct RunTable {
    column: u32,
    row: u32,
    heights_m: Vec<f64>,
}

impl GroundTable {
    pub(super) fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// Whether the heights are in a file, which is not read yet.
    pub(super) fn is_file(&self) -> bool {
        self.heights.is_some()
    }

    /// Number of heights in the document.
    pub(super) fn heights(&self) -> usize {
        self.runs.iter().flatten().map(|run| run.heights_m.len()).sum()
    }

    /// Reads the file of heights, if the table names one. `folder` is that of the configuration.
    ///
    /// # Errors
    /// A key does not apply, or the file has no heights.
    pub(super) fn read(&self, origin: &OriginTable, folder: &Path) -> Result<Option<Ground>, ConfigError> {
        self.refuse_other_keys()?;
        let Some(file) = &self.heights else { return Ok(None) };
        let Self { metres_per_unit, x_m, y_m, metres_per_pixel, .. } = *self;
        metres_per_unit.map_or(Ok(()), |metres| require("ground", "metres_per_unit", metres, &METRES_PER_UNIT))?;
        let placing = Placing { metres_per_unit, x_m, y_m, metres_per_pixel };
        // A map that the table places is about the origin already.
        let own = origin.position();
        let moved = DVec2::new(if x_m.is_none() { own.x } else { 0.0 }, if y_m.is_none() { own.y } else { 0.0 });
        let in_file = |reason: String| ConfigError(format!("[ground] heights {:?}: {reason}", file.display()));
        let grid = height_map::read(&folder.join(file), &placing).map_err(|error| in_file(error.to_string()))?;
        let heights_m = grid.heights_m.iter().map(|height_m| (height_m * STEPS_PER_M).round() / STEPS_PER_M).collect();
        let (first, spacing) = (DVec2::new(grid.x_m, grid.y_m) - moved, DVec2::new(grid.spacing_x_m, grid.spacing_y_m));
        let map = HeightMap::new([grid.columns, grid.rows], first, spacing, heights_m);
        let map = map.map_err(|error| in_file(error.to_string()))?;
        self.carried(Ground::map(map)).map(Some)
    }

    /// The ground of a table without a file; `None` for level ground at height 0.
    ///
    /// # Errors
    /// A key does not apply, or a number is out of range.
    pub(super) fn ground(&self) -> Result<Option<Ground>, ConfigError> {
        self.refuse_other_keys()?;
        if self.is_empty() {
            return Ok(None);
        }
        if self.heights.is_some() {
            let reason = "heights is only allowed in a file: its heights are another file";
            return Err(ConfigError(format!("[ground] {reason}")));
        }
        let ground = if let Some(runs) = &self.runs {
            Ground::map(self.map_of(runs)?)
        } else {
            let rise = DVec2::new(self.rise_x.unwrap_or(0.0), self.rise_y.unwrap_or(0.0));
            Ground::plane(rise).map_err(|error| ConfigError(format!("[ground] {error}")))?
        };
        self.carried(ground).map(Some)
    }

    /// The same ground, with the heights under a route in the place of a file.
    pub(super) fn with_heights_under(&self, ground: &Ground, route: &Route) -> Self {
        let Some(map) = ground.height_map() else { return self.clone() };
        let run = |run: HeightRun| RunTable {
            column: u32::try_from(run.column).unwrap_or(u32::MAX),
            row: u32::try_from(run.row).unwrap_or(u32::MAX),
            heights_m: run.heights_m,
        };
        Self {
            carry_height_m: self.carry_height_m,
            first_m: Some(map.first().into()),
            spacing_m: Some(map.spacing().into()),
            runs: Some(route.ground_runs(ground).into_iter().map(run).collect()),
            ..Self::default()
        }
    }

    fn carried(&self, ground: Ground) -> Result<Ground, ConfigError> {
        ground.carried_at(self.carry_height_m.unwrap_or(0.0)).map_err(|error| ConfigError(format!("[ground] {error}")))
    }

    fn map_of(&self, runs: &[RunTable]) -> Result<HeightMap, ConfigError> {
        let (Some(first), Some(spacing)) = (self.first_m, self.spacing_m) else {
            return Err(ConfigError("[ground] runs need first_m and spacing_m".to_owned()));
        };
        let run = |run: &RunTable| HeightRun {
            column: run.column as usize,
            row: run.row as usize,
            heights_m: run.heights_m.clone(),
        };
        let runs: Vec<HeightRun> = runs.iter().map(run).collect();
        HeightMap::from_runs(first.into(), spacing.into(), &runs)
            .map_err(|error| ConfigError(format!("[ground] {error}")))
    }

    /// Fails for a key that does not apply to the kind of ground.
    fn refuse_other_keys(&self) -> Result<(), ConfigError> {
        let number = |value: Option<f64>| value.map(|value| Number(value).to_string());
        let pair = |value: Option<[f64; 2]>| value.map(|[x, y]| format!("[{}, {}]", Number(x), Number(y)));
        let (is_file, is_listed) = (self.heights.is_some(), self.runs.is_some());
        let is_plane = !is_file && !is_listed;
        let listed = self.runs.as_ref().map(|runs| format!("a list of {}", runs.len()));
        let keys = [
            ("rise_x", number(self.rise_x), is_plane, "without heights"),
            ("rise_y", number(self.rise_y), is_plane, "without heights"),
            ("metres_per_unit", number(self.metres_per_unit), is_file, "with heights"),
            ("x_m", number(self.x_m), is_file, "with heights"),
            ("y_m", number(self.y_m), is_file, "with heights"),
            ("metres_per_pixel", number(self.metres_per_pixel), is_file, "with heights"),
            ("runs", listed, !is_file, "without heights"),
            ("first_m", pair(self.first_m), is_listed, "with runs"),
            ("spacing_m", pair(self.spacing_m), is_listed, "with runs"),
        ];
        for (key, value, is_allowed, allowed) in keys {
            if let Some(value) = value.filter(|_| !is_allowed) {
                return Err(ConfigError(format!("[ground] {key} is {value}, only allowed {allowed}")));
            }
        }
        Ok(())
    }
}

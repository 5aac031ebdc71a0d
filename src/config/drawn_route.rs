//! `[route] kind = "drawing"`: a file with a drawing in place of the segments of a path.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use bench_dragon_geometry::drawing::FitSettings;

use super::route_table::RouteTable;
use super::{ConfigError, require};
use crate::drawing::{self, PathChoice};

/// Allowed distances between a route and its drawing, in metres.
pub(super) const TOLERANCE_M: RangeInclusive<f64> = 0.0001..=1.0;
/// Allowed radii of rounded corners, in metres.
pub(super) const CORNER_RADIUS_M: RangeInclusive<f64> = 0.01..=10_000.0;
/// Allowed lengths of a drawing's unit, in metres.
pub(super) const METRES_PER_UNIT: RangeInclusive<f64> = 1e-6..=1e6;
/// Distance between a route and its drawing without the key.
const DEFAULT_TOLERANCE_M: f64 = 0.005;
/// Largest gap between two entities of a path, as a share of the tolerance.
const GAP: f64 = 0.1;

/// How a route follows its drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct DrawingFit {
    /// The file, as the configuration names it.
    pub file: PathBuf,
    /// The file that was read.
    pub path: PathBuf,
    /// Number of segments of the path.
    pub segments: usize,
    /// Largest distance between the route and the drawing outside rounded corners, in metres, as measured.
    pub fit_error_m: f64,
    /// Largest allowed distance, in metres.
    pub tolerance_m: f64,
    /// Number of rounded corners.
    pub corners: usize,
    /// Width and height of the path where it is drawn, in metres.
    pub size_m: [f64; 2],
    /// Radius of rounded corners, in metres, if the configuration has one.
    pub corner_radius_m: Option<f64>,
}

/// Replaces a drawing by the path that follows it. `folder` is that of the configuration. Does nothing for another route.
///
/// # Errors
/// A key is missing or out of range, the file cannot be read, or no route follows its path.
pub(super) fn read(table: &mut RouteTable, folder: &Path) -> Result<Option<DrawingFit>, ConfigError> {
    if !table.is_drawing() {
        return Ok(None);
    }
    table.refuse_other_keys()?;
    let Some(file) = table.file.clone() else {
        return Err(ConfigError("[route] file is missing, must be a drawing: .svg, .dxf or .csv".to_owned()));
    };
    let settings = FitSettings {
        tolerance_m: table.tolerance_m.unwrap_or(DEFAULT_TOLERANCE_M),
        corner_radius_m: table.corner_radius_m,
        joins_samples: table.corner_radius_m.is_none() && drawing::has_points(&file),
    };
    require("route", "tolerance_m", settings.tolerance_m, &TOLERANCE_M)?;
    let require_some =
        |key, value: Option<f64>, allowed| value.map_or(Ok(()), |value| require("route", key, value, allowed));
    require_some("corner_radius_m", settings.corner_radius_m, &CORNER_RADIUS_M)?;
    require_some("metres_per_unit", table.metres_per_unit, &METRES_PER_UNIT)?;
    let choice = PathChoice {
        id: table.id.as_deref(),
        metres_per_unit: table.metres_per_unit,
        is_closed: table.closed,
        gap_m: GAP * settings.tolerance_m,
    };
    let in_file = |reason: String| ConfigError(format!("[route] file {:?}: {reason}", file.display()));
    let path = folder.join(&file);
    let drawing = drawing::read(&path, &choice).map_err(|error| in_file(error.to_string()))?;
    let fit = drawing.fit(&settings).map_err(|error| in_file(error.to_string()))?;
    *table = table.clone().with_path(&fit, drawing.is_closed)?;
    Ok(Some(DrawingFit {
        file,
        path,
        segments: fit.segments.len(),
        fit_error_m: fit.error_m,
        tolerance_m: settings.tolerance_m,
        corners: fit.corners,
        size_m: fit.size_m.to_array(),
        corner_radius_m: settings.corner_radius_m,
    }))
}

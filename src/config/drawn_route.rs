//! `[route] kind = "drawing"`: a file with a drawing in place of the segments of a path.

use std::ops::RangeInclusive;
use std::path::{Path, PathBuf};

use bench_dragon_geometry::drawing::{Drawing, FitSettings, MAX_COORDINATE_M};
use bench_dragon_geometry::number::Number;
use glam::{DAffine2, DVec2};

use super::origin_table::OriginTable;
use super::route_table::{DrawingTable, KindTable, RouteTable};
use super::{ConfigError, require};
use crate::drawing::{self, FORMATS, PathChoice};

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

/// Allowed numbers of a scale, metres of the plan for a metre of the page.
const SCALE: RangeInclusive<f64> = 0.001..=1e6;

/// Replaces a drawing by the path that follows it. `folder` is that of the configuration. Does nothing for another route.
///
/// # Errors
/// A key is missing or out of range, the file cannot be read, or no route follows its path.
pub(super) fn read(
    table: &mut RouteTable,
    origin: &OriginTable,
    folder: &Path,
) -> Result<Option<DrawingFit>, ConfigError> {
    let KindTable::Drawing(keys) = &table.kind else { return Ok(None) };
    table.refuse_stray_key()?;
    let Some(file) = keys.file.clone() else {
        return Err(ConfigError(format!("[route] file is missing, must be a drawing: {FORMATS}")));
    };
    let settings = FitSettings {
        tolerance_m: keys.tolerance_m.unwrap_or(DEFAULT_TOLERANCE_M),
        corner_radius_m: keys.corner_radius_m,
        joins_samples: keys.corner_radius_m.is_none() && drawing::has_points(&file),
    };
    require("route", "tolerance_m", settings.tolerance_m, &TOLERANCE_M)?;
    let require_some =
        |key, value: Option<f64>, allowed| value.map_or(Ok(()), |value| require("route", key, value, allowed));
    require_some("corner_radius_m", settings.corner_radius_m, &CORNER_RADIUS_M)?;
    require_some("metres_per_unit", keys.metres_per_unit, &METRES_PER_UNIT)?;
    let choice = PathChoice {
        id: keys.id.as_deref(),
        label: keys.label.as_deref(),
        layer: keys.layer.as_deref(),
        number: keys.number,
        scale: scale(keys)?,
        has_origin: !origin.is_empty(),
        metres_per_unit: keys.metres_per_unit,
        is_closed: keys.is_closed,
        gap_m: GAP * settings.tolerance_m,
    };
    let in_file = |reason: String| ConfigError(format!("[route] file {:?}: {reason}", file.display()));
    let path = folder.join(&file);
    let drawing = drawing::read(&path, &choice).map_err(|error| in_file(error.to_string()))?;
    let drawing = placed(drawing, table.is_placed(), origin).map_err(in_file)?;
    let fit = drawing.fit(&settings).map_err(|error| in_file(error.to_string()))?;
    table.set_path(&fit, drawing.is_closed)?;
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

/// Metres of the plan for a metre of the page, by `scale`.
fn scale(keys: &DrawingTable) -> Result<Option<f64>, ConfigError> {
    let Some(text) = &keys.scale else { return Ok(None) };
    let ratio = || {
        let (page, plan) = text.split_once(':')?;
        let [page, plan] = [page, plan].map(|part| part.trim().parse::<f64>().ok());
        Some(plan? / page?).filter(|ratio| SCALE.contains(ratio))
    };
    let ratio = ratio().ok_or_else(|| {
        ConfigError(format!("[route] scale is {text:?}, must be such as \"1:100\", from 1:0.001 to 1:1000000"))
    })?;
    match keys.metres_per_unit.map(Number) {
        Some(metres) => {
            Err(ConfigError(format!("[route] metres_per_unit is {metres}, but there is a scale too: omit one of them")))
        }
        None => Ok(Some(ratio)),
    }
}

/// The drawing about the origin. A drawing in survey coordinates, far from any origin, is moved to its own beginning if the route is
/// then placed elsewhere.
///
/// # Errors
/// It is far from the origin, in words.
fn placed(drawing: Drawing, is_placed: bool, origin: &OriginTable) -> Result<Drawing, String> {
    let moved = |drawing: &Drawing, by: DVec2| {
        let map = DAffine2::from_translation(-by);
        let pieces = drawing.pieces.iter().flat_map(|piece| piece.mapped(&map)).collect();
        Drawing { pieces, is_closed: drawing.is_closed }
    };
    let drawing = if origin.is_empty() { drawing } else { moved(&drawing, origin.position()) };
    let Some(begin) = drawing.pieces.first().map(|piece| piece.begin().round()) else { return Ok(drawing) };
    let furthest_m = |from: DVec2| {
        let ends = drawing.pieces.iter().flat_map(|piece| [piece.begin(), piece.end()]);
        ends.map(|end| (end - from).abs().max_element()).fold(0.0, f64::max)
    };
    let is_far = furthest_m(DVec2::ZERO) > MAX_COORDINATE_M;
    if !(is_far && furthest_m(begin) <= MAX_COORDINATE_M && begin.abs().max_element() <= drawing::MAX_POSITION_M) {
        return Ok(drawing);
    }
    if is_placed {
        return Ok(moved(&drawing, begin));
    }
    let [x, y] = (begin + origin.position()).to_array().map(Number);
    Err(format!(
        "the path begins at ({x}, {y}) m, further than {MAX_COORDINATE_M} m from the origin: set start_x_m = 0 and start_y_m = 0, \
         or [origin] x_m = {x} and y_m = {y}"
    ))
}

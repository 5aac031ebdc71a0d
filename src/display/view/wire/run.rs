//! A run, as a page draws around it.

use glam::DVec2;
use serde::Serialize;

use crate::display::observe::Run;

/// What stays the same through a run. Metres, seconds.
#[derive(Clone, Debug, Serialize)]
#[serde(tag = "type", rename = "run")]
#[expect(missing_docs, reason = "each field is the configuration's, with its unit in its name")]
pub struct RunMessage {
    pub run_id: u64,
    pub benches: usize,
    pub head_length_m: f64,
    pub body_length_m: f64,
    pub width_m: f64,
    pub hole_offset_m: f64,
    pub start_s: f64,
    /// The latest show time that may be sought: with ramps the run ends later.
    pub end_s: f64,
    pub near_m: f64,
    pub margin_m: f64,
    pub guarded: bool,
    pub planned_speed_mps: f64,
    pub rate_hz: u32,
    /// The route from point to point: x, y, x, y, …, to a millimetre.
    pub route: Vec<f64>,
}

impl From<&Run> for RunMessage {
    fn from(run: &Run) -> Self {
        let config = &run.config;
        let dimensions = config.dragon().dimensions();
        Self {
            run_id: run.run_id,
            benches: dimensions.benches(),
            head_length_m: dimensions.head_length_m(),
            body_length_m: dimensions.body_length_m(),
            width_m: dimensions.width_m(),
            hole_offset_m: dimensions.hole_offset_m(),
            start_s: config.start_s(),
            end_s: config.last_seek_s(),
            near_m: config.near_m(),
            margin_m: config.margin_m(),
            guarded: config.is_guarded(),
            planned_speed_mps: config.head_speed_mps(),
            rate_hz: config.rate_hz(),
            route: run.route.iter().flat_map(DVec2::to_array).map(to_millimetres).collect(),
        }
    }
}

fn to_millimetres(value_m: f64) -> f64 {
    (value_m * 1e3).round() / 1e3
}

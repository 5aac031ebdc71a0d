//! An alert, as a page lists it.

use serde::Serialize;

use crate::display::observe::NumberedAlert;

/// An alert and its number. Metres, seconds of show time.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[serde(tag = "type", rename = "alert")]
#[expect(missing_docs, reason = "each field is the alert's on the bus, with its unit in its name")]
pub struct AlertMessage {
    pub number: u64,
    pub run_id: u64,
    pub kind: &'static str,
    pub time_s: f64,
    pub benches: Option<[u32; 2]>,
    pub clearance_m: Option<f64>,
    pub point_m: Option<[f64; 2]>,
    pub forecast_s: Option<f64>,
}

impl From<&NumberedAlert> for AlertMessage {
    fn from(NumberedAlert { number, alert }: &NumberedAlert) -> Self {
        let benches = alert.pair();
        Self {
            number: *number,
            run_id: alert.run_id,
            kind: alert.alert_kind().map_or("unknown", |kind| kind.name()),
            time_s: alert.sim_time_ns as f64 * 1e-9,
            benches,
            clearance_m: benches.map(|_| alert.clearance_m),
            point_m: benches.map(|_| alert.point_m),
            forecast_s: alert.forecast(),
        }
    }
}

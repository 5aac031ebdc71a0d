//! What lies ahead of the head, in show time.

use bench_dragon_ipc::FrameHeader;
use serde::Serialize;

use crate::monitor::forecast::Forecast;

/// Whether benches will touch.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[serde(tag = "kind", rename_all = "snake_case")]
pub enum Outlook {
    /// Nothing is known of the ground ahead.
    #[default]
    Unknown,
    /// They will not, up to this show time; the search may go on.
    Free {
        /// Seconds.
        until_s: f64,
        /// Whether that is the end of the run.
        is_end: bool,
    },
    /// They will.
    Contact {
        /// Show time in seconds.
        time_s: f64,
        /// Which ones, the lower index first.
        benches: [usize; 2],
    },
}

impl Outlook {
    /// What a forecast says to a head that goes on at its present speed, or where it stands, at this one.
    pub fn of(forecast: &Forecast, header: &FrameHeader, resumed_speed_mps: f64, end_travel_m: f64) -> Self {
        if !forecast.covers(header.head_travel_m) {
            return Self::Unknown;
        }
        let speed_mps = if header.head_speed_mps > 0.0 { header.head_speed_mps } else { resumed_speed_mps };
        let time_s = |travel_m: f64| header.sim_time_s() + (travel_m - header.head_travel_m) / speed_mps;
        match forecast.contact {
            Some(contact) => Self::Contact { time_s: time_s(contact.travel_m), benches: contact.benches },
            None => Self::Free {
                until_s: time_s(forecast.free_to_m.max(header.head_travel_m)),
                is_end: forecast.free_to_m >= end_travel_m,
            },
        }
    }

    /// Show time of the contact ahead, in seconds.
    pub fn contact_s(&self) -> Option<f64> {
        match self {
            Self::Contact { time_s, .. } => Some(*time_s),
            Self::Unknown | Self::Free { .. } => None,
        }
    }
}

//! The table `[origin]`, not yet checked: the point of a survey that is (0, 0) of the plan. Drawings and maps share it.

use std::ops::RangeInclusive;

use bench_dragon_geometry::number::Number;
use glam::DVec2;
use serde::{Deserialize, Serialize};

use super::{ConfigError, require};
use crate::drawing::MAX_POSITION_M;

/// Allowed coordinates of a survey, in metres.
const POSITION_M: RangeInclusive<f64> = -MAX_POSITION_M..=MAX_POSITION_M;

/// The written document has no origin: its route and its heights are about it already.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct OriginTable {
    #[serde(skip_serializing_if = "Option::is_none")]
    x_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    y_m: Option<f64>,
}

impl OriginTable {
    pub(super) fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The point of the survey.
    pub(super) fn position(&self) -> DVec2 {
        DVec2::new(self.x_m.unwrap_or(0.0), self.y_m.unwrap_or(0.0))
    }

    /// Fails for a coordinate out of range, or if there is neither a drawing nor a map.
    pub(super) fn check(&self, is_used: bool) -> Result<(), ConfigError> {
        for (key, value) in [("x_m", self.x_m), ("y_m", self.y_m)] {
            let Some(value) = value else { continue };
            require("origin", key, value, &POSITION_M)?;
            if !is_used {
                let value = Number(value);
                let reason = "only allowed with a drawing in [route], or heights in [ground]";
                return Err(ConfigError(format!("[origin] {key} is {value}, {reason}")));
            }
        }
        Ok(())
    }
}

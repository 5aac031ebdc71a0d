//! The table `[stage]`, not yet checked.

use bench_dragon_geometry::number::Number;
use bench_dragon_geometry::outline::Outline;
use serde::{Deserialize, Serialize};

use super::ConfigError;

/// Most numbers of a point that a message shows.
const MAX_SHOWN: usize = 4;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct StageTable {
    /// Corners of the stage, in metres: two numbers each.
    #[serde(skip_serializing_if = "Option::is_none")]
    outline: Option<Vec<Vec<f64>>>,
}

impl StageTable {
    pub(super) fn is_empty(&self) -> bool {
        self.outline.is_none()
    }

    /// The outline of the stage, if there is one.
    ///
    /// # Errors
    /// A point does not have two numbers, or the outline is not a simple polygon.
    pub(super) fn outline(&self) -> Result<Option<Outline>, ConfigError> {
        let Some(points) = &self.outline else { return Ok(None) };
        let points_m = (1..).zip(points).map(|(number, point)| corner_m(number, point));
        let outline = points_m
            .collect::<Result<Vec<_>, _>>()
            .and_then(|points_m| Outline::new(&points_m).map_err(|error| error.to_string()));
        outline.map(Some).map_err(|reason| ConfigError(format!("[stage] outline {reason}")))
    }
}

/// The x and y of a corner; otherwise a reason, in words.
fn corner_m(number: usize, point: &[f64]) -> Result<[f64; 2], String> {
    point.try_into().map_err(|_| {
        let numbers: Vec<String> = point.iter().take(MAX_SHOWN).map(|&value| Number(value).to_string()).collect();
        let more = if point.len() > MAX_SHOWN { ", …" } else { "" };
        format!("point {number} is [{}{more}], must be two numbers, [x, y]", numbers.join(", "))
    })
}

//! The table `[stage]`, not yet checked.

use std::ops::RangeInclusive;

use bench_dragon_geometry::number::Number;
use bench_dragon_geometry::stage::{Border, Outline, OutlineError, Stage};
use serde::{Deserialize, Serialize};

use super::{ConfigError, require};

/// Most numbers of a point that a message shows.
const MAX_SHOWN: usize = 4;
/// Greatest number of areas to keep out of.
const MAX_AREAS: usize = 32;
/// Allowed distances from borders, in metres.
const CLEAR_M: RangeInclusive<f64> = 0.0..=100.0;

/// Points in metres: two numbers each.
type Points = Vec<Vec<f64>>;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct StageTable {
    /// Corners of the stage.
    #[serde(skip_serializing_if = "Option::is_none")]
    outline: Option<Points>,
    /// Corners of each area that no board may enter.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    keep_out: Vec<Points>,
    /// The line that people stand behind.
    #[serde(skip_serializing_if = "Option::is_none")]
    crowd: Option<Points>,
    /// Distance that boards keep from all of these, in metres.
    #[serde(skip_serializing_if = "Option::is_none")]
    clear_m: Option<f64>,
    /// Whether the guard keeps that distance.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub(super) guard: bool,
}

impl StageTable {
    pub(super) fn is_empty(&self) -> bool {
        *self == Self::default()
    }

    /// The borders of the stage, and the distance from them.
    ///
    /// # Errors
    /// A point does not have two numbers, a polygon is not simple, there are too many areas, or a key needs another one.
    pub(super) fn stage(&self) -> Result<Stage, ConfigError> {
        let mut borders = Vec::new();
        if let Some(points) = &self.outline {
            borders.push(Border::outline(built("outline", points, Outline::new)?));
        }
        if self.keep_out.len() > MAX_AREAS {
            let count = self.keep_out.len();
            return Err(ConfigError(format!("[stage] keep_out has {count} areas, at most {MAX_AREAS} are allowed")));
        }
        for (number, points) in (1..).zip(&self.keep_out) {
            borders.push(Border::keep_out(built(&format!("keep_out area {number}"), points, Outline::new)?));
        }
        if let Some(points) = &self.crowd {
            borders.push(built("crowd", points, Border::crowd)?);
        }
        self.clear_m.map_or(Ok(()), |clear_m| require("stage", "clear_m", clear_m, &CLEAR_M))?;
        match self.clear_m {
            Some(clear_m) if borders.is_empty() => Err(ConfigError(format!(
                "[stage] clear_m is {}, only allowed with outline, keep_out or crowd",
                Number(clear_m)
            ))),
            None if self.guard => {
                Err(ConfigError("[stage] guard is true, needs clear_m: the distance that the guard keeps".to_owned()))
            }
            clear_m => Ok(Stage::new(borders, clear_m.unwrap_or(0.0))),
        }
    }
}

/// What `new` builds of the points of a key.
fn built<T>(
    key: &str,
    points: &Points,
    new: impl FnOnce(&[[f64; 2]]) -> Result<T, OutlineError>,
) -> Result<T, ConfigError> {
    let points_m: Result<Vec<_>, _> = (1..).zip(points).map(|(number, point)| point_m(number, point)).collect();
    let built = points_m.and_then(|points_m| new(&points_m).map_err(|error| error.to_string()));
    built.map_err(|reason| ConfigError(format!("[stage] {key} {reason}")))
}

/// The x and y of a point; otherwise a reason, in words.
fn point_m(number: usize, point: &[f64]) -> Result<[f64; 2], String> {
    point.try_into().map_err(|_| {
        let numbers: Vec<String> = point.iter().take(MAX_SHOWN).map(|&value| Number(value).to_string()).collect();
        let more = if point.len() > MAX_SHOWN { ", …" } else { "" };
        format!("point {number} is [{}{more}], must be two numbers, [x, y]", numbers.join(", "))
    })
}

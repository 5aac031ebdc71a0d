//! The table `[route]`, not yet checked. Its kind determines which keys apply, and their defaults.

use std::ops::RangeInclusive;

use bench_dragon_geometry::number::Number;
use bench_dragon_geometry::route::{RouteSpec, SpiralSpec, TurnaroundSpec};
use serde::{Deserialize, Serialize};

use super::{ConfigError, require};

/// Allowed show times of a turnaround's plan, in seconds.
const PLAN_S: RangeInclusive<f64> = -1e6..=1e6;

#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
pub(super) struct RouteTable {
    kind: RouteKind,
    #[serde(skip_serializing_if = "Option::is_none")]
    pitch_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    start_turns: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turn_diameter_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    radius_ratio: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    start_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    end_s: Option<f64>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RouteKind {
    #[default]
    Spiral,
    Turnaround,
}

impl RouteTable {
    /// Returns the table of a route, with every key that applies.
    pub(super) fn written_out(plan: RouteSpec) -> Self {
        match plan {
            RouteSpec::Spiral(SpiralSpec { pitch_m, start_turns }) => Self {
                kind: RouteKind::Spiral,
                pitch_m: Some(pitch_m),
                start_turns: Some(start_turns),
                ..Self::default()
            },
            RouteSpec::Turnaround(plan) => Self {
                kind: RouteKind::Turnaround,
                pitch_m: Some(plan.pitch_m),
                turn_diameter_m: Some(plan.turn_diameter_m),
                radius_ratio: Some(plan.radius_ratio),
                start_s: Some(plan.start_s),
                end_s: Some(plan.end_s),
                ..Self::default()
            },
        }
    }

    /// Returns the route of the table. Missing keys have the paper's values.
    ///
    /// # Errors
    /// A key does not apply to this kind, or a time is out of range.
    pub(super) fn plan(&self) -> Result<RouteSpec, ConfigError> {
        match self.kind {
            RouteKind::Spiral => self.spiral().map(RouteSpec::Spiral),
            RouteKind::Turnaround => self.turnaround().map(RouteSpec::Turnaround),
        }
    }

    fn spiral(&self) -> Result<SpiralSpec, ConfigError> {
        refuse("turn_diameter_m", self.turn_diameter_m, "turnaround")?;
        refuse("radius_ratio", self.radius_ratio, "turnaround")?;
        refuse("start_s", self.start_s, "turnaround")?;
        refuse("end_s", self.end_s, "turnaround")?;
        let paper = SpiralSpec::default();
        Ok(SpiralSpec {
            pitch_m: self.pitch_m.unwrap_or(paper.pitch_m),
            start_turns: self.start_turns.unwrap_or(paper.start_turns),
        })
    }

    fn turnaround(&self) -> Result<TurnaroundSpec, ConfigError> {
        refuse("start_turns", self.start_turns, "spiral")?;
        let paper = TurnaroundSpec::default();
        let plan = TurnaroundSpec {
            pitch_m: self.pitch_m.unwrap_or(paper.pitch_m),
            turn_diameter_m: self.turn_diameter_m.unwrap_or(paper.turn_diameter_m),
            radius_ratio: self.radius_ratio.unwrap_or(paper.radius_ratio),
            start_s: self.start_s.unwrap_or(paper.start_s),
            end_s: self.end_s.unwrap_or(paper.end_s),
        };
        require("route", "start_s", plan.start_s, &PLAN_S)?;
        require("route", "end_s", plan.end_s, &PLAN_S)?;
        if plan.end_s <= plan.start_s {
            let (start_s, end_s) = (Number(plan.start_s), Number(plan.end_s));
            return Err(ConfigError(format!("[route] end_s is {end_s}, must be above start_s {start_s}")));
        }
        Ok(plan)
    }
}

fn refuse(key: &'static str, value: Option<f64>, kind: &'static str) -> Result<(), ConfigError> {
    let Some(value) = value.map(Number) else { return Ok(()) };
    Err(ConfigError(format!("[route] {key} is {value}, only allowed with kind = \"{kind}\"")))
}

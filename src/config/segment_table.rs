//! The tables `[[route.segments]]`, not yet checked.

use bench_dragon_geometry::number::Number;
use bench_dragon_geometry::route::PathSegment;
use serde::{Deserialize, Serialize};

/// One of `[[route.segments]]`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "lowercase", try_from = "SegmentKeys")]
pub(super) enum SegmentTable {
    Line { length_m: f64 },
    Arc { radius_m: f64, turn_deg: f64 },
    Spiral { start_radius_m: f64, end_radius_m: f64, turn_deg: f64 },
}

/// The keys of a segment of any kind. Each is read as a number, so an error of its type has its line.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields, expecting = "a segment")]
struct SegmentKeys {
    kind: SegmentKind,
    length_m: Option<f64>,
    radius_m: Option<f64>,
    start_radius_m: Option<f64>,
    end_radius_m: Option<f64>,
    turn_deg: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
enum SegmentKind {
    Line,
    Arc,
    Spiral,
}

impl TryFrom<SegmentKeys> for SegmentTable {
    type Error = String;

    /// Fails without a key of the kind, and with a key of another kind.
    fn try_from(keys: SegmentKeys) -> Result<Self, String> {
        use SegmentKind::{Arc, Line, Spiral};
        let SegmentKeys { kind, length_m, radius_m, start_radius_m, end_radius_m, turn_deg } = keys;
        let keys: [(&str, Option<f64>, &[SegmentKind], &str); 5] = [
            ("length_m", length_m, &[Line], "\"line\""),
            ("radius_m", radius_m, &[Arc], "\"arc\""),
            ("start_radius_m", start_radius_m, &[Spiral], "\"spiral\""),
            ("end_radius_m", end_radius_m, &[Spiral], "\"spiral\""),
            ("turn_deg", turn_deg, &[Arc, Spiral], "\"arc\" or kind = \"spiral\""),
        ];
        for (key, value, kinds, names) in keys {
            match (value, kinds.contains(&kind)) {
                (None, true) => return Err(format!("missing field `{key}`")),
                (Some(value), false) => {
                    return Err(format!("{key} is {}, only allowed with kind = {names}", Number(value)));
                }
                _ => {}
            }
        }
        Ok(match kind {
            Line => Self::Line { length_m: known(length_m) },
            Arc => Self::Arc { radius_m: known(radius_m), turn_deg: known(turn_deg) },
            Spiral => Self::Spiral {
                start_radius_m: known(start_radius_m),
                end_radius_m: known(end_radius_m),
                turn_deg: known(turn_deg),
            },
        })
    }
}

impl SegmentTable {
    pub(super) fn of(segment: &PathSegment) -> Self {
        match *segment {
            PathSegment::Line { length_m } => Self::Line { length_m },
            PathSegment::Arc { radius_m, turn } => Self::Arc { radius_m, turn_deg: turn.to_degrees() },
            PathSegment::Spiral { start_radius_m, end_radius_m, turn } => {
                Self::Spiral { start_radius_m, end_radius_m, turn_deg: turn.to_degrees() }
            }
        }
    }

    pub(super) fn plan(self) -> PathSegment {
        match self {
            Self::Line { length_m } => PathSegment::Line { length_m },
            Self::Arc { radius_m, turn_deg } => PathSegment::Arc { radius_m, turn: turn_deg.to_radians() },
            Self::Spiral { start_radius_m, end_radius_m, turn_deg } => {
                PathSegment::Spiral { start_radius_m, end_radius_m, turn: turn_deg.to_radians() }
            }
        }
    }
}

fn known(value: Option<f64>) -> f64 {
    value.expect("the table is complete")
}

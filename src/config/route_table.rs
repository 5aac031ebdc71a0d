//! The table `[route]`, not yet checked. Its kind determines which keys apply, and their defaults.

use std::ops::RangeInclusive;
use std::path::PathBuf;

use bench_dragon_geometry::drawing::Fit;
use bench_dragon_geometry::number::Number;
use bench_dragon_geometry::route::{
    PathSegment, PathSpec, Placement, RouteShape, RouteSpec, SpiralSpec, TurnaroundSpec,
};
use serde::{Deserialize, Serialize};

use super::{ConfigError, require, require_whole};

/// Allowed show times of a plan, in seconds.
const PLAN_S: RangeInclusive<f64> = -1e6..=1e6;
/// Allowed coordinates of the point where a route lies, in metres.
const PLACE_M: RangeInclusive<f64> = -100_000.0..=100_000.0;
/// Allowed headings, in degrees.
const HEADING_DEG: RangeInclusive<f64> = -360.0..=360.0;
/// Allowed numbers of laps.
const LAPS: RangeInclusive<u32> = 1..=10_000;

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
    /// Path of a drawing, relative to the folder of the configuration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) file: Option<PathBuf>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) id: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) label: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) layer: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) number: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) metres_per_unit: Option<f64>,
    /// Scale of a drawing's page, `"1:100"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) scale: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) tolerance_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) corner_radius_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    turn_line_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    start_x_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    start_y_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    start_heading_deg: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    start_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    end_s: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) closed: Option<bool>,
    #[serde(skip_serializing_if = "Option::is_none")]
    laps: Option<u32>,
    /// After all other keys, because TOML writes an array of tables last.
    #[serde(skip_serializing_if = "Option::is_none")]
    segments: Option<Vec<SegmentTable>>,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum RouteKind {
    #[default]
    Spiral,
    Turnaround,
    Path,
    Drawing,
}

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
    fn of(segment: &PathSegment) -> Self {
        match *segment {
            PathSegment::Line { length_m } => Self::Line { length_m },
            PathSegment::Arc { radius_m, turn } => Self::Arc { radius_m, turn_deg: turn.to_degrees() },
            PathSegment::Spiral { start_radius_m, end_radius_m, turn } => {
                Self::Spiral { start_radius_m, end_radius_m, turn_deg: turn.to_degrees() }
            }
        }
    }

    fn plan(self) -> PathSegment {
        match self {
            Self::Line { length_m } => PathSegment::Line { length_m },
            Self::Arc { radius_m, turn_deg } => PathSegment::Arc { radius_m, turn: turn_deg.to_radians() },
            Self::Spiral { start_radius_m, end_radius_m, turn_deg } => {
                PathSegment::Spiral { start_radius_m, end_radius_m, turn: turn_deg.to_radians() }
            }
        }
    }
}

impl RouteTable {
    /// The same table with every key that applies. Missing ones have the paper's values, or those that leave the route where
    /// and as it is.
    pub(super) fn completed(self) -> Self {
        if self.is_drawing() {
            return self;
        }
        let (spiral, turnaround) = (SpiralSpec::default(), TurnaroundSpec::default());
        let mut table = Self {
            start_x_m: self.start_x_m.or(Some(0.0)),
            start_y_m: self.start_y_m.or(Some(0.0)),
            start_heading_deg: self.start_heading_deg.or(Some(0.0)),
            ..self
        };
        match self.kind {
            RouteKind::Spiral => {
                table.pitch_m.get_or_insert(spiral.pitch_m);
                table.start_turns.get_or_insert(spiral.start_turns);
                table.start_s.get_or_insert(0.0);
            }
            RouteKind::Turnaround => {
                let times = RouteSpec::from(turnaround);
                table.pitch_m.get_or_insert(turnaround.pitch_m);
                table.turn_diameter_m.get_or_insert(turnaround.turn_diameter_m);
                table.radius_ratio.get_or_insert(turnaround.radius_ratio);
                table.turn_line_m.get_or_insert(turnaround.line_m);
                table.start_s.get_or_insert(times.start_s);
                table.end_s = table.end_s.or(times.end_s);
            }
            RouteKind::Path => {
                table.start_s.get_or_insert(0.0);
                if table.closed == Some(true) {
                    table.laps.get_or_insert(1);
                }
            }
            RouteKind::Drawing => {}
        }
        table
    }

    /// The same table with its times multiplied by a factor. A turnaround keeps them: its route has no end.
    pub(super) fn with_times_scaled(self, factor: f64) -> Self {
        let scaled = |time_s: Option<f64>| time_s.map(|time_s| factor * time_s);
        match self.kind {
            RouteKind::Turnaround => self,
            _ => Self { start_s: scaled(self.start_s), end_s: scaled(self.end_s), ..self },
        }
    }

    /// The same table with another spiral or turnaround. A path stays as it is. Times of another kind of route are dropped.
    pub(super) fn with_shape(self, shape: &RouteShape) -> Self {
        let kind = self.kind;
        let rest = Self {
            pitch_m: None,
            start_turns: None,
            turn_diameter_m: None,
            radius_ratio: None,
            turn_line_m: None,
            ..self
        };
        let table = match *shape {
            RouteShape::Spiral(SpiralSpec { pitch_m, start_turns }) => {
                let kind = RouteKind::Spiral;
                Self { kind, pitch_m: Some(pitch_m), start_turns: Some(start_turns), ..rest }
            }
            RouteShape::Turnaround(TurnaroundSpec { pitch_m, turn_diameter_m, radius_ratio, line_m }) => Self {
                kind: RouteKind::Turnaround,
                pitch_m: Some(pitch_m),
                turn_diameter_m: Some(turn_diameter_m),
                radius_ratio: Some(radius_ratio),
                turn_line_m: Some(line_m),
                ..rest
            },
            RouteShape::Path(_) => return rest,
        };
        if table.kind == kind { table } else { Self { start_s: None, end_s: None, ..table } }
    }

    /// Returns the route of a table with every key that applies.
    ///
    /// # Errors
    /// A key does not apply to this kind, or a number that does not belong to the curve is out of range.
    pub(super) fn plan(&self) -> Result<RouteSpec, ConfigError> {
        self.refuse_other_keys()?;
        let shape = match self.kind {
            RouteKind::Spiral => {
                RouteShape::Spiral(SpiralSpec { pitch_m: known(self.pitch_m), start_turns: known(self.start_turns) })
            }
            RouteKind::Turnaround => RouteShape::Turnaround(TurnaroundSpec {
                pitch_m: known(self.pitch_m),
                turn_diameter_m: known(self.turn_diameter_m),
                radius_ratio: known(self.radius_ratio),
                line_m: known(self.turn_line_m),
            }),
            RouteKind::Path => RouteShape::Path(self.path()?),
            RouteKind::Drawing => {
                let reason = "kind is \"drawing\", only allowed in a file: its drawing is another file";
                return Err(ConfigError(format!("[route] {reason}")));
            }
        };
        let (start_x_m, start_y_m) = (known(self.start_x_m), known(self.start_y_m));
        let (start_heading_deg, start_s) = (known(self.start_heading_deg), known(self.start_s));
        require("route", "start_x_m", start_x_m, &PLACE_M)?;
        require("route", "start_y_m", start_y_m, &PLACE_M)?;
        require("route", "start_heading_deg", start_heading_deg, &HEADING_DEG)?;
        require("route", "start_s", start_s, &PLAN_S)?;
        if let Some(end_s) = self.end_s {
            require("route", "end_s", end_s, &PLAN_S)?;
            if end_s <= start_s {
                let (start_s, end_s) = (Number(start_s), Number(end_s));
                return Err(ConfigError(format!("[route] end_s is {end_s}, must be above start_s {start_s}")));
            }
        }
        let placement = Placement { position: [start_x_m, start_y_m].into(), heading: start_heading_deg.to_radians() };
        Ok(RouteSpec { shape, placement, start_s, end_s: self.end_s, ground: None })
    }

    /// Whether the table says where the route begins.
    pub(super) fn is_placed(&self) -> bool {
        self.start_x_m.is_some() && self.start_y_m.is_some()
    }

    /// Whether the route is a drawing, which is not read yet.
    pub(super) fn is_drawing(&self) -> bool {
        self.kind == RouteKind::Drawing
    }

    /// The same table with the path of a drawing in place of its file. The path begins where it is drawn, unless the table
    /// moves or turns it.
    ///
    /// # Errors
    /// There are laps, but the path is open.
    pub(super) fn with_path(self, fit: &Fit, is_closed: bool) -> Result<Self, ConfigError> {
        if let (Some(laps), false) = (self.laps, is_closed) {
            return Err(ConfigError(format!("[route] laps is {laps}, only allowed with a closed path")));
        }
        Ok(Self {
            kind: RouteKind::Path,
            start_x_m: self.start_x_m.or(Some(fit.begin.position.x + 0.0)),
            start_y_m: self.start_y_m.or(Some(fit.begin.position.y + 0.0)),
            start_heading_deg: self.start_heading_deg.or(Some(fit.begin.heading.to_degrees() + 0.0)),
            start_s: self.start_s,
            end_s: self.end_s,
            closed: Some(is_closed),
            laps: self.laps,
            segments: Some(fit.segments.iter().map(SegmentTable::of).collect()),
            ..Self::default()
        })
    }

    fn path(&self) -> Result<PathSpec, ConfigError> {
        let segments = self.segments.iter().flatten().map(|segment| segment.plan()).collect();
        let laps = self.laps.filter(|_| self.closed == Some(true));
        laps.map_or(Ok(()), |laps| require_whole("route", "laps", laps, &LAPS))?;
        Ok(PathSpec { segments, laps })
    }

    /// Fails for a key that does not apply to the kind of route.
    pub(super) fn refuse_other_keys(&self) -> Result<(), ConfigError> {
        use RouteKind::{Drawing, Path, Spiral, Turnaround};
        let number = |value: Option<f64>| value.map(|value| Number(value).to_string());
        let quoted = |value: &Option<String>| value.as_ref().map(|value| format!("{value:?}"));
        let listed = self.segments.as_ref().map(|segments| format!("a list of {}", segments.len()));
        let keys: [(&str, Option<String>, &[RouteKind]); 17] = [
            ("pitch_m", number(self.pitch_m), &[Spiral, Turnaround]),
            ("start_turns", number(self.start_turns), &[Spiral]),
            ("turn_diameter_m", number(self.turn_diameter_m), &[Turnaround]),
            ("radius_ratio", number(self.radius_ratio), &[Turnaround]),
            ("turn_line_m", number(self.turn_line_m), &[Turnaround]),
            ("segments", listed, &[Path]),
            ("closed", self.closed.map(|closed| closed.to_string()), &[Path, Drawing]),
            ("laps", self.laps.map(|laps| laps.to_string()), &[Path, Drawing]),
            ("file", self.file.as_ref().map(|file| format!("{:?}", file.display())), &[Drawing]),
            ("id", quoted(&self.id), &[Drawing]),
            ("label", quoted(&self.label), &[Drawing]),
            ("layer", quoted(&self.layer), &[Drawing]),
            ("number", self.number.map(|number| number.to_string()), &[Drawing]),
            ("metres_per_unit", number(self.metres_per_unit), &[Drawing]),
            ("scale", quoted(&self.scale), &[Drawing]),
            ("tolerance_m", number(self.tolerance_m), &[Drawing]),
            ("corner_radius_m", number(self.corner_radius_m), &[Drawing]),
        ];
        for (key, value, kinds) in keys {
            let Some(value) = value.filter(|_| !kinds.contains(&self.kind)) else { continue };
            let names: Vec<String> = kinds.iter().map(|kind| format!("kind = \"{}\"", kind.name())).collect();
            let allowed = names.join(" or ");
            return Err(ConfigError(format!("[route] {key} is {value}, only allowed with {allowed}")));
        }
        match self.laps {
            Some(laps) if self.closed != Some(true) && self.kind != Drawing => {
                Err(ConfigError(format!("[route] laps is {laps}, only allowed with closed = true")))
            }
            _ => Ok(()),
        }
    }
}

impl RouteKind {
    fn name(self) -> &'static str {
        match self {
            Self::Spiral => "spiral",
            Self::Turnaround => "turnaround",
            Self::Path => "path",
            Self::Drawing => "drawing",
        }
    }
}

fn known(value: Option<f64>) -> f64 {
    value.expect("the table is complete")
}

//! The table `[route]`, not yet checked: the table of its kind, and the keys of every kind.

use std::mem;
use std::ops::RangeInclusive;
use std::path::PathBuf;

use bench_dragon_geometry::drawing::Fit;
use bench_dragon_geometry::number::Number;
use bench_dragon_geometry::route::{PathSpec, Placement, RouteShape, RouteSpec, SpiralSpec, TurnaroundSpec};
use serde::{Deserialize, Serialize};

use super::segment_table::SegmentTable;
use super::{ConfigError, require, require_whole};

/// Allowed show times of a plan, in seconds.
const PLAN_S: RangeInclusive<f64> = -1e6..=1e6;
/// Allowed coordinates of the point where a route lies, in metres.
const PLACE_M: RangeInclusive<f64> = -100_000.0..=100_000.0;
/// Allowed headings, in degrees.
const HEADING_DEG: RangeInclusive<f64> = -360.0..=360.0;
/// Allowed numbers of laps.
const LAPS: RangeInclusive<u32> = 1..=10_000;

/// `[route]`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(from = "RouteKeys", into = "RouteKeys")]
pub(super) struct RouteTable {
    pub(super) kind: KindTable,
    start: StartTable,
    /// The error of the first key that belongs to another kind.
    stray_key: Option<String>,
}

/// The keys of one kind of route. Missing numbers of a spiral and a turnaround have the paper's values.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum KindTable {
    Spiral(SpiralSpec),
    Turnaround(TurnaroundSpec),
    Path(PathTable),
    Drawing(DrawingTable),
}

/// Where and when a route of any kind begins, and when it ends.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct StartTable {
    x_m: Option<f64>,
    y_m: Option<f64>,
    heading_deg: Option<f64>,
    start_s: Option<f64>,
    end_s: Option<f64>,
}

#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct PathTable {
    is_closed: Option<bool>,
    laps: Option<u32>,
    segments: Option<Vec<SegmentTable>>,
}

/// A drawing that is not read yet.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct DrawingTable {
    /// Path of the drawing, relative to the folder of the configuration.
    pub(super) file: Option<PathBuf>,
    pub(super) id: Option<String>,
    pub(super) label: Option<String>,
    pub(super) layer: Option<String>,
    pub(super) number: Option<u32>,
    pub(super) metres_per_unit: Option<f64>,
    /// Scale of the page, `"1:100"`.
    pub(super) scale: Option<String>,
    pub(super) tolerance_m: Option<f64>,
    pub(super) corner_radius_m: Option<f64>,
    pub(super) is_closed: Option<bool>,
    laps: Option<u32>,
}

/// The keys of a route of any kind. Each is read as its own type, so an error of its type has its line. The written document
/// has them in this order.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields, expecting = "a table")]
struct RouteKeys {
    kind: RouteKind,
    pitch_m: Option<f64>,
    start_turns: Option<f64>,
    turn_diameter_m: Option<f64>,
    radius_ratio: Option<f64>,
    file: Option<PathBuf>,
    id: Option<String>,
    label: Option<String>,
    layer: Option<String>,
    number: Option<u32>,
    metres_per_unit: Option<f64>,
    scale: Option<String>,
    tolerance_m: Option<f64>,
    corner_radius_m: Option<f64>,
    turn_line_m: Option<f64>,
    start_x_m: Option<f64>,
    start_y_m: Option<f64>,
    start_heading_deg: Option<f64>,
    start_s: Option<f64>,
    end_s: Option<f64>,
    closed: Option<bool>,
    laps: Option<u32>,
    /// After all other keys, because TOML writes an array of tables last.
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

impl Default for RouteTable {
    fn default() -> Self {
        RouteKeys::default().into()
    }
}

impl From<RouteKeys> for RouteTable {
    fn from(keys: RouteKeys) -> Self {
        let stray_key = keys.stray_key();
        let (spiral, turnaround) = (SpiralSpec::default(), TurnaroundSpec::default());
        let start = StartTable {
            x_m: keys.start_x_m,
            y_m: keys.start_y_m,
            heading_deg: keys.start_heading_deg,
            start_s: keys.start_s,
            end_s: keys.end_s,
        };
        let kind = match keys.kind {
            RouteKind::Spiral => KindTable::Spiral(SpiralSpec {
                pitch_m: keys.pitch_m.unwrap_or(spiral.pitch_m),
                start_turns: keys.start_turns.unwrap_or(spiral.start_turns),
            }),
            RouteKind::Turnaround => KindTable::Turnaround(TurnaroundSpec {
                pitch_m: keys.pitch_m.unwrap_or(turnaround.pitch_m),
                turn_diameter_m: keys.turn_diameter_m.unwrap_or(turnaround.turn_diameter_m),
                radius_ratio: keys.radius_ratio.unwrap_or(turnaround.radius_ratio),
                line_m: keys.turn_line_m.unwrap_or(turnaround.line_m),
            }),
            RouteKind::Path => {
                KindTable::Path(PathTable { is_closed: keys.closed, laps: keys.laps, segments: keys.segments })
            }
            RouteKind::Drawing => KindTable::Drawing(DrawingTable {
                file: keys.file,
                id: keys.id,
                label: keys.label,
                layer: keys.layer,
                number: keys.number,
                metres_per_unit: keys.metres_per_unit,
                scale: keys.scale,
                tolerance_m: keys.tolerance_m,
                corner_radius_m: keys.corner_radius_m,
                is_closed: keys.closed,
                laps: keys.laps,
            }),
        };
        Self { kind, start, stray_key }
    }
}

impl From<RouteTable> for RouteKeys {
    fn from(RouteTable { kind, start, .. }: RouteTable) -> Self {
        let keys = Self {
            start_x_m: start.x_m,
            start_y_m: start.y_m,
            start_heading_deg: start.heading_deg,
            start_s: start.start_s,
            end_s: start.end_s,
            ..Self::default()
        };
        match kind {
            KindTable::Spiral(spiral) => Self {
                kind: RouteKind::Spiral,
                pitch_m: Some(spiral.pitch_m),
                start_turns: Some(spiral.start_turns),
                ..keys
            },
            KindTable::Turnaround(turnaround) => Self {
                kind: RouteKind::Turnaround,
                pitch_m: Some(turnaround.pitch_m),
                turn_diameter_m: Some(turnaround.turn_diameter_m),
                radius_ratio: Some(turnaround.radius_ratio),
                turn_line_m: Some(turnaround.line_m),
                ..keys
            },
            KindTable::Path(path) => {
                Self { kind: RouteKind::Path, closed: path.is_closed, laps: path.laps, segments: path.segments, ..keys }
            }
            KindTable::Drawing(drawing) => Self {
                kind: RouteKind::Drawing,
                file: drawing.file,
                id: drawing.id,
                label: drawing.label,
                layer: drawing.layer,
                number: drawing.number,
                metres_per_unit: drawing.metres_per_unit,
                scale: drawing.scale,
                tolerance_m: drawing.tolerance_m,
                corner_radius_m: drawing.corner_radius_m,
                closed: drawing.is_closed,
                laps: drawing.laps,
                ..keys
            },
        }
    }
}

impl RouteKeys {
    /// The error of the first key that does not apply to the kind of route.
    fn stray_key(&self) -> Option<String> {
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
        keys.into_iter().find_map(|(key, value, kinds)| {
            let value = value.filter(|_| !kinds.contains(&self.kind))?;
            let names: Vec<String> = kinds.iter().map(|kind| format!("kind = \"{}\"", kind.name())).collect();
            Some(format!("[route] {key} is {value}, only allowed with {}", names.join(" or ")))
        })
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

impl RouteTable {
    /// The same table with every key that applies. Missing ones leave the route where and as it is.
    pub(super) fn completed(mut self) -> Self {
        let times = match &mut self.kind {
            KindTable::Drawing(_) => return self,
            KindTable::Spiral(_) => [Some(0.0), None],
            KindTable::Turnaround(turnaround) => {
                let times = RouteSpec::from(*turnaround);
                [Some(times.start_s), times.end_s]
            }
            KindTable::Path(path) => {
                if path.is_closed == Some(true) {
                    path.laps.get_or_insert(1);
                }
                [Some(0.0), None]
            }
        };
        let StartTable { x_m, y_m, heading_deg, start_s, end_s } = self.start;
        self.start = StartTable {
            x_m: x_m.or(Some(0.0)),
            y_m: y_m.or(Some(0.0)),
            heading_deg: heading_deg.or(Some(0.0)),
            start_s: start_s.or(times[0]),
            end_s: end_s.or(times[1]),
        };
        self
    }

    /// The same table with its times multiplied by a factor. A turnaround keeps them: its route has no end.
    pub(super) fn with_times_scaled(mut self, factor: f64) -> Self {
        if !matches!(self.kind, KindTable::Turnaround(_)) {
            let StartTable { start_s, end_s, .. } = &mut self.start;
            [*start_s, *end_s] = [*start_s, *end_s].map(|time_s| time_s.map(|time_s| factor * time_s));
        }
        self
    }

    /// The same table with other times. Without an end, it stays without one.
    pub(super) fn with_times(mut self, [start_s, end_s]: [f64; 2]) -> Self {
        self.start.start_s = Some(start_s);
        self.start.end_s = self.start.end_s.map(|_| end_s);
        self
    }

    /// The same table with another spiral or turnaround. A path stays as it is. Times of another kind of route are dropped.
    pub(super) fn with_shape(self, shape: &RouteShape) -> Self {
        let kind = match *shape {
            RouteShape::Spiral(spiral) => KindTable::Spiral(spiral),
            RouteShape::Turnaround(turnaround) => KindTable::Turnaround(turnaround),
            RouteShape::Path(_) => return self,
        };
        let is_same_kind = mem::discriminant(&kind) == mem::discriminant(&self.kind);
        let times = if is_same_kind { [self.start.start_s, self.start.end_s] } else { [None; 2] };
        Self { kind, start: StartTable { start_s: times[0], end_s: times[1], ..self.start }, ..self }
    }

    /// Returns the route of a table with every key that applies.
    ///
    /// # Errors
    /// A key does not apply to this kind, or a number that does not belong to the curve is out of range.
    pub(super) fn plan(&self) -> Result<RouteSpec, ConfigError> {
        self.refuse_stray_key()?;
        let shape = match &self.kind {
            KindTable::Spiral(spiral) => RouteShape::Spiral(*spiral),
            KindTable::Turnaround(turnaround) => RouteShape::Turnaround(*turnaround),
            KindTable::Path(path) => RouteShape::Path(path.plan()?),
            KindTable::Drawing(_) => {
                let reason = "kind is \"drawing\", only allowed in a file: its drawing is another file";
                return Err(ConfigError(format!("[route] {reason}")));
            }
        };
        let StartTable { x_m, y_m, heading_deg, start_s, end_s } = self.start;
        let [x_m, y_m, heading_deg, start_s] = [x_m, y_m, heading_deg, start_s].map(|value| value.unwrap_or(0.0));
        require("route", "start_x_m", x_m, &PLACE_M)?;
        require("route", "start_y_m", y_m, &PLACE_M)?;
        require("route", "start_heading_deg", heading_deg, &HEADING_DEG)?;
        require("route", "start_s", start_s, &PLAN_S)?;
        if let Some(end_s) = end_s {
            require("route", "end_s", end_s, &PLAN_S)?;
            if end_s <= start_s {
                let (start_s, end_s) = (Number(start_s), Number(end_s));
                return Err(ConfigError(format!("[route] end_s is {end_s}, must be above start_s {start_s}")));
            }
        }
        let placement = Placement { position: [x_m, y_m].into(), heading: heading_deg.to_radians() };
        Ok(RouteSpec { shape, placement, start_s, end_s, ground: None })
    }

    /// Whether the table says where the route begins.
    pub(super) fn is_placed(&self) -> bool {
        self.start.x_m.is_some() && self.start.y_m.is_some()
    }

    /// Whether the route is a drawing, which is not read yet.
    pub(super) fn is_drawing(&self) -> bool {
        matches!(self.kind, KindTable::Drawing(_))
    }

    /// Replaces a drawing by its path. The path begins where it is drawn, unless the table moves or turns it.
    ///
    /// # Errors
    /// There are laps, but the path is open.
    pub(super) fn set_path(&mut self, fit: &Fit, is_closed: bool) -> Result<(), ConfigError> {
        let laps = if let KindTable::Drawing(drawing) = &self.kind { drawing.laps } else { None };
        if let (Some(laps), false) = (laps, is_closed) {
            return Err(ConfigError(format!("[route] laps is {laps}, only allowed with a closed path")));
        }
        self.start.x_m.get_or_insert(fit.begin.position.x + 0.0);
        self.start.y_m.get_or_insert(fit.begin.position.y + 0.0);
        self.start.heading_deg.get_or_insert(fit.begin.heading.to_degrees() + 0.0);
        let segments = Some(fit.segments.iter().map(SegmentTable::of).collect());
        self.kind = KindTable::Path(PathTable { is_closed: Some(is_closed), laps, segments });
        Ok(())
    }

    /// Fails for a key that does not apply to the kind of route.
    pub(super) fn refuse_stray_key(&self) -> Result<(), ConfigError> {
        self.stray_key.clone().map_or(Ok(()), |error| Err(ConfigError(error)))
    }
}

impl PathTable {
    fn plan(&self) -> Result<PathSpec, ConfigError> {
        if let Some(laps) = self.laps {
            if self.is_closed != Some(true) {
                return Err(ConfigError(format!("[route] laps is {laps}, only allowed with closed = true")));
            }
            require_whole("route", "laps", laps, &LAPS)?;
        }
        let segments = self.segments.iter().flatten().map(|segment| segment.plan()).collect();
        Ok(PathSpec { segments, laps: self.laps })
    }
}

//! Planned routes: the values that a choreographer sets, and the construction of routes from them.

use std::f64::consts::PI;
use std::sync::Arc;

use glam::DVec2;

use super::{PathSpec, Placement, Route, RouteError, RouteFamily, Turnaround};
use crate::ground::Ground;

/// A planned route. Its times are show times in seconds; a [`Route`] has only travels.
#[derive(Clone, Debug, PartialEq)]
pub struct RouteSpec {
    /// The curve.
    pub shape: RouteShape,
    /// Where it lies: the centre of a spiral or a turnaround, the beginning of a path.
    pub placement: Placement,
    /// Show time at which the plan begins.
    pub start_s: f64,
    /// Show time at which the plan ends; `None`: where the route ends.
    pub end_s: Option<f64>,
    /// Ground that is not flat.
    pub ground: Option<Arc<Ground>>,
}

/// The curve of a planned route.
#[derive(Clone, Debug, PartialEq)]
pub enum RouteShape {
    /// An inward spiral, from t = 0 to its centre.
    Spiral(SpiralSpec),
    /// An inward spiral, an S, and an outward spiral. The head enters the turning circle at t = 0.
    Turnaround(TurnaroundSpec),
    /// Lines, arcs and spirals, from t = 0 at the beginning of the first.
    Path(PathSpec),
}

/// A planned spiral; by default the paper's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SpiralSpec {
    /// Distance between neighbouring turns, in metres.
    pub pitch_m: f64,
    /// Number of turns from the centre to the start of the head.
    pub start_turns: f64,
}

impl Default for SpiralSpec {
    fn default() -> Self {
        Self { pitch_m: 0.55, start_turns: 16.0 }
    }
}

/// A planned turnaround; by default the paper's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TurnaroundSpec {
    /// Distance between neighbouring turns, in metres.
    pub pitch_m: f64,
    /// Diameter of the circle that contains the S, in metres.
    pub turn_diameter_m: f64,
    /// Radius of the entry arc ÷ that of the exit arc.
    pub radius_ratio: f64,
    /// Length of the straight line between the two arcs, in metres; 0 without one.
    pub line_m: f64,
}

impl Default for TurnaroundSpec {
    fn default() -> Self {
        Self { pitch_m: 1.7, turn_diameter_m: 9.0, radius_ratio: 2.0, line_m: 0.0 }
    }
}

/// Show times at which the paper's turnaround begins and ends.
const TURNAROUND_S: [f64; 2] = [-100.0, 100.0];

impl SpiralSpec {
    /// The spiral, walked from its start to the circle of this diameter about its centre.
    ///
    /// # Errors
    /// A value is out of range, or the spiral starts inside the circle.
    pub fn to_circle(&self, diameter_m: f64) -> Result<Route, RouteError> {
        let spiral = Route::spiral(self.pitch_m, self.start_turns)?;
        let end_travel_m = spiral.travel(self.circle_parameter(diameter_m));
        spiral.between(0.0, end_travel_m)
    }

    /// The parameter at which the spiral reaches the circle of this diameter about its centre.
    fn circle_parameter(&self, diameter_m: f64) -> f64 {
        -PI * diameter_m.max(0.0) / self.pitch_m
    }

    /// Whether the spiral starts inside the circle of this diameter about its centre, or on it.
    pub(crate) fn starts_inside(&self, diameter_m: f64) -> bool {
        diameter_m >= 2.0 * self.start_turns * self.pitch_m
    }
}

impl RouteShape {
    /// The configuration's name of this kind of route.
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Spiral(_) => "spiral",
            Self::Turnaround(_) => "turnaround",
            Self::Path(_) => "path",
        }
    }

    /// Number of segments, of a closed path: in one lap.
    pub fn segments(&self) -> usize {
        match self {
            Self::Spiral(_) => 1,
            Self::Turnaround(_) => 4,
            Self::Path(spec) => spec.segments.len(),
        }
    }
}

impl From<SpiralSpec> for RouteSpec {
    /// The spiral about the origin, from t = 0 to its centre.
    fn from(spec: SpiralSpec) -> Self {
        Self {
            shape: RouteShape::Spiral(spec),
            placement: Placement::default(),
            start_s: 0.0,
            end_s: None,
            ground: None,
        }
    }
}

impl From<TurnaroundSpec> for RouteSpec {
    /// The turnaround about the origin, at the paper's times.
    fn from(spec: TurnaroundSpec) -> Self {
        let [start_s, end_s] = TURNAROUND_S;
        Self {
            shape: RouteShape::Turnaround(spec),
            placement: Placement::default(),
            start_s,
            end_s: Some(end_s),
            ground: None,
        }
    }
}

impl From<PathSpec> for RouteSpec {
    /// The path from the origin in the direction of +x, from its beginning to its end.
    fn from(spec: PathSpec) -> Self {
        Self { shape: RouteShape::Path(spec), placement: Placement::default(), start_s: 0.0, end_s: None, ground: None }
    }
}

impl RouteSpec {
    /// Travel of the head up to which a dragon is at the same places as on another route: infinite on the same curve, the length of
    /// the equal segments at the beginning of open paths on level ground, negative infinity where nothing is known.
    pub fn same_to_m(&self, other: &Self) -> f64 {
        if (self.placement, self.start_s, &self.ground) != (other.placement, other.start_s, &other.ground) {
            return f64::NEG_INFINITY;
        }
        if self.shape == other.shape {
            return f64::INFINITY;
        }
        match (&self.shape, &other.shape, &self.ground) {
            (
                RouteShape::Path(PathSpec { segments, laps: None }),
                RouteShape::Path(PathSpec { segments: others, laps: None }),
                None,
            ) => {
                let equal = segments.iter().zip(others).take_while(|(segment, other)| segment == other);
                equal.map(|(segment, _)| segment.length_m()).sum()
            }
            _ => f64::NEG_INFINITY,
        }
    }

    /// The route for a head of this speed, in m/s, and a dragon whose links have this length together.
    ///
    /// # Errors
    /// A value is out of range.
    pub fn build(&self, head_speed_mps: f64, dragon_m: f64) -> Result<Route, RouteError> {
        match &self.shape {
            RouteShape::Spiral(spec) => {
                let spiral = Route::spiral(spec.pitch_m, spec.start_turns)?.placed(&self.placement);
                self.walked(spiral, head_speed_mps, dragon_m)
            }
            RouteShape::Turnaround(spec) => {
                let route = self.turnaround(spec, head_speed_mps)?.route();
                if self.ground.is_some() { self.walked(route, head_speed_mps, dragon_m) } else { Ok(route) }
            }
            RouteShape::Path(spec) => {
                let route = spec.route(&self.placement, dragon_m, head_speed_mps * self.start_s)?;
                self.walked(route, head_speed_mps, dragon_m)
            }
        }
    }

    /// The same route, with its change over the pitch.
    ///
    /// # Errors
    /// A value is out of range.
    pub fn family(&self, head_speed_mps: f64, dragon_m: f64) -> Result<RouteFamily, RouteError> {
        let route = self.build(head_speed_mps, dragon_m)?;
        let family = match &self.shape {
            RouteShape::Spiral(_) => RouteFamily::of_spiral(route, self.placement.position),
            RouteShape::Turnaround(spec) => RouteFamily::of_turnaround(self.turnaround(spec, head_speed_mps)?, route),
            RouteShape::Path(_) => RouteFamily::of_path(route),
        };
        Ok(family.on_ground(self.ground.clone()))
    }

    /// A spiral on the ground of the plan, walked from its start to the circle of this diameter about its centre, by a dragon whose
    /// links have this length together. Without ground it is about the origin. With its change over the pitch.
    ///
    /// # Errors
    /// A value is out of range, or the spiral starts inside the circle.
    pub(crate) fn lead_in(&self, spec: SpiralSpec, diameter_m: f64, dragon_m: f64) -> Result<RouteFamily, RouteError> {
        let Some(ground) = &self.ground else {
            return Ok(RouteFamily::of_spiral(spec.to_circle(diameter_m)?, DVec2::ZERO));
        };
        let spiral = Route::spiral(spec.pitch_m, spec.start_turns)?.placed(&self.placement);
        let spiral = spiral.on_ground(ground, 0.0, None, dragon_m)?;
        let end_m = spiral.travel(spec.circle_parameter(diameter_m));
        let family = RouteFamily::of_spiral(spiral.between(0.0, end_m)?, self.placement.position);
        Ok(family.on_ground(self.ground.clone()))
    }

    /// The planned turnaround for a head of this speed; `None` for another route.
    ///
    /// # Errors
    /// A value is out of range.
    pub fn planned_turnaround(&self, head_speed_mps: f64) -> Result<Option<Turnaround>, RouteError> {
        self.as_turnaround().map(|spec| self.turnaround(&spec, head_speed_mps)).transpose()
    }

    fn turnaround(&self, spec: &TurnaroundSpec, head_speed_mps: f64) -> Result<Turnaround, RouteError> {
        let end_s = self.end_s.unwrap_or(TURNAROUND_S[1]);
        Turnaround::with_line(spec.pitch_m, spec.turn_diameter_m, spec.radius_ratio, spec.line_m)?
            .placed(self.placement)
            .between(head_speed_mps * self.start_s, head_speed_mps * end_s)
    }

    /// A route, walked between the planned times on its ground.
    fn walked(&self, route: Route, head_speed_mps: f64, dragon_m: f64) -> Result<Route, RouteError> {
        let start_m = head_speed_mps * self.start_s;
        let end_m = self.end_s.map(|end_s| head_speed_mps * end_s);
        let walked = if let Some(ground) = &self.ground {
            route.on_ground(ground, start_m, end_m, dragon_m)
        } else {
            let end_m = end_m.unwrap_or(route.end_travel_m());
            route.between(start_m, end_m)
        };
        walked.map_err(|error| self.in_times(error, head_speed_mps))
    }

    /// An error about travels as one about the planned times.
    fn in_times(&self, error: RouteError, head_speed_mps: f64) -> RouteError {
        match error {
            RouteError::End { curve_end_m, .. } => {
                let last_s = curve_end_m / head_speed_mps;
                RouteError::EndTime { end_s: self.end_s.unwrap_or(last_s), last_s }
            }
            RouteError::Span { end_travel_m, .. } => {
                let end_s = self.end_s.unwrap_or(end_travel_m / head_speed_mps);
                RouteError::Times { start_s: self.start_s, end_s }
            }
            error => error,
        }
    }

    /// The planned turnaround, if the route is one.
    pub fn as_turnaround(&self) -> Option<TurnaroundSpec> {
        if let RouteShape::Turnaround(spec) = self.shape { Some(spec) } else { None }
    }

    /// The planned path, if the route is one.
    pub fn as_path(&self) -> Option<&PathSpec> {
        if let RouteShape::Path(spec) = &self.shape { Some(spec) } else { None }
    }

    /// The planned spiral. For a turnaround: a spiral of its pitch with the paper's number of turns at the start. `None` for a
    /// path, which has no pitch.
    pub fn spiral(&self) -> Option<SpiralSpec> {
        match &self.shape {
            RouteShape::Spiral(spec) => Some(*spec),
            RouteShape::Turnaround(spec) => Some(SpiralSpec { pitch_m: spec.pitch_m, ..SpiralSpec::default() }),
            RouteShape::Path(_) => None,
        }
    }

    /// Diameter of the circle that contains the S. For another route: the diameter of the paper's turning circle.
    pub fn turn_diameter_m(&self) -> f64 {
        self.as_turnaround().unwrap_or_default().turn_diameter_m
    }

    /// Distance between neighbouring turns, in metres; `None` for a path.
    pub fn pitch_m(&self) -> Option<f64> {
        self.spiral().map(|spec| spec.pitch_m)
    }

    /// The same plan with another shape.
    #[must_use]
    pub fn with_shape(&self, shape: RouteShape) -> Self {
        Self { shape, ..self.clone() }
    }

    /// The same plan with another pitch, which is not checked. A path has no pitch.
    #[must_use]
    pub fn with_pitch(&self, pitch_m: f64) -> Self {
        self.with_shape(match &self.shape {
            RouteShape::Spiral(spec) => RouteShape::Spiral(SpiralSpec { pitch_m, ..*spec }),
            RouteShape::Turnaround(spec) => RouteShape::Turnaround(TurnaroundSpec { pitch_m, ..*spec }),
            RouteShape::Path(spec) => RouteShape::Path(spec.clone()),
        })
    }
}

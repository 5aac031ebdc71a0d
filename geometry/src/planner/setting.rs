//! Settings: a choreographer's plan, and changes of one of its parameters.

use std::fmt::{self, Display, Formatter};

use crate::dragon::{Dimensions, DimensionsError};
use crate::formation::Timetable;
use crate::route::{RouteMeasure, RouteShape, RouteSpec, TurnaroundSpec};

/// A planned dragon and its planned route.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// The benches.
    pub dimensions: Dimensions,
    /// The route.
    pub route: RouteSpec,
    /// Speed of the head in m/s.
    pub speed_mps: f64,
    /// Largest acceleration of the head in m/s²; with `None` the head starts and stops at once.
    pub accel_mps2: Option<f64>,
}

impl Setting {
    /// Timetable of the head on a run to `end_travel_m`.
    pub(super) fn timetable(&self, end_travel_m: f64) -> Timetable {
        Timetable::new(self.speed_mps, self.accel_mps2, self.route.start_s, end_travel_m)
    }

    /// Whether the plan has a parameter. A path has no pitch, and a head that starts at once has no acceleration. Only a
    /// turnaround has the measures of a turn, and only one with a line the length of that. Only loose hinges have diameters.
    pub fn has(&self, parameter: Parameter) -> bool {
        match parameter {
            Parameter::Pitch => self.route.pitch_m().is_some(),
            Parameter::Accel => self.accel_mps2.is_some(),
            Parameter::TurnDiameter | Parameter::RadiusRatio => self.route.as_turnaround().is_some(),
            Parameter::TurnLine => self.route.as_turnaround().is_some_and(|turn| turn.line_m > 0.0),
            Parameter::HoleDiameter | Parameter::PoleDiameter => self.dimensions.play_m() > 0.0,
            _ => true,
        }
    }

    /// The value of a parameter; NaN for one that the plan does not have.
    pub fn value(&self, parameter: Parameter) -> f64 {
        let turn = |measure: fn(&TurnaroundSpec) -> f64| self.route.as_turnaround().as_ref().map_or(f64::NAN, measure);
        match parameter {
            Parameter::Pitch => self.route.pitch_m().unwrap_or(f64::NAN),
            Parameter::HeadLength => self.dimensions.head_length_m(),
            Parameter::BodyLength => self.dimensions.body_length_m(),
            Parameter::Width => self.dimensions.width_m(),
            Parameter::HoleOffset => self.dimensions.hole_offset_m(),
            Parameter::HoleDiameter => self.dimensions.hole_diameter_m(),
            Parameter::PoleDiameter => self.dimensions.pole_diameter_m(),
            Parameter::Speed => self.speed_mps,
            Parameter::Accel => self.accel_mps2.unwrap_or(f64::NAN),
            Parameter::TurnDiameter => turn(|turn| turn.turn_diameter_m),
            Parameter::RadiusRatio => turn(|turn| turn.radius_ratio),
            Parameter::TurnLine => turn(|turn| turn.line_m),
        }
    }

    /// The route with another value of a measure of its turn, if it has one.
    fn with_turn(&self, parameter: Parameter, value: f64) -> RouteSpec {
        let Some(mut turn) = self.route.as_turnaround() else { return self.route.clone() };
        match parameter {
            Parameter::TurnDiameter => turn.turn_diameter_m = value,
            Parameter::RadiusRatio => turn.radius_ratio = value,
            _ => turn.line_m = value,
        }
        self.route.with_shape(RouteShape::Turnaround(turn))
    }

    /// The same setting with another speed or acceleration of the head.
    pub(super) fn timed(&self, parameter: Parameter, value: f64) -> Self {
        match parameter {
            Parameter::Accel => Self { accel_mps2: Some(value), ..self.clone() },
            _ => Self { speed_mps: value, ..self.clone() },
        }
    }

    /// The same setting with another value of one parameter. A measure of the route is not checked here, but when a dragon is placed
    /// on its route.
    ///
    /// # Errors
    /// The dimensions of the benches are invalid.
    pub fn with(&self, parameter: Parameter, value: f64) -> Result<Self, DimensionsError> {
        let mut changed = self.clone();
        match parameter {
            Parameter::Speed | Parameter::Accel => changed = self.timed(parameter, value),
            Parameter::Pitch => changed.route = self.route.with_pitch(value),
            _ if parameter.is_of_turn() => changed.route = self.with_turn(parameter, value),
            _ => {
                let measure = |of| if of == parameter { value } else { self.value(of) };
                changed.dimensions = Dimensions::new(
                    self.dimensions.benches(),
                    measure(Parameter::HeadLength),
                    measure(Parameter::BodyLength),
                    measure(Parameter::Width),
                    measure(Parameter::HoleOffset),
                )?;
                if self.dimensions.play_m() > 0.0 {
                    let [hole_m, pole_m] = [Parameter::HoleDiameter, Parameter::PoleDiameter].map(measure);
                    changed.dimensions = changed.dimensions.with_poles(hole_m, pole_m)?;
                }
            }
        }
        Ok(changed)
    }
}

/// A parameter of the plan that a choreographer can vary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Distance between neighbouring turns of the route. Its other measures stay fixed.
    Pitch,
    /// Length of the head's board.
    HeadLength,
    /// Length of every other board.
    BodyLength,
    /// Width of every board.
    Width,
    /// Distance of the hinge holes from the ends of the boards.
    HoleOffset,
    /// Diameter of the holes of loose hinges. It changes only what the play allows.
    HoleDiameter,
    /// Diameter of the poles of loose hinges. It changes only what the play allows.
    PoleDiameter,
    /// Speed of the head. It only changes times.
    Speed,
    /// Acceleration of the head's ramps. It only changes times.
    Accel,
    /// Diameter of a turnaround's circle.
    TurnDiameter,
    /// Radius of a turnaround's entry arc ÷ that of its exit arc.
    RadiusRatio,
    /// Length of the line between a turnaround's arcs.
    TurnLine,
}

impl Parameter {
    /// All parameters.
    pub const ALL: [Self; 12] = [
        Self::Pitch,
        Self::HeadLength,
        Self::BodyLength,
        Self::Width,
        Self::HoleOffset,
        Self::HoleDiameter,
        Self::PoleDiameter,
        Self::Speed,
        Self::Accel,
        Self::TurnDiameter,
        Self::RadiusRatio,
        Self::TurnLine,
    ];

    /// Whether the parameter changes only the times of travels.
    pub(super) fn is_of_times(self) -> bool {
        matches!(self, Self::Speed | Self::Accel)
    }

    /// Whether the parameter changes only the play of the hinges.
    pub(super) fn is_of_play(self) -> bool {
        matches!(self, Self::HoleDiameter | Self::PoleDiameter)
    }

    /// Whether the parameter is a measure of a turnaround's turn.
    pub(super) fn is_of_turn(self) -> bool {
        matches!(self, Self::TurnDiameter | Self::RadiusRatio | Self::TurnLine)
    }

    /// The measure of the route that the parameter is.
    pub(super) fn of_route(self) -> Option<RouteMeasure> {
        match self {
            Self::Pitch => Some(RouteMeasure::Pitch),
            Self::TurnDiameter => Some(RouteMeasure::TurnDiameter),
            Self::RadiusRatio => Some(RouteMeasure::RadiusRatio),
            Self::TurnLine => Some(RouteMeasure::TurnLine),
            _ => None,
        }
    }

    /// The configuration's key of the parameter, and its name in messages.
    fn names(self) -> [&'static str; 2] {
        match self {
            Self::Pitch => ["pitch_m", "pitch"],
            Self::HeadLength => ["head_length_m", "head length"],
            Self::BodyLength => ["body_length_m", "body length"],
            Self::Width => ["width_m", "width"],
            Self::HoleOffset => ["hole_offset_m", "hole offset"],
            Self::HoleDiameter => ["hole_diameter_m", "hole diameter"],
            Self::PoleDiameter => ["pole_diameter_m", "pole diameter"],
            Self::Speed => ["speed_mps", "speed"],
            Self::Accel => ["accel_mps2", "acceleration"],
            Self::TurnDiameter => ["turn_diameter_m", "turn diameter"],
            Self::RadiusRatio => ["radius_ratio", "radius ratio"],
            Self::TurnLine => ["line_m", "turn line"],
        }
    }

    /// The configuration's key of the parameter.
    pub fn key(self) -> &'static str {
        self.names()[0]
    }

    /// The unit of the value; empty for a ratio.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Speed => "m/s",
            Self::Accel => "m/s²",
            Self::RadiusRatio => "",
            _ => "m",
        }
    }
}

impl Display for Parameter {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.names()[1])
    }
}

//! What a choreographer plans with, and any one measure of it changed.

use std::fmt::{self, Display, Formatter};

use super::HeadTimetable;
use crate::dragon::{Dimensions, DimensionsError};
use crate::route::RouteSpec;

/// A dragon and its route as planned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The benches.
    pub dimensions: Dimensions,
    /// The route.
    pub route: RouteSpec,
    /// Speed of the head in m/s.
    pub speed_mps: f64,
    /// Greatest acceleration of the head in m/s²; without one it starts and stops at once.
    pub accel_mps2: Option<f64>,
}

impl Setting {
    /// When the head is where on a run to `end_travel_m`.
    pub(super) fn timetable(&self, end_travel_m: f64) -> HeadTimetable {
        HeadTimetable::new(self.speed_mps, self.accel_mps2, self.route.start_s(), end_travel_m)
    }

    /// The value of a parameter.
    pub fn value(&self, parameter: Parameter) -> f64 {
        match parameter {
            Parameter::Pitch => self.route.pitch_m(),
            Parameter::HeadLength => self.dimensions.head_length_m(),
            Parameter::BodyLength => self.dimensions.body_length_m(),
            Parameter::Width => self.dimensions.width_m(),
            Parameter::HoleOffset => self.dimensions.hole_offset_m(),
            Parameter::Speed => self.speed_mps,
        }
    }

    /// The same with another value of one parameter. A pitch is not checked until a dragon walks it.
    ///
    /// # Errors
    /// Impossible measures of a bench.
    pub fn with(&self, parameter: Parameter, value: f64) -> Result<Self, DimensionsError> {
        let mut changed = *self;
        match parameter {
            Parameter::Speed => changed.speed_mps = value,
            Parameter::Pitch => changed.route = self.route.with_pitch(value),
            _ => {
                let measure = |of| if of == parameter { value } else { self.value(of) };
                changed.dimensions = Dimensions::new(
                    self.dimensions.benches(),
                    measure(Parameter::HeadLength),
                    measure(Parameter::BodyLength),
                    measure(Parameter::Width),
                    measure(Parameter::HoleOffset),
                )?;
            }
        }
        Ok(changed)
    }
}

/// A value that a choreographer can vary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Distance between neighbouring turns of the route, its other measures being held.
    Pitch,
    /// Length of the head's board.
    HeadLength,
    /// Length of every other board.
    BodyLength,
    /// Width of every board.
    Width,
    /// Distance of the hinge holes from the ends of the boards.
    HoleOffset,
    /// Speed of the head: it changes times alone.
    Speed,
}

impl Parameter {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Pitch, Self::HeadLength, Self::BodyLength, Self::Width, Self::HoleOffset, Self::Speed];

    /// The configuration's name of the value, and its name in messages.
    fn names(self) -> [&'static str; 2] {
        match self {
            Self::Pitch => ["pitch_m", "pitch"],
            Self::HeadLength => ["head_length_m", "head length"],
            Self::BodyLength => ["body_length_m", "body length"],
            Self::Width => ["width_m", "width"],
            Self::HoleOffset => ["hole_offset_m", "hole offset"],
            Self::Speed => ["speed_mps", "speed"],
        }
    }

    /// The configuration's name of the value.
    pub fn key(self) -> &'static str {
        self.names()[0]
    }

    /// The unit that the value is given in.
    pub fn unit(self) -> &'static str {
        if self == Self::Speed { "m/s" } else { "m" }
    }
}

impl Display for Parameter {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.names()[1])
    }
}

//! Planned routes: the values that a choreographer sets, and the construction of routes from them.

use std::f64::consts::PI;

use super::{PitchFamily, Route, RouteError, Turnaround};

/// A planned route. Its times are show times in seconds; a [`Route`] has only travels.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum RouteSpec {
    /// An inward spiral, from t = 0 to its centre.
    Spiral(SpiralSpec),
    /// An inward spiral, an S, and an outward spiral.
    Turnaround(TurnaroundSpec),
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
    /// Show time at which the plan begins. The head enters the circle at 0.
    pub start_s: f64,
    /// Show time at which the plan ends.
    pub end_s: f64,
}

impl Default for TurnaroundSpec {
    fn default() -> Self {
        Self { pitch_m: 1.7, turn_diameter_m: 9.0, radius_ratio: 2.0, start_s: -100.0, end_s: 100.0 }
    }
}

impl SpiralSpec {
    /// The spiral, walked from its start to the circle of this diameter about its centre.
    ///
    /// # Errors
    /// A value is out of range, or the spiral starts inside the circle.
    pub fn to_circle(&self, diameter_m: f64) -> Result<Route, RouteError> {
        let spiral = Route::spiral(self.pitch_m, self.start_turns)?;
        let end_travel_m = spiral.travel(-PI * diameter_m.max(0.0) / self.pitch_m);
        spiral.between(0.0, end_travel_m)
    }
}

impl TurnaroundSpec {
    /// The turnaround, walked between the planned times by a head of this speed, in m/s.
    ///
    /// # Errors
    /// The errors of [`Turnaround::new`] and [`Turnaround::between`].
    pub fn turnaround(&self, head_speed_mps: f64) -> Result<Turnaround, RouteError> {
        Turnaround::new(self.pitch_m, self.turn_diameter_m, self.radius_ratio)?
            .between(head_speed_mps * self.start_s, head_speed_mps * self.end_s)
    }
}

impl RouteSpec {
    /// The route for a head of this speed, in m/s.
    ///
    /// # Errors
    /// A value is out of range.
    pub fn build(&self, head_speed_mps: f64) -> Result<Route, RouteError> {
        match self {
            Self::Spiral(spec) => Route::spiral(spec.pitch_m, spec.start_turns),
            Self::Turnaround(spec) => spec.turnaround(head_speed_mps).map(|turnaround| turnaround.route()),
        }
    }

    /// The same route, with its change over the pitch.
    ///
    /// # Errors
    /// A value is out of range.
    pub fn family(&self, head_speed_mps: f64) -> Result<PitchFamily, RouteError> {
        match self {
            Self::Spiral(_) => self.build(head_speed_mps).map(PitchFamily::of_spiral),
            Self::Turnaround(spec) => spec.turnaround(head_speed_mps).map(PitchFamily::of_turnaround),
        }
    }

    /// The planned turnaround, if the route is one.
    pub fn as_turnaround(&self) -> Option<TurnaroundSpec> {
        match self {
            Self::Spiral(_) => None,
            Self::Turnaround(spec) => Some(*spec),
        }
    }

    /// The planned spiral. For a turnaround: a spiral of its pitch with the paper's number of turns at the start.
    pub fn spiral(&self) -> SpiralSpec {
        match self {
            Self::Spiral(spec) => *spec,
            Self::Turnaround(spec) => SpiralSpec { pitch_m: spec.pitch_m, ..SpiralSpec::default() },
        }
    }

    /// Diameter of the circle that contains the S. For a spiral: the diameter of the paper's turning circle.
    pub fn turn_diameter_m(&self) -> f64 {
        self.as_turnaround().unwrap_or_default().turn_diameter_m
    }

    /// Show time at which the plan begins.
    pub fn start_s(&self) -> f64 {
        self.as_turnaround().map_or(0.0, |spec| spec.start_s)
    }

    /// Show time at which the plan ends, if the plan sets one.
    pub fn end_s(&self) -> Option<f64> {
        self.as_turnaround().map(|spec| spec.end_s)
    }

    /// Distance between neighbouring turns, in metres.
    pub fn pitch_m(&self) -> f64 {
        self.spiral().pitch_m
    }

    /// The same plan with another pitch, which is not checked.
    #[must_use]
    pub fn with_pitch(self, pitch_m: f64) -> Self {
        match self {
            Self::Spiral(spec) => Self::Spiral(SpiralSpec { pitch_m, ..spec }),
            Self::Turnaround(spec) => Self::Turnaround(TurnaroundSpec { pitch_m, ..spec }),
        }
    }
}

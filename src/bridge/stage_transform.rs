//! The transform from the bus to the coordinate system of a desk.
//!
//! The bus has x right, y away, z up. The transform has three steps, always in this order:
//!
//! 1. *Rotate*: the dragon is turned about the bus's vertical axis, through its origin, counter-clockwise seen from above.
//! 2. *Offset*: the turned dragon is moved to the right, away and up.
//! 3. *Reorder*: the result is expressed along the desk's axes ([`AxisOrder`]).
//!
//! So a position p becomes A·(R·p + o), and a velocity v becomes A·R·v. A scalar speed is unchanged.
//!
//! *Heading.* A desk's heading is the angle of the board's direction in the desk's horizontal plane: 0 along the first
//! horizontal axis, a quarter turn along the second one. The horizontal components of the direction are its cosine and sine, in
//! any order of axes. A mirroring order therefore changes the heading's sign.
//!
//! *Orientation.* A desk's orientation is the rotation that turns the first horizontal axis into the board's direction, and leaves
//! the board level across. On level ground it is a vector along the vertical axis. Its length is the angle in radians.
//! With the axes' numbers as usual, a rotation by ω turns a small vector r by ω × r.

use std::f64::consts::{PI, TAU};
use std::fmt;
use std::ops::RangeInclusive;
use std::str::FromStr;

use glam::DQuat;

use super::axis_order::AxisOrder;

/// Places poses of the bus in the coordinate system of a desk. See the [module](self) for the formulae.
///
/// ```
/// use bench_dragon::bridge::AxisOrder;
/// use bench_dragon::bridge::stage_transform::StageTransform;
///
/// // A quarter turn puts a bench at 4 m away onto 4 m left; the offset moves it 10 m to the right.
/// let transform = StageTransform::new("10,0,1".parse()?, "90".parse()?, AxisOrder::RIGHT_UP_AWAY);
/// assert_eq!(transform.position_m([0.0, 4.0, 0.0]), [6.0, 1.0, 0.0]);
/// assert_eq!(transform.velocity_mps([0.0, 1.0, 0.0]), [-1.0, 0.0, 0.0]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StageTransform {
    offset_m: [f64; 3],
    /// Sine and cosine of the rotation; `None` without a rotation, so that every bit of a position stays as it is.
    rotation: Option<(f64, f64)>,
    axes: AxisOrder,
    /// Desk heading of a bench with the bus heading 0, in radians.
    heading_of_zero_rad: f64,
}

impl StageTransform {
    /// Returns the transform that rotates, then moves, then reorders the axes.
    pub fn new(offset: StageOffset, rotation: StageRotation, axes: AxisOrder) -> Self {
        let StageRotation { degrees } = rotation;
        Self {
            offset_m: offset.metres,
            rotation: (degrees != 0.0).then(|| sin_cos(degrees)),
            axes,
            heading_of_zero_rad: axes.angle_of_plus_x_rad() + axes.turn_sign() * degrees.to_radians(),
        }
    }

    /// Returns the transform that only reorders the axes.
    pub fn of_axes(axes: AxisOrder) -> Self {
        Self::new(StageOffset::default(), StageRotation::default(), axes)
    }

    /// The desk's axes.
    pub fn axes(&self) -> AxisOrder {
        self.axes
    }

    /// Returns the position on the desk of a position on the bus, both in metres.
    pub fn position_m(&self, position_m: [f64; 3]) -> [f64; 3] {
        let [x, y, z] = self.rotate(position_m);
        let [right, away, up] = self.offset_m;
        self.axes.reorder([plus(x, right), plus(y, away), plus(z, up)])
    }

    /// Returns the velocity on the desk of a velocity on the bus, both in metres per second.
    pub fn velocity_mps(&self, velocity_mps: [f64; 3]) -> [f64; 3] {
        self.axes.reorder(self.rotate(velocity_mps))
    }

    /// Returns the heading on the desk of a heading on the bus, both in radians from −π to π.
    pub fn heading_rad(&self, heading_rad: f64) -> f64 {
        wrapped(plus(self.axes.turn_sign() * heading_rad, self.heading_of_zero_rad))
    }

    /// Returns the rotation vector on the desk, in radians, of a bench with a heading and a pitch on the bus.
    pub fn orientation_rad(&self, heading_rad: f64, pitch_rad: f64) -> [f64; 3] {
        let turn = self.axes.rotation_vector(self.heading_rad(heading_rad));
        if pitch_rad == 0.0 {
            return turn;
        }
        let pitch = DQuat::from_scaled_axis(self.axes.pitch_vector(pitch_rad).into());
        (DQuat::from_scaled_axis(turn.into()) * pitch).to_scaled_axis().into()
    }

    fn rotate(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let Some((sin, cos)) = self.rotation else { return [x, y, z] };
        [x * cos - y * sin, x * sin + y * cos, z]
    }
}

/// The place of the bus's origin on the desk's stage: metres to the right, away and up.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageOffset {
    metres: [f64; 3],
}

/// Error for a text that is not an offset.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "must be metres to the right, away and up, such as 2.5,-4,0, each from {} to {}",
    StageOffset::METRES.start(),
    StageOffset::METRES.end()
)]
pub struct StageOffsetError;

impl StageOffset {
    /// Allowed metres. At 10 km, the 32-bit numbers of the protocols still resolve a millimetre.
    pub const METRES: RangeInclusive<f64> = -10_000.0..=10_000.0;
}

impl FromStr for StageOffset {
    type Err = StageOffsetError;

    fn from_str(text: &str) -> Result<Self, StageOffsetError> {
        let metre = |part: &str| part.parse().ok().filter(|metres| Self::METRES.contains(metres));
        let metres: Option<Vec<f64>> = text.split(',').map(metre).collect();
        let metres = metres.and_then(|metres| metres.try_into().ok()).ok_or(StageOffsetError)?;
        Ok(Self { metres })
    }
}

impl fmt::Display for StageOffset {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.metres.map(|metres| metres.to_string()).join(","))
    }
}

/// A rotation of the dragon about the vertical axis, counter-clockwise seen from above.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StageRotation {
    degrees: f64,
}

/// Error for a text that is not a rotation.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be degrees from {} to {}", StageRotation::DEGREES.start(), StageRotation::DEGREES.end())]
pub struct StageRotationError;

impl StageRotation {
    /// Allowed degrees.
    pub const DEGREES: RangeInclusive<f64> = -360.0..=360.0;
}

impl FromStr for StageRotation {
    type Err = StageRotationError;

    fn from_str(text: &str) -> Result<Self, StageRotationError> {
        let degrees = text.parse().ok().filter(|degrees| Self::DEGREES.contains(degrees));
        degrees.map(|degrees| Self { degrees }).ok_or(StageRotationError)
    }
}

impl fmt::Display for StageRotation {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.degrees, formatter)
    }
}

/// Returns sine and cosine of an angle in degrees. Those of whole quarter turns are exact.
fn sin_cos(degrees: f64) -> (f64, f64) {
    let quarters = (degrees / 90.0).round();
    let (sin, cos) = (degrees - quarters * 90.0).to_radians().sin_cos();
    match quarters.rem_euclid(4.0) {
        0.0 => (sin, cos),
        1.0 => (cos, -sin),
        2.0 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

/// Adds a term. A term of 0 changes no bit, not even the sign of a negative zero.
fn plus(value: f64, term: f64) -> f64 {
    if term == 0.0 { value } else { value + term }
}

/// Returns an angle without whole turns, from −π to π.
fn wrapped(angle_rad: f64) -> f64 {
    if angle_rad.abs() <= PI {
        return angle_rad;
    }
    (angle_rad - TAU * (angle_rad / TAU).round()).clamp(-PI, PI)
}

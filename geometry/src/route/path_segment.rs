//! A segment of a path: a line, an arc or a part of a spiral, wherever it begins.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use glam::DVec2;

use super::capability::ArcLength;
use super::path_error::{MIN_LENGTH_M, PathError};
use super::{CircularArc, Line, Placement, Segment, Spiral, Turn};

/// Allowed lengths of a line, and radii of an arc or a spiral, in metres. A spiral may have one radius of 0.
pub const SEGMENT_M: RangeInclusive<f64> = 1e-6..=100_000.0;
/// Least turn of a spiral, in radians: 0.00001°, however it is rounded. On a smaller one the radius would jump.
const LEAST_SPIRAL_TURN: f64 = 1.7e-7;
/// Largest turn of an arc or a spiral, in radians: 360 000°, however they are rounded.
const MAX_TURN: f64 = 1000.0 * TAU * (1.0 + 1e-12);

/// A segment of a path, wherever it begins.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathSegment {
    /// A straight line.
    Line {
        /// Length in metres.
        length_m: f64,
    },
    /// A circular arc.
    Arc {
        /// Radius in metres.
        radius_m: f64,
        /// Angle by which it turns, in radians; above 0 to the left, below 0 to the right.
        turn: f64,
    },
    /// A part of a spiral, whose radius is linear in the angle. Its centre follows from its beginning.
    Spiral {
        /// Radius at its beginning, in metres.
        start_radius_m: f64,
        /// Radius at its end, in metres.
        end_radius_m: f64,
        /// Angle about the centre from its beginning to its end, in radians; above 0 to the left, below 0 to the right.
        turn: f64,
    },
}

impl PathSegment {
    /// The segment that begins at a placement.
    pub(super) fn segment(&self, begin: &Placement) -> Segment {
        let tangent = DVec2::from_angle(begin.heading);
        match *self {
            Self::Line { length_m } => Segment::Line(Line::from_begin(begin.position, tangent, length_m)),
            Self::Arc { radius_m, turn } => Segment::Arc(arc(begin, radius_m, turn)),
            Self::Spiral { start_radius_m, end_radius_m, turn } if self.is_circular() => {
                Segment::Arc(arc(begin, 0.5 * (start_radius_m + end_radius_m), turn))
            }
            Self::Spiral { start_radius_m, end_radius_m, turn } => {
                let per_radian_m = (end_radius_m - start_radius_m).abs() / turn.abs();
                let [from_angle, to_angle] = [start_radius_m, end_radius_m].map(|radius_m| radius_m / per_radian_m);
                // The direction as the angle of the spiral grows: backwards on the way in.
                let winding = Turn::of(if end_radius_m > start_radius_m { turn } else { -turn });
                let spiral = Spiral::new(TAU * per_radian_m, from_angle, to_angle);
                Segment::Spiral(spiral.from_begin(begin.position, tangent, winding))
            }
        }
    }

    /// Where a segment that begins at a placement ends.
    pub fn end(&self, begin: &Placement) -> Placement {
        let turned = match *self {
            Self::Line { .. } => 0.0,
            Self::Arc { turn, .. } => turn,
            Self::Spiral { turn, .. } if self.is_circular() => turn,
            Self::Spiral { start_radius_m, end_radius_m, turn } => {
                // The angle between spoke and tangent is atan θ, where θ is the angle of the spiral.
                let per_radian_m = (end_radius_m - start_radius_m) / turn.abs();
                let slope = |radius_m: f64| f64::atan2(per_radian_m, radius_m);
                turn + turn.signum() * (slope(start_radius_m) - slope(end_radius_m))
            }
        };
        let segment = self.segment(begin);
        Placement { position: segment.point(segment.span().1).position, heading: begin.heading + turned }
    }

    /// Whether a spiral's radii are so nearly equal that an arc of their mean is more exact: the rounding of a spiral grows
    /// with the number of turns to its centre.
    fn is_circular(&self) -> bool {
        let Self::Spiral { start_radius_m, end_radius_m, turn } = *self else { return false };
        let difference_m = (end_radius_m - start_radius_m).abs();
        difference_m <= 8.0 * (f64::EPSILON * turn.abs()).sqrt() * start_radius_m.max(end_radius_m)
    }

    /// The same segment with a measure changed by a share: 0 is the length or the turn, 1 the radius of an arc or the end
    /// radius of a spiral.
    pub(super) fn with_measure(&self, measure: usize, share: f64) -> Option<Self> {
        let factor = 1.0 + share;
        match (*self, measure) {
            (Self::Line { length_m }, 0) => Some(Self::Line { length_m: length_m * factor }),
            (Self::Arc { radius_m, turn }, 0) => Some(Self::Arc { radius_m, turn: turn * factor }),
            (Self::Arc { radius_m, turn }, 1) => Some(Self::Arc { radius_m: radius_m * factor, turn }),
            (Self::Spiral { start_radius_m, end_radius_m, turn }, 0) => {
                Some(Self::Spiral { start_radius_m, end_radius_m, turn: turn * factor })
            }
            (Self::Spiral { start_radius_m, end_radius_m, turn }, 1) => {
                Some(Self::Spiral { start_radius_m, end_radius_m: end_radius_m * factor, turn })
            }
            _ => None,
        }
    }

    /// Length in metres.
    pub fn length_m(&self) -> f64 {
        let segment = self.segment(&Placement::default());
        let (begin, end) = segment.span();
        segment.arc_m(end) - segment.arc_m(begin)
    }

    /// Checks the numbers of the segment with this number, from 1.
    pub(super) fn check(&self, segment: usize) -> Result<(), PathError> {
        let within = |key, value: f64, allowed: &RangeInclusive<f64>, words| {
            if allowed.contains(&value) {
                Ok(())
            } else {
                Err(PathError::Value { segment, key, value, allowed: words })
            }
        };
        let metres = |key, value| within(key, value, &SEGMENT_M, "from 0.000001 to 100000");
        let turn = |turn: f64| match turn.abs() {
            size if size > 0.0 && size <= MAX_TURN => Ok(()),
            _ => Err(PathError::Value {
                segment,
                key: "turn_deg",
                value: turn.to_degrees(),
                allowed: "from -360000 to 360000, and not 0",
            }),
        };
        match *self {
            Self::Line { length_m } => metres("length_m", length_m)?,
            Self::Arc { radius_m, turn: angle } => {
                metres("radius_m", radius_m)?;
                turn(angle)?;
            }
            Self::Spiral { start_radius_m, end_radius_m, turn: angle } => {
                let to_centre = 0.0..=*SEGMENT_M.end();
                within("start_radius_m", start_radius_m, &to_centre, "from 0 to 100000")?;
                within("end_radius_m", end_radius_m, &to_centre, "from 0 to 100000")?;
                metres("the larger radius", start_radius_m.max(end_radius_m))?;
                turn(angle)?;
                if angle.abs() < LEAST_SPIRAL_TURN {
                    let (key, value) = ("turn_deg", angle.to_degrees());
                    let allowed = "at most -0.00001 or at least 0.00001 for a spiral";
                    return Err(PathError::Value { segment, key, value, allowed });
                }
            }
        }
        let length_m = self.length_m();
        if length_m >= MIN_LENGTH_M { Ok(()) } else { Err(PathError::TooShort { segment, length_m }) }
    }
}

fn arc(begin: &Placement, radius_m: f64, turn: f64) -> CircularArc {
    CircularArc::from_begin(begin.position, DVec2::from_angle(begin.heading), radius_m, turn.abs(), Turn::of(turn))
}

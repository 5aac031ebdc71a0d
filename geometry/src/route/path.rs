//! Paths: routes from a list of lines, arcs and spirals, each of which begins where the one before ends, in its direction.
//!
//! Behind its beginning, where t = 0, a path goes straight back, so that a whole dragon can stand there. A closed path is
//! walked lap after lap. Behind its beginning is then the lap before.

use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use glam::DVec2;

use super::{CircularArc, Line, Placement, Route, RouteError, Segment, Spiral, Turn};

/// Allowed lengths of a line, and radii of an arc or a spiral, in metres. A spiral may have one radius of 0.
pub const SEGMENT_M: RangeInclusive<f64> = 1e-6..=100_000.0;
/// Largest turn of an arc or a spiral, in radians: 360 000°, however they are rounded.
const MAX_TURN: f64 = 1000.0 * TAU * (1.0 + 1e-12);
/// Shortest arc or spiral, in metres.
const MIN_LENGTH_M: f64 = 1e-6;
/// Longest path, in metres.
const MAX_LENGTH_M: f64 = 1_000_000.0;
/// Most segments of a path, all laps included.
const MAX_SEGMENTS: usize = 100_000;
/// Largest gap between the end and the beginning of a closed path, in metres: typed decimals do not close exactly.
const CLOSING_GAP_M: f64 = 1e-3;
/// Largest difference of direction between the end and the beginning of a closed path, in radians.
const CLOSING_TURN: f64 = 1e-4;

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

/// A planned path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathSpec {
    /// The segments in walking order.
    pub segments: Vec<PathSegment>,
    /// Number of laps of a closed path; `None` for an open one.
    pub laps: Option<u32>,
}

/// Reason why a path is invalid. Segments are numbered from 1.
#[derive(Clone, Copy, Debug, thiserror::Error, PartialEq)]
pub enum PathError {
    /// There is no segment.
    #[error("a path needs at least one segment")]
    Empty,
    /// A number of a segment is out of range.
    #[error("segment {segment}: {key} is {}, must be {allowed}", crate::number::Number(*value))]
    Value {
        /// Number of the segment.
        segment: usize,
        /// Key of the configuration.
        key: &'static str,
        /// The value, in the unit of the key.
        value: f64,
        /// Allowed values, in words.
        allowed: &'static str,
    },
    /// A segment is too short.
    #[error("segment {segment} is {} m long, must be at least {MIN_LENGTH_M} m", crate::number::Number(*length_m))]
    TooShort {
        /// Number of the segment.
        segment: usize,
        /// Its length in metres.
        length_m: f64,
    },
    /// The path is too long.
    #[error("the path is longer than {MAX_LENGTH_M} m from segment {segment} on, all laps included")]
    TooLong {
        /// Number of the segment.
        segment: usize,
    },
    /// The path has too many segments.
    #[error(
        "the path has {segments} segments with all laps, and those on which the dragon stands, must have at most {MAX_SEGMENTS}"
    )]
    TooMany {
        /// Number of segments.
        segments: usize,
    },
    /// A closed path does not close.
    #[error(
        "closed: the end is {gap_m:.6} m from the beginning and turned by {turn_deg:.6}°, \
         must be at most {CLOSING_GAP_M} m and {:.6}°",
        CLOSING_TURN.to_degrees()
    )]
    Open {
        /// Distance between the end and the beginning, in metres.
        gap_m: f64,
        /// Angle between the two directions, in degrees.
        turn_deg: f64,
    },
}

impl PathSegment {
    /// The segment that begins at a placement.
    fn segment(&self, begin: &Placement) -> Segment {
        let tangent = DVec2::from_angle(begin.heading);
        let direction = |turn: f64| if turn > 0.0 { Turn::CounterClockwise } else { Turn::Clockwise };
        match *self {
            Self::Line { length_m } => Segment::Line(Line::from_begin(begin.position, tangent, length_m)),
            Self::Arc { radius_m, turn } => Segment::Arc(arc(begin, radius_m, turn)),
            Self::Spiral { start_radius_m, end_radius_m, turn } if start_radius_m == end_radius_m => {
                Segment::Arc(arc(begin, start_radius_m, turn))
            }
            Self::Spiral { start_radius_m, end_radius_m, turn } => {
                let per_radian_m = (end_radius_m - start_radius_m).abs() / turn.abs();
                let [from_angle, to_angle] = [start_radius_m, end_radius_m].map(|radius_m| radius_m / per_radian_m);
                // The direction as the angle of the spiral grows: backwards on the way in.
                let winding = direction(if end_radius_m > start_radius_m { turn } else { -turn });
                let spiral = Spiral::new(TAU * per_radian_m, from_angle, to_angle);
                Segment::Spiral(spiral.from_begin(begin.position, tangent, winding))
            }
        }
    }

    /// Where a segment that begins at a placement ends.
    pub(crate) fn end(&self, begin: &Placement) -> Placement {
        let turned = match *self {
            Self::Line { .. } => 0.0,
            Self::Arc { turn, .. } => turn,
            Self::Spiral { start_radius_m, end_radius_m, turn } => {
                // The angle between spoke and tangent is atan θ, where θ is the angle of the spiral.
                let per_radian_m = (end_radius_m - start_radius_m).abs() / turn.abs();
                let slope =
                    |radius_m: f64| f64::atan2(per_radian_m * (end_radius_m - start_radius_m).signum(), radius_m);
                if per_radian_m == 0.0 {
                    turn
                } else {
                    turn + turn.signum() * (slope(start_radius_m) - slope(end_radius_m))
                }
            }
        };
        let segment = self.segment(begin);
        Placement { position: segment.point(segment.span().1).position, heading: begin.heading + turned }
    }

    /// Length in metres.
    pub fn length_m(&self) -> f64 {
        let segment = self.segment(&Placement::default());
        let (begin, end) = segment.span();
        segment.arc_m(end) - segment.arc_m(begin)
    }

    /// Checks the numbers of the segment with this number, from 1.
    fn check(&self, segment: usize) -> Result<(), PathError> {
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
            }
        }
        let length_m = self.length_m();
        if length_m >= MIN_LENGTH_M { Ok(()) } else { Err(PathError::TooShort { segment, length_m }) }
    }
}

fn arc(begin: &Placement, radius_m: f64, turn: f64) -> CircularArc {
    let direction = if turn > 0.0 { Turn::CounterClockwise } else { Turn::Clockwise };
    CircularArc::from_begin(begin.position, DVec2::from_angle(begin.heading), radius_m, turn.abs(), direction)
}

impl PathSpec {
    /// Length of the path in metres; of a closed path: of one lap.
    pub fn lap_m(&self) -> f64 {
        self.segments.iter().map(PathSegment::length_m).sum()
    }

    /// The route of the path from a placement. Behind the beginning it has room for a dragon of this length.
    ///
    /// # Errors
    /// A number is out of range, the path is too long, or a closed path does not close.
    pub(super) fn route(&self, begin: &Placement, dragon_m: f64) -> Result<Route, RouteError> {
        let lap_m = self.check()?;
        let laps_behind = if self.laps.is_some() { (dragon_m / lap_m).ceil() as usize } else { 0 };
        let laps = laps_behind + self.laps.map_or(1, |laps| laps as usize);
        let count = laps.saturating_mul(self.segments.len());
        if count > MAX_SEGMENTS {
            return Err(PathError::TooMany { segments: count }.into());
        }
        let mut at = *begin;
        for _ in 0..laps_behind {
            at = at.after(&self.lap().inverse());
        }
        let mut segments = Vec::with_capacity(count + 1);
        segments.push(Segment::Line(Line::up_to(at.position, DVec2::from_angle(at.heading))));
        for _ in 0..laps {
            for segment in &self.segments {
                segments.push(segment.segment(&at));
                at = segment.end(&at);
            }
        }
        let (before_m, after_m) = (laps_behind as f64 * lap_m, (laps - laps_behind) as f64 * lap_m);
        Route::new(&segments, -before_m, [0.0, after_m])
    }

    /// Where a lap from the origin in the direction of +x ends.
    fn lap(&self) -> Placement {
        self.segments.iter().fold(Placement::default(), |at, segment| segment.end(&at))
    }

    /// Checks the path. Returns its length in metres, without laps.
    fn check(&self) -> Result<f64, PathError> {
        if self.segments.is_empty() {
            return Err(PathError::Empty);
        }
        let laps = self.laps.unwrap_or(1);
        let mut length_m = 0.0;
        for (number, segment) in (1..).zip(&self.segments) {
            segment.check(number)?;
            length_m += segment.length_m();
            if length_m * f64::from(laps) > MAX_LENGTH_M {
                return Err(PathError::TooLong { segment: number });
            }
        }
        if self.laps.is_some() {
            let lap = self.lap();
            let (gap_m, turn) = (lap.position.length(), (lap.heading / TAU - (lap.heading / TAU).round()) * TAU);
            if gap_m > CLOSING_GAP_M || turn.abs() > CLOSING_TURN {
                return Err(PathError::Open { gap_m, turn_deg: turn.to_degrees() });
            }
        }
        Ok(length_m)
    }
}

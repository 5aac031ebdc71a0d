//! Paths: routes from a list of lines, arcs and spirals, each of which begins where the one before ends, in its direction.
//!
//! Behind its beginning, where t = 0, a path goes straight back, so that a whole dragon can stand there. A closed path is
//! walked lap after lap, each in the same place. Behind its beginning are then the laps before.
//!
//! Typed decimals do not close exactly. So the measures of a closed path are changed, each by the same small share if possible,
//! until its end is its beginning up to rounding: Newton's method on the least squares of the shares.

use std::borrow::Cow;
use std::f64::consts::TAU;
use std::ops::RangeInclusive;

use glam::{DMat3, DVec2, DVec3};

use super::capability::ArcLength;
use super::{CircularArc, Line, Placement, Route, RouteError, Segment, Spiral, Turn};

/// Allowed lengths of a line, and radii of an arc or a spiral, in metres. A spiral may have one radius of 0.
pub const SEGMENT_M: RangeInclusive<f64> = 1e-6..=100_000.0;
/// Least turn of a spiral, in radians: 0.00001°, however it is rounded. On a smaller one the radius would jump.
const LEAST_SPIRAL_TURN: f64 = 1.7e-7;
/// Largest turn of an arc or a spiral, in radians: 360 000°, however they are rounded.
const MAX_TURN: f64 = 1000.0 * TAU * (1.0 + 1e-12);
/// Shortest arc or spiral, in metres.
const MIN_LENGTH_M: f64 = 1e-6;
/// Longest path, in metres.
const MAX_LENGTH_M: f64 = 1_000_000.0;
/// Most segments of a path, all laps included.
const MAX_SEGMENTS: usize = 100_000;
/// Largest gap between the end and the beginning of a closed path as planned, in metres.
const CLOSING_GAP_M: f64 = 1e-3;
/// Largest difference of direction between the end and the beginning of a closed path as planned, in radians.
const CLOSING_TURN: f64 = 1e-4;
/// Gap at which a path is closed, as a share of its extent: a few times its rounding.
const CLOSED_PER_EXTENT: f64 = 1e-12;
/// Largest gap of a path that was closed, in metres, and largest share by which that changes its length.
const CLOSED_M: f64 = 1e-9;
const CLOSING_SHARE: f64 = 0.01;
/// Most steps to close a path. Three are usual.
const MAX_CLOSING_STEPS: usize = 20;
/// Change of a measure from which its effect is computed, as a share.
const CLOSING_LOOK: f64 = 1e-6;
/// Damping of the least squares, as a share of their sum: a path may have too few measures.
const DAMPING: f64 = 1e-12;
/// Room on the laps behind the beginning, in lengths of the stretched dragon: a bent dragon covers more.
const ROOM_PER_LENGTH: f64 = 2.0;

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
    /// No small change of the measures of a closed path closes it.
    #[error("closed: no small change of lengths, radii and angles joins the end to the beginning, {gap_m:.6} m away")]
    Unclosable {
        /// Distance between the end and the beginning as planned, in metres.
        gap_m: f64,
    },
}

impl PathSegment {
    /// The segment that begins at a placement.
    fn segment(&self, begin: &Placement) -> Segment {
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
    pub(crate) fn end(&self, begin: &Placement) -> Placement {
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
    fn with_measure(&self, measure: usize, share: f64) -> Option<Self> {
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

impl PathSpec {
    /// Length of the path in metres; of a closed path: of one lap.
    pub fn lap_m(&self) -> f64 {
        self.closed().iter().map(PathSegment::length_m).sum()
    }

    /// The route of the path from a placement, for a dragon of this length that starts at this travel. On a closed path, the
    /// dragon stands on the laps behind the beginning, and nowhere else.
    ///
    /// # Errors
    /// A number is out of range, the path is too long, or a closed path does not close.
    pub(super) fn route(&self, begin: &Placement, dragon_m: f64, start_m: f64) -> Result<Route, RouteError> {
        self.check()?;
        let lap = self.closed();
        self.check_closed(&lap)?;
        let lap_m: f64 = lap.iter().map(PathSegment::length_m).sum();
        let behind_m = ROOM_PER_LENGTH * dragon_m + (-start_m).max(0.0);
        let laps_behind = if self.laps.is_some() { (behind_m / lap_m).ceil() as usize } else { 0 };
        let laps = laps_behind.saturating_add(self.laps.map_or(1, |laps| laps as usize));
        let count = laps.saturating_mul(lap.len());
        if count > MAX_SEGMENTS {
            return Err(PathError::TooMany { segments: count }.into());
        }
        let placed = placements(begin, &lap);
        let mut segments = Vec::with_capacity(count + 1);
        segments.push(Segment::Line(Line::up_to(begin.position, DVec2::from_angle(begin.heading))));
        for _ in 0..laps {
            segments.extend(lap.iter().zip(&placed).map(|(segment, at)| segment.segment(at)));
        }
        let (before_m, after_m) = (laps_behind as f64 * lap_m, (laps - laps_behind) as f64 * lap_m);
        let route = Route::new(&segments, -before_m, [0.0, after_m])?;
        Ok(if self.laps.is_some() { route.standing_from(-before_m) } else { route })
    }

    /// The segments; those of a closed path with their measures changed so that it closes.
    fn closed(&self) -> Cow<'_, [PathSegment]> {
        let (mut segments, begin) = (Cow::Borrowed(&self.segments[..]), Placement::default());
        if self.laps.is_none() {
            return segments;
        }
        for _ in 0..MAX_CLOSING_STEPS {
            let placed = placements(&begin, &segments);
            let end = placed[segments.len()];
            let extent_m = placed.iter().map(|at| at.position.length()).fold(1.0, f64::max);
            let gap = end.position.extend(extent_m * whole_turns_off(end.heading));
            if gap.length() <= CLOSED_PER_EXTENT * extent_m {
                break;
            }
            let effects = effects(&segments, &placed, extent_m);
            let squares = effects.iter().map(|effect| outer(effect.end)).sum::<DMat3>();
            let damping = DAMPING * (squares.x_axis.x + squares.y_axis.y + squares.z_axis.z);
            let pull = -((squares + DMat3::from_diagonal(DVec3::splat(damping))).inverse() * gap);
            for Effect { segment, measure, end } in effects {
                let changed = segments[segment].with_measure(measure, end.dot(pull));
                segments.to_mut()[segment] = changed.expect("the measure has an effect");
            }
        }
        segments
    }

    /// Checks that the changed segments of a closed path close it, and are nearly as long as planned.
    fn check_closed(&self, lap: &[PathSegment]) -> Result<(), PathError> {
        let end = placements(&Placement::default(), lap)[lap.len()];
        let [lap_m, planned_m] = [lap, &self.segments].map(|all| all.iter().map(PathSegment::length_m).sum::<f64>());
        let is_closed = end.position.length() <= CLOSED_M && (lap_m - planned_m).abs() <= CLOSING_SHARE * planned_m;
        if self.laps.is_none() || is_closed {
            return Ok(());
        }
        let planned = placements(&Placement::default(), &self.segments)[self.segments.len()];
        Err(PathError::Unclosable { gap_m: planned.position.length() })
    }

    /// Checks the path.
    fn check(&self) -> Result<(), PathError> {
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
            let end = placements(&Placement::default(), &self.segments)[self.segments.len()];
            let (gap_m, turn) = (end.position.length(), whole_turns_off(end.heading));
            if gap_m > CLOSING_GAP_M || turn.abs() > CLOSING_TURN {
                return Err(PathError::Open { gap_m, turn_deg: turn.to_degrees() });
            }
        }
        Ok(())
    }
}

/// Where each segment begins, and where the last one ends.
fn placements(begin: &Placement, segments: &[PathSegment]) -> Vec<Placement> {
    let mut placed = vec![*begin];
    for (number, segment) in segments.iter().enumerate() {
        placed.push(segment.end(&placed[number]));
    }
    placed
}

/// The angle by which a heading differs from a whole number of turns.
fn whole_turns_off(heading: f64) -> f64 {
    (heading / TAU - (heading / TAU).round()) * TAU
}

/// How a measure of a segment moves the end of the path.
struct Effect {
    segment: usize,
    measure: usize,
    /// Metres by which the end moves, and metres of turn at the path's extent, per share of the measure.
    end: DVec3,
}

/// The effects of all measures.
fn effects(segments: &[PathSegment], placed: &[Placement], extent_m: f64) -> Vec<Effect> {
    let path_end = placed[segments.len()].position;
    let effect = |segment: usize, measure: usize| {
        let changed = segments[segment].with_measure(measure, CLOSING_LOOK)?.end(&placed[segment]);
        let (moved, turned) =
            (changed.position - placed[segment + 1].position, changed.heading - placed[segment + 1].heading);
        let swung = turned * (path_end - placed[segment + 1].position).perp();
        Some(Effect { segment, measure, end: (moved + swung).extend(extent_m * turned) / CLOSING_LOOK })
    };
    (0..segments.len())
        .flat_map(|segment| [0, 1].map(|measure| (segment, measure)))
        .filter_map(|(i, k)| effect(i, k))
        .collect()
}

fn outer(vector: DVec3) -> DMat3 {
    DMat3::from_cols(vector * vector.x, vector * vector.y, vector * vector.z)
}

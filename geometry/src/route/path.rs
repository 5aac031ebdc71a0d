//! Paths: routes from a list of lines, arcs and spirals, each of which begins where the one before ends, in its direction.
//!
//! Behind its beginning, where t = 0, a path goes straight back, so that a whole dragon can stand there. A closed path is
//! walked lap after lap, each in the same place. Behind its beginning are then the laps before.
//!
//! Typed decimals do not close exactly. So the measures of a closed path are changed, each by the same small share if possible,
//! until its end is its beginning up to rounding: Newton's method on the least squares of the shares.

use std::borrow::Cow;
use std::f64::consts::TAU;

use glam::{DMat3, DVec2, DVec3};

use super::path_error::{CLOSING_GAP_M, CLOSING_TURN, MAX_LENGTH_M, MAX_SEGMENTS, PathError};
use super::path_segment::PathSegment;
use super::{Line, Placement, Route, RouteError, Segment};

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

/// A planned path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathSpec {
    /// The segments in walking order.
    pub segments: Vec<PathSegment>,
    /// Number of laps of a closed path; `None` for an open one.
    pub laps: Option<u32>,
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

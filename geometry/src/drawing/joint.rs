//! The joints of a drawing: smooth, a sample of a smooth curve, or a corner.

use std::f64::consts::PI;

use glam::DVec2;

use super::part::{BEZIER, Part, SIMPLIFIED};
use super::{DrawingError, FitSettings, Piece};

/// Largest angle between two pieces that is only rounding, in radians: it moves the end of a path of 1 km by 1 µm.
const SMOOTH: f64 = 1e-9;
/// Largest angle between two edges of a sampled curve.
const SAMPLED: f64 = 0.8 * PI;
/// Largest difference of a corner's angle from half a turn at which the path turns back on itself, in radians: an arc of 1 cm
/// would replace 20 km on each side.
const BACK: f64 = 1e-6;
/// Smallest radius of the arc that replaces a slight kink within the tolerance, in metres, unless corners have a radius. Every
/// dragon can walk it.
const KINK_RADIUS_M: f64 = 10.0;
/// Greatest radius of an arc, in metres.
const MAX_RADIUS_M: f64 = 1e5;
/// Share of the tolerance that an arc in place of a slight kink uses.
const KINK: f64 = 0.5;

/// A joint whose two directions differ.
#[derive(Clone, Copy)]
pub(super) struct Corner {
    pub(super) at: DVec2,
    /// Angle by which the drawing turns, above 0 to the left.
    pub(super) turn: f64,
    /// Radius of the arc that replaces it.
    pub(super) radius_m: f64,
    /// Whether it is a corner to round. Otherwise the arc stays within the tolerance.
    pub(super) is_rounded: bool,
}

#[derive(Clone, Copy)]
pub(super) enum Joint {
    /// The directions are the same.
    Smooth,
    /// A sample of a smooth curve. The edges are followed up to this distance from it.
    Sample {
        room_m: f64,
    },
    Corner(Corner),
}

/// Classifies the joint of two parts.
///
/// # Errors
/// The path turns back on itself, or it is a corner, and corners have no radius.
pub(super) fn joint(
    before: &Part,
    after: &Part,
    settings: &FitSettings,
    tolerance_m: f64,
) -> Result<Joint, DrawingError> {
    let (at, turn) = (after.piece.begin(), before.end_tangent.angle_to(after.begin_tangent));
    let angle = turn.abs();
    let has_bezier = [before, after].iter().any(|part| matches!(part.piece, Piece::Bezier(_)));
    if angle <= if has_bezier { BEZIER } else { SMOOTH } {
        return Ok(Joint::Smooth);
    }
    let edges_m = before.line_m().zip(after.line_m());
    if let Some(room_m) = edges_m.map(|(before_m, after_m)| 0.5 * before_m.min(after_m)) {
        // The arc from the middle of an edge to the other edge is this far from the joint.
        if angle <= SAMPLED && room_m * (0.25 * angle).tan() <= (1.0 - 1.2 * SIMPLIFIED) * tolerance_m {
            return Ok(Joint::Sample { room_m });
        }
    }
    let kink_radius_m = KINK * tolerance_m / (1.0 / (0.5 * angle).cos() - 1.0);
    if kink_radius_m >= settings.corner_radius_m.unwrap_or(KINK_RADIUS_M) {
        let room_m = 0.45 * before.piece.extent_m().min(after.piece.extent_m());
        let radius_m = kink_radius_m.min(room_m / (0.5 * angle).tan()).min(MAX_RADIUS_M);
        return Ok(Joint::Corner(Corner { at, turn, radius_m, is_rounded: false }));
    }
    if PI - angle <= BACK {
        return Err(DrawingError::TurnsBack { at });
    }
    match settings.corner_radius_m {
        Some(radius_m) => Ok(Joint::Corner(Corner { at, turn, radius_m, is_rounded: true })),
        None => Err(DrawingError::Corner { at, turn: angle }),
    }
}

/// Removes a last line up to `gap_m` long that makes a corner with a curve. It joins ends that are apart by their rounded
/// decimals, in any direction.
pub(super) fn drop_closing_remainder(
    parts: &mut Vec<Part>,
    gap_m: f64,
    joint: impl Fn(&Part, &Part) -> Result<Joint, DrawingError>,
) {
    let [first, .., before, last] = &parts[..] else { return };
    let is_corner = |before: &Part, after: &Part| {
        let is_curved = [before, after].iter().any(|part| part.line_m().is_none());
        is_curved
            && !matches!(joint(before, after), Ok(Joint::Smooth | Joint::Corner(Corner { is_rounded: false, .. })))
    };
    let is_short = last.line_m().is_some_and(|length_m| length_m <= gap_m);
    if is_short && (is_corner(before, last) || is_corner(last, first)) {
        parts.pop();
    }
}

//! Smooth curves through points that are further apart than a polyline within the tolerance would need.

use std::f64::consts::PI;

use glam::DVec2;

use super::{Bezier, Drawing, Piece};

/// Largest angle between two edges at a sample of a smooth curve: 30°.
const SAMPLE_TURN: f64 = PI / 6.0;
/// Neighbouring edges of a curve are at most this many times as long as each other. A longer one is straight.
const UNEVEN: f64 = 3.0;

/// The same drawing with smooth curves in place of the edges of sampled curves.
///
/// A chain of edges that turns by at most [`SAMPLE_TURN`] at each point is a sampled curve if arcs from edge to edge would be
/// further than the tolerance from some point. It becomes a cubic Bézier curve an edge. The direction at a point is that of the
/// circle through it and its neighbours. Other pieces stay as they are.
pub(super) fn smoothed(drawing: &Drawing, tolerance_m: f64) -> Drawing {
    let mut pieces = Vec::with_capacity(drawing.pieces.len());
    let mut chain: Vec<DVec2> = vec![];
    for piece in &drawing.pieces {
        let Piece::Line { from, to } = *piece else {
            finish(&mut chain, tolerance_m, &mut pieces);
            pieces.push(piece.clone());
            continue;
        };
        if from == to {
            continue;
        }
        let continues = match chain[..] {
            [.., before, last] => last == from && (last - before).angle_to(to - from).abs() <= SAMPLE_TURN,
            _ => false,
        };
        if !continues {
            finish(&mut chain, tolerance_m, &mut pieces);
            chain.push(from);
        }
        chain.push(to);
    }
    finish(&mut chain, tolerance_m, &mut pieces);
    Drawing { pieces, is_closed: drawing.is_closed }
}

/// Adds the edges of a chain, or the curve through its points.
fn finish(chain: &mut Vec<DVec2>, tolerance_m: f64, pieces: &mut Vec<Piece>) {
    let points = std::mem::take(chain);
    let is_coarse = |triple: &[DVec2]| {
        let [before, after] = [triple[1] - triple[0], triple[2] - triple[1]];
        let room_m = 0.5 * before.length().min(after.length());
        room_m * (0.25 * before.angle_to(after).abs()).tan() > 0.7 * tolerance_m
    };
    if !points.windows(3).any(is_coarse) {
        pieces.extend(Drawing::polyline(&points, false).pieces);
        return;
    }
    let tangents = tangents(&points);
    for (ends, tangents) in points.windows(2).zip(tangents.windows(2)) {
        let (chord, [from, to]) = (ends[1] - ends[0], [ends[0], ends[1]]);
        if chord.perp_dot(tangents[0]) == 0.0 && chord.perp_dot(tangents[1]) == 0.0 {
            pieces.push(Piece::Line { from, to });
            continue;
        }
        // For an arc this is its usual approximation: handles of 4/3·r·tan(a/4) for a turn of a.
        let half = 0.5 * (chord.angle_to(tangents[0]).abs() + chord.angle_to(tangents[1]).abs());
        let handle_m = chord.length() * 2.0 / 3.0 / (1.0 + half.cos());
        let controls = [from + handle_m * tangents[0], to - handle_m * tangents[1]];
        pieces.push(Piece::Bezier(Bezier::new(vec![from, controls[0], controls[1], to])));
    }
}

/// Directions at the points of a curve.
fn tangents(points: &[DVec2]) -> Vec<DVec2> {
    let edge = |i: usize| points[i + 1] - points[i];
    let count = points.len();
    let inner = |i: usize| {
        let [before, after] = [edge(i - 1), edge(i)];
        let [before_m, after_m] = [before.length(), after.length()];
        // The angle between a chord of a circle and its tangent grows with the chord.
        let share = match before_m / after_m {
            ratio if ratio > UNEVEN => 0.0,
            ratio if ratio < 1.0 / UNEVEN => 1.0,
            _ => before_m / (before_m + after_m),
        };
        DVec2::from_angle(share * before.angle_to(after)).rotate(before.normalize())
    };
    // At an end the arc over the edge is symmetrical.
    let mirrored = |edge: DVec2, tangent: DVec2| {
        let chord = edge.normalize();
        2.0 * chord.dot(tangent) * chord - tangent
    };
    let mut tangents: Vec<DVec2> = (1..count - 1).map(inner).collect();
    let (first, last) = (tangents[0], tangents[tangents.len() - 1]);
    tangents.insert(0, mirrored(edge(0), first));
    tangents.push(mirrored(edge(count - 2), last));
    if points[0] == points[count - 1] {
        let both = tangents[0] + tangents[count - 1];
        if tangents[0].angle_to(tangents[count - 1]).abs() <= SAMPLE_TURN {
            (tangents[0], tangents[count - 1]) = (both.normalize(), both.normalize());
        }
    }
    tangents
}

//! The parts of a drawing: its pieces, without those of no length, where polylines have no more points than they need.

use std::ops::Range;

use glam::DVec2;

use super::biarc::bounded;
use super::element::Element;
use super::simplify::kept_points;
use super::{Drawing, DrawingError, MAX_COORDINATE_M, Piece};

/// Largest angle between a Bézier curve and its neighbour that is no corner. Drawing programs write control points with few decimals.
pub(super) const BEZIER: f64 = 1e-3;
/// Share of the tolerance for points that polylines lose.
pub(super) const SIMPLIFIED: f64 = 0.25;
/// Largest gap between two pieces, as a share of the tolerance.
pub(super) const GAP: f64 = 0.1;
/// Shortest piece, in metres, for coordinates of 1 m.
const SHORTEST_M: f64 = 1e-10;

/// A piece, and what of the drawing it stands for.
#[derive(Clone)]
pub(super) struct Part {
    pub(super) piece: Piece,
    /// Numbers of pieces.
    pub(super) sources: Range<usize>,
    pub(super) begin_tangent: DVec2,
    pub(super) end_tangent: DVec2,
}

impl Part {
    /// A piece that stands for these pieces of the drawing; `None` without a length.
    pub(super) fn new(piece: Piece, sources: Range<usize>) -> Option<Self> {
        let (begin_tangent, end_tangent) = (piece.begin_tangent()?, piece.end_tangent()?);
        Some(Self { piece, sources, begin_tangent, end_tangent })
    }

    /// Length of a line; `None` for another piece.
    pub(super) fn line_m(&self) -> Option<f64> {
        if let Piece::Line { from, to } = self.piece { Some(from.distance(to)) } else { None }
    }

    /// A line or an arc as elements.
    pub(super) fn elements(&self) -> impl Iterator<Item = Element> {
        let element = match &self.piece {
            Piece::Arc { radius_m, turn, .. } => Element {
                begin: self.piece.begin(),
                tangent: self.begin_tangent,
                curvature: turn.signum() / radius_m,
                length_m: radius_m * turn.abs(),
            },
            piece => Element::line(piece.begin(), piece.end()),
        };
        element.parts().flat_map(|part| bounded(&part)).flatten()
    }
}

/// The pieces that have a length.
pub(super) fn checked(drawing: &Drawing, tolerance_m: f64) -> Result<Vec<Part>, DrawingError> {
    let mut parts: Vec<Part> = Vec::with_capacity(drawing.pieces.len());
    for (number, piece) in drawing.pieces.iter().enumerate() {
        if let Some(value_m) = outlying_m(piece) {
            return Err(DrawingError::Coordinate { part: number + 1, value_m, limit_m: MAX_COORDINATE_M });
        }
        if piece.extent_m() <= SHORTEST_M * (1.0 + piece.begin().length()) {
            continue;
        }
        let Some(part) = Part::new(piece.clone(), number..number + 1) else { continue };
        if let Some(last) = parts.last() {
            let gap_m = last.piece.end().distance(piece.begin());
            if gap_m > GAP * tolerance_m {
                return Err(DrawingError::Gap { at: last.piece.end(), gap_m });
            }
        }
        parts.push(part);
    }
    let (Some(first), Some(last)) = (parts.first(), parts.last()) else { return Err(DrawingError::Empty) };
    let (gap_m, limit_m) = (last.piece.end().distance(first.piece.begin()), GAP * tolerance_m);
    if drawing.is_closed && gap_m > limit_m {
        return Err(DrawingError::Open { at: last.piece.end(), gap_m, limit_m });
    }
    Ok(parts)
}

/// A coordinate or the extent of a piece that is not a number or too large.
fn outlying_m(piece: &Piece) -> Option<f64> {
    let ([begin, end], extent_m) = ([piece.begin(), piece.end()], piece.extent_m());
    let mut values_m = [begin.x, begin.y, end.x, end.y, extent_m].into_iter();
    let outlying = values_m.find(|value_m| value_m.is_nan() || value_m.abs() > MAX_COORDINATE_M);
    outlying.or((!piece.is_finite()).then_some(f64::NAN))
}

/// The same parts, where lines in a row are fewer. A line that continues a curve keeps its direction.
pub(super) fn simplified(parts: &[Part], tolerance_m: f64) -> Vec<Part> {
    let continues = |before: &Part, after: &Part| before.end_tangent.distance(after.begin_tangent) < BEZIER;
    let mut fewer: Vec<Part> = vec![];
    let mut at = 0;
    while at < parts.len() {
        let count = parts[at..].iter().take_while(|part| part.line_m().is_some()).count();
        let (mut from, mut to) = (at, at + count);
        at = (at + count).max(at + 1);
        if count == 0 {
            fewer.push(parts[from].clone());
            continue;
        }
        if fewer.last().is_some_and(|before| continues(before, &parts[from])) {
            fewer.push(parts[from].clone());
            from += 1;
        }
        let last = parts.get(to).is_some_and(|after| from < to && continues(&parts[to - 1], after));
        to -= usize::from(last);
        if from < to {
            merge(&parts[from..to], tolerance_m, &mut fewer);
        }
        if last {
            fewer.push(parts[to].clone());
        }
    }
    fewer
}

/// Adds lines in a row, but without the points that are near the lines between the others.
fn merge(lines: &[Part], tolerance_m: f64, fewer: &mut Vec<Part>) {
    let mut points = vec![lines[0].piece.begin()];
    points.extend(lines.iter().map(|line| line.piece.end()));
    for pair in kept_points(&points, tolerance_m).windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let sources = lines[from].sources.start..lines[to - 1].sources.end;
        fewer.extend(Part::new(Piece::Line { from: points[from], to: points[to] }, sources));
    }
}

/// Divides the first part in its middle, and begins there: a closed sampled curve has a direction in the middle of an edge.
pub(super) fn begin_inside_first(parts: &mut Vec<Part>) {
    let first = parts.remove(0);
    let (from, to) = (first.piece.begin(), first.piece.end());
    let middle = from.midpoint(to);
    parts.splice(0..0, Part::new(Piece::Line { from: middle, to }, first.sources.clone()));
    parts.extend(Part::new(Piece::Line { from, to: middle }, first.sources));
}

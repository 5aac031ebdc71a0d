//! A drawing as runs: chains of lines and arcs with common tangents, which meet in corners.

use std::f64::consts::PI;
use std::mem::take;
use std::ops::Range;

use glam::DVec2;

use super::arc_spline::Stretch;
use super::biarc::bounded;
use super::curve::CurvePoint;
use super::element::Element;
use super::simplify::kept_points;
use super::{Bezier, Drawing, DrawingError, FitSettings, MAX_COORDINATE_M, Piece};

/// Largest angle between two pieces that is only rounding, in radians: it moves the end of a path of 1 km by 1 µm.
const SMOOTH: f64 = 1e-9;
/// Largest angle between a Bézier curve and its neighbour that is no corner. Drawing programs write control points with few decimals.
const BEZIER: f64 = 1e-3;
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
/// Share of the tolerance for points that polylines lose.
const SIMPLIFIED: f64 = 0.25;
/// Share of the tolerance for the outline of Bézier curves.
const OUTLINE: f64 = 0.04;
/// Share of the tolerance by which the points of a Bézier curve at which elements may begin leave it.
const NODES: f64 = 0.25;
/// Share of the tolerance that an arc in place of a slight kink uses.
const KINK: f64 = 0.5;
/// Largest gap between two pieces, as a share of the tolerance.
const GAP: f64 = 0.1;
/// Shortest piece, in metres, for coordinates of 1 m.
const SHORTEST_M: f64 = 1e-10;
/// Shortest distance of two nodes of an edge, relative to its length.
const SHORTEST_NODE: f64 = 1e-9;

/// A drawing as runs.
pub(super) struct Runs {
    pub(super) list: Vec<Run>,
    /// The corner behind each run; an open drawing has none behind its last.
    pub(super) corners: Vec<Corner>,
}

/// Elements with common tangents.
pub(super) struct Run {
    pub(super) elements: Vec<Element>,
    /// Numbers of the pieces that they follow.
    pub(super) sources: Vec<Range<usize>>,
}

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

/// A piece, and what of the drawing it stands for.
#[derive(Clone)]
struct Part {
    piece: Piece,
    /// Numbers of pieces.
    sources: Range<usize>,
    begin_tangent: DVec2,
    end_tangent: DVec2,
}

#[derive(Clone, Copy)]
enum Joint {
    /// The directions are the same.
    Smooth,
    /// A sample of a smooth curve. The edges are followed up to this distance from it.
    Sample {
        room_m: f64,
    },
    Corner(Corner),
}

impl Runs {
    /// The runs of a drawing. Only a share of the tolerance is used.
    pub(super) fn new(drawing: &Drawing, settings: &FitSettings, share: f64) -> Result<Self, DrawingError> {
        let tolerance_m = share * settings.tolerance_m;
        let joint = |before: &Part, after: &Part| joint(before, after, settings, tolerance_m);
        let mut checked = checked(drawing, settings.tolerance_m)?;
        if drawing.is_closed {
            drop_closing_remainder(&mut checked, GAP * settings.tolerance_m, joint);
        }
        let mut parts = simplified(&checked, SIMPLIFIED * tolerance_m);
        let mut closing = None;
        if drawing.is_closed {
            let joint = joint(parts.last().expect("a part"), &parts[0])?;
            if matches!(joint, Joint::Sample { .. }) {
                begin_inside_first(&mut parts);
                closing = Some(Joint::Smooth);
            } else {
                closing = Some(joint);
            }
        }
        let mut joints = Vec::with_capacity(parts.len());
        for pair in parts.windows(2) {
            joints.push(joint(&pair[0], &pair[1])?);
        }
        Builder::new(&parts, &joints, closing, tolerance_m).build()
    }

    /// Whether the last run ends in a slight kink, whose arc stays within the tolerance. For a closed drawing this is its seam.
    pub(super) fn ends_in_kink(&self) -> bool {
        self.corners.len() == self.list.len() && self.corners.last().is_some_and(|corner| !corner.is_rounded)
    }
}

/// The pieces that have a length.
fn checked(drawing: &Drawing, tolerance_m: f64) -> Result<Vec<Part>, DrawingError> {
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

/// Removes a last line up to `gap_m` long that makes a corner with a curve. It joins ends that are apart by their rounded
/// decimals, in any direction.
fn drop_closing_remainder(
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

/// A coordinate or the extent of a piece that is not a number or too large.
fn outlying_m(piece: &Piece) -> Option<f64> {
    let ([begin, end], extent_m) = ([piece.begin(), piece.end()], piece.extent_m());
    let mut values_m = [begin.x, begin.y, end.x, end.y, extent_m].into_iter();
    let outlying = values_m.find(|value_m| value_m.is_nan() || value_m.abs() > MAX_COORDINATE_M);
    outlying.or((!piece.is_finite()).then_some(f64::NAN))
}

/// The same parts, where lines in a row are fewer. A line that continues a curve keeps its direction.
fn simplified(parts: &[Part], tolerance_m: f64) -> Vec<Part> {
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
fn begin_inside_first(parts: &mut Vec<Part>) {
    let first = parts.remove(0);
    let (from, to) = (first.piece.begin(), first.piece.end());
    let middle = from.midpoint(to);
    parts.splice(0..0, Part::new(Piece::Line { from: middle, to }, first.sources.clone()));
    parts.extend(Part::new(Piece::Line { from, to: middle }, first.sources));
}

/// Classifies the joint of two parts.
///
/// # Errors
/// The path turns back on itself, or it is a corner, and corners have no radius.
fn joint(before: &Part, after: &Part, settings: &FitSettings, tolerance_m: f64) -> Result<Joint, DrawingError> {
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

impl Part {
    /// A piece that stands for these pieces of the drawing; `None` without a length.
    fn new(piece: Piece, sources: Range<usize>) -> Option<Self> {
        let (begin_tangent, end_tangent) = (piece.begin_tangent()?, piece.end_tangent()?);
        Some(Self { piece, sources, begin_tangent, end_tangent })
    }

    /// Length of a line; `None` for another piece.
    fn line_m(&self) -> Option<f64> {
        if let Piece::Line { from, to } = self.piece { Some(from.distance(to)) } else { None }
    }

    /// A line or an arc as elements.
    fn elements(&self) -> impl Iterator<Item = Element> {
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

/// Builds runs part by part.
struct Builder<'a> {
    parts: &'a [Part],
    joints: &'a [Joint],
    closing: Option<Joint>,
    tolerance_m: f64,
    runs: Vec<Run>,
    elements: Vec<Element>,
    sources: Vec<Range<usize>>,
    /// The smooth curve that has no elements yet.
    stretch: Stretch,
    is_sampled: bool,
}

impl<'a> Builder<'a> {
    fn new(parts: &'a [Part], joints: &'a [Joint], closing: Option<Joint>, tolerance_m: f64) -> Self {
        let (runs, elements, sources) = (vec![], vec![], vec![]);
        let (stretch, is_sampled) = (Stretch::default(), false);
        Self { parts, joints, closing, tolerance_m, runs, elements, sources, stretch, is_sampled }
    }

    fn build(mut self) -> Result<Runs, DrawingError> {
        let count = self.parts.len();
        let mut corners = vec![];
        for i in 0..count {
            let (before, after) = (self.joint_before(i), self.joint_after(i));
            self.add(i, before, after)?;
            if let Some(Joint::Corner(corner)) = after {
                self.finish_run()?;
                corners.push(corner);
            }
        }
        if !matches!(self.closing, Some(Joint::Corner(_))) {
            self.finish_run()?;
        }
        Ok(Runs { list: self.runs, corners })
    }

    fn joint_before(&self, i: usize) -> Option<Joint> {
        if i == 0 { self.closing } else { Some(self.joints[i - 1]) }
    }

    fn joint_after(&self, i: usize) -> Option<Joint> {
        if i + 1 == self.parts.len() { self.closing } else { Some(self.joints[i]) }
    }

    /// Adds the part with this number.
    fn add(&mut self, i: usize, before: Option<Joint>, after: Option<Joint>) -> Result<(), DrawingError> {
        let part = &self.parts[i];
        self.sources.push(part.sources.clone());
        let rooms_m = [before, after].map(|joint| match joint {
            Some(Joint::Sample { room_m }) => Some(room_m),
            _ => None,
        });
        match &part.piece {
            Piece::Line { .. } if rooms_m != [None; 2] => self.add_edge(part, rooms_m),
            Piece::Bezier(curve) => self.add_curve(i, curve, before, after),
            _ => {
                self.finish_stretch()?;
                self.elements.extend(part.elements());
            }
        }
        Ok(())
    }

    /// Adds an edge of a sampled curve. Nodes are where arcs can go round its samples.
    fn add_edge(&mut self, part: &Part, rooms_m: [Option<f64>; 2]) {
        let (from, to, tangent) = (part.piece.begin(), part.piece.end(), part.begin_tangent);
        self.is_sampled = true;
        match rooms_m[0] {
            Some(room_m) => self.stretch.push(CurvePoint { position: from + room_m * tangent, tangent }),
            None if self.stretch.nodes.is_empty() => self.stretch.push(CurvePoint { position: from, tangent }),
            None => {}
        }
        match rooms_m[1] {
            Some(room_m) => {
                let position = to - room_m * tangent;
                let last = self.stretch.nodes.last().expect("an edge has a node");
                if position.distance(last.position) > SHORTEST_NODE * from.distance(to) {
                    self.stretch.push(CurvePoint { position, tangent });
                }
                self.stretch.outline.push(to);
            }
            None => self.stretch.push(CurvePoint { position: to, tangent }),
        }
    }

    /// Adds a Bézier curve. At a smooth joint it takes the direction of a line or an arc, or a direction in between.
    fn add_curve(&mut self, i: usize, curve: &Bezier, before: Option<Joint>, after: Option<Joint>) {
        let part = &self.parts[i];
        let count = self.parts.len();
        let common = |joint: Option<Joint>, own: DVec2, other: usize, theirs: fn(&Part) -> DVec2| match joint {
            Some(Joint::Smooth) => match &self.parts[other].piece {
                Piece::Bezier(_) => (own + theirs(&self.parts[other])).normalize(),
                _ => theirs(&self.parts[other]),
            },
            _ => own,
        };
        let begin = common(before, part.begin_tangent, (i + count - 1) % count, |part| part.end_tangent);
        let end = common(after, part.end_tangent, (i + 1) % count, |part| part.begin_tangent);
        if self.stretch.nodes.is_empty() {
            self.stretch.push(CurvePoint { position: part.piece.begin(), tangent: begin });
        }
        let mut points = vec![];
        for part in curve.parts(NODES * self.tolerance_m) {
            points.clear();
            part.flatten(OUTLINE * self.tolerance_m, &mut points);
            if let Some((node, between)) = points.split_last() {
                self.stretch.outline.extend(between.iter().map(|point| point.position));
                self.stretch.push(*node);
            }
        }
        self.stretch.nodes.last_mut().expect("a curve has a node").tangent = end;
    }

    /// Fits elements to the curve that has none yet.
    fn finish_stretch(&mut self) -> Result<(), DrawingError> {
        let stretch = take(&mut self.stretch);
        if stretch.nodes.len() > 1 {
            let used = if take(&mut self.is_sampled) { SIMPLIFIED } else { OUTLINE };
            let fitted = stretch.fit((0.97 - used) * self.tolerance_m)?;
            self.elements.extend(fitted);
        }
        Ok(())
    }

    fn finish_run(&mut self) -> Result<(), DrawingError> {
        self.finish_stretch()?;
        self.runs.push(Run { elements: take(&mut self.elements), sources: take(&mut self.sources) });
        Ok(())
    }
}

//! A drawing as runs: chains of lines and arcs with common tangents, which meet in corners.

use std::mem::take;
use std::ops::Range;

use glam::DVec2;

use super::arc_spline::Stretch;
use super::curve::CurvePoint;
use super::element::Element;
use super::joint::{Corner, Joint, drop_closing_remainder, joint};
use super::part::{GAP, Part, SIMPLIFIED, begin_inside_first, checked, simplified};
use super::{Bezier, Drawing, DrawingError, FitSettings, Piece};

/// Share of the tolerance for the outline of Bézier curves.
const OUTLINE: f64 = 0.04;
/// Share of the tolerance by which the points of a Bézier curve at which elements may begin leave it.
const NODES: f64 = 0.25;
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

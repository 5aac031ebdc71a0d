//! The fit of a path to a drawing, in five steps:
//!
//! 1. Polylines lose the points that are near the lines between their neighbours ([`simplify`](super::simplify)).
//! 2. Each joint of two pieces is classified ([`joint`](super::joint)). Corners divide the drawing into runs.
//! 3. In each run, lines and arcs become elements as they are. Everything else becomes an arc spline
//!    ([`arc_spline`](super::arc_spline)).
//! 4. Corners are rounded ([`corner`](super::corner)).
//! 5. The elements become segments of a path. The path is built from them, and its distance from the drawing is measured.

use std::ops::Range;

use glam::DVec2;

use super::corner::Rounding;
use super::element::{Element, distance_m};
use super::joint::Corner;
use super::runs::{Run, Runs};
use super::samples::smoothed;
use super::{Drawing, DrawingError, Fit, FitSettings, Piece};
use crate::route::{PathSegment, Placement};

/// Distance between the measured outline and the drawing, relative to the tolerance.
const MEASURED: f64 = 0.002;
/// Distance within which an outline crosses the normal at an end of its elements, relative to the tolerance.
const NEAR: f64 = 2.0;
/// Tolerances that are tried, relative to the given one. The measured distance can exceed the first where rounding corners or
/// a long path adds to it.
const ATTEMPTS: [f64; 3] = [1.0, 0.7, 0.4];
/// Shortest element of a path, in metres, and its turn. A shorter one is left out.
const SHORTEST_M: f64 = 1e-6;
const LEAST_TURN: f64 = 1e-9;
/// Greatest distance by which an arc that turns by a slight kink too moves its end, relative to the tolerance: first one that
/// nobody sees, and where no arc of its own fits, a larger one.
const UNSEEN: f64 = 1e-3;
const ABSORBED: f64 = 0.25;
/// Number of times that the radius of a joint without a given radius is halved until it fits. An arc that bends to the same
/// side as its neighbour must be tighter than that: from the greatest radius down to 0.1 µm.
const HALVINGS: usize = 40;
/// Largest length that the arc of a joint without a given radius replaces on each side, relative to that of straight
/// neighbours.
const KINK_REACH: f64 = 1.5;

/// Elements that follow a part of the drawing, or the arc of a rounded corner.
struct Group {
    elements: Vec<Element>,
    /// Numbers of the pieces that it follows; none for a corner.
    sources: Vec<Range<usize>>,
}

pub(super) fn fit(drawing: &Drawing, settings: &FitSettings) -> Result<Fit, DrawingError> {
    if !settings.joins_samples {
        return fit_pieces(drawing, settings);
    }
    match fit_pieces(&smoothed(drawing, settings.tolerance_m), settings) {
        // Where points are close together, several edges become one line, which may be too long for arcs to the next edge.
        Err(DrawingError::Corner { .. }) => fit_pieces(&smoothed(drawing, 0.0), settings),
        result => result,
    }
}

/// The fit to the pieces as they are.
fn fit_pieces(drawing: &Drawing, settings: &FitSettings) -> Result<Fit, DrawingError> {
    let mut error_m = f64::INFINITY;
    for share in ATTEMPTS {
        let runs = Runs::new(drawing, settings, share)?;
        // The arc of a slight kink at the seam ends on the first piece of the drawing, behind the seam.
        let passes_seam = drawing.is_closed && runs.ends_in_kink();
        let elements = rounded(runs, settings)?;
        let fit = path(drawing, elements, settings.tolerance_m, passes_seam).ok_or(DrawingError::Empty)?;
        if fit.error_m <= settings.tolerance_m {
            return Ok(fit);
        }
        error_m = error_m.min(fit.error_m);
    }
    Err(DrawingError::Tolerance { tolerance_m: settings.tolerance_m, error_m })
}

/// Rounds the corners between runs.
fn rounded(runs: Runs, settings: &FitSettings) -> Result<Vec<Group>, DrawingError> {
    let Runs { list: mut runs, corners } = runs;
    let count = runs.len();
    let mut arcs = Vec::with_capacity(corners.len());
    for (i, corner) in corners.iter().enumerate() {
        let (mut before, next) = (std::mem::take(&mut runs[i].elements), (i + 1) % count);
        let arc = if next == i {
            // One run whose end meets its beginning in a corner: its halves are the two sides.
            let mut after = before;
            before = after.split_off(after.len() / 2);
            let arc = round(corner, &mut before, &mut after, settings)?;
            after.append(&mut before);
            before = after;
            arc
        } else {
            round(corner, &mut before, &mut runs[next].elements, settings)?
        };
        runs[i].elements = before;
        arcs.push(arc);
    }
    Ok(groups(runs, &corners, arcs))
}

/// Rounds one corner. Returns its arc.
fn round(
    corner: &Corner,
    before: &mut Vec<Element>,
    after: &mut Vec<Element>,
    settings: &FitSettings,
) -> Result<Vec<Element>, DrawingError> {
    if !corner.is_rounded && is_absorbed(corner.turn, before, after, UNSEEN * settings.tolerance_m) {
        return Ok(vec![]);
    }
    let mut radius_m = corner.radius_m;
    let mut found = fitting(corner, before, after, radius_m);
    if !corner.is_rounded {
        for _ in 0..HALVINGS {
            if found.is_some() {
                break;
            }
            radius_m *= 0.5;
            found = fitting(corner, before, after, radius_m);
        }
    }
    let (at, turn) = (corner.at, corner.turn.abs());
    let Some(rounding) = found else {
        if !corner.is_rounded && is_absorbed(corner.turn, before, after, ABSORBED * settings.tolerance_m) {
            return Ok(vec![]);
        }
        if !corner.is_rounded || settings.corner_radius_m.is_none() {
            return Err(DrawingError::Sharp { at });
        }
        let (mut low_m, mut high_m) = (0.0, radius_m);
        for _ in 0..40 {
            let middle_m = 0.5 * (low_m + high_m);
            *(if fitting(corner, before, after, middle_m).is_some() { &mut low_m } else { &mut high_m }) = middle_m;
        }
        return Err(DrawingError::Radius { at, turn, radius_m, largest_m: (low_m * 1e3).floor() / 1e3 });
    };
    Ok(rounding.apply(before, after, corner.turn, radius_m))
}

/// The arc of a radius at a corner; `None` if none fits.
fn fitting(corner: &Corner, before: &[Element], after: &[Element], radius_m: f64) -> Option<Rounding> {
    let found = Rounding::find(before, after, corner.turn, radius_m)?;
    // Between straight neighbours a slight kink loses this length on each side. Far beyond, an arc would cut a bend.
    let straight_m = radius_m * (0.5 * corner.turn.abs()).tan();
    (corner.is_rounded || found.replaced_m(before, after) <= KINK_REACH * straight_m).then_some(found)
}

/// Lets an arc beside a slight kink turn by the kink too, so that both sides have one direction at the joint. Returns whether
/// one of the arcs can: this moves its far end by at most `limit_m`, half of its length times the angle.
///
/// A joint of coordinates with few decimals has an angle such as 1e-7, for which an arc of its own would be too short.
fn is_absorbed(turn: f64, before: &mut [Element], after: &mut [Element], limit_m: f64) -> bool {
    let can = |element: &Element| element.curvature != 0.0 && 0.5 * element.length_m * turn.abs() <= limit_m;
    let bends = |element: &Element| (element.curvature * element.length_m).abs();
    let sides = [before.last_mut(), after.first_mut()].into_iter().flatten().filter(|element| can(element));
    let Some(arc) = sides.max_by(|a, b| bends(a).total_cmp(&bends(b))) else { return false };
    arc.curvature += turn / arc.length_m;
    true
}

/// The elements in walking order, divided at the rounded corners.
fn groups(runs: Vec<Run>, corners: &[Corner], arcs: Vec<Vec<Element>>) -> Vec<Group> {
    let mut groups = vec![Group { elements: vec![], sources: vec![] }];
    let mut corners = corners.iter().zip(arcs);
    for run in runs {
        let group = groups.last_mut().expect("there is a group");
        group.elements.extend(run.elements);
        group.sources.extend(run.sources);
        match corners.next() {
            Some((corner, arc)) if corner.is_rounded => {
                groups.push(Group { elements: arc, sources: vec![] });
                groups.push(Group { elements: vec![], sources: vec![] });
            }
            Some((_, arc)) => group.elements.extend(arc),
            None => {}
        }
    }
    groups.retain(|group| !group.elements.is_empty());
    groups
}

/// The path of these elements, and its distance from their sources; `None` if all are too short for a path. If it
/// `passes_seam`, its end follows the beginning of the drawing, up to where the path begins.
fn path(drawing: &Drawing, mut groups: Vec<Group>, tolerance_m: f64, passes_seam: bool) -> Option<Fit> {
    for group in &mut groups {
        group.elements = joined(&group.elements);
    }
    let first = groups.iter().find_map(|group| group.elements.first())?;
    let degrees = |angle: f64| angle.to_degrees().to_radians();
    let begin = Placement { position: first.begin, heading: degrees(first.tangent.to_angle()) };
    let (mut at, mut segments, mut error_m) = (begin, vec![], 0.0);
    let (mut low, mut high) = (begin.position, begin.position);
    let behind_seam = if passes_seam { begun(drawing, &groups[0], &begin, tolerance_m) } else { vec![] };
    for (number, group) in groups.iter().enumerate() {
        let mut placed = Vec::with_capacity(group.elements.len());
        for element in &group.elements {
            let segment = if element.curvature == 0.0 {
                PathSegment::Line { length_m: element.length_m }
            } else {
                PathSegment::Arc { radius_m: element.curvature.abs().recip(), turn: degrees(element.turn()) }
            };
            let tangent = DVec2::from_angle(at.heading);
            placed.extend(Element { begin: at.position, tangent, ..*element }.parts());
            at = segment.end(&at);
            segments.push(segment);
        }
        for point in placed.iter().flat_map(Element::extremes) {
            (low, high) = (low.min(point), high.max(point));
        }
        let beyond = if number + 1 == groups.len() { &behind_seam[..] } else { &[] };
        error_m = f64::max(error_m, group_error_m(&placed, drawing, &group.sources, beyond, tolerance_m));
    }
    let corners = groups.iter().filter(|group| group.sources.is_empty()).count();
    Some(Fit { begin, segments, error_m, corners, size_m: high - low })
}

/// Distance between the elements of a group and the pieces that they follow. `beyond` continues the outline of the pieces.
fn group_error_m(
    elements: &[Element],
    drawing: &Drawing,
    sources: &[Range<usize>],
    beyond: &[DVec2],
    tolerance_m: f64,
) -> f64 {
    let mut outline = outline_of(drawing, sources, tolerance_m);
    let (Some(first), Some(last), false) = (elements.first(), elements.last(), outline.is_empty()) else { return 0.0 };
    let pieces = sources.iter().flat_map(|range| &drawing.pieces[range.clone()]);
    let is_curved = pieces.clone().any(|piece| !matches!(piece, Piece::Line { .. }));
    trim(&mut outline, first.begin, first.tangent, NEAR * tolerance_m);
    outline.extend(beyond);
    outline.reverse();
    let (end, tangent) = last.end();
    trim(&mut outline, end, -tangent, NEAR * tolerance_m);
    outline.reverse();
    let measured_m = distance_m(elements, &outline, f64::INFINITY).unwrap_or(f64::INFINITY);
    measured_m + if is_curved { MEASURED * tolerance_m } else { 0.0 }
}

/// The outline of a group from the seam of the drawing to where the path begins, without its first point.
fn begun(drawing: &Drawing, group: &Group, begin: &Placement, tolerance_m: f64) -> Vec<DVec2> {
    let mut outline = outline_of(drawing, &group.sources, tolerance_m);
    let cut = crossing(&outline, begin.position, DVec2::from_angle(begin.heading), NEAR * tolerance_m);
    if let Some((number, cut)) = cut {
        outline.truncate(number + 1);
        outline.push(cut);
        outline.drain(..1);
    }
    outline
}

/// The points of pieces, in their order; none without a piece.
fn outline_of(drawing: &Drawing, sources: &[Range<usize>], tolerance_m: f64) -> Vec<DVec2> {
    let mut points = vec![];
    let mut outline = vec![];
    for piece in sources.iter().flat_map(|range| &drawing.pieces[range.clone()]) {
        if outline.is_empty() {
            outline.push(piece.begin());
        }
        piece.flatten(MEASURED * tolerance_m, &mut points);
    }
    outline.extend(points.iter().map(|point| point.position));
    outline
}

/// Removes the beginning of an outline up to where it crosses a normal.
fn trim(outline: &mut Vec<DVec2>, position: DVec2, tangent: DVec2, near_m: f64) {
    if let Some((number, cut)) = crossing(outline, position, tangent, near_m) {
        outline.drain(..number);
        outline[0] = cut;
    }
}

/// Where an outline first crosses a normal within `near_m` of a position on it: the number of the edge, and the point.
/// Otherwise the crossing nearest to the position.
fn crossing(outline: &[DVec2], position: DVec2, tangent: DVec2, near_m: f64) -> Option<(usize, DVec2)> {
    let ahead_m = |point: DVec2| (point - position).dot(tangent);
    let mut nearest: Option<(f64, usize, DVec2)> = None;
    let mut offer = |number: usize, cut: DVec2| {
        let off_m = cut.distance(position);
        if nearest.is_none_or(|(least_m, ..)| off_m < least_m) {
            nearest = Some((off_m, number, cut));
        }
        off_m <= near_m
    };
    let is_begin = ahead_m(outline[0]) >= 0.0 && offer(0, outline[0]);
    if !is_begin {
        for (number, edge) in outline.windows(2).enumerate() {
            let [behind, ahead] = [ahead_m(edge[0]), ahead_m(edge[1])];
            if behind < 0.0 && ahead >= 0.0 && offer(number, edge[0].lerp(edge[1], behind / (behind - ahead))) {
                break;
            }
        }
    }
    nearest.map(|(_, number, cut)| (number, cut))
}

/// The same elements, where neighbours of the same curvature are one, and without those that are too short for a path.
fn joined(elements: &[Element]) -> Vec<Element> {
    let mut joined: Vec<Element> = Vec::with_capacity(elements.len());
    for element in elements {
        if element.length_m < SHORTEST_M && element.turn().abs() < LEAST_TURN {
            continue;
        }
        match joined.last_mut() {
            Some(last) if (last.curvature - element.curvature).abs() <= 1e-12 * element.curvature.abs() => {
                last.length_m += element.length_m;
            }
            _ => joined.push(*element),
        }
    }
    joined
}

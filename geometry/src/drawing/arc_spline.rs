//! Arc splines: the fewest lines and arcs with common tangents within a tolerance of a smooth curve.
//!
//! Source: R. L. S. Drysdale, G. Rote and A. Sturm, *Approximation of an open polygonal curve with a minimum number of circular
//! arcs and biarcs* (2008): a shortest path over the points of the curve, whose steps are biarcs. Here only steps about as long
//! as the longest from each point are tried.

use std::ops::RangeInclusive;

use glam::DVec2;

use super::DrawingError;
use super::biarc::{Elements, biarc};
use super::curve::CurvePoint;
use super::element::{Element, distance_m};

/// Number of steps in a row that are too far from the curve, after which longer ones from the same point are not tried.
const MAX_MISSES: usize = 8;
/// Number of ends that are tried near the longest step from a point.
const ENDS: usize = 10;
/// Number of those that are longer than the longest step with the first ratio.
const LONGER: usize = 4;
/// Ratios of the two legs of a biarc, in the order in which they are tried.
const RATIOS: [f64; 5] = [1.0, 0.6, 1.7, 0.3, 3.0];
/// Most elements of a fit. The path of more would be too long for any configuration.
const MAX_ELEMENTS: usize = 4_000;

/// A smooth curve: points with directions, and the outline between them.
#[derive(Clone, Debug, Default)]
pub(super) struct Stretch {
    /// Where elements may begin and end.
    pub(super) nodes: Vec<CurvePoint>,
    /// The polyline that elements follow.
    pub(super) outline: Vec<DVec2>,
    /// For each node its number on the outline.
    pub(super) on_outline: Vec<usize>,
}

impl Stretch {
    /// Adds a point of the outline at which elements may begin and end.
    pub(super) fn push(&mut self, node: CurvePoint) {
        self.on_outline.push(self.outline.len());
        self.outline.push(node.position);
        self.nodes.push(node);
    }

    /// Few elements from the first to the last node within a tolerance of the outline.
    ///
    /// The work is bounded: from each point about twenty steps are tried, and the search ends at [`MAX_ELEMENTS`].
    ///
    /// # Errors
    /// No biarc leads beyond a point, or too many elements are needed.
    pub(super) fn fit(&self, tolerance_m: f64) -> Result<Vec<Element>, DrawingError> {
        let last = self.nodes.len() - 1;
        let mut best: Vec<Option<Step>> = vec![None; last + 1];
        let mut farthest = 0;
        for from in 0..last {
            let cost = match best[from] {
                Some(step) => step.cost,
                None if from == 0 => 0.0,
                None => continue,
            };
            if cost > MAX_ELEMENTS as f64 {
                return Err(DrawingError::Segments { limit: MAX_ELEMENTS });
            }
            for to in self.ends(from, tolerance_m) {
                let Some((elements, step_cost)) = self.step(from, to, &RATIOS, tolerance_m) else { continue };
                farthest = farthest.max(to);
                let cost = cost + step_cost;
                if best[to].is_none_or(|step| cost < step.cost) {
                    best[to] = Some(Step { from, cost, elements });
                }
            }
        }
        let mut fitted = Vec::new();
        let mut at = last;
        while at > 0 {
            let step = best[at].ok_or(DrawingError::Sharp { at: self.nodes[farthest].position })?;
            fitted.push(step.elements);
            at = step.from;
        }
        Ok(fitted.iter().rev().flat_map(Elements::as_slice).copied().collect())
    }

    /// Nodes at which steps from a node may end: those near the end of the longest step, which is found by doubling and
    /// bisection.
    fn ends(&self, from: usize, tolerance_m: f64) -> RangeInclusive<usize> {
        let last = self.nodes.len() - 1;
        let reaches = |width: usize| self.step(from, from + width, &RATIOS[..1], tolerance_m).is_some();
        let longest = last - from;
        let Some(first) = (1..=longest.min(MAX_MISSES)).find(|&width| reaches(width)) else { return from + 1..=from };
        let (mut low, mut high) = (first, longest + 1);
        while low < longest && high > longest {
            let width = (2 * low).min(longest);
            *(if reaches(width) { &mut low } else { &mut high }) = width;
        }
        while high - low > 1 {
            let width = low.midpoint(high);
            *(if reaches(width) { &mut low } else { &mut high }) = width;
        }
        // With other ratios slightly longer steps may be near enough.
        from + low.saturating_sub(ENDS - LONGER - 1).max(1)..=last.min(from + low + LONGER)
    }

    /// Elements from one node to another, with their cost: their number, and less than 1 for their distance from the outline.
    fn step(&self, from: usize, to: usize, ratios: &[f64], tolerance_m: f64) -> Option<(Elements, f64)> {
        let (begin, end) = (self.nodes[from], self.nodes[to]);
        let outline = &self.outline[self.on_outline[from]..=self.on_outline[to]];
        let costed = |elements: Elements| {
            let error_m = distance_m(elements.as_slice(), outline, tolerance_m)?;
            Some((elements, elements.as_slice().len() as f64 + 0.01 * error_m / tolerance_m))
        };
        let chord = (end.position - begin.position).normalize_or_zero();
        if chord.distance(begin.tangent).max(chord.distance(end.tangent)) < STRAIGHT {
            return costed(Elements::line(begin.position, end.position));
        }
        let [from, to] = [begin, end].map(|node| [node.position, node.tangent]);
        ratios.iter().find_map(|&ratio| costed(biarc(from, to, ratio)?))
    }
}

/// Largest difference of two directions that are taken as the same.
const STRAIGHT: f64 = 1e-9;

/// The best step to a node.
#[derive(Clone, Copy, Debug)]
struct Step {
    from: usize,
    cost: f64,
    elements: Elements,
}

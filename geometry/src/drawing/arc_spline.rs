//! Arc splines: the fewest lines and arcs with common tangents within a tolerance of a smooth curve.
//!
//! Source: R. L. S. Drysdale, G. Rote and A. Sturm, *Approximation of an open polygonal curve with a minimum number of circular
//! arcs and biarcs* (2008): a shortest path over the points of the curve, whose steps are biarcs. Here the steps from a point
//! end after some that are too far from the curve.

use glam::DVec2;

use super::biarc::{Elements, biarc};
use super::curve::CurvePoint;
use super::element::{Element, distance_m};

/// Most points that a step passes.
const MAX_STEP: usize = 600;
/// Number of steps in a row that are too far from the curve, after which longer ones from the same point are not tried.
const MAX_MISSES: usize = 8;
/// Ratios of the two legs of a biarc that are tried.
const RATIOS: [f64; 3] = [1.0, 0.5, 2.0];

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

    /// Fewest elements from the first to the last node within a tolerance of the outline.
    ///
    /// # Errors
    /// No biarc leads beyond the returned point.
    pub(super) fn fit(&self, tolerance_m: f64) -> Result<Vec<Element>, DVec2> {
        let count = self.nodes.len();
        let mut best: Vec<Option<Step>> = vec![None; count];
        let mut farthest = 0;
        for from in 0..count - 1 {
            let Some(cost) = (if from == 0 { Some(0.0) } else { best[from].as_ref().map(|step| step.cost) }) else {
                continue;
            };
            let mut misses = 0;
            for to in from + 1..count.min(from + 1 + MAX_STEP) {
                let Some((elements, step_cost)) = self.step(from, to, tolerance_m) else {
                    misses += 1;
                    if misses > MAX_MISSES {
                        break;
                    }
                    continue;
                };
                misses = 0;
                farthest = farthest.max(to);
                let cost = cost + step_cost;
                if best[to].as_ref().is_none_or(|step| cost < step.cost) {
                    best[to] = Some(Step { from, cost, elements });
                }
            }
        }
        let mut fitted = Vec::new();
        let mut at = count - 1;
        while at > 0 {
            let step = best[at].ok_or(self.nodes[farthest].position)?;
            fitted.push(step.elements);
            at = step.from;
        }
        Ok(fitted.iter().rev().flat_map(|elements| elements.as_slice()).copied().collect())
    }

    /// The cheapest elements from one node to another, with their cost: their number, and less than 1 for their distance from
    /// the outline.
    fn step(&self, from: usize, to: usize, tolerance_m: f64) -> Option<(Elements, f64)> {
        let (begin, end) = (self.nodes[from], self.nodes[to]);
        let outline = &self.outline[self.on_outline[from]..=self.on_outline[to]];
        let mut cheapest: Option<(Elements, f64)> = None;
        let mut offer = |elements: Elements| {
            if let Some(error_m) = distance_m(elements.as_slice(), outline, tolerance_m) {
                let cost = elements.as_slice().len() as f64 + 0.01 * error_m / tolerance_m;
                if cheapest.is_none_or(|(_, least)| cost < least) {
                    cheapest = Some((elements, cost));
                }
            }
        };
        let chord = (end.position - begin.position).normalize_or_zero();
        if chord.distance(begin.tangent).max(chord.distance(end.tangent)) < STRAIGHT {
            offer(Elements::line(begin.position, end.position));
        } else {
            let [from, to] = [begin, end].map(|node| [node.position, node.tangent]);
            RATIOS.iter().filter_map(|&ratio| biarc(from, to, ratio)).for_each(&mut offer);
        }
        cheapest
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

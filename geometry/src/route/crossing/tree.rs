//! A tree of boxes over the pieces of a route, in walking order.

use glam::DVec2;

use super::MEETING_M;
use super::piece_pair::Chord;
use crate::route::Segment;
use crate::route::segment_part::SegmentPart;

/// A part of a segment that turns by at most a right angle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Piece<'a> {
    pub(super) part: SegmentPart<'a>,
    bounds: Bounds,
}

impl<'a> Piece<'a> {
    pub(super) fn new(part: SegmentPart<'a>) -> Self {
        let chord = Chord::of(&part);
        let rounding_m = MEETING_M * (1.0 + chord.ends[0].abs().max(chord.ends[1].abs()).max_element());
        let [low, high] = [chord.ends[0].min(chord.ends[1]), chord.ends[0].max(chord.ends[1])];
        let margin_m = chord.bulge_m + rounding_m;
        Self { part, bounds: Bounds { low: low - margin_m, high: high + margin_m } }
    }
}

/// An upright rectangle.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    low: DVec2,
    high: DVec2,
}

impl Bounds {
    fn around(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn overlaps(&self, other: &Self) -> bool {
        self.low.cmple(other.high).all() && other.low.cmple(self.high).all()
    }
}

/// A binary tree over the pieces in walking order.
pub(super) struct Tree<'a> {
    pub(super) pieces: Vec<Piece<'a>>,
    /// Bounds of the pieces, then of pairs of them, and so on up to the root.
    levels: Vec<Vec<Bounds>>,
}

/// A node of the tree: its level, and its index in the level. Level 0 has the pieces.
pub(super) type Node = (usize, usize);

impl<'a> Tree<'a> {
    pub(super) fn of(pieces: Vec<Piece<'a>>) -> Self {
        let mut levels = vec![pieces.iter().map(|piece| piece.bounds).collect::<Vec<_>>()];
        while let Some(last) = levels.last().filter(|last| last.len() > 1) {
            levels.push(last.chunks(2).map(|pair| pair[0].around(pair[pair.len() - 1])).collect());
        }
        Self { pieces, levels }
    }

    /// The node of all pieces.
    pub(super) fn root(&self) -> Node {
        (self.levels.len() - 1, 0)
    }

    /// Whether no piece of one node crosses a piece of the other.
    pub(super) fn are_apart(&self, first: Node, second: Node) -> bool {
        let [(one, other), (at, behind)] = [(first.0, second.0), (first.1, second.1)];
        if first != second && !self.levels[one][at].overlaps(&self.levels[other][behind]) {
            return true;
        }
        match (self.segment(first), self.segment(second)) {
            (Some(one), Some(other)) => std::ptr::eq(one, other) || one.curve().never_crosses(other),
            _ => false,
        }
    }

    pub(super) fn children(&self, (level, index): Node) -> impl Iterator<Item = Node> {
        let below = level - 1;
        (2 * index..(2 * index + 2).min(self.levels[below].len())).map(move |index| (below, index))
    }

    /// The segment of a node whose pieces all lie on one segment.
    fn segment(&self, (level, index): Node) -> Option<&Segment> {
        let (first, last) = (index << level, (((index + 1) << level) - 1).min(self.pieces.len() - 1));
        let [first, last] = [first, last].map(|piece| &self.pieces[piece].part);
        (first.number == last.number).then_some(&first.placed.segment)
    }
}

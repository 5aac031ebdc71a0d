//! A tree of circles over the boards of one dragon, for the nearest boards of two dragons.
//!
//! A node covers consecutive benches, and its circle contains their boards. A node of n benches has 2·n − 1 nodes: itself, those
//! of its first half, then those of its second half.

use glam::DVec2;

use crate::dragon::board::Board;

/// Boards with their tree.
#[derive(Clone, Debug, Default)]
pub(super) struct BoardTree {
    boards: Vec<Board>,
    circles: Vec<Circle>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Circle {
    centre: DVec2,
    radius_m: f64,
}

impl Circle {
    fn of(board: &Board) -> Self {
        Self { centre: board.centre, radius_m: board.radius_m() }
    }

    /// The smallest circle around two circles.
    fn around(self, other: Self) -> Self {
        let distance_m = self.centre.distance(other.centre);
        let [larger, smaller] = if self.radius_m >= other.radius_m { [self, other] } else { [other, self] };
        if distance_m + smaller.radius_m <= larger.radius_m {
            return larger;
        }
        let radius_m = 0.5 * (distance_m + larger.radius_m + smaller.radius_m);
        let share = (radius_m - larger.radius_m) / distance_m;
        Self { centre: larger.centre.lerp(smaller.centre, share), radius_m }
    }

    fn gap_m(&self, other: &Self) -> f64 {
        self.centre.distance(other.centre) - self.radius_m - other.radius_m
    }
}

/// A node: its index, and its benches.
#[derive(Clone, Copy)]
struct Node {
    index: usize,
    first: usize,
    count: usize,
}

impl Node {
    fn halves(self) -> [Self; 2] {
        let count = self.count / 2;
        let first = Self { index: self.index + 1, first: self.first, count };
        [first, Self { index: self.index + 2 * count, first: self.first + count, count: self.count - count }]
    }
}

impl BoardTree {
    pub(super) fn new(boards: &[Board]) -> Self {
        let mut tree = Self { boards: boards.to_vec(), circles: vec![Circle::default(); 2 * boards.len() - 1] };
        tree.build(tree.root());
        tree
    }

    pub(super) fn boards(&self) -> &[Board] {
        &self.boards
    }

    fn root(&self) -> Node {
        Node { index: 0, first: 0, count: self.boards.len() }
    }

    fn build(&mut self, node: Node) -> Circle {
        let circle = if node.count == 1 {
            Circle::of(&self.boards[node.first])
        } else {
            let [first, second] = node.halves();
            self.build(first).around(self.build(second))
        };
        self.circles[node.index] = circle;
        circle
    }

    /// The two nearest boards, one of each tree, and their clearance.
    pub(super) fn nearest(&self, other: &Self) -> ([usize; 2], f64) {
        self.nearest_over(other, f64::NEG_INFINITY)
    }

    /// The same; or, if some boards have a clearance of at most `enough_m`, any two such boards.
    pub(super) fn nearest_over(&self, other: &Self, enough_m: f64) -> ([usize; 2], f64) {
        self.nearest_within(other, [enough_m, f64::INFINITY]).unwrap_or(([0, 0], f64::INFINITY))
    }

    /// The same, if their clearance is at most `reach_m`. The search is the shorter, the less it reaches.
    pub(super) fn nearest_within(&self, other: &Self, [enough_m, reach_m]: [f64; 2]) -> Option<([usize; 2], f64)> {
        let mut nearest = None;
        self.visit(other, reach_m, |benches, reach_m| {
            let [ours, theirs] = [&self.boards[benches[0]], &other.boards[benches[1]]];
            if ours.gap_m(theirs) > reach_m {
                return reach_m;
            }
            let clearance_m = ours.clearance(theirs);
            if clearance_m > reach_m {
                return reach_m;
            }
            nearest = Some((benches, clearance_m));
            // Nothing is nearer than −∞, which ends the search.
            if clearance_m <= enough_m { f64::NEG_INFINITY } else { clearance_m }
        });
        nearest
    }

    /// Whether some boards, one of each tree, have a clearance of at most `reach_m`.
    pub(super) fn comes_within(&self, other: &Self, reach_m: f64) -> bool {
        self.nearest_within(other, [reach_m; 2]).is_some()
    }

    /// All pairs of boards, one of each tree, with a clearance of at most `reach_m`.
    pub(super) fn within(&self, other: &Self, reach_m: f64) -> Vec<[usize; 2]> {
        let mut found = Vec::new();
        self.visit(other, reach_m, |benches, reach_m| {
            if self.boards[benches[0]].gap_m(&other.boards[benches[1]]) <= reach_m {
                found.push(benches);
            }
            reach_m
        });
        found
    }

    /// Calls `look` with each pair of benches whose circles are at most `reach_m` apart, the nearer halves first. It returns the
    /// next reach.
    fn visit(&self, other: &Self, mut reach_m: f64, mut look: impl FnMut([usize; 2], f64) -> f64) {
        let nodes = [self.root(), other.root()];
        if self.circles[0].gap_m(&other.circles[0]) <= reach_m {
            self.visit_halves(other, nodes, &mut look, &mut reach_m);
        }
    }

    /// The same for two nodes whose circles are within reach.
    fn visit_halves(
        &self,
        other: &Self,
        [ours, theirs]: [Node; 2],
        look: &mut impl FnMut([usize; 2], f64) -> f64,
        reach_m: &mut f64,
    ) {
        if ours.count == 1 && theirs.count == 1 {
            *reach_m = look([ours.first, theirs.first], *reach_m);
            return;
        }
        let circles = [self.circles[ours.index], other.circles[theirs.index]];
        let splits_ours = theirs.count == 1 || (ours.count > 1 && circles[0].radius_m >= circles[1].radius_m);
        let mut parts = if splits_ours {
            ours.halves().map(|half| (self.circles[half.index].gap_m(&circles[1]), [half, theirs]))
        } else {
            theirs.halves().map(|half| (other.circles[half.index].gap_m(&circles[0]), [ours, half]))
        };
        if parts[1].0 < parts[0].0 {
            parts.swap(0, 1);
        }
        for (gap_m, nodes) in parts {
            if gap_m <= *reach_m {
                self.visit_halves(other, nodes, look, reach_m);
            }
        }
    }
}

//! Crossings of a route with itself.
//!
//! *Terms.* A crossing is a point that the route passes at two travels, with an angle of at least [`TOUCH_ANGLE`] between the
//! two tangents. At a smaller angle the route touches itself, or runs along itself. That is not a crossing, and neither is an
//! end of the route that lies on the route.
//!
//! *Method.* The search splits the segments into pieces that turn by at most a right angle. So neither a piece nor two adjacent
//! pieces cross themselves. A tree of boxes over the pieces, in walking order, finds the pairs of pieces that may meet. Lines
//! and arcs meet at points in closed form. A pair with another curve is bisected (see [`PiecePair`]) until its halves are
//! provably apart, or provably meet at most once, where Newton's method finds the point. So no crossing is missed, up to the
//! rounding of positions.

mod closed_form;
mod piece_pair;
mod tree;

use glam::DVec2;

use super::Route;
use super::segment_part::SegmentPart;

pub(super) use closed_form::ClosedForm;
use closed_form::parameter_near;
use piece_pair::{PiecePair, Verdict};
use tree::{Node, Piece, Tree};

/// Smallest angle of a crossing, in radians. Positions are exact to about 10⁻¹² m, so a smaller angle would depend on rounding.
pub(super) const TOUCH_ANGLE: f64 = 1e-6;
/// Distance in metres, relative to 1 m plus the distance from the origin, at which two points of pieces are the same.
pub(super) const MEETING_M: f64 = 1e-9;
/// Travels that are nearer than this belong to the same crossing, in metres. A crossing at a seam is found on both sides of it.
const MERGE_M: f64 = 1e-6;
/// The same for the joint of a closed path, whose ends may be this far apart.
const JOINT_MERGE_M: f64 = 2e-3;
/// Work for storing a piece or a crossing, in steps. It bounds their number.
const STEPS_PER_ITEM: u64 = 16;
/// Greatest number of Newton's steps.
const MAX_NEWTON_STEPS: usize = 24;

/// A point at which a route crosses itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Crossing {
    /// Position in metres.
    pub point: DVec2,
    /// The two travels at which the route passes it, the lower one first.
    pub travels_m: [f64; 2],
}

/// The crossings of a part of a route.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Crossings {
    /// All of them in the order of their travels, or the found ones.
    pub found: Vec<Crossing>,
    /// Whether the limit of work allowed to find all of them.
    pub is_complete: bool,
    /// The steps of work.
    pub steps: u64,
}

impl Route {
    /// Finds the crossings of the route with itself between two travels. `is_lap` states that the two are the joint of a closed
    /// path. The search takes at most about `most_steps` steps of about 50 ns.
    pub fn crossings(&self, from_m: f64, to_m: f64, is_lap: bool, most_steps: u64) -> Crossings {
        let span_m = [from_m, to_m].map(|travel_m| self.in_plan(travel_m));
        let mut search = Search { span_m, is_lap, most_steps, steps: 0, found: Vec::new() };
        let pieces = search.cut(self.segment_parts(from_m, to_m));
        if let Some(pieces) = pieces {
            search.walk(&Tree::of(pieces));
        }
        search.merge();
        let in_space = |crossing: &Crossing| Crossing {
            travels_m: crossing.travels_m.map(|travel_m| self.in_space(travel_m)),
            ..*crossing
        };
        let found = search.found.iter().map(in_space).collect();
        Crossings { is_complete: !search.is_spent(), found, steps: search.steps }
    }
}

/// A search for crossings, its limit of work and its results.
struct Search {
    span_m: [f64; 2],
    is_lap: bool,
    most_steps: u64,
    steps: u64,
    found: Vec<Crossing>,
}

impl Search {
    fn is_spent(&self) -> bool {
        self.steps >= self.most_steps
    }

    /// Cuts parts into pieces; `None` if there are too many.
    fn cut<'a>(&mut self, parts: impl Iterator<Item = SegmentPart<'a>>) -> Option<Vec<Piece<'a>>> {
        let mut pieces = Vec::new();
        for part in parts {
            let longest = part.placed.segment.curve().right_angle();
            let span = part.front - part.rear;
            let count = (span / longest).ceil().max(1.0);
            self.steps = self.steps.saturating_add((count as u64).saturating_mul(STEPS_PER_ITEM));
            if self.is_spent() {
                return None;
            }
            let at = |piece: f64| part.rear + span * (piece / count);
            pieces.extend((0..count as u64).map(|piece| {
                let front = if piece as f64 + 1.0 == count { part.front } else { at(piece as f64 + 1.0) };
                Piece::new(SegmentPart { rear: at(piece as f64), front, ..part })
            }));
        }
        Some(pieces)
    }

    /// Examines all pairs of pieces whose bounds overlap.
    fn walk(&mut self, tree: &Tree<'_>) {
        let mut pairs = vec![(tree.root(), tree.root())];
        while let Some((first, second)) = pairs.pop() {
            self.steps += 1;
            if self.is_spent() {
                return;
            }
            if tree.are_apart(first, second) {
                continue;
            }
            if first == second {
                let children: Vec<Node> = tree.children(first).collect();
                pairs.extend(children.iter().map(|&child| (child, child)));
                pairs.extend(children.windows(2).map(|pair| (pair[0], pair[1])));
            } else if first.0.max(second.0) == 0 {
                if !self.are_adjacent(first.1, second.1, tree.pieces.len()) {
                    self.meet(&tree.pieces[first.1].part, &tree.pieces[second.1].part);
                }
            } else if first.0 >= second.0 {
                pairs.extend(tree.children(first).map(|child| (child, second)));
            } else {
                pairs.extend(tree.children(second).map(|child| (first, child)));
            }
        }
    }

    /// Whether one piece begins where the other ends. Together they turn by at most half a turn, so they do not cross.
    fn are_adjacent(&self, first: usize, second: usize, count: usize) -> bool {
        second - first == 1 || (self.is_lap && first == 0 && second == count - 1)
    }

    /// Finds the crossings of two pieces.
    fn meet(&mut self, first: &SegmentPart<'_>, second: &SegmentPart<'_>) {
        let forms = [first, second].map(|part| part.placed.segment.curve().closed_form());
        let [Some(one), Some(other)] = forms else { return self.bisect(*first, *second) };
        for near in one.crossings(other) {
            self.settle([first, second], near);
        }
    }

    /// Adds the crossing near a point, if both pieces reach it.
    fn settle(&mut self, [first, second]: [&SegmentPart<'_>; 2], near: DVec2) {
        self.steps += 1;
        if let (Some(one), Some(other)) = (parameter_near(first, near), parameter_near(second, near)) {
            self.refine([first, second], [one, other]);
        }
    }

    /// Newton's method from two parameters to the point at which both pieces meet. Adds the crossing if there is one.
    fn refine(&mut self, pair: [&SegmentPart<'_>; 2], mut at: [f64; 2]) {
        for _ in 0..MAX_NEWTON_STEPS {
            self.steps += 1;
            let [one, other] = [0, 1].map(|i| pair[i].placed.kernel.at(at[i]));
            let across = one.tangent.perp_dot(other.tangent);
            let gap = other.position - one.position;
            let meeting_m = MEETING_M * (1.0 + one.position.abs().max_element());
            if across.abs() <= TOUCH_ANGLE {
                return;
            }
            let steps_m = [gap.perp_dot(other.tangent) / across, gap.perp_dot(one.tangent) / across];
            let step = [steps_m[0] / one.speed_m_per_unit, steps_m[1] / other.speed_m_per_unit];
            let room = [meeting_m / one.speed_m_per_unit, meeting_m / other.speed_m_per_unit];
            let next = [0, 1].map(|i| (at[i] + step[i]).clamp(pair[i].rear - room[i], pair[i].front + room[i]));
            let is_still = (0..2).all(|i| (next[i] - at[i]).abs() <= 1e-3 * room[i]);
            at = next;
            if is_still {
                if gap.length() <= 2.0 * meeting_m {
                    self.add(pair, at, 0.5 * (one.position + other.position));
                }
                return;
            }
        }
    }

    fn add(&mut self, pair: [&SegmentPart<'_>; 2], at: [f64; 2], point: DVec2) {
        self.steps += STEPS_PER_ITEM;
        let travels_m = [0, 1].map(|i| pair[i].placed.travel(at[i]));
        let [from_m, to_m] = self.span_m;
        let is_end = |travel_m: f64| travel_m <= from_m + MERGE_M || travel_m >= to_m - MERGE_M;
        if self.is_lap || !travels_m.into_iter().any(is_end) {
            self.found.push(Crossing { point, travels_m });
        }
    }

    /// Bisects a pair of pieces down to pairs that are apart, touch, or meet at most once.
    fn bisect(&mut self, first: SegmentPart<'_>, second: SegmentPart<'_>) {
        let mut pairs = vec![PiecePair { parts: [first, second] }];
        while let Some(pair) = pairs.pop() {
            self.steps += 2;
            if self.is_spent() {
                return;
            }
            match pair.verdict() {
                Verdict::Apart => {}
                Verdict::MeetsOnce(at) => self.refine([&pair.parts[0], &pair.parts[1]], at),
                Verdict::Unknown(longer) => pairs.extend(pair.halves(longer)),
            }
        }
    }

    /// Sorts the crossings, and merges those that were found more than once.
    fn merge(&mut self) {
        if self.is_lap {
            self.join_ends();
        }
        let order = |one: &Crossing, other: &Crossing| {
            let [first, second] = [0, 1].map(|i| one.travels_m[i].total_cmp(&other.travels_m[i]));
            first.then(second)
        };
        self.found.sort_by(order);
        let (from_m, is_lap) = (self.span_m[0], self.is_lap);
        let mut kept = Vec::<Crossing>::with_capacity(self.found.len());
        for crossing in self.found.drain(..) {
            let is_joint = is_lap && crossing.travels_m[0] <= from_m + JOINT_MERGE_M;
            let merge_m = if is_joint { 2.0 * JOINT_MERGE_M } else { MERGE_M };
            let mut before = kept.iter().rev().take_while(|kept| crossing.travels_m[0] - kept.travels_m[0] <= merge_m);
            if !before.any(|kept| (crossing.travels_m[1] - kept.travels_m[1]).abs() <= merge_m) {
                kept.push(Crossing { travels_m: crossing.travels_m.map(|at_m| at_m.max(from_m)), ..crossing });
            }
        }
        self.found = kept;
    }

    /// Counts travels at the end of a lap from its beginning. Drops crossings of the lap's end with its beginning, which join
    /// up to a gap.
    fn join_ends(&mut self) {
        let [from_m, to_m] = self.span_m;
        let from_joint_m = |at_m: f64| if at_m >= to_m - JOINT_MERGE_M { at_m - (to_m - from_m) } else { at_m };
        for crossing in &mut self.found {
            crossing.travels_m = crossing.travels_m.map(from_joint_m);
            crossing.travels_m.sort_by(f64::total_cmp);
        }
        self.found.retain(|crossing| crossing.travels_m[1] > from_m + JOINT_MERGE_M);
    }
}

//! Crossings of a route with itself.
//!
//! *Terms.* A crossing is a point that the route passes at two travels, with an angle of at least [`TOUCH_ANGLE`] between the
//! two tangents. At a smaller angle the route touches itself, or runs along itself. That is not a crossing, and neither is an
//! end of the route that lies on the route.
//!
//! *Method.* The segments are cut into pieces that turn by at most a right angle, so neither a piece nor two adjacent pieces
//! cross themselves. A tree of boxes over the pieces, in walking order, finds the pairs of pieces that may meet. Lines and arcs
//! meet at points in closed form. A pair with a spiral is bisected (see [`SpiralPair`]) until its halves are provably apart, or
//! provably meet at most once, where Newton's method finds the point. So no crossing is missed, up to the rounding of positions.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, TAU};

use glam::DVec2;

use super::stretch::Stretch;
use super::{CircularArc, Line, Route, Segment};

/// Smallest angle of a crossing, in radians. Positions are exact to about 10⁻¹² m, so a smaller angle would depend on rounding.
const TOUCH_ANGLE: f64 = 1e-6;
/// Distance in metres, relative to 1 m plus the distance from the origin, at which two points of pieces are the same.
const MEETING_M: f64 = 1e-9;
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
        let mut search = Search { span_m: [from_m, to_m], is_lap, most_steps, steps: 0, found: Vec::new() };
        let pieces = search.cut(self.stretches(from_m, to_m));
        if let Some(pieces) = pieces {
            search.walk(&Tree::of(pieces));
        }
        search.merge();
        Crossings { is_complete: !search.is_spent(), found: search.found, steps: search.steps }
    }
}

/// A part of a segment that turns by at most a right angle.
#[derive(Clone, Copy, Debug)]
struct Piece<'a> {
    stretch: Stretch<'a>,
    bounds: Bounds,
}

impl<'a> Piece<'a> {
    fn new(stretch: Stretch<'a>) -> Self {
        let chord = Chord::of(&stretch);
        let rounding_m = MEETING_M * (1.0 + chord.ends[0].abs().max(chord.ends[1].abs()).max_element());
        let [low, high] = [chord.ends[0].min(chord.ends[1]), chord.ends[0].max(chord.ends[1])];
        let margin_m = chord.bulge_m + rounding_m;
        Self { stretch, bounds: Bounds { low: low - margin_m, high: high + margin_m } }
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
struct Tree<'a> {
    pieces: Vec<Piece<'a>>,
    /// Bounds of the pieces, then of pairs of them, and so on up to the root.
    levels: Vec<Vec<Bounds>>,
}

/// A node of the tree: its level, and its index in the level. Level 0 has the pieces.
type Node = (usize, usize);

impl<'a> Tree<'a> {
    fn of(pieces: Vec<Piece<'a>>) -> Self {
        let mut levels = vec![pieces.iter().map(|piece| piece.bounds).collect::<Vec<_>>()];
        while let Some(last) = levels.last().filter(|last| last.len() > 1) {
            levels.push(last.chunks(2).map(|pair| pair[0].around(pair[pair.len() - 1])).collect());
        }
        Self { pieces, levels }
    }

    /// Whether no piece of one node crosses a piece of the other.
    fn are_apart(&self, first: Node, second: Node) -> bool {
        let [(one, other), (at, behind)] = [(first.0, second.0), (first.1, second.1)];
        if first != second && !self.levels[one][at].overlaps(&self.levels[other][behind]) {
            return true;
        }
        match (self.segment(first), self.segment(second)) {
            (Some(one), Some(other)) => std::ptr::eq(one, other) || never_cross(one, other),
            _ => false,
        }
    }

    fn children(&self, (level, index): Node) -> impl Iterator<Item = Node> {
        let below = level - 1;
        (2 * index..(2 * index + 2).min(self.levels[below].len())).map(move |index| (below, index))
    }

    /// The segment of a node whose pieces all lie on one segment.
    fn segment(&self, (level, index): Node) -> Option<&Segment> {
        let (first, last) = (index << level, (((index + 1) << level) - 1).min(self.pieces.len() - 1));
        let [first, last] = [first, last].map(|piece| &self.pieces[piece].stretch);
        (first.number == last.number).then_some(&first.placed.segment)
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

    /// Cuts stretches into pieces; `None` if there are too many.
    ///
    /// An arc turns by its angle. A spiral turns by at most twice its angle: the angle between spoke and tangent is atan θ.
    fn cut<'a>(&mut self, stretches: impl Iterator<Item = Stretch<'a>>) -> Option<Vec<Piece<'a>>> {
        let mut pieces = Vec::new();
        for stretch in stretches {
            let longest = match stretch.placed.segment {
                Segment::Line(_) => f64::INFINITY,
                Segment::Arc(arc) => FRAC_PI_2 * arc.radius_m(),
                Segment::Spiral(_) => FRAC_PI_4,
            };
            let span = stretch.front - stretch.rear;
            let count = (span / longest).ceil().max(1.0);
            self.steps = self.steps.saturating_add((count as u64).saturating_mul(STEPS_PER_ITEM));
            if self.is_spent() {
                return None;
            }
            let at = |piece: f64| stretch.rear + span * (piece / count);
            pieces.extend((0..count as u64).map(|piece| {
                let front = if piece as f64 + 1.0 == count { stretch.front } else { at(piece as f64 + 1.0) };
                Piece::new(Stretch { rear: at(piece as f64), front, ..stretch })
            }));
        }
        Some(pieces)
    }

    /// Examines all pairs of pieces whose bounds overlap.
    fn walk(&mut self, tree: &Tree<'_>) {
        let root = tree.levels.len() - 1;
        let mut pairs = vec![((root, 0), (root, 0))];
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
                    self.meet(&tree.pieces[first.1].stretch, &tree.pieces[second.1].stretch);
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
    fn meet(&mut self, first: &Stretch<'_>, second: &Stretch<'_>) {
        let points: Vec<DVec2> = match (&first.placed.segment, &second.placed.segment) {
            (Segment::Spiral(_), _) | (_, Segment::Spiral(_)) => return self.bisect(*first, *second),
            (Segment::Line(one), Segment::Line(other)) => line_and_line(one, other).into_iter().collect(),
            (Segment::Line(line), Segment::Arc(arc)) | (Segment::Arc(arc), Segment::Line(line)) => {
                line_and_arc(line, arc).into_iter().flatten().collect()
            }
            (Segment::Arc(one), Segment::Arc(other)) => arc_and_arc(one, other).into_iter().flatten().collect(),
        };
        for near in points {
            self.settle([first, second], near);
        }
    }

    /// Adds the crossing near a point, if both pieces reach it.
    fn settle(&mut self, [first, second]: [&Stretch<'_>; 2], near: DVec2) {
        self.steps += 1;
        if let (Some(one), Some(other)) = (parameter_near(first, near), parameter_near(second, near)) {
            self.refine([first, second], [one, other]);
        }
    }

    /// Newton's method from two parameters to the point at which both pieces meet. Adds the crossing if there is one.
    fn refine(&mut self, pair: [&Stretch<'_>; 2], mut at: [f64; 2]) {
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

    fn add(&mut self, pair: [&Stretch<'_>; 2], at: [f64; 2], point: DVec2) {
        self.steps += STEPS_PER_ITEM;
        let travels_m = [0, 1].map(|i| pair[i].placed.travel(at[i]));
        let [from_m, to_m] = self.span_m;
        let is_end = |travel_m: f64| travel_m <= from_m + MERGE_M || travel_m >= to_m - MERGE_M;
        if self.is_lap || !travels_m.into_iter().any(is_end) {
            self.found.push(Crossing { point, travels_m });
        }
    }

    /// Bisects a pair of pieces down to pairs that are apart, touch, or meet at most once.
    fn bisect(&mut self, first: Stretch<'_>, second: Stretch<'_>) {
        let mut pairs = vec![SpiralPair { stretches: [first, second] }];
        while let Some(pair) = pairs.pop() {
            self.steps += 2;
            if self.is_spent() {
                return;
            }
            match pair.verdict() {
                Verdict::Apart => {}
                Verdict::MeetsOnce(at) => self.refine([&pair.stretches[0], &pair.stretches[1]], at),
                Verdict::Unknown(longer) => pairs.extend(pair.halves(longer)),
            }
        }
    }

    /// Sorts the crossings, and merges those that were found more than once.
    fn merge(&mut self) {
        let [from_m, to_m] = self.span_m;
        let lap_m = to_m - from_m;
        if self.is_lap {
            for crossing in &mut self.found {
                let travels_m =
                    crossing.travels_m.map(|at_m| if at_m >= to_m - JOINT_MERGE_M { at_m - lap_m } else { at_m });
                crossing.travels_m = [travels_m[0].min(travels_m[1]), travels_m[0].max(travels_m[1])];
            }
        }
        self.found
            .sort_by(|a, b| a.travels_m[0].total_cmp(&b.travels_m[0]).then(a.travels_m[1].total_cmp(&b.travels_m[1])));
        let (is_lap, mut kept) = (self.is_lap, Vec::<Crossing>::with_capacity(self.found.len()));
        for crossing in self.found.drain(..) {
            let is_joint = is_lap && crossing.travels_m[0] <= from_m + JOINT_MERGE_M;
            let merge_m = if is_joint { 2.0 * JOINT_MERGE_M } else { MERGE_M };
            let before = kept.iter().rev().take_while(|kept| crossing.travels_m[0] - kept.travels_m[0] <= merge_m);
            let is_known = before.into_iter().any(|kept| (crossing.travels_m[1] - kept.travels_m[1]).abs() <= merge_m);
            if !is_known {
                kept.push(Crossing { travels_m: crossing.travels_m.map(|at_m| at_m.max(from_m)), ..crossing });
            }
        }
        self.found = kept;
    }
}

/// Two pieces, at least one of them on a spiral.
#[derive(Clone, Copy, Debug)]
struct SpiralPair<'a> {
    stretches: [Stretch<'a>; 2],
}

/// The result of the bounds of a pair of pieces.
enum Verdict {
    /// The pieces do not cross.
    Apart,
    /// The pieces meet at most once, near these parameters.
    MeetsOnce([f64; 2]),
    /// Nothing. The piece with this index turns more.
    Unknown(usize),
}

impl SpiralPair<'_> {
    /// Examines the pair.
    ///
    /// 1. A curve with |κ| ≤ K stays within K·ℓ²/8 of the chord between its ends. So the pieces are apart if their chords are
    ///    further apart than that, in the direction along or across either chord.
    /// 2. The tangents of a piece differ from its chord by at most K·ℓ. If the chords make a larger angle than both together,
    ///    no direction of one piece is a direction of the other. Then the pieces meet at most once: between two common points,
    ///    both would have the direction of the line through them.
    /// 3. If both pieces turn by less than [`TOUCH_ANGLE`], and 2 does not apply, they touch at most.
    fn verdict(&self) -> Verdict {
        let chords = [0, 1].map(|i| Chord::of(&self.stretches[i]));
        let [one, other] = &chords;
        if one.is_apart(other) || other.is_apart(one) {
            return Verdict::Apart;
        }
        let (turn, [u, v]) = (one.turn + other.turn, [one.direction(), other.direction()]);
        let across = u.perp_dot(v);
        let angle = across.abs().min(1.0).asin();
        if angle > 2.0 * turn && angle > TOUCH_ANGLE {
            let gap = other.ends[0] - one.ends[0];
            let shares = [gap.perp_dot(v) / across / one.length_m, gap.perp_dot(u) / across / other.length_m];
            return Verdict::MeetsOnce([0, 1].map(|i| {
                let Stretch { rear, front, .. } = self.stretches[i];
                rear + shares[i].clamp(0.0, 1.0) * (front - rear)
            }));
        }
        let longer = usize::from(other.turn > one.turn);
        let is_touch = turn <= TOUCH_ANGLE || chords[longer].length_m <= MEETING_M;
        if is_touch { Verdict::Apart } else { Verdict::Unknown(longer) }
    }

    /// The two pairs with one half of a piece and the whole other piece.
    fn halves(self, halved: usize) -> [Self; 2] {
        let Stretch { rear, front, .. } = self.stretches[halved];
        let middle = 0.5 * (rear + front);
        [(rear, middle), (middle, front)].map(|(rear, front)| {
            let mut half = self;
            half.stretches[halved] = Stretch { rear, front, ..half.stretches[halved] };
            half
        })
    }
}

/// The chord of a piece, and bounds on the piece around it.
#[derive(Clone, Copy, Debug)]
struct Chord {
    ends: [DVec2; 2],
    /// Arc length of the piece.
    length_m: f64,
    /// Bound on the distance of the piece from its chord.
    bulge_m: f64,
    /// Bound on the angle between the piece and its chord.
    turn: f64,
}

impl Chord {
    fn of(&Stretch { placed, rear, front, .. }: &Stretch<'_>) -> Self {
        let length_m = placed.travel(front) - placed.travel(rear);
        let turn = placed.curvature_bound(rear, front) * length_m;
        let ends = [rear, front].map(|at| placed.kernel.at(at).position);
        Self { ends, length_m, bulge_m: 0.125 * turn * length_m, turn }
    }

    fn direction(&self) -> DVec2 {
        (self.ends[1] - self.ends[0]).normalize_or_zero()
    }

    /// Whether the other piece lies beyond this one, along or across this chord.
    fn is_apart(&self, other: &Self) -> bool {
        let margin_m = self.bulge_m + other.bulge_m + MEETING_M * (1.0 + self.ends[0].abs().max_element());
        let direction = self.direction();
        [direction, direction.perp()].into_iter().any(|axis| {
            let [[a, b], [c, d]] = [self.ends, other.ends].map(|ends| ends.map(|end| end.dot(axis)));
            a.min(b) - c.max(d) > margin_m || c.min(d) - a.max(b) > margin_m
        })
    }
}

/// Whether two segments lie on curves that never cross: the same circle, or spirals that are turned copies of each other. A
/// line does not cross a parallel line, which [`line_and_line`] finds.
fn never_cross(one: &Segment, other: &Segment) -> bool {
    match (one, other) {
        (Segment::Arc(one), Segment::Arc(other)) => {
            let tolerance_m = 0.1 * TOUCH_ANGLE * one.radius_m();
            one.centre().distance(other.centre()) <= tolerance_m
                && (one.radius_m() - other.radius_m()).abs() <= tolerance_m
        }
        (Segment::Spiral(one), Segment::Spiral(other)) => one.is_turned_copy(other, MEETING_M),
        _ => false,
    }
}

/// The point at which the straight lines through two segments cross.
fn line_and_line(one: &Line, other: &Line) -> Option<DVec2> {
    let across = one.direction().perp_dot(other.direction());
    let share = (other.origin() - one.origin()).perp_dot(other.direction()) / across;
    (across.abs() > TOUCH_ANGLE).then(|| one.origin() + share * one.direction())
}

/// The points at which the straight line and the circle through two segments cross.
fn line_and_arc(line: &Line, arc: &CircularArc) -> Option<[DVec2; 2]> {
    let to_centre = arc.centre() - line.origin();
    let foot = line.origin() + to_centre.dot(line.direction()) * line.direction();
    let off_m = to_centre.perp_dot(line.direction());
    let half_m = ((arc.radius_m() - off_m) * (arc.radius_m() + off_m)).max(0.0).sqrt();
    let is_crossing = half_m > TOUCH_ANGLE * arc.radius_m();
    is_crossing.then(|| [half_m, -half_m].map(|along_m| foot + along_m * line.direction()))
}

/// The points at which the circles through two arcs cross.
fn arc_and_arc(one: &CircularArc, other: &CircularArc) -> Option<[DVec2; 2]> {
    let (between, [r, s]) = (other.centre() - one.centre(), [one.radius_m(), other.radius_m()]);
    let distance_m = between.length();
    let along_m = 0.5 * (distance_m + (r - s) * (r + s) / distance_m);
    let half_m = ((r - along_m) * (r + along_m)).max(0.0).sqrt();
    let is_crossing = half_m * distance_m > TOUCH_ANGLE * r * s;
    let direction = between / distance_m;
    is_crossing.then(|| [half_m, -half_m].map(|off_m| one.centre() + along_m * direction + off_m * direction.perp()))
}

/// The parameter of a line or an arc nearest to a point, if the piece reaches it. The caller refines it.
fn parameter_near(stretch: &Stretch<'_>, near: DVec2) -> Option<f64> {
    let &Stretch { placed, rear, front, .. } = stretch;
    let parameter = match &placed.segment {
        Segment::Line(line) => placed.parameter_of((near - line.origin()).dot(line.direction())),
        Segment::Arc(arc) => {
            let (parameter, turn) = (placed.parameter_of(arc.toward(near)), TAU * arc.radius_m());
            parameter + turn * ((0.5 * (rear + front) - parameter) / turn).round()
        }
        Segment::Spiral(_) => return None,
    };
    let slack = 1e-3;
    (parameter >= rear - slack && parameter <= front + slack).then(|| parameter.clamp(rear, front))
}

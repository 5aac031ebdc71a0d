//! A pair of pieces without crossings in closed form, and the bounds that decide whether they cross.

use glam::DVec2;

use super::{MEETING_M, TOUCH_ANGLE};
use crate::route::segment_part::SegmentPart;

/// Two pieces, at least one of them neither on a line nor on an arc.
#[derive(Clone, Copy, Debug)]
pub(super) struct PiecePair<'a> {
    pub(super) parts: [SegmentPart<'a>; 2],
}

/// The result of the bounds of a pair of pieces.
pub(super) enum Verdict {
    /// The pieces do not cross.
    Apart,
    /// The pieces meet at most once, near these parameters.
    MeetsOnce([f64; 2]),
    /// Nothing. The piece with this index turns more.
    Unknown(usize),
}

impl PiecePair<'_> {
    /// Examines the pair.
    ///
    /// 1. A curve with |κ| ≤ K stays within K·ℓ²/8 of the chord between its ends. So the pieces are apart if their chords are
    ///    further apart than that, in the direction along or across either chord.
    /// 2. The tangents of a piece differ from its chord by at most K·ℓ. If the chords make a larger angle than both together,
    ///    no direction of one piece is a direction of the other. Then the pieces meet at most once: between two common points,
    ///    both would have the direction of the line through them.
    /// 3. If both pieces turn by less than [`TOUCH_ANGLE`], and 2 does not apply, they touch at most.
    pub(super) fn verdict(&self) -> Verdict {
        let chords = [0, 1].map(|i| Chord::of(&self.parts[i]));
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
                let SegmentPart { rear, front, .. } = self.parts[i];
                rear + shares[i].clamp(0.0, 1.0) * (front - rear)
            }));
        }
        let longer = usize::from(other.turn > one.turn);
        let is_touch = turn <= TOUCH_ANGLE || chords[longer].length_m <= MEETING_M;
        if is_touch { Verdict::Apart } else { Verdict::Unknown(longer) }
    }

    /// The two pairs with one half of a piece and the whole other piece.
    pub(super) fn halves(self, halved: usize) -> [Self; 2] {
        let SegmentPart { rear, front, .. } = self.parts[halved];
        let middle = 0.5 * (rear + front);
        [(rear, middle), (middle, front)].map(|(rear, front)| {
            let mut half = self;
            half.parts[halved] = SegmentPart { rear, front, ..half.parts[halved] };
            half
        })
    }
}

/// The chord of a piece, and bounds on the piece around it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Chord {
    pub(super) ends: [DVec2; 2],
    /// Arc length of the piece.
    length_m: f64,
    /// Bound on the distance of the piece from its chord.
    pub(super) bulge_m: f64,
    /// Bound on the angle between the piece and its chord.
    turn: f64,
}

impl Chord {
    pub(super) fn of(&SegmentPart { placed, rear, front, .. }: &SegmentPart<'_>) -> Self {
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

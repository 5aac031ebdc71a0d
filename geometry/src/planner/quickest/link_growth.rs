//! Bounds on the growth of a link's speed ratio while its front handle walks.
//!
//! The terms: d is the link's length, σ the arc that the front handle walks, κ and λ the route's signed curvatures at the front
//! and the rear handle. α and β are the angles from the link's direction, rear to front, to the tangents at front and rear;
//! a = tan α and b = tan β. A prime is a derivative by σ. Both handles of a rigid link have the same speed along it, and turn it
//! by their speeds across it:
//!
//! 1. g = cos α / cos β = √((1 + b²) / (1 + a²)), the speed of the rear handle;
//! 2. φ' = (sin α − g·sin β) / d = (a − b) / (d·√(1 + a²)), the turn of the link;
//! 3. α' = κ − φ' and β' = g·λ − φ', so a' = (1 + a²)·α' and b' = (1 + b²)·β';
//! 4. (ln g)' = b·β' − a·α'.
//!
//! Interval arithmetic over intervals of a, b, κ and λ bounds these rates. The intervals of a and b are proved in two steps:
//!
//! 5. Take any intervals of a and b around their values at the beginning. Let A bound |a'| on them, and B bound |b'|. If A and B
//!    times the whole arc do not reach the ends of the intervals, then a and b never leave them, because they are continuous.
//! 6. Then a is also within A·arc/2 of the mean of its values at both ends, and b likewise.

use crate::dragon::Handle;
use crate::numerics::Interval;

/// Most intervals that step 5 tries.
const MOST_TRIES: usize = 6;

/// Growth of the intervals from try to try.
const GROWTH: f64 = 1.6;

/// Rounding of a and b.
const ROUNDING: f64 = 1e-12;

/// The tangents of the angles α and β.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Angles {
    front: f64,
    rear: f64,
}

impl Angles {
    /// Of a link between two handles on level ground.
    pub(super) fn of(front: &Handle, rear: &Handle) -> Self {
        let link = front.position - rear.position;
        let tangent = |handle: &Handle| link.perp_dot(handle.tangent) / link.dot(handle.tangent);
        Self { front: tangent(front), rear: tangent(rear) }
    }
}

/// A link while its front handle walks.
#[derive(Clone, Copy, Debug)]
pub(super) struct WalkingLink {
    pub(super) length_m: f64,
    /// Curvatures at the front handle and at the rear handle.
    pub(super) curvatures: [Interval; 2],
    /// A bound on the arc that the front handle walks.
    pub(super) walk_m: f64,
}

/// Bounds on the rates of a link.
struct Rates {
    /// (ln g)'.
    growth: Interval,
    /// Bounds on |a'| and |b'|.
    most: [f64; 2],
}

impl WalkingLink {
    /// Bounds on (ln g)' between two positions of the link. `None` if the arc is too long for step 5.
    pub(super) fn growth(&self, earlier: Angles, later: Angles) -> Option<Interval> {
        let ends = [[earlier.front, later.front], [earlier.rear, later.rear]];
        let mut spread = ends.map(|[from, to]| (to - from).abs() + ROUNDING);
        for _ in 0..MOST_TRIES {
            let within = [0, 1].map(|i| Interval::hull(ends[i][0], ends[i][1]).widened(spread[i]));
            let reach = self.rates(within).most.map(|most| most * self.walk_m);
            let stays = |i: usize| within[i].contains(Interval::around(ends[i][0], reach[i] * (1.0 + ROUNDING)));
            if stays(0) && stays(1) {
                let between = |i: usize| {
                    let [from, to] = ends[i];
                    Interval::around(0.5 * (from + to), 0.5 * reach[i] + ROUNDING).common(within[i]).with(from).with(to)
                };
                return Some(self.rates([between(0), between(1)]).growth);
            }
            spread = [0, 1].map(|i| GROWTH * spread[i].max(reach[i]));
        }
        None
    }

    /// Steps 1 to 4.
    fn rates(&self, [a, b]: [Interval; 2]) -> Rates {
        let [front_squares, rear_squares] = [a, b].map(|tangent| tangent.squared() + Interval::hull(1.0, 1.0));
        let ratio = Interval {
            low: (rear_squares.low / front_squares.high).sqrt(),
            high: (rear_squares.high / front_squares.low).sqrt(),
        };
        let cosine = Interval { low: front_squares.high.sqrt().recip(), high: front_squares.low.sqrt().recip() };
        let turn = ((a - b) * cosine).scaled(self.length_m.recip());
        let (front, rear) = (self.curvatures[0] - turn, ratio * self.curvatures[1] - turn);
        let most = [(front_squares * front).size(), (rear_squares * rear).size()];
        Rates { growth: b * rear - a * front, most }
    }
}

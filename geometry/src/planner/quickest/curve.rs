//! Curves of the head's squared speed over its travel: straight lines between knots.
//!
//! At a constant acceleration a the squared speed changes by 2a per metre. So a head whose acceleration is at most a has a
//! squared speed of that slope at most, and a walk of ramps and even speeds is such a curve.

/// A curve of straight lines. Knots are a travel in metres and a squared speed.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    knots: Vec<[f64; 2]>,
}

impl Curve {
    /// The curve through knots in order of travel; there is one at least.
    pub(super) fn new(knots: Vec<[f64; 2]>) -> Self {
        Self { knots }
    }

    /// The curves of intervals that follow each other.
    pub(super) fn joined(curves: impl Iterator<Item = Self>) -> Self {
        Self { knots: curves.flat_map(|curve| curve.knots).collect() }
    }

    /// The part of the curve from one travel to another.
    pub(super) fn between(&self, [from_m, to_m]: [f64; 2]) -> Self {
        let inside = self.knots.iter().filter(|knot| from_m < knot[0] && knot[0] < to_m);
        let ends = [from_m, to_m].map(|travel_m| [travel_m, self.at(travel_m)]);
        Self { knots: [&ends[..1], &inside.copied().collect::<Vec<_>>(), &ends[1..]].concat() }
    }

    /// Travel at both ends.
    pub(super) fn ends_m(&self) -> [f64; 2] {
        [self.knots[0][0], self.knots[self.knots.len() - 1][0]]
    }

    /// Squared speed at a travel; beyond an end, that of the end.
    pub(super) fn at(&self, travel_m: f64) -> f64 {
        let next = self.knots.partition_point(|knot| knot[0] < travel_m);
        match (next.checked_sub(1), self.knots.get(next)) {
            (Some(before), Some(_)) => between(self.knots[before], self.knots[next], travel_m),
            (None, Some(first)) => first[1],
            (before, None) => self.knots[before.unwrap_or(0)][1],
        }
    }

    /// The least squared speed from one travel to another.
    pub(super) fn least(&self, [from_m, to_m]: [f64; 2]) -> f64 {
        let first = self.knots.partition_point(|knot| knot[0] <= from_m);
        let inside = self.knots[first..].iter().take_while(|knot| knot[0] < to_m).map(|knot| knot[1]);
        inside.fold(self.at(from_m).min(self.at(to_m)), f64::min)
    }

    /// The longest interval around another one on which the squared speed is at least `level`, as it is on that one.
    pub(super) fn component(&self, [from_m, to_m]: [f64; 2], level: f64) -> [f64; 2] {
        let crossing = |low: [f64; 2], high: [f64; 2]| {
            let share = (level - low[1]) / (high[1] - low[1]);
            low[0] + (high[0] - low[0]) * share.clamp(0.0, 1.0)
        };
        let behind = self.knots.partition_point(|knot| knot[0] <= from_m);
        let begin = (0..behind).rev().find(|&knot| self.knots[knot][1] < level).map_or(self.ends_m()[0], |low| {
            let high = self.knots.get(low + 1).map_or([from_m, level], |next| *next);
            crossing(self.knots[low], high).min(from_m)
        });
        let ahead = self.knots.partition_point(|knot| knot[0] < to_m);
        let end = (ahead..self.knots.len()).find(|&knot| self.knots[knot][1] < level).map_or(self.ends_m()[1], |low| {
            let high = low.checked_sub(1).map_or([to_m, level], |before| self.knots[before]);
            crossing(self.knots[low], high).max(to_m)
        });
        [begin, end]
    }

    /// The lesser of this curve and a squared speed.
    pub(super) fn limited(&self, most: f64) -> Self {
        let mut knots: Vec<[f64; 2]> = Vec::with_capacity(self.knots.len());
        let mut before: Option<[f64; 2]> = None;
        for &knot in &self.knots {
            if let Some(before) = before.filter(|before| (before[1] < most) != (knot[1] < most)) {
                let share = (most - before[1]) / (knot[1] - before[1]);
                knots.push([before[0] + (knot[0] - before[0]) * share, most]);
            }
            knots.push([knot[0], knot[1].min(most)]);
            before = Some(knot);
        }
        Self { knots }
    }

    /// The greatest curve under this one that begins and ends at rest and whose slope is at most `slope`: the fastest walk.
    /// A pass forward and one backward find it at the knots, and three lines between them: this curve, and a ramp from either knot.
    pub(super) fn ramped(&self, slope: f64) -> Self {
        let mut squares: Vec<f64> = self.knots.iter().map(|knot| knot[1]).collect();
        let last = squares.len() - 1;
        [squares[0], squares[last]] = [0.0; 2];
        let width_m = |knot: usize| self.knots[knot + 1][0] - self.knots[knot][0];
        for knot in 0..last {
            squares[knot + 1] = squares[knot + 1].min(squares[knot] + slope * width_m(knot));
        }
        for knot in (0..last).rev() {
            squares[knot] = squares[knot].min(squares[knot + 1] + slope * width_m(knot));
        }
        let mut knots = Vec::with_capacity(2 * squares.len());
        for knot in 0..last {
            let [from, to] = [self.knots[knot], self.knots[knot + 1]];
            let (width_m, [before, behind]) = (width_m(knot), [squares[knot], squares[knot + 1]]);
            let least = |walked_m: f64| {
                let ramps = (before + slope * walked_m).min(behind + slope * (width_m - walked_m));
                between(from, to, from[0] + walked_m).min(ramps)
            };
            let own = if width_m > 0.0 { (to[1] - from[1]) / width_m } else { 0.0 };
            let mut meetings = [
                (from[1] - before) / (slope - own),
                (behind + slope * width_m - from[1]) / (slope + own),
                0.5 * (behind - before) / slope + 0.5 * width_m,
            ];
            meetings.sort_unstable_by(f64::total_cmp);
            knots.push([from[0], before]);
            let inside = meetings.into_iter().filter(|&walked_m| walked_m > 0.0 && walked_m < width_m);
            knots.extend(inside.map(|walked_m| [from[0] + walked_m, least(walked_m)]));
        }
        knots.push([self.knots[last][0], squares[last]]);
        Self { knots }
    }

    /// Seconds of the walk. On a line the speed changes evenly over time.
    pub(super) fn duration_s(&self) -> f64 {
        let time_s = |ends: &[[f64; 2]]| {
            let width_m = ends[1][0] - ends[0][0];
            if width_m > 0.0 { 2.0 * width_m / (ends[0][1].sqrt() + ends[1][1].sqrt()) } else { 0.0 }
        };
        self.knots.windows(2).map(time_s).sum()
    }

    /// The largest of this curve's squared speeds as a share of another curve's. Between the knots of both, it is largest at one
    /// of them, because both are straight there.
    pub(super) fn largest_share_of(&self, other: &Self) -> f64 {
        let of = |travel_m: f64, square: f64| square / other.at(travel_m);
        let own = self.knots.iter().map(|knot| of(knot[0], knot[1]));
        let [from_m, to_m] = self.ends_m();
        let others = other.knots.iter().filter(|knot| (from_m..=to_m).contains(&knot[0]));
        own.chain(others.map(|knot| self.at(knot[0]) / knot[1])).fold(0.0, f64::max)
    }
}

fn between(from: [f64; 2], to: [f64; 2], travel_m: f64) -> f64 {
    let width_m = to[0] - from[0];
    if width_m > 0.0 { from[1] + (to[1] - from[1]) * ((travel_m - from[0]) / width_m) } else { from[1].min(to[1]) }
}

//! Walks of even speeds, each on an interval of travel, with ramps between them.
//!
//! A *plateau* is an interval with an even squared speed that the optimum is never below there. With ramps of the largest slope at
//! both ends, it is a walk under the optimum, because the optimum's slope is no larger. So the greatest of several plateaus
//! with their ramps is such a walk too. Where two ramps meet above all plateaus, the head turns from braking to accelerating.

use super::curve::Curve;

/// Distance by which rounding may keep a ramp of the first or last plateau from the end of the run, as a share of the run.
const ROUNDING: f64 = 1e-12;

/// Most steps of [`Plateau::to_ends`]. Each begins nearer to the end of the run; the last ones differ by rounding.
const MOST_STEPS: usize = 64;

/// An interval of travel with an even squared speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Plateau {
    pub(super) span_m: [f64; 2],
    pub(super) square: f64,
}

/// The plateaus of a walk, in order, from rest to rest. Each can be seen: no ramps of the others cover it.
#[derive(Clone, Debug)]
pub(super) struct Plateaus {
    all: Vec<Plateau>,
    ends_m: [f64; 2],
    slope: f64,
}

/// A change of the planned speed: the travel at which its ramp begins, and the squared speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Turn {
    pub(super) travel_m: f64,
    pub(super) square: f64,
}

impl Plateau {
    /// The greatest plateau under the optimum on a span, as long as possible.
    pub(super) fn under(optimum: &Curve, span_m: [f64; 2]) -> Self {
        let square = optimum.least(span_m);
        Self { span_m: optimum.component(span_m, square), square }
    }

    /// The plateau, lowered so far that its ramps from the start of the run and to its end, as required, begin and end at rest there.
    /// Such a ramp is a part of the optimum's own one, so the plateau extends to that first.
    pub(super) fn to_ends(mut self, optimum: &Curve, slope: f64, [is_first, is_last]: [bool; 2]) -> Self {
        let [start_m, end_m] = optimum.ends_m();
        let mut ramps_m = self.span_m;
        if is_first {
            ramps_m[0] = ramps_m[0].min(rest_ramp_m(optimum, slope, start_m, end_m));
        }
        if is_last {
            ramps_m[1] = ramps_m[1].max(rest_ramp_m(optimum, slope, end_m, start_m));
        }
        if ramps_m != self.span_m {
            self = Self::under(optimum, ramps_m);
        }
        for _ in 0..MOST_STEPS {
            let ramp_m = self.square / slope;
            let from_m = if is_first { self.span_m[0].min(start_m + ramp_m) } else { self.span_m[0] };
            let to_m = if is_last { self.span_m[1].max(end_m - ramp_m) } else { self.span_m[1] };
            if [from_m, to_m] == self.span_m {
                break;
            }
            self = Self::under(optimum, [from_m, to_m]);
        }
        self
    }
}

/// How far the optimum's ramp from or to a rest at one end of the run extends: its travel that is nearest to the other end.
fn rest_ramp_m(optimum: &Curve, slope: f64, rest_m: f64, other_m: f64) -> f64 {
    let tolerance_m = 0.5 * ROUNDING * (other_m - rest_m).abs();
    let is_on_ramp = |travel_m: f64| (travel_m - rest_m).abs() - optimum.at(travel_m) / slope <= tolerance_m;
    let (mut on_m, mut off_m) = (rest_m, other_m);
    if is_on_ramp(off_m) {
        return off_m;
    }
    loop {
        let middle_m = 0.5 * (on_m + off_m);
        if middle_m == on_m || middle_m == off_m {
            return on_m;
        }
        *if is_on_ramp(middle_m) { &mut on_m } else { &mut off_m } = middle_m;
    }
}

impl Plateaus {
    /// Plateaus in order of travel; those that the others cover are dropped. `None` if their ramps leave a gap.
    pub(super) fn new(plateaus: Vec<Plateau>, optimum: &Curve, slope: f64) -> Option<Self> {
        let mut seen = Self { all: Vec::with_capacity(plateaus.len()), ends_m: optimum.ends_m(), slope };
        for plateau in plateaus {
            seen.all.push(plateau);
            // A new plateau may cover the one before, or be covered by it; then others are neighbours.
            while let Some(covered) = seen.covered_of_last() {
                seen.all.remove(covered);
            }
        }
        let (first, last) = (seen.all.first()?, seen.all.last()?);
        let [start_m, end_m] = seen.ends_m;
        let rounding_m = ROUNDING * (end_m - start_m);
        let begins = first.span_m[0] - first.square / slope <= start_m + rounding_m;
        let ends = last.span_m[1] + last.square / slope >= end_m - rounding_m;
        let joins = seen.all.windows(2).all(|pair| valley(pair[0], pair[1], slope) > 0.0);
        (begins && ends && joins).then_some(seen)
    }

    /// The index of a plateau among the last three that its neighbours cover.
    fn covered_of_last(&self) -> Option<usize> {
        let count = self.all.len();
        (count.saturating_sub(3)..count).rev().find(|&index| self.is_covered(index))
    }

    /// Whether the ramps of the neighbours cover a plateau: one of them all of it, or both together.
    fn is_covered(&self, index: usize) -> bool {
        let Plateau { span_m: [from_m, to_m], square } = self.all[index];
        let before = index.checked_sub(1).map(|before| self.all[before]).filter(|before| before.square >= square);
        let next = self.all.get(index + 1).filter(|next| next.square > square);
        let ends_m = before.map(|before| before.span_m[1] + (before.square - square) / self.slope);
        let begins_m = next.map(|next| next.span_m[0] - (next.square - square) / self.slope);
        ends_m.is_some_and(|ends_m| ends_m >= to_m)
            || begins_m.is_some_and(|begins_m| begins_m <= from_m)
            || ends_m.zip(begins_m).is_some_and(|(ends_m, begins_m)| ends_m > begins_m)
    }

    pub(super) fn plateaus(&self) -> &[Plateau] {
        &self.all
    }

    /// The changes of the planned speed, the first at the start.
    pub(super) fn turns(&self) -> Vec<Turn> {
        let mut turns = vec![Turn { travel_m: self.ends_m[0], square: self.all[0].square }];
        for pair in self.all.windows(2) {
            let [before, next] = [pair[0], pair[1]];
            let valley = valley(before, next, self.slope);
            if valley < before.square.min(next.square) {
                turns.push(Turn { travel_m: before.span_m[1], square: valley });
                let up_m = next.span_m[0] - (next.square - valley) / self.slope;
                turns.push(Turn { travel_m: up_m, square: next.square });
            } else if next.square > before.square {
                let up_m = next.span_m[0] - (next.square - before.square) / self.slope;
                turns.push(Turn { travel_m: up_m, square: next.square });
            } else {
                turns.push(Turn { travel_m: before.span_m[1], square: next.square });
            }
        }
        turns
    }

    pub(super) fn ends_m(&self) -> [f64; 2] {
        self.ends_m
    }

    /// Seconds of the walk.
    pub(super) fn duration_s(&self) -> f64 {
        let [start_m, end_m] = self.ends_m;
        let accel_mps2 = 0.5 * self.slope;
        let (mut at_m, mut speed_mps, mut time_s) = (start_m, 0.0, 0.0);
        let mut turns = self.turns();
        turns.push(Turn { travel_m: end_m, square: 0.0 });
        for pair in turns.windows(2) {
            let target_mps = pair[0].square.sqrt();
            let brakes = pair[1].square == 0.0;
            // The brakes of the run's end begin before it.
            let until_m = if brakes { end_m - pair[0].square / self.slope } else { pair[1].travel_m };
            let ramp_m = (target_mps * target_mps - speed_mps * speed_mps).abs() / self.slope;
            time_s += (target_mps - speed_mps).abs() / accel_mps2 + (until_m - at_m - ramp_m).max(0.0) / target_mps;
            (at_m, speed_mps) = (until_m, target_mps);
        }
        time_s + speed_mps / accel_mps2
    }
}

/// The squared speed at which the ramp down from a plateau and the ramp up to the next meet.
fn valley(before: Plateau, next: Plateau, slope: f64) -> f64 {
    0.5 * (before.square + next.square - slope * (next.span_m[0] - before.span_m[1]))
}

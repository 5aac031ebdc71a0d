//! Search for a walk of few plateaus that takes little longer than the optimum.
//!
//! *Method.* A dynamic programme over travels and levels of the squared speed: at a node the head walks evenly, at a level that the
//! optimum is not below. It goes on at this level to the next travel, or ramps to another level. Each cue costs a *price* in
//! seconds. So a walk of the least time plus price is found for each price. A higher price gives fewer cues and a longer time.
//! The search halves the interval of prices, and keeps the walk of the fewest cues that is quick enough. Each plateau then
//! rises to the optimum's least value on it, and extends as far as it may. At last plateaus are dropped, or joined with a neighbour,
//! as long as the walk stays quick enough.
//!
//! *Guarantee.* The walk is under the optimum, whatever the search finds. No single plateau can be left out of the result, and no two
//! neighbours joined, without a walk that takes too long.

use super::curve::Curve;
use super::plateaus::{Plateau, Plateaus};
use crate::dragon::Meter;

/// Travels of the programme.
const STEPS: usize = 4096;

/// Levels that divide the time of the optimum evenly, and levels at even ratios.
const TIMED_LEVELS: usize = 48;
const EVEN_LEVELS: usize = 16;

/// Number of prices that the search tries.
const PRICES: usize = 14;

/// Greatest price of a cue, as a share of the time that the walk may take longer than the optimum; and the ratio of the
/// greatest to the least.
const PRICE_RANGE: f64 = 1e5;

/// Work of a price, in steps: a ramp of the programme takes a tenth of one.
const STEPS_PER_PRICE: u64 = (STEPS * (TIMED_LEVELS + EVEN_LEVELS) * (TIMED_LEVELS + EVEN_LEVELS) / 10) as u64;

/// Plateaus of a walk that is tried with fewer of them, per step of work.
const PLATEAUS_PER_STEP: u64 = 10;

/// Share of the allowed extra time that is left for rounding the cues.
const ROUNDING: f64 = 0.01;

/// A search for the cues of a run.
pub(super) struct CueSearch<'a> {
    pub(super) optimum: &'a Curve,
    /// Largest slope of the squared speed.
    pub(super) slope: f64,
    /// Longest duration of the result, in seconds.
    pub(super) most_s: f64,
    pub(super) meter: &'a Meter,
}

impl CueSearch<'_> {
    /// The walk of the fewest plateaus that is quick enough, or else the quickest. A walk at the squared speed `even` is known to
    /// be possible.
    pub(super) fn plateaus(&self, even: f64) -> Plateaus {
        let optimum_s = self.optimum.duration_s();
        let extra_s = (1.0 - ROUNDING) * (self.most_s - optimum_s);
        let most_s = optimum_s + extra_s;
        let mut best = self.even(even);
        let mut best_s = best.duration_s();
        let programme = Programme::new(self.optimum, self.slope, even);
        let mut prices_s = [extra_s / PRICE_RANGE, extra_s];
        for _ in 0..PRICES {
            if (best_s <= most_s && best.plateaus().len() == 1) || self.meter.is_spent() {
                break;
            }
            self.meter.add(STEPS_PER_PRICE);
            let price_s = (prices_s[0] * prices_s[1]).sqrt();
            let found = self.highest(&programme.spans_m(price_s));
            let found_s = found.as_ref().map_or(f64::INFINITY, Plateaus::duration_s);
            let is_quick = found_s <= most_s;
            prices_s[usize::from(!is_quick)] = price_s;
            let Some(found) = found else { continue };
            let has_fewer = found.turns().len() < best.turns().len();
            if if is_quick && best_s <= most_s { has_fewer } else { found_s < best_s } {
                (best, best_s) = (found, found_s);
            }
        }
        while let Some(fewer) = self.with_fewer(&best, most_s) {
            best = fewer;
        }
        best
    }

    /// The walk at one squared speed, or at the greatest that the run has room for.
    pub(super) fn even(&self, square: f64) -> Plateaus {
        let [start_m, end_m] = self.optimum.ends_m();
        let square = square.min(0.5 * self.slope * (end_m - start_m));
        let ramp_m = square / self.slope;
        let only = Plateau { span_m: [start_m + ramp_m, end_m - ramp_m], square };
        Plateaus::new(vec![only], self.optimum, self.slope).expect("one plateau from the first ramp to the last")
    }

    /// The greatest plateaus on spans in order of travel, from rest to rest.
    fn highest(&self, spans_m: &[[f64; 2]]) -> Option<Plateaus> {
        let last = spans_m.len().checked_sub(1)?;
        let plateau = |(index, &span_m): (usize, &[f64; 2])| {
            Plateau::under(self.optimum, span_m).to_ends(self.optimum, self.slope, [index == 0, index == last])
        };
        Plateaus::new(spans_m.iter().enumerate().map(plateau).collect(), self.optimum, self.slope)
    }

    /// The quickest walk with a plateau left out, or two joined, if it is quick enough.
    fn with_fewer(&self, plateaus: &Plateaus, most_s: f64) -> Option<Plateaus> {
        let (all, cues) = (plateaus.plateaus(), plateaus.turns().len());
        if self.meter.is_spent() {
            return None;
        }
        self.meter.add(2 * (all.len() * all.len()) as u64 / PLATEAUS_PER_STEP);
        let joined = |index: usize| {
            let [one, other] = [all[index].span_m, all[index + 1].span_m];
            let both = Plateau::under(self.optimum, [one[0].min(other[0]), one[1].max(other[1])]);
            let both = both.to_ends(self.optimum, self.slope, [index == 0, index + 2 == all.len()]);
            [&all[..index], &[both], &all[index + 2..]].concat()
        };
        let dropped = (0..all.len()).map(|index| [&all[..index], &all[index + 1..]].concat());
        let candidates = dropped.chain((1..all.len()).map(|index| joined(index - 1)));
        let walks = candidates.filter_map(|plateaus| Plateaus::new(plateaus, self.optimum, self.slope));
        let fewer = walks.filter(|walk| walk.turns().len() < cues).map(|walk| (walk.duration_s(), walk));
        let quick = fewer.filter(|(duration_s, _)| *duration_s <= most_s);
        quick.min_by(|one, other| one.0.total_cmp(&other.0)).map(|(_, walk)| walk)
    }
}

/// The programme's travels and levels.
struct Programme {
    start_m: f64,
    step_m: f64,
    /// Squared speeds, rising.
    levels: Vec<f64>,
    slope: f64,
    /// The optimum at each travel, and its least value from there to the next.
    squares: Vec<[f64; 2]>,
}

/// From where the best walk to a node comes.
#[derive(Clone, Copy, Debug, PartialEq)]
enum From {
    Nowhere,
    Start,
    SameLevel,
    Level(u16),
}

impl Programme {
    fn new(optimum: &Curve, slope: f64, even: f64) -> Self {
        let [start_m, end_m] = optimum.ends_m();
        let step_m = (end_m - start_m) / STEPS as f64;
        let travel_m = |step: usize| start_m + step_m * step as f64;
        let square = |step: usize| [optimum.at(travel_m(step)), optimum.least([travel_m(step), travel_m(step + 1)])];
        let squares: Vec<[f64; 2]> = (0..=STEPS).map(square).collect();
        let mut sorted: Vec<f64> = squares.iter().map(|square| square[1]).filter(|&square| square >= even).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let most = squares.iter().map(|square| square[0]).fold(even, f64::max);
        let even_level = |index: usize| even * (most / even).powf(index as f64 / EVEN_LEVELS as f64);
        let timed = (0..TIMED_LEVELS).filter_map(|index| sorted.get(index * sorted.len() / TIMED_LEVELS).copied());
        let mut levels: Vec<f64> = (0..EVEN_LEVELS).map(even_level).chain(timed).collect();
        levels.sort_unstable_by(f64::total_cmp);
        levels.dedup_by(|next, level| *next <= *level * (1.0 + 1e-9));
        Self { start_m, step_m, levels, slope, squares }
    }

    /// Steps of a ramp between two squared speeds, and its time and that of the rest of its last step at the lower speed.
    fn ramp(&self, one: f64, other: f64) -> (usize, f64) {
        let [low, high] = [one.min(other), one.max(other)];
        let ramp_m = (high - low) / self.slope;
        let steps = (ramp_m / self.step_m).ceil();
        let rest_m = steps * self.step_m - ramp_m;
        let [low_mps, high_mps] = [low.sqrt(), high.sqrt()];
        // From and to rest, the rest of the step is walked at the higher speed.
        let even_mps = if low > 0.0 { low_mps } else { high_mps };
        (steps as usize, 2.0 * (high_mps - low_mps) / self.slope + rest_m / even_mps)
    }

    /// The spans of even speed of the walk with the least time plus price, in order. The ramps between them are left out.
    fn spans_m(&self, price_s: f64) -> Vec<[f64; 2]> {
        let count = self.levels.len();
        let ramps: Vec<(usize, f64)> =
            self.levels.iter().flat_map(|&to| self.levels.iter().map(move |&from| self.ramp(from, to))).collect();
        let rests: Vec<(usize, f64)> = self.levels.iter().map(|&level| self.ramp(0.0, level)).collect();
        let step_s: Vec<f64> = self.levels.iter().map(|level| self.step_m / level.sqrt()).collect();
        let mut costs_s = vec![f64::INFINITY; (STEPS + 1) * count];
        let mut froms = vec![From::Nowhere; (STEPS + 1) * count];
        for step in 1..=STEPS {
            let highest = self.levels.partition_point(|&level| level <= self.squares[step][0]);
            for to in 0..highest {
                let node = step * count + to;
                let mut best = (f64::INFINITY, From::Nowhere);
                if rests[to].0 == step {
                    best = (rests[to].1, From::Start);
                }
                if self.levels[to] <= self.squares[step - 1][1] {
                    let cost_s = costs_s[node - count] + step_s[to];
                    if cost_s < best.0 {
                        best = (cost_s, From::SameLevel);
                    }
                }
                for (from, &(steps, ramp_s)) in ramps[to * count..(to + 1) * count].iter().enumerate() {
                    if from == to || steps >= step {
                        continue;
                    }
                    let cost_s = costs_s[(step - steps) * count + from] + ramp_s + price_s;
                    if cost_s < best.0 {
                        best = (cost_s, From::Level(from as u16));
                    }
                }
                (costs_s[node], froms[node]) = best;
            }
        }
        let end_s = |level: &usize| {
            let (steps, rest_s) = rests[*level];
            STEPS.checked_sub(steps).map_or(f64::INFINITY, |step| costs_s[step * count + level] + rest_s)
        };
        let last = (0..count).min_by(|one, other| end_s(one).total_cmp(&end_s(other))).unwrap_or(0);
        if end_s(&last) == f64::INFINITY {
            Vec::new()
        } else {
            self.traced(&froms, &ramps, last, STEPS - rests[last].0)
        }
    }

    /// The spans of the best walk to a node.
    fn traced(&self, froms: &[From], ramps: &[(usize, f64)], mut level: usize, mut step: usize) -> Vec<[f64; 2]> {
        let count = self.levels.len();
        let travel_m = |step: usize| self.start_m + self.step_m * step as f64;
        let (mut spans_m, mut end) = (Vec::new(), step);
        loop {
            match froms[step * count + level] {
                From::SameLevel => step -= 1,
                From::Level(from) => {
                    spans_m.push([travel_m(step), travel_m(end)]);
                    step -= ramps[level * count + usize::from(from)].0;
                    (level, end) = (usize::from(from), step);
                }
                From::Start | From::Nowhere => break,
            }
        }
        spans_m.push([travel_m(step), travel_m(end)]);
        spans_m.reverse();
        spans_m
    }
}

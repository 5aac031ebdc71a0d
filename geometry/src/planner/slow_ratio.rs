//! The ratio of an S at which its fastest handle is slowest.
//!
//! *Method.* At the ratio with the slowest handle, mostly two handles are equally fast: one becomes slower with the ratio, the other one
//! faster. So the lines through two trials on either side meet near that ratio. Where there are no such lines, golden section goes on.
//! The excess of the slowest handle at two radii leads to the radius at which it vanishes, by the secant. Radii to either side of that
//! one then shorten the bracket from both ends.
//!
//! *Guarantee.* None: the search of `shortest_turn` confirms what is found here.

use super::obstacle::Obstacle;
use super::shortest_turn::{LARGEST_RATIO, NEAREST_RATIOS, RATIO_PER_RADIUS, RATIOS, Search, Trial};
use crate::dragon::{Meter, Spent};
use crate::numerics::GOLDEN;

/// Least distance of a trial from those beside it, as a share of their distance, where lines through them meet.
const BESIDE_KINK: f64 = 1.0 / 32.0;

/// Factor between the distances from a ratio at which trials to either side of it are made.
const WIDENING: f64 = 4.0;

/// Distance of a radius from the one at which handles are expected to be slow enough, as a share of the bracket.
const BESIDE_GUESS: f64 = 1.0 / 64.0;

/// Bound on the steps of a golden section. Each leaves 0.62 of the interval; from a factor of 1.4 to [`NEAREST_RATIOS`] it
/// takes 61 steps.
const GOLDEN_STEPS: u32 = 64;

/// Times by which the fastest handle may become slower more quickly between the trials of a golden section than it does from
/// trial to trial.
const STEEPEST: f64 = 4.0;

/// A trial of a search for the slowest handle: the logarithm of its ratio, its fastest handle and that handle's excess.
#[derive(Clone, Copy)]
struct Dip {
    at: f64,
    excess: f64,
    handle: usize,
}

impl Dip {
    fn of(trial: &Trial) -> Self {
        let handle = if let Some(Obstacle::TooFast(largest)) = trial.obstacle { largest.handle } else { usize::MAX };
        Self { at: trial.ratio.ln(), excess: trial.excess(), handle }
    }

    /// The point at which the line through this dip and another one has the excess of the line through two more.
    fn meeting(&self, other: &Self, two: [&Self; 2]) -> Option<Self> {
        let slope = |one: &Self, other: &Self| (other.excess - one.excess) / (other.at - one.at);
        let [ours, theirs] = [slope(self, other), slope(two[0], two[1])];
        let at = other.at + (two[0].excess - other.excess + theirs * (other.at - two[0].at)) / (ours - theirs);
        let excess = other.excess + ours * (at - other.at);
        excess.is_finite().then_some(Self { at, excess, handle: self.handle })
    }
}

/// Whether a handle is too fast at the middle one of three trials, and no faster there than at the other two.
pub(super) fn is_valley(three: &[Trial]) -> bool {
    let [before, middle, after] = [three[0].excess(), three[1].excess(), three[2].excess()];
    middle < f64::INFINITY && middle <= before && middle <= after
}

/// Where the fastest handle is slowest, between the trials beside the slowest one of them: where the lines through the two nearest
/// trials on either side meet, if there is one handle on each side. With it, the interval that contains it.
fn kink(dips: &[Dip], slowest: usize) -> Option<(Dip, [f64; 2])> {
    let gap = (slowest - 1..=slowest).find(|&i| dips[i].handle != dips[i + 1].handle)?;
    let [before, low, high, beyond] = dips.get(gap.checked_sub(1)?..gap + 3)? else { return None };
    let is_alike = before.handle == low.handle && high.handle == beyond.handle;
    let meeting = before.meeting(low, [high, beyond]).filter(|_| is_alike)?;
    (low.at < meeting.at && meeting.at < high.at).then_some((meeting, [low.at, high.at]))
}

/// Result of a search for the slowest handle at one radius.
#[derive(Clone, Copy)]
pub(super) struct Slowest {
    /// Whether the ratio is clear.
    pub(super) is_clear: bool,
    pub(super) ratio: f64,
    /// The excess at the ratio, by the lines through the trials beside it.
    pub(super) excess: f64,
}

impl Slowest {
    fn clear(ratio: f64) -> Self {
        Self { is_clear: true, ratio, excess: f64::NEG_INFINITY }
    }
}

impl Search<'_> {
    /// The slowest handle near a ratio at which a handle is too fast at most; `None` if the fastest handle is not slower there than
    /// at ratios to either side.
    pub(super) fn slowest_beside(&self, radius_m: f64, excess_m: f64, ratio: f64) -> Result<Option<Slowest>, Spent> {
        let middle = self.trial(self.meter, radius_m, ratio)?;
        if middle.obstacle.is_none() {
            return Ok(Some(Slowest::clear(ratio)));
        }
        let excess = excess_m / radius_m;
        let mut reach = excess.max(NEAREST_RATIOS);
        while middle.excess() < f64::INFINITY && reach < LARGEST_RATIO.powf(2.0 / (RATIOS - 1) as f64) - 1.0 {
            let sides = [ratio / (1.0 + reach), ratio * (1.0 + reach)];
            let sides = self.on_all(2, |i, meter| self.trial(meter, radius_m, sides[i]))?;
            if let Some(clear) = sides.iter().find(|trial| trial.obstacle.is_none()) {
                return Ok(Some(Slowest::clear(clear.ratio)));
            }
            let three = [sides[0], middle, sides[1]];
            if is_valley(&three) {
                let finest = (RATIO_PER_RADIUS * excess).max(NEAREST_RATIOS);
                return self.slowest(self.meter, radius_m, &three, finest).map(Some);
            }
            reach *= WIDENING;
        }
        Ok(None)
    }

    /// The slowest handle between the outer two of three trials. At the middle one, the fastest handle is slowest. The search ends
    /// with a clear ratio, at `finest`, or when the fastest handle would have to become slower [`STEEPEST`] times as quickly as
    /// between the trials to be slow enough.
    pub(super) fn slowest(&self, meter: &Meter, radius_m: f64, three: &[Trial], finest: f64) -> Result<Slowest, Spent> {
        let mut dips: Vec<Dip> = three.iter().map(Dip::of).collect();
        let limit = self.check.staging.speed_ratio;
        let mut slowest = 1;
        for _ in 0..GOLDEN_STEPS {
            let [low, near, high] = [dips[slowest - 1], dips[slowest], dips[slowest + 1]];
            let slope = (low.excess - near.excess) / (near.at - low.at);
            let slope = slope.max((high.excess - near.excess) / (high.at - near.at));
            let is_hopeless = near.excess - STEEPEST * slope * (high.at - low.at) > limit;
            if high.at - low.at <= finest || is_hopeless {
                break;
            }
            let side = if high.at - near.at > near.at - low.at { high.at } else { low.at };
            let golden = near.at + GOLDEN * (side - near.at);
            let at = kink(&dips, slowest).map_or(golden, |(kink, [low, high])| {
                let aside = BESIDE_KINK * (high - low);
                kink.at.clamp(low + aside, high - aside)
            });
            let trial = self.trial(meter, radius_m, at.exp())?;
            if trial.obstacle.is_none() {
                return Ok(Slowest::clear(trial.ratio));
            }
            let place = slowest + usize::from(at > near.at);
            dips.insert(place, Dip::of(&trial));
            slowest = if dips[place].excess < near.excess { place } else { slowest + usize::from(at < near.at) };
        }
        let Dip { at, excess, .. } = kink(&dips, slowest).map_or(dips[slowest], |(kink, _)| kink);
        Ok(Slowest { is_clear: false, ratio: at.exp(), excess })
    }
}

/// The excess of the slowest handle at two radii, the later one last, as a guide to the radius at which it vanishes.
pub(super) struct Guide {
    known: [Option<(f64, f64)>; 2],
    /// The lengths of the last two brackets, the later one last.
    widths_m: [f64; 2],
}

impl Guide {
    pub(super) fn new() -> Self {
        Self { known: [None; 2], widths_m: [f64::INFINITY; 2] }
    }

    pub(super) fn note(&mut self, radius_m: f64, excess: f64) {
        if excess > 0.0 {
            self.known = [self.known[1], Some((radius_m, excess))];
        }
    }

    /// The next radius to try in a bracket: a little beyond the expected one, first on the side of the more distant end. The middle
    /// without an expectation, and if the last two radii have not halved the bracket.
    pub(super) fn next_m(&mut self, [tight_m, clear_m]: [f64; 2], tolerance_m: f64) -> f64 {
        let (middle_m, width_m) = (0.5 * (tight_m + clear_m), clear_m - tight_m);
        let is_slow = width_m > 0.5 * self.widths_m[0];
        self.widths_m = [self.widths_m[1], width_m];
        let [Some((one_m, one)), Some((other_m, other))] = self.known else { return middle_m };
        let guess_m = other_m + other * (other_m - one_m) / (one - other);
        let aside_m = (BESIDE_GUESS * width_m).max(0.25 * tolerance_m).copysign(middle_m - guess_m);
        let tries_m = [guess_m + aside_m, guess_m - aside_m];
        let next_m = tries_m.into_iter().find(|&next_m| tight_m < next_m && next_m < clear_m && !is_slow);
        next_m.unwrap_or(middle_m)
    }
}

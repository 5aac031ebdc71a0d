//! The shortest S in which a dragon can turn round inside a circle, within limits of clearance and speed.
//!
//! The S may begin further in than on the circle, where the spiral has any radius ρ up to the circle's. It is
//! 2·α·ρ / sin α long, with α = atan(2π·ρ/pitch), whatever the ratio of its radii (see `route::turnaround`), and so the
//! longer the larger ρ. What is sought is the least ρ for which the dragon gets through with some ratio.
//!
//! *Method.* Neither the radii nor the ratios with which it does need be an interval. So [`RADII`] radii are tried from
//! the centre outward, each with [`RATIOS`] ratios. Between two ratios at which different things are in the way, say a
//! handle that stops on the one arc and on the other, there may be some at which nothing is: such an interval is halved
//! until something clear is found, or the two obstacles meet. Where a handle is too fast at three ratios, and least in the
//! middle, golden section looks for one between them at which none is. The first radius with a clear ratio and the one before it
//! then bracket the answer, and halving with the same question at each radius finds it.
//!
//! At first only the links are looked at: whether a handle stops or jumps depends on the head's and one body link alone, and
//! the fastest handles are mostly among the first few. A contact is a pair within the clearance that is to remain.
//! If the dragon does not touch itself on the shortest S that they walk, that is the answer. Else contacts are looked for
//! as well, from the entry until the head has gone once round on the way out; and if that is not enough, on all of the
//! passage. Whatever is found is walked through as a whole.
//!
//! *Guarantee.* The answer is clear on the whole passage. That nothing shorter is, is as sure as the sampling is dense:
//! between two radii or ratios tried, at which the same is in the way, clear ones would be missed. Where the set of
//! clear turns comes down to a tip between two obstacles, as on the paper's turnaround, the tip is found exactly.

use super::cores::on_all_cores;
use super::least_clearance::ClosestApproach;
use super::obstacle::{Extent, Obstacle, TurnCheck};
use super::passage::{Staging, TurnPassage, walk_through};
use crate::dragon::{Dimensions, Meter, Spent};
use crate::numerics::{GOLDEN, try_turning_point};
use crate::route::{RADIUS_RATIO, Turnaround};

/// Radii tried, evenly up to the circle's.
const RADII: usize = 64;

/// Ratios tried with each radius, evenly in their logarithm.
const RATIOS: usize = 17;

/// The largest ratio tried, entry to exit or exit to entry.
const LARGEST_RATIO: f64 = 4.0;

/// Two ratios at which different handles or arcs are at fault are halved in on until they are this near: where such
/// obstacles meet in a tip, it is a narrow one.
const NEAREST_RATIOS: f64 = 1e-13;

/// Where one of the two is a contact, until they are this part of what the radius may still lose apart, relative to it: a
/// contact hardly depends on the ratio, so what is clear is wide as soon as it is there.
const RATIO_PER_RADIUS: f64 = 1.0 / 16.0;

/// Radius in metres to which the answer is found.
const TOLERANCE_M: f64 = 1e-10;

/// By how much the answer's radius exceeds the least one found. At the very edge a handle comes to a stop, or its speed
/// has no bound, and rounding would tell differently from one run to the next whether it walks on.
const LEAST_MARGIN_M: f64 = 1e-5;

/// The same where that is not enough: the first of these that is.
const WIDER_MARGINS_M: [f64; 3] = [1e-4, 1e-3, 1e-2];

/// As far as the ratios that are clear beside the answer are looked for, in steps of [`TOLERANCE_M`]: a hundredth.
const FAR: f64 = 1e8;

/// Part of the step out to where a ratio is no longer clear to which that is known.
const EDGE_PART: f64 = 0.75 / 4096.0;

/// What is left between any ratio tried and the least and the greatest that a turn may have: more than [`FAR`] steps.
const RATIO_ROOM: f64 = 1.02;

/// Most steps of a golden section: each leaves 0.62 of the interval, and from a factor of 1.4 to [`NEAREST_RATIOS`] takes 61.
const GOLDEN_STEPS: u32 = 64;

/// How far beside the answer's ratio the limits are told.
const BESIDE: f64 = 1e-6;

/// The shortest S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortestTurn {
    /// The way in and out with it; its turning circle is the one that the S begins on.
    pub turnaround: Turnaround,
    /// Radius of the entry arc ÷ that of the exit arc.
    pub radius_ratio: f64,
    /// Where two benches come nearest on the whole passage; none with fewer than three.
    pub closest: Option<ClosestApproach>,
    /// What is in the way of a tighter S with a lower ratio and with a higher one.
    pub limits: [Option<Obstacle>; 2],
}

/// The shortest S inside the turning circle of this turnaround that the dragon gets through on its whole passage, within the
/// limits of `staging`; none if it gets through no S that was tried.
///
/// All work counts on the meter. `progress` hears of the share of the work that is done, from any thread.
///
/// # Errors
/// The meter is spent before the answer is found.
pub fn shortest_turn(
    turnaround: Turnaround,
    dimensions: Dimensions,
    staging: Staging,
    meter: &Meter,
    progress: impl Fn(f64) + Sync,
) -> Result<Option<ShortestTurn>, Spent> {
    let mut tried = Vec::new();
    // Where the links alone do not get through, nothing else does.
    let mut from_m = 0.0;
    for extent in [Extent::Links, Extent::OnceRound, Extent::Whole] {
        let search = Search { check: TurnCheck { turnaround, dimensions, staging, extent }, meter };
        let Some(tightest) = search.tightest(from_m, &progress)? else { break };
        from_m = tightest.0;
        // Where something else is in the way: once more, looking at more.
        if let Some(found) = search.beside(&tightest, LEAST_MARGIN_M)? {
            return Ok(Some(found));
        }
        tried.push((search, tightest));
    }
    for margin_m in WIDER_MARGINS_M {
        for (search, tightest) in &tried {
            if let Some(found) = search.beside(tightest, margin_m)? {
                return Ok(Some(found));
            }
        }
    }
    Ok(None)
}

/// A ratio and what is in its way.
#[derive(Clone, Copy)]
struct Trial {
    ratio: f64,
    obstacle: Option<Obstacle>,
}

impl Trial {
    /// How fast the fastest handle is, where that alone is in the way.
    fn excess(&self) -> f64 {
        if let Some(Obstacle::TooFast(largest)) = self.obstacle { largest.ratio } else { f64::INFINITY }
    }
}

/// Whether in the middle one of three trials a handle is too fast, and in no other one less so.
fn is_valley(three: &[Trial]) -> bool {
    let [before, middle, after] = [three[0].excess(), three[1].excess(), three[2].excess()];
    middle < f64::INFINITY && middle <= before && middle <= after
}

/// The least radius and a ratio with which the dragon gets through, and what is in the way of a smaller radius.
type Tightest = (f64, f64, [Option<Obstacle>; 2]);

/// Whether turns with this ratio, and with those that are looked at beside it, may be.
fn is_allowed(ratio: f64) -> bool {
    (RADIUS_RATIO.start() * RATIO_ROOM..=RADIUS_RATIO.end() / RATIO_ROOM).contains(&ratio)
}

struct Search<'a> {
    check: TurnCheck,
    meter: &'a Meter,
}

impl Search<'_> {
    /// The tightest of the turns that begin no nearer to the centre than `from_m`.
    fn tightest(&self, from_m: f64, progress: &(impl Fn(f64) + Sync)) -> Result<Option<Tightest>, Spent> {
        let largest_m = 0.5 * self.check.turnaround.turn_diameter_m();
        let step_m = largest_m / RADII as f64;
        let ratios: Vec<f64> =
            (0..RATIOS).map(|i| LARGEST_RATIO.powf(2.0 * i as f64 / (RATIOS - 1) as f64 - 1.0)).collect();
        let mut found = None;
        for i in (from_m / step_m).ceil().max(1.0) as usize..=RADII {
            progress(0.5 / RADII as f64);
            found = self.clear_ratio(step_m * i as f64, step_m, &ratios)?.map(|ratio| (i, ratio));
            if found.is_some() {
                break;
            }
        }
        let Some((first, mut ratio)) = found else { return Ok(None) };
        let (mut tight_m, mut clear_m) = (step_m * (first - 1) as f64, step_m * first as f64);
        // Two ratios to either side: what is clear there shrinks into what was clear before.
        let beside = LARGEST_RATIO.powf(2.0 / (RATIOS - 1) as f64);
        while clear_m - tight_m > TOLERANCE_M {
            let middle_m = 0.5 * (tight_m + clear_m);
            let around: Vec<f64> = [-2, -1, 0, 1, 2]
                .map(|i| ratio * beside.powi(i))
                .into_iter()
                .filter(|ratio| is_allowed(*ratio))
                .collect();
            match self.clear_ratio(middle_m, clear_m - tight_m, &around)? {
                Some(found) => (clear_m, ratio) = (middle_m, found),
                None => tight_m = middle_m,
            }
            progress(0.5 / 32.0);
        }
        if tight_m == 0.0 {
            // However tight the S, the dragon gets through.
            return Ok(Some((clear_m, ratio, [None, None])));
        }
        let [below, above] =
            [1.0 - BESIDE, 1.0 + BESIDE].map(|side| self.check.obstacle(self.meter, tight_m, ratio * side));
        Ok(Some((clear_m, ratio, [below?, above?])))
    }

    /// The turn that begins so much further out than the tightest one, if the dragon gets through it on its whole passage.
    fn beside(&self, &(least_m, ratio, limits): &Tightest, margin_m: f64) -> Result<Option<ShortestTurn>, Spent> {
        let radius_m = least_m + margin_m;
        let radius_ratio = self.middle_ratio(radius_m, ratio)?;
        let turnaround = self.check.turn(radius_m, radius_ratio);
        match walk_through(turnaround, self.check.dimensions, self.check.staging, self.meter, |_| ()) {
            TurnPassage::Clear { closest } => Ok(Some(ShortestTurn { turnaround, radius_ratio, closest, limits })),
            TurnPassage::TooMuchWork(spent) => Err(spent),
            _ => Ok(None),
        }
    }

    /// About the middle of the clear ratios around one, with an S that begins at this radius.
    fn middle_ratio(&self, radius_m: f64, ratio: f64) -> Result<f64, Spent> {
        let [low, high] = [1.0 - TOLERANCE_M, 1.0 + TOLERANCE_M].map(|step| self.edge(radius_m, ratio, step));
        Ok((low? * high?).sqrt())
    }

    /// A ratio with which the dragon gets through an S that begins at this radius, which may still lose `excess_m`: one
    /// of those given or one between two of them at which different things are in the way.
    fn clear_ratio(&self, radius_m: f64, excess_m: f64, ratios: &[f64]) -> Result<Option<f64>, Spent> {
        let trials = self.on_all(ratios.len(), |i, meter| self.trial(meter, radius_m, ratios[i]))?;
        if let Some(clear) = trials.iter().find(|trial| trial.obstacle.is_none()) {
            return Ok(Some(clear.ratio));
        }
        let finest = RATIO_PER_RADIUS * excess_m / radius_m;
        let gaps: Vec<&[Trial]> = trials.windows(2).collect();
        let between = |gap: usize, meter: &Meter| self.between(meter, radius_m, gaps[gap][0], gaps[gap][1], finest);
        if let Some(clear) = self.on_all(gaps.len(), between)?.into_iter().flatten().next() {
            return Ok(Some(clear));
        }
        let valleys: Vec<&[Trial]> = trials.windows(3).filter(|three| is_valley(three)).collect();
        let slowest = |i: usize, meter: &Meter| self.slow_ratio(meter, radius_m, valleys[i], finest);
        Ok(self.on_all(valleys.len(), slowest)?.into_iter().flatten().next())
    }

    /// The results of work on all items, on all cores.
    fn on_all<Answer: Send>(
        &self,
        count: usize,
        work: impl Fn(usize, &Meter) -> Result<Answer, Spent> + Sync,
    ) -> Result<Vec<Answer>, Spent> {
        let answers = on_all_cores(self.meter, count, work);
        if answers.len() < count { Err(self.spent()) } else { answers.into_iter().collect() }
    }

    fn spent(&self) -> Spent {
        self.meter.spent(self.check.turnaround.start_travel_m())
    }

    /// A clear ratio between two that are not, if what is in the way differs; `finest` is how near contacts are halved in on,
    /// relative to the ratio.
    fn between(
        &self,
        meter: &Meter,
        radius_m: f64,
        low: Trial,
        high: Trial,
        finest: f64,
    ) -> Result<Option<f64>, Spent> {
        let (Some(below), Some(above)) = (low.obstacle, high.obstacle) else {
            return Ok(Some(if low.obstacle.is_none() { low.ratio } else { high.ratio }));
        };
        let faults = matches!((below, above), (Obstacle::Fault { .. }, Obstacle::Fault { .. }));
        let nearest = if faults { NEAREST_RATIOS } else { finest };
        if high.ratio <= low.ratio * (1.0 + nearest) || below.resembles(&above) {
            return Ok(None);
        }
        let middle = self.trial(meter, radius_m, (low.ratio * high.ratio).sqrt())?;
        match self.between(meter, radius_m, low, middle, finest)? {
            None => self.between(meter, radius_m, middle, high, finest),
            found => Ok(found),
        }
    }

    /// A clear ratio between the outer two of three trials, of which in the middle one the fastest handle is slowest: golden
    /// section in the logarithm of the ratio, until `finest` or nearer.
    fn slow_ratio(&self, meter: &Meter, radius_m: f64, three: &[Trial], finest: f64) -> Result<Option<f64>, Spent> {
        let [mut low, mut near, mut high] = [three[0].ratio.ln(), three[1].ratio.ln(), three[2].ratio.ln()];
        let mut least = three[1].excess();
        for _ in 0..GOLDEN_STEPS {
            if high - low <= finest.max(NEAREST_RATIOS) {
                break;
            }
            let far =
                if high - near > near - low { near + GOLDEN * (high - near) } else { near - GOLDEN * (near - low) };
            let trial = self.trial(meter, radius_m, far.exp())?;
            if trial.obstacle.is_none() {
                return Ok(Some(trial.ratio));
            }
            match (trial.excess() < least, far > near) {
                (true, true) => (low, near, least) = (near, far, trial.excess()),
                (true, false) => (high, near, least) = (near, far, trial.excess()),
                (false, true) => high = far,
                (false, false) => low = far,
            }
        }
        Ok(None)
    }

    /// About the last clear ratio in one direction from a clear one, or a ratio far from it.
    fn edge(&self, radius_m: f64, ratio: f64, step: f64) -> Result<f64, Spent> {
        let clear = |exponent: f64| -> Result<bool, Spent> {
            Ok(self.check.obstacle(self.meter, radius_m, ratio * step.powf(exponent))?.is_none())
        };
        let mut far = 1.0;
        while far < FAR && clear(far)? {
            far *= 4.0;
        }
        let (near, _) =
            try_turning_point(0.25 * far, far, EDGE_PART * far, |exponent| clear(exponent).map(|clear| !clear))?;
        Ok(ratio * step.powf(near))
    }

    fn trial(&self, meter: &Meter, radius_m: f64, ratio: f64) -> Result<Trial, Spent> {
        Ok(Trial { ratio, obstacle: self.check.obstacle(meter, radius_m, ratio)? })
    }
}

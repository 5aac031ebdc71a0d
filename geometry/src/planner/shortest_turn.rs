//! The shortest S of two arcs in which a dragon can turn inside a circle, within limits of clearance and speed.
//!
//! `turn_line` tries a line between the arcs. The S may begin further in than the circle, where the spiral has any radius ρ up
//! to the circle's radius. It has the length 2·α·ρ / sin α, with α = atan(2π·ρ/pitch), for every ratio of its radii (see
//! `route::turnaround`). So the S is longer for a larger ρ. The search finds the least ρ at which the dragon passes with some
//! ratio.
//!
//! *Method.* Neither the radii nor the ratios at which the dragon passes need be an interval. So the search tries [`RADII`]
//! radii from the centre outward, each with [`RATIOS`] ratios. Two neighbouring ratios may have different obstacles, for
//! example a handle that stops on one arc and on the other. Between them there may be a clear ratio. Such an interval is
//! bisected until a clear ratio is found, or the two obstacles meet. If a handle is too fast at three neighbouring ratios, and
//! slowest at the middle one, the ratio at which it is slowest is searched for (see `slow_ratio`).
//!
//! The first radius with a clear ratio and the radius before it bracket the answer. The bracket is narrowed with the same search, or,
//! where handles are too fast, with that of the slowest ratio alone. At last, the whole search confirms that the lower end of the
//! bracket has no clear ratio.
//!
//! The first search checks only the links. Whether a handle stops or jumps depends only on the head's link and one body link,
//! and the fastest handles are mostly among the first few. A contact is a pair within the required clearance. If the dragon
//! does not touch itself on the shortest S of this search, that S is the answer. Otherwise the next search also checks
//! contacts, from the entry until the head has walked once round on the way out. If that is not enough, the last search checks
//! the whole passage. Every answer is verified on the whole passage.
//!
//! *Hills.* On hills each trial walks along the ground. The shortest S is that in the plan.
//!
//! *Guarantee.* The answer is clear on the whole passage. That no shorter S is clear depends on the density of the samples:
//! clear radii or ratios between two samples with the same obstacle are missed. If the set of clear turns ends in a tip between
//! two obstacles, as on the paper's turnaround, the tip is found exactly.

use super::cores::on_all_cores;
use super::least_clearance::ClosestApproach;
use super::obstacle::{Extent, Obstacle, TurnCheck};
use super::passage::{Staging, TurnPassage, walk_through};
use super::planned_turn::PlannedTurn;
use super::slow_ratio::{Guide, is_valley};
use crate::dragon::{Dimensions, FeasibleEnd, Meter, Spent};
use crate::numerics::try_turning_point;
use crate::route::{RADIUS_RATIO, Turnaround};

/// Number of radii tried, evenly spaced up to the circle's radius.
const RADII: usize = 64;

/// Number of ratios tried with each radius, evenly spaced in their logarithm.
pub(super) const RATIOS: usize = 17;

/// The largest ratio tried, of entry to exit or of exit to entry.
pub(super) const LARGEST_RATIO: f64 = 4.0;

/// Least relative distance of two ratios.
pub(super) const NEAREST_RATIOS: f64 = 1e-13;

/// Bisection between two faults of different handles or arcs ends at this share of the radius's remaining bracket, relative to
/// the radius. Where such obstacles meet in a tip, the tip is narrow.
const FAULT_RATIO_PER_RADIUS: f64 = 1e-6;

/// The same if one of the two obstacles is a contact or a handle that is too fast. They hardly depend on the ratio, so an
/// interval of clear ratios is wide as soon as it exists.
pub(super) const RATIO_PER_RADIUS: f64 = 1.0 / 16.0;

/// Tolerance of the answer's radius, in metres.
const TOLERANCE_M: f64 = 1e-10;

/// Amount by which the answer's radius exceeds the least one found, in metres. At the least radius a handle stops, or its speed
/// is unbounded. There, rounding would decide differently from one run to the next whether the handle walks on.
pub(super) const LEAST_MARGIN_M: f64 = 1e-5;

/// Larger amounts, tried in this order if [`LEAST_MARGIN_M`] is not enough.
const WIDER_MARGINS_M: [f64; 3] = [1e-4, 1e-3, 1e-2];

/// Largest distance from the answer at which clear ratios are searched for, in steps of [`TOLERANCE_M`]: a hundredth of the
/// ratio.
const FAR: f64 = 1e8;

/// Tolerance of the last clear ratio, as a share of the step out to a ratio that is not clear.
const EDGE_PART: f64 = 0.75 / 4096.0;

/// Factor between any ratio tried and the limits of the allowed ratios: more than [`FAR`] steps.
const RATIO_ROOM: f64 = 1.02;

/// Relative distance from the answer's ratio at which the limits are determined.
const BESIDE: f64 = 1e-6;

/// The shortest S.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShortestTurn {
    /// The turnaround with this S. Its turning circle is the one on which the S begins.
    pub turnaround: Turnaround,
    /// Radius of the entry arc ÷ that of the exit arc.
    pub radius_ratio: f64,
    /// The closest approach of two benches on the whole passage; `None` with fewer than three benches.
    pub closest: Option<ClosestApproach>,
    /// The obstacles of a tighter S with a slightly lower and a slightly higher ratio.
    pub limits: [Option<Obstacle>; 2],
}

/// Finds the shortest S, inside the turning circle of this turnaround, that the dragon passes within the limits of `staging`.
/// The limits hold on the whole passage. Returns `None` if the dragon passes no S that was tried.
///
/// The meter counts all work. `progress` receives the share of the work that each step completes, from any thread.
///
/// # Errors
/// The meter is spent before the answer is found.
pub fn shortest_turn(
    planned: impl Into<PlannedTurn>,
    dimensions: Dimensions,
    staging: Staging,
    meter: &Meter,
    progress: impl Fn(f64) + Sync,
) -> Result<Option<ShortestTurn>, Spent> {
    let planned = planned.into();
    let mut tried = Vec::new();
    // A radius at which the links alone do not pass is not clear for the wider checks either.
    let mut from_m = 0.0;
    for extent in Extent::ALL {
        let planned = planned.clone();
        let search = Search { check: TurnCheck { planned, dimensions, staging, extent, line_m: 0.0 }, meter };
        let Some(tightest) = search.tightest(from_m, &progress)? else { break };
        from_m = tightest.0;
        // If the whole passage has another obstacle, the search repeats with a wider check.
        if let Some(found) = search.beside(&tightest, LEAST_MARGIN_M)? {
            return Ok(Some(found));
        }
        tried.push((search, tightest));
    }
    beside_any(&tried)
}

/// The first of these turns that the dragon passes on its whole passage, with one of the wider margins.
pub(super) fn beside_any(tried: &[(Search<'_>, Tightest)]) -> Result<Option<ShortestTurn>, Spent> {
    for margin_m in WIDER_MARGINS_M {
        for (search, tightest) in tried {
            if let Some(found) = search.beside(tightest, margin_m)? {
                return Ok(Some(found));
            }
        }
    }
    Ok(None)
}

/// A ratio and its obstacle, if it has one.
#[derive(Clone, Copy)]
pub(super) struct Trial {
    pub(super) ratio: f64,
    pub(super) obstacle: Option<Obstacle>,
}

impl Trial {
    /// Speed ratio of the fastest handle, if only the speed is the obstacle; otherwise infinite.
    pub(super) fn excess(&self) -> f64 {
        if let Some(Obstacle::TooFast(largest)) = self.obstacle { largest.ratio } else { f64::INFINITY }
    }
}

/// The least radius at which the dragon passes, a ratio at which it passes, and the obstacles of a smaller radius.
pub(super) type Tightest = (f64, f64, [Option<Obstacle>; 2]);

/// A ratio, and two to either side: clear ratios at a smaller radius lie within those at a larger one.
pub(super) fn ratios_around(ratio: f64) -> Vec<f64> {
    let beside = LARGEST_RATIO.powf(2.0 / (RATIOS - 1) as f64);
    [-2, -1, 0, 1, 2].map(|i| ratio * beside.powi(i)).into_iter().filter(|ratio| is_allowed(*ratio)).collect()
}

/// All ratios that the first search tries, from small to large.
pub(super) fn all_ratios() -> Vec<f64> {
    (0..RATIOS).map(|i| LARGEST_RATIO.powf(2.0 * i as f64 / (RATIOS - 1) as f64 - 1.0)).collect()
}

/// Whether a ratio and the ratios tried beside it are within the allowed range.
fn is_allowed(ratio: f64) -> bool {
    (RADIUS_RATIO.start() * RATIO_ROOM..=RADIUS_RATIO.end() / RATIO_ROOM).contains(&ratio)
}

/// A search for turns that a dragon passes.
pub(super) struct Search<'a> {
    pub(super) check: TurnCheck,
    pub(super) meter: &'a Meter,
}

impl Search<'_> {
    /// The tightest turn that begins at least `from_m` from the centre.
    fn tightest(&self, from_m: f64, progress: &(impl Fn(f64) + Sync)) -> Result<Option<Tightest>, Spent> {
        let largest_m = 0.5 * self.check.planned.turnaround().turn_diameter_m();
        let step_m = largest_m / RADII as f64;
        let ratios = all_ratios();
        let mut found = None;
        for i in (from_m / step_m).ceil().max(1.0) as usize..=RADII {
            progress(0.5 / RADII as f64);
            found = self.clear_ratio(step_m * i as f64, step_m, &ratios)?.map(|ratio| (i, ratio));
            if found.is_some() {
                break;
            }
        }
        let Some((first, ratio)) = found else { return Ok(None) };
        let bracket_m = [step_m * (first - 1) as f64, step_m * first as f64];
        self.refine(bracket_m, ratio, TOLERANCE_M, || progress(0.5 / 32.0)).map(Some)
    }

    /// The least radius at which the dragon passes, to `tolerance_m`. At the upper end of the bracket it passes with this ratio, at
    /// the lower end it does not pass. `step` is called after each step.
    pub(super) fn refine(
        &self,
        [mut tight_m, mut clear_m]: [f64; 2],
        mut ratio: f64,
        tolerance_m: f64,
        step: impl Fn(),
    ) -> Result<Tightest, Spent> {
        // The whole search found no clear ratio at this radius.
        let mut searched_m = tight_m;
        loop {
            let mut guide = Guide::new();
            let mut centre = ratio;
            while clear_m - tight_m > tolerance_m {
                let (next_m, width_m) = (guide.next_m([tight_m, clear_m], tolerance_m), clear_m - tight_m);
                let found = if let Some(slowest) = self.slowest_beside(next_m, width_m, centre)? {
                    guide.note(next_m, slowest.excess - self.check.staging.speed_ratio);
                    centre = slowest.ratio;
                    slowest.is_clear.then_some(slowest.ratio)
                } else {
                    let found = self.clear_ratio(next_m, width_m, &ratios_around(ratio))?;
                    searched_m = if found.is_none() { next_m } else { searched_m };
                    found
                };
                match found {
                    Some(found) => (clear_m, ratio) = (next_m, found),
                    None => tight_m = next_m,
                }
                step();
            }
            if searched_m == tight_m {
                break;
            }
            match self.clear_ratio(tight_m, clear_m - tight_m, &ratios_around(ratio))? {
                Some(found) => (clear_m, ratio, tight_m) = (tight_m, found, searched_m),
                None => break,
            }
        }
        if tight_m == 0.0 {
            // The dragon passes however tight the S is.
            return Ok((clear_m, ratio, [None, None]));
        }
        let [below, above] =
            [1.0 - BESIDE, 1.0 + BESIDE].map(|side| self.check.obstacle(self.meter, tight_m, ratio * side));
        Ok((clear_m, ratio, [below?, above?]))
    }

    /// The turn that begins `margin_m` further out than the tightest one, if the dragon passes it on its whole passage.
    pub(super) fn beside(
        &self,
        &(least_m, ratio, limits): &Tightest,
        margin_m: f64,
    ) -> Result<Option<ShortestTurn>, Spent> {
        let radius_m = least_m + margin_m;
        let radius_ratio = self.middle_ratio(radius_m, ratio)?;
        let turnaround = self.check.turn(radius_m, radius_ratio);
        match walk_through(
            self.check.planned.with(turnaround),
            self.check.dimensions,
            self.check.staging,
            self.meter,
            |_| (),
        ) {
            TurnPassage::Clear { closest } => Ok(Some(ShortestTurn { turnaround, radius_ratio, closest, limits })),
            TurnPassage::TooMuchWork(spent) => Err(spent),
            _ => Ok(None),
        }
    }

    /// Approximate middle of the clear ratios around `ratio`, for an S that begins at this radius.
    fn middle_ratio(&self, radius_m: f64, ratio: f64) -> Result<f64, Spent> {
        let [low, high] = [1.0 - TOLERANCE_M, 1.0 + TOLERANCE_M].map(|step| self.edge(radius_m, ratio, step));
        Ok((low? * high?).sqrt())
    }

    /// A ratio at which the dragon passes an S that begins at this radius. It is one of `ratios`, or lies between them.
    /// `excess_m` is the remaining bracket of the radius.
    pub(super) fn clear_ratio(&self, radius_m: f64, excess_m: f64, ratios: &[f64]) -> Result<Option<f64>, Spent> {
        let trials = self.on_all(ratios.len(), |i, meter| self.trial(meter, radius_m, ratios[i]))?;
        if let Some(clear) = trials.iter().find(|trial| trial.obstacle.is_none()) {
            return Ok(Some(clear.ratio));
        }
        let excess = excess_m / radius_m;
        let finest = (RATIO_PER_RADIUS * excess).max(NEAREST_RATIOS);
        let valleys: Vec<&[Trial]> = trials.windows(3).filter(|three| is_valley(three)).collect();
        let slowest = |i: usize, meter: &Meter| self.slowest(meter, radius_m, valleys[i], finest);
        let slowest = self.on_all(valleys.len(), slowest)?;
        if let Some(clear) = slowest.into_iter().find(|slowest| slowest.is_clear) {
            return Ok(Some(clear.ratio));
        }
        let gaps: Vec<&[Trial]> = trials.windows(2).collect();
        let between = |gap: usize, meter: &Meter| self.between(meter, radius_m, gaps[gap][0], gaps[gap][1], excess);
        Ok(self.on_all(gaps.len(), between)?.into_iter().flatten().next())
    }

    /// Runs `work` on all items, on all cores.
    pub(super) fn on_all<Answer: Send>(
        &self,
        count: usize,
        work: impl Fn(usize, &Meter) -> Result<Answer, Spent> + Sync,
    ) -> Result<Vec<Answer>, Spent> {
        let answers = on_all_cores(self.meter, count, work);
        if answers.len() < count { Err(self.spent()) } else { answers.into_iter().collect() }
    }

    fn spent(&self) -> Spent {
        self.meter.spent(self.check.planned.turnaround().start_travel_m())
    }

    /// A clear ratio between two ratios with different obstacles. `excess` is the remaining bracket of the radius, relative to
    /// the radius.
    fn between(
        &self,
        meter: &Meter,
        radius_m: f64,
        low: Trial,
        high: Trial,
        excess: f64,
    ) -> Result<Option<f64>, Spent> {
        let (Some(below), Some(above)) = (low.obstacle, high.obstacle) else {
            return Ok(Some(if low.obstacle.is_none() { low.ratio } else { high.ratio }));
        };
        let Some(share) = self.finest_share(&below, &above) else { return Ok(None) };
        if high.ratio <= low.ratio * (1.0 + (share * excess).max(NEAREST_RATIOS)) {
            return Ok(None);
        }
        let middle = self.trial(meter, radius_m, (low.ratio * high.ratio).sqrt())?;
        match self.between(meter, radius_m, low, middle, excess)? {
            None => self.between(meter, radius_m, middle, high, excess),
            found => Ok(found),
        }
    }

    /// Share of the radius's remaining bracket at which bisection between two obstacles ends; `None` if they are of the same
    /// kind. With a limit of speed, a handle that jumps is of the kind of one that is too fast, because it was too fast before.
    fn finest_share(&self, below: &Obstacle, above: &Obstacle) -> Option<f64> {
        let are_fast = [below, above].map(|obstacle| {
            let jumps = matches!(obstacle, Obstacle::Fault { end: FeasibleEnd::HandleJumps { .. }, .. });
            matches!(obstacle, Obstacle::TooFast(_)) || jumps && self.check.staging.limits_speed()
        });
        if below.resembles(above) || are_fast == [true; 2] {
            return None;
        }
        let are_faults = [below, above].map(|obstacle| matches!(obstacle, Obstacle::Fault { .. }));
        Some(if are_faults == [true; 2] && are_fast == [false; 2] { FAULT_RATIO_PER_RADIUS } else { RATIO_PER_RADIUS })
    }

    /// Approximate last clear ratio in one direction from a clear one, or a ratio far from it.
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

    pub(super) fn trial(&self, meter: &Meter, radius_m: f64, ratio: f64) -> Result<Trial, Spent> {
        Ok(Trial { ratio, obstacle: self.check.obstacle(meter, radius_m, ratio)? })
    }
}

//! The shortest S with a straight line between its two arcs.
//!
//! A line lets the links straighten before they bend the other way, so the arcs may be tighter. But for arcs of the same radii,
//! a line lengthens the S by about 8/3·r·λ³ if α is near π/2 (see `route::turnaround` for the terms). So the S becomes shorter
//! up to some length of the line, and longer beyond.
//!
//! *Method.* Lengths of the line are whole multiples of a decimal unit, about a hundredth of the longer link, so that the line
//! can be measured out on the ground. The search first tries [`COARSE_LINES`] lines, each [`COARSE_PER_LINK`]th of the longer
//! link longer than the one before. Then it tries lines to either side of the best one, at distances that are halved down to
//! one unit. A line is better if the dragon passes an S with it that is shorter than the best one so far by [`GAIN`]. Only then
//! the radius is reduced further. At a fixed line, the length of the S grows with the radius ρ at which it begins. The search
//! at each radius, the extents of the checks and the verification are those of `shortest_turn`.
//!
//! *Guarantee.* The answer is clear on the whole passage, and shorter than the S that it is compared with. That no other line
//! gives a shorter S is not proved.

use super::obstacle::{Extent, TurnCheck};
use super::passage::Staging;
use super::planned_turn::PlannedTurn;
use super::shortest_turn::{LEAST_MARGIN_M, Search, ShortestTurn, Tightest, all_ratios, beside_any, ratios_around};
use crate::dragon::{Dimensions, Meter, Spent};
use crate::numerics::turning_point;

/// Number of lines tried first.
const COARSE_LINES: u32 = 16;

/// Number of those lines for each length of the longer link.
const COARSE_PER_LINK: u32 = 8;

/// Number of those lines behind the best one that end the first search.
const FRUITLESS: u32 = 4;

/// Units per length of the longer link, at least. A unit is a power of ten in metres.
const UNITS_PER_LINK: f64 = 100.0;

/// Share by which an S must be shorter to count as shorter. Also the tolerance of a radius while lines are compared.
const GAIN: f64 = 1e-4;

/// Tolerance of the answer's radius, in metres. It is below [`LEAST_MARGIN_M`].
const RADIUS_M: f64 = 1e-6;

/// First step from a radius at which the dragon passes to a smaller one, relative to the radius.
const FIRST_STEP: f64 = 1.0 / 256.0;

/// Finds the shortest S with a line, inside the turning circle of this turnaround, that the dragon passes within the limits of
/// `staging`. It is shorter than `arcs`, the shortest S without a line, if there is one. Returns `None` if no line that was
/// tried gives such an S.
///
/// The meter counts all work. `progress` receives the share of the work that each step completes, from any thread.
///
/// # Errors
/// The meter is spent before the answer is found.
pub fn shortest_turn_with_line(
    planned: impl Into<PlannedTurn>,
    dimensions: Dimensions,
    staging: Staging,
    arcs: Option<&ShortestTurn>,
    meter: &Meter,
    progress: impl Fn(f64) + Sync,
) -> Result<Option<ShortestTurn>, Spent> {
    let planned = planned.into();
    let mut tried = Vec::new();
    let shorter =
        |turn: &ShortestTurn| arcs.is_none_or(|arcs| turn.turnaround.turn_length_m() < arcs.turnaround.turn_length_m());
    for extent in Extent::ALL {
        let lines = Lines::new(&planned, dimensions, staging, extent, meter);
        let Some((search, tightest)) = lines.shortest(arcs, &progress)? else { break };
        if let Some(found) = search.beside(&tightest, LEAST_MARGIN_M)?.filter(shorter) {
            return Ok(Some(found));
        }
        tried.push((search, tightest));
    }
    Ok(beside_any(&tried)?.filter(shorter))
}

/// An S with a line, which the dragon passes.
#[derive(Clone, Copy)]
struct Lined {
    /// Length of the line, in units.
    units: u32,
    /// Radii at which the S begins: one at which the dragon does not pass, and this one.
    bracket_m: [f64; 2],
    ratio: f64,
    /// Length of the S.
    length_m: f64,
}

struct Lines<'a> {
    planned: PlannedTurn,
    dimensions: Dimensions,
    staging: Staging,
    extent: Extent,
    meter: &'a Meter,
    units_per_m: f64,
    /// Difference of two neighbouring lines of the first search, in units.
    coarse: u32,
}

impl<'a> Lines<'a> {
    fn new(planned: &PlannedTurn, dimensions: Dimensions, staging: Staging, extent: Extent, meter: &'a Meter) -> Self {
        let link_m = dimensions.link_m(0).max(dimensions.link_m(dimensions.benches() - 1));
        let units_per_m = 10_f64.powi((UNITS_PER_LINK / link_m).log10().ceil() as i32);
        let coarse = (link_m * units_per_m / f64::from(COARSE_PER_LINK)).round() as u32;
        Self { planned: planned.clone(), dimensions, staging, extent, meter, units_per_m, coarse }
    }

    /// The shortest S with a line, with its search; `None` if none is shorter than `arcs`.
    fn shortest(
        &self,
        arcs: Option<&ShortestTurn>,
        progress: &(impl Fn(f64) + Sync),
    ) -> Result<Option<(Search<'a>, Tightest)>, Spent> {
        let mut best: Option<Lined> = None;
        let ahead = |best: Option<Lined>| {
            let found = best.map(|best| (best.length_m, best.ratio));
            found.or(arcs.map(|arcs| (arcs.turnaround.turn_length_m(), arcs.radius_ratio)))
        };
        for i in 1..=COARSE_LINES {
            best = self.shorter(self.coarse * i, ahead(best))?.or(best);
            progress(0.5 / f64::from(COARSE_LINES));
            if best.is_some_and(|best| i * self.coarse >= best.units + FRUITLESS * self.coarse) {
                break;
            }
        }
        let Some(mut best) = best else { return Ok(None) };
        let mut step = self.coarse;
        while step > 1 {
            step = step.div_ceil(2);
            for units in [best.units.saturating_sub(step), best.units + step] {
                best = self.shorter(units, ahead(Some(best)))?.unwrap_or(best);
            }
            progress(0.25 / f64::from(self.coarse.ilog2() + 1));
        }
        let search = self.search(best.units);
        let tightest = search.refine(best.bracket_m, best.ratio, RADIUS_M, || progress(0.25 / 32.0))?;
        Ok(Some((search, tightest)))
    }

    fn search(&self, units: u32) -> Search<'a> {
        let &Self { dimensions, staging, extent, meter, .. } = self;
        let line_m = f64::from(units) / self.units_per_m;
        Search { check: TurnCheck { planned: self.planned.clone(), dimensions, staging, extent, line_m }, meter }
    }

    /// The shortest S with a line of this length; `None` if it is not shorter than the length of `ahead`. `ahead` also has the
    /// ratio near which ratios are tried.
    fn shorter(&self, units: u32, ahead: Option<(f64, f64)>) -> Result<Option<Lined>, Spent> {
        let search = self.search(units);
        let line_m = search.check.line_m;
        let length_m = |radius_m| search.check.turn(radius_m, 1.0).turn_length_m();
        let largest_m = 0.5 * self.planned.turnaround().turn_diameter_m();
        // A line needs a longer diameter. At the least one, the arcs have a radius of 0.
        let least_m = 0.5 * line_m * (1.0 + GAIN);
        if units == 0 || least_m >= largest_m {
            return Ok(None);
        }
        let longest_m = ahead.map_or(f64::INFINITY, |(length_m, _)| length_m * (1.0 - GAIN));
        let radius_m = if length_m(largest_m) <= longest_m {
            largest_m
        } else {
            let tolerance_m = GAIN * GAIN * largest_m;
            turning_point(least_m, largest_m, tolerance_m, |radius_m| length_m(radius_m) > longest_m).0
        };
        let ratios = ahead.map_or_else(all_ratios, |(_, ratio)| ratios_around(ratio));
        let Some(ratio) = search.clear_ratio(radius_m, GAIN * radius_m, &ratios)? else { return Ok(None) };
        let (bracket_m, ratio) = tightened(&search, radius_m, ratio, least_m)?;
        let (radius_m, ratio, _) = search.refine(bracket_m, ratio, GAIN * radius_m, || ())?;
        let bracket_m = [bracket_m[0].max(radius_m * (1.0 - 2.0 * GAIN)), radius_m];
        Ok(Some(Lined { units, bracket_m, ratio, length_m: length_m(radius_m) }))
    }
}

/// A bracket of the least radius at which the dragon passes, and a ratio at its upper end. From a radius at which the dragon
/// passes, the steps inward are doubled until it does not pass, or at `least_m`.
fn tightened(search: &Search<'_>, mut radius_m: f64, mut ratio: f64, least_m: f64) -> Result<([f64; 2], f64), Spent> {
    let mut step_m = FIRST_STEP * radius_m;
    loop {
        let next_m = radius_m - step_m;
        if next_m <= least_m {
            return Ok(([least_m, radius_m], ratio));
        }
        match search.clear_ratio(next_m, step_m, &ratios_around(ratio))? {
            Some(found) => (radius_m, ratio) = (next_m, found),
            None => return Ok(([next_m, radius_m], ratio)),
        }
        step_m *= 2.0;
    }
}

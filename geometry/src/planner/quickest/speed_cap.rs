//! The fastest handle over the whole run, bounded between samples.
//!
//! The terms: R(s) is the largest speed ratio of any handle with the head at the travel s, Lᵢ the logarithm of the ratio of
//! handle i, and L = ln R. The run is divided into cells. The chain is solved at the ends of each cell.
//!
//! 1. Lᵢ is the sum of ln g over the links before handle i (see `link_growth`). Its derivative by s is the sum of (ln g)' times
//!    the ratio of each link's front handle. Bounds on these give an interval [p, q] that contains Lᵢ' on the cell.
//! 2. A function with that derivative, a mean growth of m, and a cell of width h stays within (q − m)·(m − p)/(q − p)·h of the
//!    straight line between its ends: it is furthest from it where two lines of slopes p and q meet. This is Lᵢ's *slack*.
//! 3. Over the cell, no Lᵢ exceeds the straight line between the values of L at the ends by more than the cell's *excess*: the
//!    slack of Lᵢ, minus the least distance of its own line below. Some Lᵢ is below that line by the *deficit* at most.
//! 4. The head's largest squared speed is V² = limit²·exp(−2L). The straight line between two values x and x·exp(y) is over
//!    the exponential curve between them by a factor of exp(y²/8) at most (Hoeffding's lemma). So V² is at least the straight
//!    line between limit²·exp(−2L) at the ends, times exp(−2·(excess + (ΔL)²/4)), and at most that line times exp(2·deficit).
//!
//! *Precondition.* The dragon walks its whole route, on level ground.
//!
//! *Guarantee.* The bounds hold everywhere, not only at samples, up to the rounding of a chain.

use super::RunLimits;
use super::curve::Curve;
use super::link_growth::{Angles, WalkingLink};
use crate::dragon::{Chain, Dragon, Handle, Meter, Spent};
use crate::numerics::Interval;
use crate::planner::cores::on_all_cores;

/// Cells per length of the shortest link, before they are divided.
const CELLS_PER_LINK: f64 = 64.0;

/// Largest excess of a cell in which the limit of the handles may bind: with it, the head is slower by this share.
const MOST_EXCESS: f64 = 1e-4;

/// The same for the deficit, which bounds the shortest duration. It is larger only where the fastest handle changes.
const MOST_DEFICIT: f64 = 1e-3;

/// Rounding of a logarithm of a ratio, per handle.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Most halvings of a cell. A narrower one would be shorter than rounding.
const MOST_HALVINGS: u32 = 26;

/// Number of undivided cells that a core takes at a time.
const CELLS_AT_A_TIME: usize = 16;

/// Work for a link of a cell besides its solution, in steps.
const STEPS_PER_LINK: u64 = 3;

/// Work for a cell besides its links, in steps. So the limit of work bounds the number of stored cells, which take some hundred
/// bytes each.
const STEPS_PER_CELL: u64 = 100;

/// Bounds on the largest squared speed of the head at which no handle exceeds its limit.
pub(super) struct SpeedCap {
    /// A curve that the largest squared speed is never below.
    pub(super) safe: Curve,
    /// A curve that the largest squared speed is never above.
    pub(super) loose: Curve,
}

/// The chain at one travel.
struct Stance {
    travel_m: f64,
    parameters: Vec<f64>,
    /// Lᵢ of each handle.
    logarithms: Vec<f64>,
    /// The angles of each link.
    angles: Vec<Angles>,
    /// L.
    largest: f64,
}

/// A part of the run, from a stance to the next.
#[derive(Clone, Copy, Debug)]
struct Cell {
    from_m: f64,
    /// L at both ends.
    largest: [f64; 2],
    /// Includes (ΔL)²/4.
    excess: f64,
    deficit: f64,
}

impl SpeedCap {
    /// The cap for a dragon.
    ///
    /// # Errors
    /// The dragon's meter is spent, or a cell is too narrow to be divided.
    pub(super) fn of(dragon: &Dragon, limits: &RunLimits) -> Result<Self, Spent> {
        let [start_m, end_m] = [dragon.start_travel_m(), dragon.end_travel_m()];
        let dimensions = dragon.dimensions();
        let link_m = dimensions.link_m(0).min(dimensions.link_m(dimensions.benches() - 1));
        let count = ((end_m - start_m) * CELLS_PER_LINK / link_m).ceil().max(1.0) as usize;
        let end_of = |cell: usize| match cell {
            last if last >= count => end_m,
            cell => start_m + (end_m - start_m) * (cell as f64 / count as f64),
        };
        let cells = on_all_cores(dragon.meter(), count.div_ceil(CELLS_AT_A_TIME), |chunk, meter| {
            let first = chunk * CELLS_AT_A_TIME;
            let cells = Cells { dragon: &dragon.metered(meter), limits };
            let mut earlier = cells.stance(end_of(first));
            let mut found = Vec::new();
            for cell in first..(first + CELLS_AT_A_TIME).min(count) {
                let later = cells.stance(end_of(cell + 1));
                if !cells.divide(&earlier, &later, MOST_HALVINGS, &mut found) {
                    meter.exhaust();
                    return Err(earlier.travel_m);
                }
                earlier = later;
            }
            Ok(found)
        });
        let meter = dragon.meter();
        let spent = |reached_m| Err(meter.spent(reached_m));
        let mut all: Vec<Cell> = Vec::new();
        for chunk in &cells {
            match chunk {
                Ok(cells) => all.extend(cells),
                Err(reached_m) => return spent(*reached_m),
            }
        }
        if cells.len() * CELLS_AT_A_TIME < count {
            return spent(end_of(cells.len() * CELLS_AT_A_TIME));
        }
        Ok(Self::over(&all, end_m, limits))
    }

    /// Step 4.
    fn over(cells: &[Cell], end_m: f64, limits: &RunLimits) -> Self {
        let most = limits.handle_mps * limits.handle_mps;
        let knot = |number: usize, share: &dyn Fn(&Cell) -> f64, pick: fn(f64, f64) -> f64| {
            let (before, behind) = (number.checked_sub(1).map(|before| &cells[before]), cells.get(number));
            let largest = behind.map_or_else(|| before.map_or(0.0, |cell| cell.largest[1]), |cell| cell.largest[0]);
            let shares = [before, behind].into_iter().flatten().map(share);
            let share = shares.reduce(pick).unwrap_or(0.0);
            let travel_m = behind.map_or(end_m, |cell| cell.from_m);
            [travel_m, most * (2.0 * (share - largest)).exp()]
        };
        let knots = |share: &dyn Fn(&Cell) -> f64, pick: fn(f64, f64) -> f64| {
            Curve::new((0..=cells.len()).map(|number| knot(number, share, pick)).collect())
        };
        Self { safe: knots(&|cell| -cell.excess, f64::min), loose: knots(&|cell| cell.deficit, f64::max) }
    }
}

struct Cells<'a> {
    dragon: &'a Dragon,
    limits: &'a RunLimits,
}

impl Cells<'_> {
    fn meter(&self) -> &Meter {
        self.dragon.meter()
    }

    fn stance(&self, travel_m: f64) -> Stance {
        let chain: Chain<'_> = self.dragon.chain(travel_m).expect("the travel lies within the run");
        let handles: Vec<Handle> = chain.collect();
        let logarithms: Vec<f64> = handles.iter().map(|handle| handle.speed_ratio.ln()).collect();
        Stance {
            travel_m,
            parameters: handles.iter().map(|handle| handle.parameter).collect(),
            largest: logarithms.iter().copied().fold(0.0, f64::max),
            angles: handles.windows(2).map(|ends| Angles::of(&ends[0], &ends[1])).collect(),
            logarithms,
        }
    }

    /// Adds the cells between two stances, which are halved until their bounds are narrow. `false` if that takes too much.
    fn divide(&self, earlier: &Stance, later: &Stance, halvings: u32, cells: &mut Vec<Cell>) -> bool {
        if self.meter().is_spent() {
            return false;
        }
        self.meter().add(STEPS_PER_CELL + STEPS_PER_LINK * earlier.angles.len() as u64);
        if let Some(cell) = self.cell(earlier, later) {
            cells.push(cell);
            return true;
        }
        let middle_m = 0.5 * (earlier.travel_m + later.travel_m);
        if halvings == 0 || !(middle_m > earlier.travel_m && middle_m < later.travel_m) {
            return false;
        }
        let middle = self.stance(middle_m);
        self.divide(earlier, &middle, halvings - 1, cells) && self.divide(&middle, later, halvings - 1, cells)
    }

    /// Steps 1 to 3. `None` if the bounds are too wide.
    fn cell(&self, earlier: &Stance, later: &Stance) -> Option<Cell> {
        let (route, dimensions) = (self.dragon.route(), self.dragon.dimensions());
        let width_m = later.travel_m - earlier.travel_m;
        let largest = [earlier.largest, later.largest];
        let bend = 0.25 * (largest[1] - largest[0]) * (largest[1] - largest[0]);
        let mut cell = Cell { from_m: earlier.travel_m, largest, excess: bend, deficit: largest[0].max(largest[1]) };
        let curvatures = |handle: usize| route.plan_curvatures(earlier.parameters[handle], later.parameters[handle]);
        let (mut slope, mut slack) = (Interval::hull(0.0, 0.0), 0.0);
        let mut front = curvatures(0);
        for bench in 0..dimensions.benches() {
            let logarithms = [earlier.logarithms[bench], later.logarithms[bench]];
            let ratio = Interval::hull(logarithms[0], logarithms[1]).widened(slack);
            let ratio = Interval { low: ratio.low.exp(), high: ratio.high.exp() };
            let rear = curvatures(bench + 1);
            let link = WalkingLink {
                length_m: dimensions.link_m(bench),
                curvatures: [front, rear],
                walk_m: ratio.high * width_m,
            };
            slope = slope + link.growth(earlier.angles[bench], later.angles[bench])? * ratio;
            let handle = bench + 1;
            let ends = [earlier.logarithms[handle], later.logarithms[handle]];
            slack = self::slack(slope, (ends[1] - ends[0]) / width_m, width_m) + ROUNDING * handle as f64;
            let below = [largest[0] - ends[0], largest[1] - ends[1]];
            cell.excess = cell.excess.max(slack - below[0].min(below[1]) + bend);
            cell.deficit = cell.deficit.min(slack + below[0].max(below[1]));
            if cell.excess > MOST_EXCESS && self.may_bind(&cell) {
                return None;
            }
            front = rear;
        }
        (cell.deficit <= MOST_DEFICIT || !self.may_bind(&cell)).then_some(cell)
    }

    /// Whether the limit of the handles may hold the head below its own limit in a cell.
    fn may_bind(&self, cell: &Cell) -> bool {
        let largest = cell.largest[0].max(cell.largest[1]) + cell.excess;
        self.limits.handle_mps * (-largest).exp() < self.limits.head_mps
    }
}

/// Step 2.
fn slack(slope: Interval, mean: f64, width_m: f64) -> f64 {
    let slope = slope.with(mean);
    if slope.width() > 0.0 { (slope.high - mean) * (mean - slope.low) / slope.width() * width_m } else { 0.0 }
}

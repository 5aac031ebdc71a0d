//! Where and when two dragons could meet, whenever each leaves.
//!
//! Whether the boards of two dragons are within a clearance depends on their own times alone (see `own_time`). The pairs of own
//! times at which they are form zones of a plane. A scan of the plane finds them: it halves rectangles that may have such a point
//! (see `delay_search` for the bound), down to 1/128 of the longer run. Rectangles that touch each other form a zone. So two zones
//! are separate if rectangles between them are proved free. In each zone, a [`DelaySearch`] finds the delays that meet.

use std::collections::HashMap;
use std::sync::Arc;

use glam::DVec2;

use super::delay_search::{Cell, DelaySearch, Look, OutOfWork, Side, look};
use super::near_spans::way;
use super::own_time::{LeastClearance, Nearest, Walker};
use super::pair_motion::GRAZE_M;
use crate::formation::{DelaySet, Planned};

/// Number of rectangles along the longer run of a scan: 2 to this power.
const LEVELS: u32 = 7;

/// Halvings of a rectangle that are left out inside a zone: where boards are within the clearance at two opposite corners.
const JOINED_LEVELS: u32 = 3;

/// Halvings of both sides of a rectangle at the border of a zone, for a picture.
const DRAWN_LEVELS: u32 = 3;

/// The boards of two dragons that are just within the clearance, at the least or at the greatest delay of a zone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tip {
    /// Own times of both dragons: the time since each leaves, in seconds.
    pub times_s: [f64; 2],
    /// Index of a bench of each dragon.
    pub benches: [usize; 2],
    /// Point between their boards.
    pub point: DVec2,
}

impl Tip {
    pub(super) fn of(nearest: &Nearest) -> Self {
        Self { times_s: nearest.times_s, benches: nearest.benches, point: nearest.approach.point }
    }

    /// By how much the second dragon leaves after the first one.
    pub fn delay_s(&self) -> f64 {
        self.times_s[0] - self.times_s[1]
    }
}

/// A zone in which two dragons could meet.
#[derive(Clone, Debug)]
pub struct MeetingZone {
    /// Delays of the second dragon after the first one at which they meet here. No other delay meets here. At each of these, two
    /// boards come within the clearance, or exceed it by about 2 mm at most.
    pub delays: DelaySet,
    /// The boards at the least and at the greatest delay, if it is finite.
    pub tips: [Option<Tip>; 2],
    /// Own times of each dragon in the zone, from and to.
    pub times_s: [[f64; 2]; 2],
    /// Own times of both dragons in rectangles that contain the zone.
    cells: Vec<[[f64; 2]; 2]>,
}

/// Two dragons, and the clearance that is to be kept between them.
#[derive(Clone, Debug)]
pub struct DragonPair {
    walkers: [Walker; 2],
    clearance_m: f64,
}

/// A rectangle of the scan that may have a point of a zone.
#[derive(Clone, Copy)]
struct Leaf {
    /// Number of the interval of each dragon; −1 before it leaves, and the number of intervals after its end.
    index: [i64; 2],
    is_met: bool,
}

/// An interval of the scan: a side of a cell, and its place.
#[derive(Clone)]
struct Interval {
    side: Side,
    index: i64,
    /// Number of halvings that are left.
    levels: u32,
}

impl DragonPair {
    /// Two dragons of a formation. It does not matter when they leave.
    ///
    /// # Panics
    /// Panics for a clearance that is negative or not finite.
    pub fn new(dragons: [&Planned; 2], clearance_m: f64) -> Self {
        assert!(clearance_m >= 0.0 && clearance_m.is_finite(), "a pair with a clearance of {clearance_m} m");
        Self { walkers: dragons.map(Walker::new), clearance_m }
    }

    /// All zones in which the dragons could meet; `None` if the work of a dragon's meter does not suffice.
    pub fn zones(&self) -> Option<Vec<MeetingZone>> {
        let zones = self.find_zones();
        self.forget();
        zones
    }

    /// Forgets the poses of a search.
    fn forget(&self) {
        self.walkers.iter().for_each(Walker::forget);
    }

    fn find_zones(&self) -> Option<Vec<MeetingZone>> {
        if self.ways_gap_m(self.clearance_m + GRAZE_M) > self.clearance_m + GRAZE_M {
            return (!self.is_spent()).then(Vec::new);
        }
        let levels = self.levels();
        let mut leaves = Vec::new();
        for ours in self.intervals(0, levels[0]) {
            for theirs in self.intervals(1, levels[1]) {
                self.scan(&[ours.clone(), theirs], &mut leaves).ok()?;
            }
        }
        let zones: Option<Vec<MeetingZone>> = parts(&leaves).iter().map(|part| self.zone(part, levels).ok()).collect();
        let zones = zones?.into_iter().filter(|zone| !zone.delays.is_empty()).collect();
        // The last proof may have ended early.
        (!self.is_spent()).then_some(zones)
    }

    fn is_spent(&self) -> bool {
        self.walkers.iter().any(|walker| walker.planned.dragon.meter().is_spent())
    }

    /// A lower bound on the clearance of the dragons on any plan: that of all that they pass. It is exact only above `enough_m`.
    pub(crate) fn ways_gap_m(&self, enough_m: f64) -> f64 {
        let [ours, theirs] = self.walkers.each_ref().map(|walker| way(&walker.planned, [0.0, walker.end_s]));
        ours.nearest_over(&theirs, enough_m).1
    }

    /// The nearest boards on a plan in which the second dragon leaves `delay_s` after the first one, at own times of the first one
    /// from `times_s[0]` to `times_s[1]`. The clearance is exact to 2 mm, or to a hundredth of it, and the nearest one around.
    pub fn least_clearance(&self, delay_s: f64, times_s: [f64; 2]) -> Nearest {
        let nearest = LeastClearance::new(&self.walkers, delay_s).over(times_s);
        self.forget();
        nearest
    }

    /// Own times at which the dragons reach their ends, in seconds.
    pub fn ends_s(&self) -> [f64; 2] {
        [0, 1].map(|i| self.walkers[i].end_s)
    }

    /// Travel of a dragon at an own time.
    pub fn travel_m(&self, dragon: usize, time_s: f64) -> f64 {
        self.walkers[dragon].planned.travel_m(time_s)
    }

    /// Numbers of halvings of both runs, so that rectangles are about as long as wide.
    fn levels(&self) -> [u32; 2] {
        let runs_m = self
            .walkers
            .each_ref()
            .map(|walker| walker.planned.dragon.end_travel_m() - walker.planned.dragon.start_travel_m());
        let longest_m = runs_m[0].max(runs_m[1]);
        let level =
            |run_m: f64| LEVELS.saturating_sub((longest_m / run_m.max(f64::MIN_POSITIVE)).log2().floor() as u32);
        let strides =
            self.walkers.each_ref().map(|walker| (walker.end_s / walker.stride_s()).log2().ceil().max(0.0) as u32);
        [0, 1].map(|i| level(runs_m[i]).min(strides[i]))
    }

    /// The dragon's own times: before it leaves, on its way, and after its end.
    fn intervals(&self, dragon: usize, levels: u32) -> Vec<Interval> {
        let walker = &self.walkers[dragon];
        let ends = [walker.end_at(0.0), walker.end_at(walker.end_s)];
        let interval = |span_s: [f64; 2], ends: [usize; 2], index: i64, levels: u32, all: &[_; 2]| Interval {
            side: Side { span_s, ends: ends.map(|end| Arc::clone(&all[end])) },
            index,
            levels,
        };
        let before = interval([f64::NEG_INFINITY, 0.0], [0, 0], -1, 0, &ends);
        let walks = interval([0.0, walker.end_s], [0, 1], 0, levels, &ends);
        let after = interval([walker.end_s, f64::INFINITY], [1, 1], 1 << levels, 0, &ends);
        [before, walks, after].into_iter().filter(|interval| interval.side.stands() || walker.end_s > 0.0).collect()
    }

    /// Finds the rectangles that may have a point of a zone.
    fn scan(&self, intervals: &[Interval; 2], leaves: &mut Vec<Leaf>) -> Result<(), OutOfWork> {
        if self.is_spent() {
            return Err(OutOfWork);
        }
        let cell = intervals.each_ref().map(|interval| interval.side.clone());
        let Some(Look { is_met, .. }) = look(&self.walkers, &cell, self.clearance_m) else { return Ok(()) };
        let levels = intervals.each_ref().map(|interval| interval.levels);
        if is_met == [true; 2] && levels[0].max(levels[1]) <= JOINED_LEVELS {
            let within = |i: usize| (0..1_i64 << levels[i]).map(move |part| (intervals[i].index << levels[i]) + part);
            leaves.extend(
                within(0).flat_map(|one| within(1).map(move |other| Leaf { index: [one, other], is_met: true })),
            );
            return Ok(());
        }
        let splits = usize::from(intervals[1].levels > intervals[0].levels);
        let interval = &intervals[splits];
        if interval.levels == 0 {
            let is_met = is_met.contains(&true);
            leaves.push(Leaf { index: [intervals[0].index, intervals[1].index], is_met });
            return Ok(());
        }
        for (number, side) in (0..).zip(interval.side.halves(&self.walkers[splits])) {
            let mut part = intervals.clone();
            part[splits] = Interval { side, index: 2 * interval.index + number, levels: interval.levels - 1 };
            self.scan(&part, leaves)?;
        }
        Ok(())
    }

    /// The zone of connected rectangles.
    fn zone(&self, leaves: &[Leaf], levels: [u32; 2]) -> Result<MeetingZone, OutOfWork> {
        let mut search = DelaySearch::new(&self.walkers, self.clearance_m);
        // Rectangles with a known point come first: climbs from it cover the delays of most others.
        for is_met in [true, false] {
            for leaf in leaves.iter().filter(|leaf| leaf.is_met == is_met) {
                let spans_s = [0, 1].map(|i| self.span_s(leaf, levels, i));
                if !search.covers(spans_s) {
                    search.add(&self.cell(spans_s))?;
                }
            }
        }
        let (delays, tips) = search.finish();
        let times_s = [0, 1].map(|i| {
            let spans_s = leaves.iter().map(|leaf| self.walked_s(leaf, levels, i));
            spans_s.reduce(|all, span| [all[0].min(span[0]), all[1].max(span[1])]).unwrap_or_default()
        });
        let cells = leaves.iter().map(|leaf| [0, 1].map(|i| self.walked_s(leaf, levels, i))).collect();
        Ok(MeetingZone { delays, tips, times_s, cells })
    }

    /// The zone for a picture: travels of both dragons in rectangles in which boards are within the clearance. It is exact to an
    /// eighth of the rectangles of the scan.
    pub fn area_m(&self, zone: &MeetingZone) -> Vec<[[f64; 2]; 2]> {
        let mut area = Vec::new();
        for times_s in zone.cells.iter().filter(|times_s| times_s.iter().all(|span_s| span_s[0] < span_s[1])) {
            self.fill(&self.cell(*times_s), 2 * DRAWN_LEVELS, &mut area);
        }
        self.forget();
        let travels_m = |times_s: [[f64; 2]; 2]| [0, 1].map(|i| times_s[i].map(|time_s| self.travel_m(i, time_s)));
        area.into_iter().map(travels_m).collect()
    }

    /// Adds the parts of a cell in which boards are within the clearance.
    fn fill(&self, cell: &Cell, levels: u32, area: &mut Vec<[[f64; 2]; 2]>) {
        let Some(Look { is_met, .. }) = look(&self.walkers, cell, self.clearance_m) else { return };
        if is_met == [true; 2] {
            area.push([cell[0].span_s, cell[1].span_s]);
        } else if levels > 0 {
            let side = (levels % 2) as usize;
            for half in cell[side].halves(&self.walkers[side]) {
                let mut part = cell.clone();
                part[side] = half;
                self.fill(&part, levels - 1, area);
            }
        }
    }

    /// Own times of a dragon in a rectangle, with infinite ends where it stands.
    fn span_s(&self, leaf: &Leaf, levels: [u32; 2], i: usize) -> [f64; 2] {
        let (index, count, end_s) = (leaf.index[i], 1_i64 << levels[i], self.walkers[i].end_s);
        let time_s = |index: i64| if index == count { end_s } else { end_s * (index as f64 / count as f64) };
        match index {
            -1 => [f64::NEG_INFINITY, 0.0],
            index if index == count => [end_s, f64::INFINITY],
            index => [time_s(index), time_s(index + 1)],
        }
    }

    /// The same within the dragon's run.
    fn walked_s(&self, leaf: &Leaf, levels: [u32; 2], i: usize) -> [f64; 2] {
        self.span_s(leaf, levels, i).map(|time_s| time_s.clamp(0.0, self.walkers[i].end_s))
    }

    fn cell(&self, spans_s: [[f64; 2]; 2]) -> Cell {
        [0, 1].map(|i| Side { span_s: spans_s[i], ends: spans_s[i].map(|time_s| self.walkers[i].end_at(time_s)) })
    }
}

/// The sets of rectangles that touch each other.
fn parts(leaves: &[Leaf]) -> Vec<Vec<Leaf>> {
    let mut left: HashMap<[i64; 2], Leaf> = leaves.iter().map(|leaf| (leaf.index, *leaf)).collect();
    let mut parts = Vec::new();
    for leaf in leaves {
        let mut open: Vec<Leaf> = left.remove(&leaf.index).into_iter().collect();
        let mut part = Vec::new();
        while let Some(leaf) = open.pop() {
            part.push(leaf);
            for (across, along) in (-1..=1).flat_map(|across| (-1..=1).map(move |along| (across, along))) {
                open.extend(left.remove(&[leaf.index[0] + across, leaf.index[1] + along]));
            }
        }
        if !part.is_empty() {
            parts.push(part);
        }
    }
    parts
}

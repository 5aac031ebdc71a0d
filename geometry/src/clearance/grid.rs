//! A grid that finds discs near each other.

use std::ops::{ControlFlow, Range};

use glam::DVec2;

/// Largest difference in columns and rows between discs near each other. Smaller cells exclude more discs, but there are more
/// cells.
const CELLS_PER_REACH: usize = 2;

/// A circumscribed circle.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Disc {
    pub(super) centre: DVec2,
    pub(super) radius_m: f64,
    /// Index of the object in the circle.
    pub(super) index: u32,
}

/// A grid of square cells over discs, sorted by cell. It reuses its buffers: refilling it with no more discs than before
/// allocates nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Grid {
    /// The largest disc, such as the head's, which is in no cell. So the cells can be as small as the other discs allow.
    largest: Option<Disc>,
    reach_m: f64,
    origin: DVec2,
    cells_per_m: f64,
    columns: usize,
    rows: usize,
    /// Index in `sorted` of the first disc of each cell, then the number of discs.
    starts: Vec<u32>,
    /// All discs except the largest, sorted by cell.
    sorted: Vec<Disc>,
    /// Buffer for the discs near one disc.
    near: Vec<u32>,
}

impl Grid {
    /// Sorts discs into cells, at most about four cells per disc. The search then finds pairs of discs at most `reach_m` apart.
    pub(super) fn fill(&mut self, discs: &[Disc], reach_m: f64) {
        self.reach_m = reach_m;
        self.largest = discs.iter().copied().max_by(|a, b| a.radius_m.total_cmp(&b.radius_m));
        let others = others_than(self.largest, discs);
        let radius_m = others.map(|disc| disc.radius_m).fold(0.0, f64::max);
        let centres = || discs.iter().map(|disc| disc.centre);
        let low = centres().reduce(DVec2::min).unwrap_or_default();
        let span = centres().reduce(DVec2::max).unwrap_or_default() - low;
        let per_side = 2.0 * (discs.len() as f64).sqrt().max(1.0);
        let wanted_m = (2.0 * radius_m + reach_m) / CELLS_PER_REACH as f64;
        let cell_m = wanted_m.max(span.max_element() / per_side).max(f64::MIN_POSITIVE);
        self.origin = low;
        self.cells_per_m = cell_m.recip();
        self.columns = (span.x / cell_m) as usize + 1;
        self.rows = (span.y / cell_m) as usize + 1;
        self.sort(discs);
    }

    /// Calls `visit(disc, others)` for each disc, until `visit` breaks. Each two discs at most the fill's `reach_m` apart, to
    /// rounding, meet exactly once, in either order. The slices contain indices. Returns the number of discs evaluated.
    pub(super) fn for_each_neighbourhood(&mut self, visit: impl FnMut(u32, &[u32]) -> ControlFlow<()>) -> u64 {
        let mut near = std::mem::take(&mut self.near);
        near.resize(self.sorted.len(), 0);
        let mut looked_at = 0;
        // The result is dropped: `visit` itself decided whether to break.
        let _ = self.visit_neighbourhoods(&mut near, &mut looked_at, visit);
        self.near = near;
        looked_at
    }

    fn visit_neighbourhoods(
        &self,
        near: &mut [u32],
        looked_at: &mut u64,
        mut visit: impl FnMut(u32, &[u32]) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        if let Some(largest) = &self.largest {
            *looked_at += self.sorted.len() as u64;
            let count = self.collect(largest, &self.sorted, near, 0);
            visit(largest.index, &near[..count])?;
        }
        for row in 0..self.rows {
            for column in 0..self.columns {
                let (first, last) = (column.saturating_sub(CELLS_PER_REACH), column + CELLS_PER_REACH);
                for k in self.cells(column, column, row) {
                    let disc = &self.sorted[k];
                    let beside = k + 1..self.cells(column, last, row).end;
                    *looked_at += 1 + beside.len() as u64;
                    let mut count = self.collect(disc, &self.sorted[beside], near, 0);
                    for above in row + 1..self.rows.min(row + 1 + CELLS_PER_REACH) {
                        let across = self.cells(first, last, above);
                        *looked_at += across.len() as u64;
                        count = self.collect(disc, &self.sorted[across], near, count);
                    }
                    visit(disc.index, &near[..count])?;
                }
            }
        }
        ControlFlow::Continue(())
    }

    /// Writes those of `others` that are near `disc` behind the first `count` entries of `near`. It has no branch, because the
    /// nearness of a disc is hard to predict.
    fn collect(&self, disc: &Disc, others: &[Disc], near: &mut [u32], mut count: usize) -> usize {
        for other in others {
            let reach_m = disc.radius_m + other.radius_m + self.reach_m;
            near[count] = other.index;
            count += usize::from(disc.centre.distance_squared(other.centre) <= reach_m * reach_m);
        }
        count
    }

    /// Range in `sorted` of the discs of a row from column `first` to column `last`. They are contiguous.
    fn cells(&self, first: usize, last: usize, row: usize) -> Range<usize> {
        let base = row * self.columns;
        let end = base + last.min(self.columns - 1) + 1;
        self.starts[base + first] as usize..self.starts[end] as usize
    }

    fn cell(&self, point: DVec2) -> usize {
        let at = (point - self.origin) * self.cells_per_m;
        (at.y as usize).min(self.rows - 1) * self.columns + (at.x as usize).min(self.columns - 1)
    }

    /// Sorts the discs by cell with a counting sort.
    fn sort(&mut self, discs: &[Disc]) {
        self.starts.clear();
        self.starts.resize(self.columns * self.rows + 1, 0);
        for disc in others_than(self.largest, discs) {
            let cell = self.cell(disc.centre);
            self.starts[cell] += 1;
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        self.sorted.clear();
        self.sorted.resize(end as usize, Disc::default());
        // Fills each cell from its end to its start.
        for disc in others_than(self.largest, discs) {
            let cell = self.cell(disc.centre);
            self.starts[cell] -= 1;
            self.sorted[self.starts[cell] as usize] = *disc;
        }
    }
}

fn others_than(largest: Option<Disc>, discs: &[Disc]) -> impl Iterator<Item = &Disc> {
    discs.iter().filter(move |disc| largest.is_none_or(|largest| largest.index != disc.index))
}

//! Which points lie near to each other.

use glam::DVec2;

/// A grid of square cells over points, sorted by cell. Reuses its buffers: filling it again with no more points than
/// before allocates nothing.
#[derive(Clone, Debug, Default)]
pub(super) struct Grid {
    origin: DVec2,
    cell_m: f64,
    columns: usize,
    rows: usize,
    /// Per cell, where its points begin in `sorted`; one more at the end.
    starts: Vec<u32>,
    /// Indices of points, by cell and ascending within it.
    sorted: Vec<u32>,
}

impl Grid {
    /// Sorts points into cells at least `reach_m` wide, of which there are at most some four per point.
    pub(super) fn fill(&mut self, points: &[DVec2], reach_m: f64) {
        let low = points.iter().copied().reduce(DVec2::min).unwrap_or_default();
        let high = points.iter().copied().reduce(DVec2::max).unwrap_or_default();
        let span = high - low;
        let per_side = (points.len() as f64).sqrt().max(1.0);
        self.origin = low;
        self.cell_m = reach_m.max(span.max_element() / per_side).max(f64::MIN_POSITIVE);
        self.columns = (span.x / self.cell_m) as usize + 1;
        self.rows = (span.y / self.cell_m) as usize + 1;
        self.sort(points);
    }

    /// Calls `visit(i, j)`, i < j, once for each two points in the same cell or in neighbouring ones, which includes
    /// all two points at most the fill's `reach_m` apart.
    pub(super) fn for_each_pair(&self, mut visit: impl FnMut(usize, usize)) {
        for row in 0..self.rows {
            for column in 0..self.columns {
                let here = self.cell(column, row);
                for (k, &i) in here.iter().enumerate() {
                    here[k + 1..].iter().for_each(|&j| visit(i as usize, j as usize));
                }
                self.for_each_across(here, column, row, &mut visit);
            }
        }
    }

    /// Pairs between a cell and the half of its neighbours that come after it.
    fn for_each_across(&self, here: &[u32], column: usize, row: usize, visit: &mut impl FnMut(usize, usize)) {
        let east = (column + 1 < self.columns).then(|| self.cell(column + 1, row));
        let north = (row + 1 < self.rows).then(|| self.cells(column.saturating_sub(1), column + 1, row + 1));
        for &j in east.into_iter().flatten().chain(north.into_iter().flatten()) {
            for &i in here {
                visit(i.min(j) as usize, i.max(j) as usize);
            }
        }
    }

    fn cell(&self, column: usize, row: usize) -> &[u32] {
        self.cells(column, column, row)
    }

    /// The points of the cells of a row from column `first` to column `last`, which lie in one piece.
    fn cells(&self, first: usize, last: usize, row: usize) -> &[u32] {
        let base = row * self.columns;
        let from = self.starts[base + first] as usize;
        let to = self.starts[base + last.min(self.columns - 1) + 1] as usize;
        &self.sorted[from..to]
    }

    fn index(&self, point: DVec2) -> usize {
        let at = (point - self.origin) / self.cell_m;
        (at.y as usize).min(self.rows - 1) * self.columns + (at.x as usize).min(self.columns - 1)
    }

    /// Counting sort by cell.
    fn sort(&mut self, points: &[DVec2]) {
        self.starts.clear();
        self.starts.resize(self.columns * self.rows + 1, 0);
        self.sorted.clear();
        self.sorted.resize(points.len(), 0);
        for &point in points {
            let cell = self.index(point);
            self.starts[cell] += 1;
        }
        let mut end = 0;
        for start in &mut self.starts {
            end += *start;
            *start = end;
        }
        // From the ends of the cells down to their starts, the last point first, so that each cell ascends.
        for (i, &point) in points.iter().enumerate().rev() {
            let cell = self.index(point);
            self.starts[cell] -= 1;
            self.sorted[self.starts[cell] as usize] = i as u32;
        }
    }
}

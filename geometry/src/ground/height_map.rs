//! Heights on a regular grid, and the surface between them.
//!
//! Each cell is the bicubic polynomial that has, at its four corners, the height, the slopes and the mixed derivative of the
//! grid there (Hermite interpolation). These are differences of the neighbouring heights: central ones, or one-sided ones at an
//! edge. So the surface passes through every height, and two cells have the same height and the same slopes along their common
//! edge.

use std::collections::BTreeSet;
use std::ops::RangeInclusive;

use glam::{DMat2, DVec2};
use thiserror::Error;

use super::Cell;
use crate::number::Number;

/// Allowed heights, in metres.
pub const HEIGHT_M: RangeInclusive<f64> = -10_000.0..=10_000.0;
/// Allowed distances of neighbouring heights, in metres.
pub const SPACING_M: RangeInclusive<f64> = 0.01..=1000.0;
/// Greatest number of heights of a map.
pub const MAX_HEIGHTS: usize = 16_000_000;
/// Greatest distance of a height from the origin, in metres. The rounding of positions grows with it.
const MAX_COORDINATE_M: f64 = 1e8;

/// Error of an invalid map of heights: the value, and what is allowed.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
pub enum HeightMapError {
    /// The distance of neighbouring heights is out of range.
    #[error("spacing_m is {}, must be from {} to {}", Number(*spacing_m), Number(*SPACING_M.start()), Number(*SPACING_M.end()))]
    Spacing {
        /// Distance of neighbouring heights, in metres.
        spacing_m: f64,
    },
    /// A height is out of range.
    #[error("the height in column {column} of row {row} is {}, must be from {} to {}", Number(*height_m), Number(*HEIGHT_M.start()), Number(*HEIGHT_M.end()))]
    Height {
        /// Column of the height, from 0.
        column: usize,
        /// Row of the height, from 0.
        row: usize,
        /// The height in metres.
        height_m: f64,
    },
    /// The first height is too far from the origin.
    #[error("the map is at ({}, {}) m, must be within {MAX_COORDINATE_M} m of the origin", Number(first.x), Number(first.y))]
    Position {
        /// Position of the first height, in metres.
        first: DVec2,
    },
    /// There are too few or too many heights.
    #[error(
        "the map has {columns} columns and {rows} rows, must have at least 2 of each, and at most {MAX_HEIGHTS} heights"
    )]
    Size {
        /// Number of columns.
        columns: usize,
        /// Number of rows.
        rows: usize,
    },
}

/// A part of a row of heights.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightRun {
    /// Column of the first height.
    pub column: usize,
    /// Row of all heights.
    pub row: usize,
    /// The heights in metres, in order of growing x.
    pub heights_m: Vec<f64>,
}

/// A map of heights. Columns grow with x, rows with y.
#[derive(Clone, Debug, PartialEq)]
pub struct HeightMap {
    /// Position of column 0 of row 0.
    first: DVec2,
    spacing: DVec2,
    /// Column and row of the first stored height.
    stored: Cell,
    columns: usize,
    rows: usize,
    /// Row after row; NaN where there is none.
    heights_m: Vec<f64>,
}

impl HeightMap {
    /// A map of all heights of a grid, row after row. `first` is the position of the first height, `spacing` the distance of
    /// neighbouring heights in x and y. A height that is NaN is missing.
    ///
    /// ```
    /// use bench_dragon_geometry::ground::HeightMap;
    /// use glam::DVec2;
    ///
    /// let map = HeightMap::new([2, 2], DVec2::ZERO, DVec2::ONE, vec![0.0, 1.0, 2.0, 3.0])?;
    /// assert_eq!(map.runs([[0, 0]].into_iter())[1].heights_m, [2.0, 3.0]);
    /// # Ok::<(), bench_dragon_geometry::ground::HeightMapError>(())
    /// ```
    ///
    /// # Errors
    /// There are fewer than 2 columns or rows, or a number is out of range.
    ///
    /// # Panics
    /// Panics if the number of heights is not that of the grid.
    pub fn new(
        [columns, rows]: [usize; 2],
        first: DVec2,
        spacing: DVec2,
        heights_m: Vec<f64>,
    ) -> Result<Self, HeightMapError> {
        assert_eq!(heights_m.len(), columns * rows, "one height for each column of each row");
        Self::stored_from([0; 2], [columns, rows], first, spacing, heights_m)
    }

    /// A map of which only some heights are known.
    ///
    /// # Errors
    /// The runs span fewer than 2 columns or rows, or too many, or a number is out of range.
    pub fn from_runs(first: DVec2, spacing: DVec2, runs: &[HeightRun]) -> Result<Self, HeightMapError> {
        let span = |begin: fn(&HeightRun) -> usize, end: fn(&HeightRun) -> usize| {
            let low = runs.iter().map(begin).min().unwrap_or(0);
            (low, runs.iter().map(end).max().unwrap_or(0) - low)
        };
        let (column, columns) = span(|run| run.column, |run| run.column.saturating_add(run.heights_m.len()));
        let (row, rows) = span(|run| run.row, |run| run.row.saturating_add(1));
        if columns.saturating_mul(rows) > MAX_HEIGHTS {
            return Err(HeightMapError::Size { columns, rows });
        }
        let mut heights_m = vec![f64::NAN; columns * rows];
        for run in runs {
            let begin = (run.row - row) * columns + (run.column - column);
            heights_m[begin..begin + run.heights_m.len()].copy_from_slice(&run.heights_m);
        }
        Self::stored_from([column, row], [columns, rows], first, spacing, heights_m)
    }

    fn stored_from(
        stored: Cell,
        [columns, rows]: [usize; 2],
        first: DVec2,
        spacing: DVec2,
        heights_m: Vec<f64>,
    ) -> Result<Self, HeightMapError> {
        if columns < 2 || rows < 2 || heights_m.len() > MAX_HEIGHTS {
            return Err(HeightMapError::Size { columns, rows });
        }
        if let Some(spacing_m) = spacing.to_array().into_iter().find(|spacing_m| !SPACING_M.contains(spacing_m)) {
            return Err(HeightMapError::Spacing { spacing_m });
        }
        if !first.is_finite() || first.abs().max_element() > MAX_COORDINATE_M {
            return Err(HeightMapError::Position { first });
        }
        let is_wrong = |height_m: &f64| !height_m.is_nan() && !HEIGHT_M.contains(height_m);
        if let Some(at) = heights_m.iter().position(is_wrong) {
            let (column, row) = (stored[0] + at % columns, stored[1] + at / columns);
            return Err(HeightMapError::Height { column, row, height_m: heights_m[at] });
        }
        Ok(Self { first, spacing, stored, columns, rows, heights_m })
    }

    /// Position of the height in column 0 of row 0, in metres.
    pub fn first(&self) -> DVec2 {
        self.first
    }

    /// Distance of neighbouring heights in x and y, in metres.
    pub fn spacing(&self) -> DVec2 {
        self.spacing
    }

    /// The heights on which the surface over these cells depends, in order. A map of only these runs has the same surface
    /// there, to the last bit.
    pub fn runs(&self, cells: impl Iterator<Item = [usize; 2]>) -> Vec<HeightRun> {
        let around = |at: usize| at.saturating_sub(1)..=at + 2;
        let known = |&(row, column): &(usize, usize)| self.known(column, row).is_some();
        let needed: BTreeSet<(usize, usize)> = cells
            .flat_map(|[column, row]| around(row).flat_map(move |row| around(column).map(move |column| (row, column))))
            .filter(known)
            .collect();
        let mut runs: Vec<HeightRun> = Vec::new();
        for (row, column) in needed {
            let height_m = self.height_m(column, row);
            match runs.last_mut() {
                Some(run) if run.row == row && run.column + run.heights_m.len() == column => {
                    run.heights_m.push(height_m);
                }
                _ => runs.push(HeightRun { column, row, heights_m: vec![height_m] }),
            }
        }
        runs
    }

    /// The cell at a position whose four corners have heights.
    pub(super) fn cell(&self, position: DVec2) -> Option<Cell> {
        let within = (position - self.first) / self.spacing;
        let index = |within: f64, stored: usize, count: usize| {
            let (least, last) = (stored as f64, (stored + count - 1) as f64);
            // A position on the last edge belongs to the last cell.
            (within >= least && within <= last).then(|| (within as usize).min(stored + count - 2))
        };
        let column = index(within.x, self.stored[0], self.columns)?;
        let row = index(within.y, self.stored[1], self.rows)?;
        let corners = [(0, 0), (1, 0), (0, 1), (1, 1)];
        corners.iter().all(|(i, j)| self.known(column + i, row + j).is_some()).then_some([column, row])
    }

    /// The height of a column and a row, if it is stored and known.
    fn known(&self, column: usize, row: usize) -> Option<f64> {
        let (column, row) = (column.checked_sub(self.stored[0])?, row.checked_sub(self.stored[1])?);
        let is_stored = column < self.columns && row < self.rows;
        is_stored.then(|| self.heights_m[row * self.columns + column]).filter(|height_m| !height_m.is_nan())
    }

    fn height_m(&self, column: usize, row: usize) -> f64 {
        self.known(column, row).unwrap_or(f64::NAN)
    }

    /// The surface over a cell.
    pub(super) fn patch(&self, [column, row]: Cell) -> Patch {
        let base_m = self.height_m(column, row);
        let corner = |i: usize, j: usize| {
            let (column, row) = (column + i, row + j);
            let [dx_m, dy_m] = [self.slope_m([column, row], [1, 0]), self.slope_m([column, row], [0, 1])];
            [self.height_m(column, row) - base_m, dx_m, dy_m, self.twist_m(column, row)]
        };
        let first = self.first + self.spacing * DVec2::new(column as f64, row as f64);
        let corners = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        Patch { base_m, first, per_m: self.spacing.recip(), form: Form::Bicubic(corners) }
    }

    /// Growth of the height from one column or row to the next, at a known height.
    fn slope_m(&self, [column, row]: Cell, [i, j]: Cell) -> f64 {
        let here_m = self.height_m(column, row);
        let before = column.checked_sub(i).zip(row.checked_sub(j)).and_then(|(column, row)| self.known(column, row));
        let after = self.known(column + i, row + j);
        match (before, after) {
            (Some(before_m), Some(after_m)) => 0.5 * (after_m - before_m),
            (Some(before_m), None) => here_m - before_m,
            (None, Some(after_m)) => after_m - here_m,
            (None, None) => 0.0,
        }
    }

    /// Growth of the slope along a row from one row to the next, at a known height: 0 at an edge.
    fn twist_m(&self, column: usize, row: usize) -> f64 {
        let (Some(west), Some(south)) = (column.checked_sub(1), row.checked_sub(1)) else { return 0.0 };
        let diagonal = [(column + 1, row + 1), (west, south), (column + 1, south), (west, row + 1)];
        let [Some(a), Some(b), Some(c), Some(d)] = diagonal.map(|(column, row)| self.known(column, row)) else {
            return 0.0;
        };
        0.25 * ((a - c) - (d - b))
    }
}

/// The surface over a cell, relative to a height. Without large numbers, its rounding is that of the relief.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Patch {
    /// The height to which the relief is relative, in metres.
    pub(crate) base_m: f64,
    /// Position of the corner with the least x and y.
    first: DVec2,
    /// Cells per metre in x and y.
    per_m: DVec2,
    form: Form,
}

#[derive(Clone, Copy, Debug)]
enum Form {
    Plane {
        rise: DVec2,
    },
    /// Relief, growth along a row, growth along a column, and mixed growth per cell, at the four corners.
    Bicubic([[f64; 4]; 4]),
}

impl Patch {
    /// A plane through the origin.
    pub(super) fn plane(rise: DVec2) -> Self {
        Self { base_m: 0.0, first: DVec2::ZERO, per_m: DVec2::ONE, form: Form::Plane { rise } }
    }

    /// Height above the base at a position of the cell, in metres.
    pub(crate) fn relief_m(&self, position: DVec2) -> f64 {
        match &self.form {
            Form::Plane { rise } => rise.dot(position),
            Form::Bicubic(corners) => {
                let within = (position - self.first) * self.per_m;
                blended(corners, hermite(within.x), hermite(within.y))
            }
        }
    }

    /// The slopes at a position of the cell.
    pub(crate) fn slopes(&self, position: DVec2) -> Slopes {
        match &self.form {
            Form::Plane { rise } => Slopes { rise: *rise, bend: DMat2::ZERO },
            Form::Bicubic(corners) => {
                let within = (position - self.first) * self.per_m;
                let [[x, dx, ddx], [y, dy, ddy]] =
                    [within.x, within.y].map(|t| [hermite(t), hermite_slope(t), hermite_bend(t)]);
                let rise = self.per_m * DVec2::new(blended(corners, dx, y), blended(corners, x, dy));
                let twist = self.per_m.x * self.per_m.y * blended(corners, dx, dy);
                let bend = self.per_m * self.per_m * DVec2::new(blended(corners, ddx, y), blended(corners, x, ddy));
                Slopes { rise, bend: DMat2::from_cols_array(&[bend.x, twist, twist, bend.y]) }
            }
        }
    }
}

/// The slopes of the ground at a position.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Slopes {
    /// Growth of the height in metres per metre, in x and y.
    pub(crate) rise: DVec2,
    /// Growth of `rise` per metre, in x and y.
    pub(crate) bend: DMat2,
}

/// The sum of the corners' values, with the weights of heights and of slopes over x, and over y.
fn blended(corners: &[[f64; 4]; 4], [x, dx]: [[f64; 2]; 2], [y, dy]: [[f64; 2]; 2]) -> f64 {
    let at = |corner: &[f64; 4], i: usize, j: usize| {
        let [height_m, along_row_m, along_column_m, twist_m] = *corner;
        x[i] * (y[j] * height_m + dy[j] * along_column_m) + dx[i] * (y[j] * along_row_m + dy[j] * twist_m)
    };
    at(&corners[0], 0, 0) + at(&corners[1], 1, 0) + at(&corners[2], 0, 1) + at(&corners[3], 1, 1)
}

/// The cubic polynomials that have the value 1 at 0 and at 1, and those that have the slope 1 there, and otherwise 0.
fn hermite(t: f64) -> [[f64; 2]; 2] {
    let (rest, square) = (1.0 - t, t * t);
    let value_at_end = square * (3.0 - 2.0 * t);
    [[1.0 - value_at_end, value_at_end], [t * rest * rest, -square * rest]]
}

/// The derivatives of these polynomials.
fn hermite_slope(t: f64) -> [[f64; 2]; 2] {
    let growth = 6.0 * t * (1.0 - t);
    [[-growth, growth], [(1.0 - t) * (1.0 - 3.0 * t), t * (3.0 * t - 2.0)]]
}

/// Their second derivatives.
fn hermite_bend(t: f64) -> [[f64; 2]; 2] {
    let growth = 6.0 - 12.0 * t;
    [[-growth, growth], [6.0 * t - 4.0, 6.0 * t - 2.0]]
}

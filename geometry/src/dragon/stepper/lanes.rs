//! Memory layout of the handles of a section, for calculating four of them at once.
//!
//! Handle i of a section, counted from its front, has the index (i mod [`ROWS`])·[`LANES`] + i / [`ROWS`]. So the handle ahead
//! of index k has the index k − [`LANES`]. Recurrences from one handle to the next therefore run in four parts of the section,
//! the lanes, at once. Finally the lanes are joined.

/// Numbers in a vector.
pub(super) const LANES: usize = 4;
/// Handles in a lane. Four sections hold the handles of the paper's dragon, except the head's handle, which is given.
pub(super) const ROWS: usize = 14;
/// Handles in a section.
pub(super) const HANDLES: usize = LANES * ROWS;

/// One value for each handle of a section.
pub(super) type Values = [f64; HANDLES];
/// The same, preceded by the values of the handles ahead of the four lanes.
pub(super) type LedValues = [f64; LANES + HANDLES];

/// The index of handle i of a section, counted from the front.
pub(super) fn index(i: usize) -> usize {
    (i % ROWS) * LANES + i / ROWS
}

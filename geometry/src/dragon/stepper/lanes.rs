//! How the handles of a section lie in memory, so that four of them are worked out at once.
//!
//! Handle i of a section, counted from its front, lies at the index (i mod [`ROWS`])·[`LANES`] + i / [`ROWS`]. So the
//! handle ahead of the one at index k lies at k − [`LANES`], and what one handle takes over from the next one ahead is
//! worked out for four stretches, the lanes, at once. In the end the lanes are joined.

/// Numbers of a vector.
pub(super) const LANES: usize = 4;
/// Handles of a lane. Four sections hold the handles of the paper's dragon but for the head's, which is given.
pub(super) const ROWS: usize = 14;
/// Handles of a section.
pub(super) const HANDLES: usize = LANES * ROWS;

/// One value for each handle of a section.
pub(super) type Values = [f64; HANDLES];
/// The same, and before them those of the handles ahead of the four lanes.
pub(super) type LedValues = [f64; LANES + HANDLES];

/// The index at which a section keeps its handle i, counted from the front.
pub(super) fn index(i: usize) -> usize {
    (i % ROWS) * LANES + i / ROWS
}

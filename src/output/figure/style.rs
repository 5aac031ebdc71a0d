//! What all figures have in common: sizes in millimetres on the printed page, and how lines are told apart.

use super::mark::LineStyle;
use super::palette::{Colour, LINES};

/// Width of every figure: a page of A4 or letter between its margins.
pub(super) const PAGE_WIDTH: f64 = 160.0;

/// Size of a figure's title: 10 points.
pub(super) const TITLE_SIZE: f64 = 3.5;
/// Size of an axis label, and of a legend's entries: 8.5 points.
pub(super) const LABEL_SIZE: f64 = 3.0;
/// Size of the numbers at an axis and of notes in a plot: 7.5 points.
pub(super) const TICK_SIZE: f64 = 2.65;

/// Width of a line of data.
pub(super) const LINE_WIDTH: f64 = 0.35;
/// Width of a line that goes with the data.
pub(super) const FINE_WIDTH: f64 = 0.2;
/// Width of an axis.
pub(super) const AXIS_WIDTH: f64 = 0.2;
/// Width of a line that only guides the eye.
pub(super) const GRID_WIDTH: f64 = 0.12;

/// Least distance between two ticks of an x axis.
pub(super) const X_TICK_SPACING: f64 = 11.0;
/// Least distance between two ticks of a y axis.
pub(super) const Y_TICK_SPACING: f64 = 8.0;
pub(super) const TICK_LENGTH: f64 = 1.0;
/// From the axis down to the middle of its numbers.
pub(super) const X_TICK_DROP: f64 = 3.0;
/// From the axis down to the middle of its label.
pub(super) const X_LABEL_DROP: f64 = 7.5;
/// From the axis to the right end of its numbers.
pub(super) const Y_TICK_GAP: f64 = 1.8;
/// From the numbers to the middle of the axis' label.
pub(super) const Y_LABEL_GAP: f64 = 3.0;

/// Room for a y axis' numbers and label, beside a plot.
pub(super) const LEFT_MARGIN: f64 = 16.0;
/// Room at the right of a plot, for half of the last number.
pub(super) const RIGHT_MARGIN: f64 = 4.0;
/// Width that a plot has beside its y axis.
pub(super) const PLOT_WIDTH: f64 = PAGE_WIDTH - LEFT_MARGIN - RIGHT_MARGIN;
/// Room below a plot for its numbers and label.
pub(super) const BOTTOM_MARGIN: f64 = 11.0;
/// From the legend to the plots.
pub(super) const LEGEND_GAP: f64 = 1.0;
/// From the numbers and the label of an x axis to a plot below.
pub(super) const ROW_GAP: f64 = 4.0;

/// How the line of an index is drawn; colours and dashes repeat after 21.
pub(super) fn line_look(index: usize) -> (Colour, LineStyle) {
    const DASHES: [LineStyle; 3] = [LineStyle::Solid, LineStyle::Dashed, LineStyle::DashDotted];
    (LINES[index % LINES.len()], DASHES[index % DASHES.len()])
}

//! The page of a figure: its title, its legend, and room for its plots.

use glam::DVec2;

use super::drawing::{Anchor, Drawing, Text};
use super::legend::{self, Entry};
use super::style::{LEFT_MARGIN, LEGEND_GAP, PAGE_WIDTH, RIGHT_MARGIN, TITLE_DROP, TITLE_HEIGHT, TITLE_SIZE};

/// Width that a plot has beside its y axis.
pub(super) const PLOT_WIDTH: f64 = PAGE_WIDTH - LEFT_MARGIN - RIGHT_MARGIN;

/// Height that the title and the legend take above the plots.
pub(super) fn head_height(entries: &[Entry]) -> f64 {
    TITLE_HEIGHT + legend::height(entries, PLOT_WIDTH) + LEGEND_GAP
}

/// A page with its title and legend, and a height left below them.
pub(super) fn page(title: &str, entries: &[Entry], height: f64) -> Drawing {
    let mut drawing = Drawing::new(title, DVec2::new(PAGE_WIDTH, head_height(entries) + height));
    drawing.write(&Text::new(title, TITLE_SIZE).anchored(Anchor::Left), DVec2::new(LEFT_MARGIN, TITLE_DROP));
    legend::draw(&mut drawing, entries, DVec2::new(LEFT_MARGIN, TITLE_HEIGHT), PLOT_WIDTH);
    drawing
}

//! The page of a figure: its caption, its legend, and room for its plots.

use glam::DVec2;

use super::caption::Caption;
use super::drawing::Drawing;
use super::legend::{self, Entry};
use super::style::{LEFT_MARGIN, LEGEND_GAP, PAGE_WIDTH, PLOT_WIDTH};

/// Height that the caption and the legend take above the plots.
pub(super) fn head_height(caption: &Caption, entries: &[Entry]) -> f64 {
    caption.height() + legend::height(entries, PLOT_WIDTH) + LEGEND_GAP
}

/// A page with its caption and legend, and a height left below them.
pub(super) fn page(caption: &Caption, entries: &[Entry], height: f64) -> Drawing {
    let mut drawing = Drawing::new(&caption.name(), DVec2::new(PAGE_WIDTH, head_height(caption, entries) + height));
    caption.draw(&mut drawing);
    legend::draw(&mut drawing, entries, DVec2::new(LEFT_MARGIN, caption.height()), PLOT_WIDTH);
    drawing
}

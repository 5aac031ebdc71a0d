//! A plot: an area of the page with axes round it.

use std::ops::RangeInclusive;

use glam::DVec2;

use super::drawing::{Anchor, Drawing, Text};
use super::mark::{LineStyle, Mark};
use super::palette::{BLACK, Colour, LIGHT_GREY};
use super::path::{Path, Rect};
use super::scale::{Scale, Tick};
use super::style::{
    AXIS_WIDTH, FINE_WIDTH, GRID_WIDTH, LABEL_SIZE, TICK_LENGTH, TICK_SIZE, X_LABEL_DROP, X_TICK_DROP, X_TICK_SPACING,
    Y_LABEL_GAP, Y_TICK_GAP, Y_TICK_SPACING,
};

/// Maps values onto an area of the page.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Plot {
    pub(super) area: Rect,
    x: Scale,
    y: Scale,
    y_side: Side,
    y_tick_spacing: f64,
}

/// The side of a plot at which its y axis is told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    Left,
    Right,
}

impl Plot {
    /// A plot whose axes span these ranges.
    pub(super) fn new(area: Rect, x: &RangeInclusive<f64>, y: &RangeInclusive<f64>) -> Self {
        let (x, y) = (Scale::new(x, [area.min.x, area.max.x]), Scale::new(y, [area.max.y, area.min.y]));
        Self { area, x, y, y_side: Side::Left, y_tick_spacing: Y_TICK_SPACING }
    }

    /// A plan: the plot in which a metre is as long on either axis, and that shows all between two corners.
    pub(super) fn plan(area: Rect, low: DVec2, high: DVec2) -> Self {
        let mm_per_m = (area.size() / (high - low)).min_element();
        let (centre, half) = (0.5 * (low + high), 0.5 * area.size() / mm_per_m);
        let [x, y] = [(centre.x, half.x), (centre.y, half.y)].map(|(middle, half)| middle - half..=middle + half);
        Self { y_tick_spacing: X_TICK_SPACING, ..Self::new(area, &x, &y) }
    }

    /// The plot with its y axis told at the right.
    pub(super) fn with_y_at_the_right(self) -> Self {
        Self { y_side: Side::Right, ..self }
    }

    /// Where a point of the plot lies on the page.
    pub(super) fn at(&self, point: DVec2) -> DVec2 {
        DVec2::new(self.x.at(point.x), self.y.at(point.y))
    }

    /// Millimetres of page for each unit of x.
    pub(super) fn mm_per_x(&self) -> f64 {
        self.x.mm_per_unit()
    }

    /// Straight lines from point to point, as far as they lie in the plot.
    pub(super) fn line(&self, points: &[DVec2], colour: Colour, width: f64) -> Mark {
        Mark::stroked(Path::line(points.iter().map(|point| self.at(*point))), colour, width).clipped(self.area)
    }

    /// A filled area, as far as it lies in the plot.
    pub(super) fn polygon(&self, points: &[DVec2], colour: Colour) -> Mark {
        Mark::filled(Path::polygon(points.iter().map(|point| self.at(*point))), colour).clipped(self.area)
    }

    /// A dot of a radius in millimetres, which may reach over the plot's edge.
    pub(super) fn dot(&self, point: DVec2, radius: f64, colour: Colour) -> Mark {
        Mark::filled(Path::circle(self.at(point), radius), colour)
    }

    /// A dotted frame around the values that another plot shows.
    pub(super) fn window(&self, x: &RangeInclusive<f64>, y: &RangeInclusive<f64>) -> Mark {
        let min = self.at(DVec2::new(*x.start(), *y.end()));
        let max = self.at(DVec2::new(*x.end(), *y.start()));
        Mark::stroked(Rect { min, max }.path(), BLACK, FINE_WIDTH).styled(LineStyle::Dotted).clipped(self.area)
    }

    /// Draws level lines behind the data.
    pub(super) fn draw_grid(&self, drawing: &mut Drawing) {
        for tick in self.y_ticks() {
            let y = self.y.at(tick.value);
            let line = Path::line([DVec2::new(self.area.min.x, y), DVec2::new(self.area.max.x, y)]);
            drawing.push(Mark::stroked(line, LIGHT_GREY, GRID_WIDTH));
        }
    }

    /// Draws the frame with its ticks, over the data.
    pub(super) fn draw_frame(&self, drawing: &mut Drawing) {
        drawing.push(Mark::stroked(self.area.path(), BLACK, AXIS_WIDTH));
        for tick in self.x.ticks(X_TICK_SPACING) {
            let at = DVec2::new(self.x.at(tick.value), self.area.max.y);
            drawing.push(Mark::stroked(Path::line([at, at + TICK_LENGTH * DVec2::Y]), BLACK, AXIS_WIDTH));
            drawing.write(&Text::new(tick.label, TICK_SIZE), at + X_TICK_DROP * DVec2::Y);
        }
        let (edge, outward, anchor) = self.y_edge();
        for tick in self.y_ticks() {
            let at = DVec2::new(edge, self.y.at(tick.value));
            drawing.push(Mark::stroked(Path::line([at, at + TICK_LENGTH * outward]), BLACK, AXIS_WIDTH));
            drawing.write(&Text::new(tick.label, TICK_SIZE).anchored(anchor), at + Y_TICK_GAP * outward);
        }
    }

    /// Writes what the x axis shows, with its unit.
    pub(super) fn label_x(&self, drawing: &mut Drawing, words: &str) {
        let at = DVec2::new(self.area.centre().x, self.area.max.y + X_LABEL_DROP);
        drawing.write(&Text::new(words, LABEL_SIZE), at);
    }

    /// Writes what the y axis shows, with its unit.
    pub(super) fn label_y(&self, drawing: &mut Drawing, words: &str) {
        let widths = self.y_ticks().into_iter().map(|tick| Text::new(tick.label, TICK_SIZE).width());
        let distance = Y_TICK_GAP + widths.fold(0.0, f64::max) + Y_LABEL_GAP;
        let (edge, outward, _) = self.y_edge();
        let at = DVec2::new(edge, self.area.centre().y) + distance * outward;
        drawing.write(&Text::new(words, LABEL_SIZE).upwards(), at);
    }

    fn y_ticks(&self) -> Vec<Tick> {
        self.y.ticks(self.y_tick_spacing)
    }

    /// Where the y axis is told: its place, the direction away from the plot, and how numbers are put there.
    fn y_edge(&self) -> (f64, DVec2, Anchor) {
        match self.y_side {
            Side::Left => (self.area.min.x, DVec2::NEG_X, Anchor::Right),
            Side::Right => (self.area.max.x, DVec2::X, Anchor::Left),
        }
    }
}

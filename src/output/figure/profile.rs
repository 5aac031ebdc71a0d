//! Plots of a head's speed over its travel, whole and enlarged: the largest that is allowed, the quickest run, and a
//! run with planned speeds.

use std::ops::RangeInclusive;

use glam::DVec2;
use kurbo::Rect;

use super::drawing::Drawing;
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::{Plot, range_of};
use super::style::{BOTTOM_MARGIN, LEFT_MARGIN, LINE_WIDTH, PLOT_WIDTH, ROW_GAP, line_look};

/// Speeds of a head over its travel.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedProfile {
    /// Caption above the plots.
    pub caption: Caption,
    /// The lines. Each is drawn over those before.
    pub lines: Vec<SpeedLine>,
    /// Travels of a second, larger plot.
    pub detail_m: RangeInclusive<f64>,
}

/// A line of the plots.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedLine {
    /// Name in the legend.
    pub name: String,
    /// Travel in metres and speed in m/s, in order.
    pub points: Vec<DVec2>,
    /// The same, denser, over the travels of the second plot.
    pub detail: Vec<DVec2>,
}

const HEIGHT: f64 = 65.0;
const MARGIN: f64 = 0.05;

impl SpeedProfile {
    /// Draws the figure.
    pub fn draw(&self) -> Drawing {
        let row = HEIGHT + BOTTOM_MARGIN;
        let (mut drawing, top) = page(&self.caption, &self.legend(), 2.0 * row + ROW_GAP);
        let area = |top: f64| Rect::from_origin_size((LEFT_MARGIN, top), (PLOT_WIDTH, HEIGHT));
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let travels_m = range_of(points().map(|point| point.x), 0.0);
        let whole = Plot::new(area(top), &travels_m, &range_of(points().map(|point| point.y), MARGIN));
        let details = self.lines.iter().flat_map(|line| &line.detail);
        let speeds_mps = range_of(details.map(|point| point.y), MARGIN);
        let detail = Plot::new(area(top + row + ROW_GAP), &self.detail_m, &speeds_mps);
        self.draw_plot(&mut drawing, &whole, |line| &line.points);
        drawing.push(whole.window(&self.detail_m, &speeds_mps));
        self.draw_plot(&mut drawing, &detail, |line| &line.detail);
        drawing
    }

    fn draw_plot(&self, drawing: &mut Drawing, plot: &Plot, points: impl Fn(&SpeedLine) -> &[DVec2]) {
        plot.draw_grid(drawing);
        for (number, line) in self.lines.iter().enumerate() {
            let (colour, style) = line_look(number);
            drawing.push(plot.line(points(line), colour, LINE_WIDTH).styled(style).labelled(line.name.as_str()));
        }
        plot.draw_frame(drawing);
        plot.label(drawing, "travel (m)", "speed (m/s)");
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let entry = |(number, line): (usize, &SpeedLine)| {
            let (colour, style) = line_look(number);
            LegendEntry::new(Swatch::Line { colour, width: LINE_WIDTH, style }, line.name.as_str())
        };
        self.lines.iter().enumerate().map(entry).collect()
    }
}

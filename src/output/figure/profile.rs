//! Plot of a head's speed over its travel: the largest that is allowed, the quickest run, and a run with planned speeds.

use glam::DVec2;
use kurbo::Rect;

use super::drawing::Drawing;
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::{Plot, range_of};
use super::style::{BOTTOM_MARGIN, LEFT_MARGIN, LINE_WIDTH, PLOT_WIDTH, line_look};

/// Speeds of a head over its travel.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedProfile {
    /// Caption above the plot.
    pub caption: Caption,
    /// The lines: travel in metres and speed in m/s, in order. The last one is drawn over the others.
    pub lines: Vec<SpeedLine>,
}

/// A line of the plot.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedLine {
    /// Name in the legend.
    pub name: String,
    /// Travel in metres and speed in m/s, in order.
    pub points: Vec<DVec2>,
}

const HEIGHT: f64 = 90.0;
const MARGIN: f64 = 0.05;

impl SpeedProfile {
    /// Draws the figure.
    pub fn draw(&self) -> Drawing {
        let (mut drawing, top) = page(&self.caption, &self.legend(), HEIGHT + BOTTOM_MARGIN);
        let area = Rect::from_origin_size((LEFT_MARGIN, top), (PLOT_WIDTH, HEIGHT));
        let points = || self.lines.iter().flat_map(|line| &line.points);
        let travels_m = range_of(points().map(|point| point.x), 0.0);
        let plot = Plot::new(area, &travels_m, &range_of(points().map(|point| point.y).chain([0.0]), MARGIN));
        plot.draw_grid(&mut drawing);
        for (number, line) in self.lines.iter().enumerate() {
            let (colour, style) = line_look(number);
            drawing.push(plot.line(&line.points, colour, LINE_WIDTH).styled(style).labelled(line.name.as_str()));
        }
        plot.draw_frame(&mut drawing);
        plot.label(&mut drawing, "travel (m)", "speed (m/s)");
        drawing
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let entry = |(number, line): (usize, &SpeedLine)| {
            let (colour, style) = line_look(number);
            LegendEntry::new(Swatch::Line { colour, width: LINE_WIDTH, style }, line.name.as_str())
        };
        self.lines.iter().enumerate().map(entry).collect()
    }
}

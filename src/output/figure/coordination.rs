//! Coordination diagram of two dragons: the travel of one over that of the other, where they would meet, and the plan.

use glam::DVec2;
use kurbo::{Rect, Shape as _};

use super::drawing::{Drawing, Mark};
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::{Plot, range_of};
use super::style::{BLUE, BOTTOM_MARGIN, Colour, GREY, LEFT_MARGIN, LINE_WIDTH, LineStyle, PLOT_WIDTH, VERMILION};

/// The travels of two dragons in one plan. The plan keeps the clearance exactly if its line stays outside of the area.
#[derive(Clone, Debug, PartialEq)]
pub struct CoordinationDiagram {
    /// Caption above the diagram.
    pub caption: Caption,
    /// Names of both dragons, that of the x axis first.
    pub names: [String; 2],
    /// Low and high corners of the rectangles in which boards come within the clearance.
    pub forbidden: Vec<[DVec2; 2]>,
    /// The plan, in the order of time.
    pub line: Vec<DVec2>,
    /// Places of the plan at which the dragons are nearest at a crossing.
    pub nearest: Vec<DVec2>,
}

const HEIGHT: f64 = 110.0;
/// Room beside the travels ÷ their extent.
const MARGIN: f64 = 0.03;
const DOT_RADIUS: f64 = 0.9;
const FORBIDDEN: Colour = GREY;

impl CoordinationDiagram {
    /// Draws the figure.
    pub fn draw(&self) -> Drawing {
        let (mut drawing, top) = page(&self.caption, &Self::legend(), HEIGHT + BOTTOM_MARGIN);
        let area = Rect::from_origin_size((LEFT_MARGIN, top), (PLOT_WIDTH, HEIGHT));
        let plot = Plot::new(
            area,
            &range_of(self.line.iter().map(|point| point.x), MARGIN),
            &range_of(self.line.iter().map(|point| point.y), MARGIN),
        );
        plot.draw_grid(&mut drawing);
        let rectangles = self.forbidden.iter().flat_map(|corners| {
            let [low, high] = corners.map(|corner| plot.at(corner));
            Rect::from_points(low, high).to_path(0.0)
        });
        drawing.push(Mark::filled(rectangles.collect(), FORBIDDEN).clipped(area).labelled("forbidden"));
        drawing.push(plot.line(&self.line, BLUE, LINE_WIDTH).labelled("plan"));
        for point in &self.nearest {
            drawing.push(plot.dot(*point, DOT_RADIUS, VERMILION).labelled("nearest boards"));
        }
        plot.draw_frame(&mut drawing);
        let [x, y] = self.names.each_ref().map(|name| format!("travel of {name} (m)"));
        plot.label(&mut drawing, &x, &y);
        drawing
    }

    fn legend() -> [LegendEntry; 3] {
        let line = Swatch::Line { colour: BLUE, width: LINE_WIDTH, style: LineStyle::Solid };
        [
            LegendEntry::new(line, "plan"),
            LegendEntry::new(Swatch::Area(FORBIDDEN), "boards within the clearance"),
            LegendEntry::new(Swatch::Dot { colour: VERMILION, radius: DOT_RADIUS }, "nearest boards at a crossing"),
        ]
    }
}

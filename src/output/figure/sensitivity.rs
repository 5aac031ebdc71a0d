//! Plots of answers over changes of the configured parameters.

use glam::DVec2;
use kurbo::Rect;

use super::drawing::Drawing;
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::{Plot, range_of};
use super::style::{BOTTOM_MARGIN, LEFT_MARGIN, LINE_WIDTH, PAGE_WIDTH, RIGHT_MARGIN, ROW_GAP, line_look};

/// Sensitivity of answers to parameters. Each answer has a plot, with a line for each parameter over its change in percent.
#[derive(Clone, Debug, PartialEq)]
pub struct SensitivityChart {
    /// Caption above the plots.
    pub caption: Caption,
    /// Names of the parameters.
    pub parameters: Vec<String>,
    /// The answers.
    pub quantities: Vec<ChartQuantity>,
}

/// An answer and its curves.
#[derive(Clone, Debug, PartialEq)]
pub struct ChartQuantity {
    /// Name of the answer, with its unit in brackets.
    pub name: String,
    /// For each parameter: its changes in percent in order, with the answer to each; `None` without an answer.
    pub curves: Vec<Vec<(f64, Option<f64>)>>,
}

const COLUMNS: usize = 2;
const HEIGHT: f64 = 50.0;
const MARGIN: f64 = 0.08;
const DOT_RADIUS: f64 = 0.55;

impl SensitivityChart {
    /// Draws the figure.
    pub fn draw(&self) -> Drawing {
        let row_height = HEIGHT + BOTTOM_MARGIN + ROW_GAP;
        let rows = self.quantities.len().div_ceil(COLUMNS) as f64;
        let (mut drawing, top) = page(&self.caption, &self.legend(), rows * row_height - ROW_GAP);
        let column_width = PAGE_WIDTH / COLUMNS as f64;
        for (index, quantity) in self.quantities.iter().enumerate() {
            let (column, row) = ((index % COLUMNS) as f64, (index / COLUMNS) as f64);
            let width = column_width - LEFT_MARGIN - RIGHT_MARGIN;
            let area =
                Rect::from_origin_size((column * column_width + LEFT_MARGIN, top + row * row_height), (width, HEIGHT));
            quantity.draw(&mut drawing, area);
        }
        drawing
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let entries = self.parameters.iter().enumerate().map(|(index, name)| {
            let (colour, style) = line_look(index);
            LegendEntry::new(Swatch::Line { colour, width: LINE_WIDTH, style }, name.as_str())
        });
        entries.collect()
    }
}

impl ChartQuantity {
    fn draw(&self, drawing: &mut Drawing, area: Rect) {
        let changes = range_of(self.curves.iter().flatten().map(|(change, _)| *change), 0.0);
        let values = range_of(self.curves.iter().flatten().filter_map(|(_, value)| *value), MARGIN);
        let plot = Plot::new(area, &changes, &values);
        plot.draw_grid(drawing);
        for (index, curve) in self.curves.iter().enumerate() {
            let (colour, style) = line_look(index);
            for stretch in curve.split(|(_, value)| value.is_none()) {
                let points: Vec<DVec2> = stretch
                    .iter()
                    .filter_map(|(change, value)| value.map(|value| DVec2::new(*change, value)))
                    .collect();
                drawing.push(plot.line(&points, colour, LINE_WIDTH).styled(style));
                for point in points {
                    drawing
                        .push(plot.dot(point, DOT_RADIUS, colour).clipped(plot.area.inflate(DOT_RADIUS, DOT_RADIUS)));
                }
            }
        }
        plot.draw_frame(drawing);
        plot.label(drawing, "change (%)", &self.name);
    }
}

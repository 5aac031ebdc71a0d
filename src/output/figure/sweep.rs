//! Plan of the area that boards sweep.

use std::f64::consts::FRAC_PI_4;

use glam::DVec2;
use kurbo::{BezPath, Rect, Vec2};

use super::Drawing;
use super::boards::bounds;
use super::drawing::{Mark, circle, polygon};
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::Plot;
use super::stage::StageInPlan;
use super::style::{BLACK, BLUE, BOTTOM_MARGIN, FINE_WIDTH, LEFT_MARGIN, LINE_WIDTH, PALE_BLUE, PLOT_WIDTH, VERMILION};
use super::text::{Anchor, Text};
use crate::output::visible_box;

/// The swept area on its stage. Both axes have the same scale.
#[derive(Clone, Debug, PartialEq)]
pub struct SweepView {
    /// Caption above the plan.
    pub caption: Caption,
    /// The borders of the stage.
    pub stage: StageInPlan,
    /// The borders of the area. Those of holes run the other way round.
    pub area: Vec<Vec<DVec2>>,
    /// Where a board is nearest to a border.
    pub nearest: Vec<DVec2>,
    /// Places to be marked, with their words.
    pub marks: Vec<(DVec2, String)>,
}

/// Free margin around the area ÷ its extent.
const MARGIN: f64 = 0.03;
/// Least and greatest height of the plan.
const HEIGHTS: [f64; 2] = [50.0, 160.0];
const RING_RADIUS: f64 = 1.3;
const MARK_RADIUS: f64 = 0.4;
/// Size of the words of a mark, and their distance from it.
const MARK_SIZE: f64 = 1.6;
const MARK_GAP: f64 = 0.8;

impl SweepView {
    /// Draws the figure.
    ///
    /// # Panics
    /// Panics without an area.
    pub fn draw(&self) -> Drawing {
        let [low, high] = visible_box(self.area.iter().flatten().copied(), self.stage.points()).expect("an area");
        let [low, high] = bounds([low, high], MARGIN * (high - low).max_element());
        let height = (PLOT_WIDTH * (high.y - low.y) / (high.x - low.x)).clamp(HEIGHTS[0], HEIGHTS[1]);
        let (mut drawing, top) = page(&self.caption, &self.legend(), height + BOTTOM_MARGIN);
        let plot = Plot::plan(Rect::from_origin_size((LEFT_MARGIN, top), (PLOT_WIDTH, height)), low, high);
        let mut borders = BezPath::new();
        for border in &self.area {
            borders.extend(polygon(border.iter().map(|&point| plot.at(point))));
        }
        let area = Mark::filled(borders, PALE_BLUE).outlined(BLUE, FINE_WIDTH);
        drawing.push(area.clipped(plot.area).labelled("area that boards sweep"));
        self.stage.draw(&mut drawing, &plot);
        for &point in &self.nearest {
            let ring = Mark::stroked(circle(plot.at(point), RING_RADIUS), VERMILION, LINE_WIDTH);
            drawing.push(ring.clipped(plot.area).labelled("nearest to a border"));
        }
        for (point, words) in &self.marks {
            let at = plot.at(*point);
            drawing.push(Mark::filled(circle(at, MARK_RADIUS), BLACK).labelled(words.as_str()));
            // Words at an angle do not cover each other along a line across the page.
            let text = Text::new(words.as_str(), MARK_SIZE).anchored(Anchor::Left).turned(-FRAC_PI_4);
            drawing.write(&text, at + MARK_GAP * Vec2::from_angle(-FRAC_PI_4));
        }
        plot.draw_frame(&mut drawing);
        plot.label(&mut drawing, "x (m)", "y (m)");
        drawing
    }

    fn legend(&self) -> Vec<LegendEntry> {
        let mut entries = vec![LegendEntry::new(Swatch::Area(PALE_BLUE), "swept by boards")];
        if !self.marks.is_empty() {
            entries.push(LegendEntry::new(
                Swatch::Dot { colour: BLACK, radius: MARK_RADIUS },
                "H head, T tail, with the moment",
            ));
        }
        entries.extend(self.stage.legend());
        if !self.nearest.is_empty() {
            let ring = Swatch::Ring { colour: VERMILION, radius: RING_RADIUS };
            entries.push(LegendEntry::new(ring, "nearest to a border"));
        }
        entries
    }
}

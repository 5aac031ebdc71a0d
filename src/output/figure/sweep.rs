//! Plan of the area that boards sweep.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_4};

use glam::DVec2;
use kurbo::{BezPath, Point, Rect, Vec2};

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
            draw_mark(&mut drawing, plot.area, plot.at(*point), words);
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

/// Draws a mark with its words at an angle, so that those of marks along a line across the page do not cover each other. They go up to the
/// right; where the area ends there, down or to the left.
fn draw_mark(drawing: &mut Drawing, area: Rect, at: Point, words: &str) {
    drawing.push(Mark::filled(circle(at, MARK_RADIUS), BLACK).labelled(words));
    let text = Text::new(words, MARK_SIZE);
    let reach = (MARK_GAP + text.width()) * FRAC_1_SQRT_2;
    let (goes_left, goes_down) = (at.x + reach > area.x1, at.y - reach < area.y0);
    let turn = if goes_left == goes_down { -FRAC_PI_4 } else { FRAC_PI_4 };
    let along = MARK_GAP * Vec2::from_angle(turn);
    let (anchor, start) = if goes_left { (Anchor::Right, at - along) } else { (Anchor::Left, at + along) };
    drawing.write(&text.anchored(anchor).turned(turn), start);
}

#[cfg(test)]
mod tests {
    use kurbo::Shape as _;

    use super::*;

    #[test]
    fn words_of_a_mark_stay_in_the_area() {
        let area = Rect::new(10.0, 10.0, 110.0, 90.0);
        for at in [(12.0, 12.0), (108.0, 12.0), (12.0, 88.0), (108.0, 88.0), (60.0, 50.0)] {
            let mut drawing = Drawing::new(String::new(), area.size());
            draw_mark(&mut drawing, area, at.into(), "H12 -12.34, 56.78");
            let words = drawing.marks.last().expect("the words").path.bounding_box();
            assert!(area.inflate(1.0, 1.0).contains_rect(words), "{words:?} of {at:?}");
            assert!(
                words.contains_rect(Rect::from_center_size(words.center(), (8.0, 8.0))),
                "{words:?} is at an angle"
            );
        }
    }
}

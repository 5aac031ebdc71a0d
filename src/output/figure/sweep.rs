//! Plan of the area that boards sweep.

use glam::DVec2;
use kurbo::{BezPath, Point, Rect};

use super::Drawing;
use super::boards::bounds;
use super::drawing::{Mark, circle, polygon};
use super::notes::Notes;
use super::page::{Caption, LegendEntry, Swatch, page};
use super::plot::Plot;
use super::stage::StageInPlan;
use super::style::{BLACK, BLUE, BOTTOM_MARGIN, FINE_WIDTH, LEFT_MARGIN, LINE_WIDTH, PALE_BLUE, PLOT_WIDTH, VERMILION};
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
    /// Places to be marked, with the lines of their words.
    pub marks: Vec<(DVec2, Vec<String>)>,
}

/// Free margin around the area ÷ its extent.
const MARGIN: f64 = 0.03;
/// Least and greatest height of the plan.
const HEIGHTS: [f64; 2] = [50.0, 160.0];
const RING_RADIUS: f64 = 1.3;
const MARK_RADIUS: f64 = 0.4;
/// Size of the words of a mark.
const MARK_SIZE: f64 = 1.6;

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
        let marks: Vec<(Point, &[String])> =
            self.marks.iter().map(|(point, words)| (plot.at(*point), &words[..])).collect();
        let borders = self.area.iter().map(|border| border.iter().map(|&point| plot.at(point)).collect());
        draw_marks(&mut drawing, plot.area, &borders.collect::<Vec<_>>(), &marks);
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

/// Draws marks, with their words where they cover neither each other nor a mark. A mark without room for its words has none.
/// `lines` are better not covered either.
fn draw_marks(drawing: &mut Drawing, area: Rect, lines: &[Vec<Point>], marks: &[(Point, &[String])]) {
    let mut notes = Notes::new(area, lines).sized(MARK_SIZE);
    for (at, words) in marks {
        drawing.push(Mark::filled(circle(*at, MARK_RADIUS), BLACK).labelled(words.join(" ")));
        notes.keep_off(Rect::from_center_size(*at, (2.0 * MARK_RADIUS, 2.0 * MARK_RADIUS)));
    }
    for (at, words) in marks {
        notes.write(drawing, words, *at);
    }
}

#[cfg(test)]
mod tests {
    use kurbo::Shape as _;

    use super::*;

    #[test]
    fn words_of_near_marks_stay_in_the_area_and_apart() {
        let area = Rect::new(10.0, 10.0, 110.0, 90.0);
        let places = [
            (12.0, 12.0),
            (13.0, 12.5),
            (108.0, 12.0),
            (12.0, 88.0),
            (108.0, 88.0),
            (60.0, 50.0),
            (60.5, 50.5),
            (61.0, 51.0),
        ];
        let words = ["gold H12".to_owned(), "-12.34, 56.78".to_owned()];
        let marks = places.map(|at| (Point::from(at), &words[..]));
        let mut drawing = Drawing::new(String::new(), area.size());
        draw_marks(&mut drawing, area, &[], &marks);
        let lines: Vec<Rect> = drawing
            .marks
            .iter()
            .filter(|mark| words.iter().any(|line| mark.label.as_ref() == Some(line)))
            .map(|mark| mark.path.bounding_box())
            .collect();
        assert_eq!(lines.len(), 2 * places.len());
        for (index, line) in lines.iter().enumerate() {
            assert!(area.contains_rect(*line), "{line:?}");
            assert!(lines[..index].iter().all(|other| !other.overlaps(*line)), "{line:?}");
            assert!(marks.iter().all(|(at, _)| !line.contains(*at)), "{line:?}");
        }
    }
}

//! Two benches and the clearance between them, from near.

use glam::DVec2;

use super::board_names::write_names;
use super::boards::{Standing, width_m};
use super::drawing::{Anchor, Drawing, Text};
use super::mark::Mark;
use super::palette::BLACK;
use super::path::{Path, Rect};
use super::plot::Plot;
use super::style::{AXIS_WIDTH, LABEL_SIZE, LINE_WIDTH};

/// Two benches whose clearance is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair {
    /// The two benches.
    pub benches: [usize; 2],
    /// Their clearance in metres; 0 or less where they touch.
    pub clearance_m: f64,
    /// The nearest points of their boards: where they touch, the same point twice.
    pub points: [DVec2; 2],
}

/// Height of what is shown ÷ width of a board, beside the clearance.
const HEIGHT_PER_WIDTH: f64 = 4.5;
/// A clearance that is printed as 0: half of a micrometre.
const TOUCHING_M: f64 = 5e-7;
/// Least distance of the two points on the page that is drawn as a measure, and not as a point.
const LEAST_MEASURE: f64 = 1.5;
/// Length of the strokes at the ends of a measure.
const END_LENGTH: f64 = 3.0;
const POINT_RADIUS: f64 = 2.0;
const HINGE_RADIUS: f64 = 0.8;
/// From the words to the plot below.
const WORDS_RISE: f64 = 3.2;

impl Pair {
    /// What the two benches are, for the legend.
    pub(super) fn kind(&self) -> &'static str {
        if self.touches() { "in touch" } else { "nearest pair" }
    }

    /// The pair as people read it.
    fn words(&self) -> String {
        let [first, second] = self.benches;
        if self.touches() {
            format!("Benches {first} and {second} touch")
        } else {
            format!("Benches {first} and {second}: clearance {:.3} mm", 1000.0 * self.clearance_m)
        }
    }

    fn touches(&self) -> bool {
        self.clearance_m < TOUCHING_M
    }

    /// Draws the pair's surroundings into an area below the plan that shows all, and the frame of it in that plan.
    pub(super) fn draw(&self, drawing: &mut Drawing, standing: &Standing<'_>, plan: &Plot, area: Rect) {
        let centre = 0.5 * (self.points[0] + self.points[1]);
        let height_m = HEIGHT_PER_WIDTH * width_m(&standing.boards[self.benches[0]]) + 2.0 * self.clearance_m.max(0.0);
        let half = 0.5 * height_m * DVec2::new(area.size().x / area.size().y, 1.0);
        let plot = Plot::plan(area, centre - half, centre + half);
        Standing { hinge_radius: HINGE_RADIUS, ..*standing }.draw(drawing, &plot);
        self.draw_measure(drawing, &plot);
        let obstacles: Vec<DVec2> = standing.hinges.iter().chain(&self.points).copied().collect();
        write_names(drawing, &plot, standing.boards, &self.benches, &obstacles);
        plot.draw_frame(drawing);
        plot.label_x(drawing, "x (m)");
        plot.label_y(drawing, "y (m)");
        let words = Text::new(self.words(), LABEL_SIZE).anchored(Anchor::Left);
        drawing.write(&words, area.min - WORDS_RISE * DVec2::Y);
        let [min, max] = [DVec2::new(-half.x, half.y), DVec2::new(half.x, -half.y)].map(|half| plan.at(centre + half));
        let frame = Mark::stroked(Rect { min, max }.path(), BLACK, LINE_WIDTH).clipped(plan.area);
        drawing.push(frame.labelled("shown larger below"));
    }

    /// Draws the clearance as a measure from point to point, or a ring where they are too near for one.
    fn draw_measure(&self, drawing: &mut Drawing, plot: &Plot) {
        let [from, to] = self.points.map(|point| plot.at(point));
        if from.distance(to) < LEAST_MEASURE {
            let ring = Path::circle(0.5 * (from + to), POINT_RADIUS);
            drawing.push(Mark::stroked(ring, BLACK, LINE_WIDTH).clipped(plot.area).labelled(self.words()));
            return;
        }
        let end = 0.5 * END_LENGTH * (to - from).normalize().perp();
        let mut path = Path::line([from, to]);
        for point in [from, to] {
            path.push(&Path::line([point - end, point + end]));
        }
        drawing.push(Mark::stroked(path, BLACK, 2.0 * AXIS_WIDTH).clipped(plot.area).labelled(self.words()));
    }
}

//! Plan of the boards at a contact or a near miss, and a larger plan of the two benches.

use glam::DVec2;
use kurbo::{Point, Rect, Shape as _};

use super::boards::{DragonInPlan, bounds, width_m, write_names};
use super::drawing::{Drawing, Mark, circle, polyline};
use super::page::{Caption, page};
use super::plan_view::NearestPair;
use super::plot::Plot;
use super::style::{AXIS_WIDTH, BLACK, BOTTOM_MARGIN, LEFT_MARGIN, LINE_WIDTH, PAGE_WIDTH};

/// The boards at a contact or a near miss: the whole dragon on the left, the surroundings of the two benches on the right.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactView {
    /// Caption above the plans.
    pub caption: Caption,
    /// The dragon.
    pub dragon: DragonInPlan,
    /// The two benches, and their nearest points.
    pub pair: NearestPair,
}

/// Distance between the two plans.
const GAP: f64 = 10.0;
/// Side of the larger plan, without the clearance at both sides, ÷ width of a board.
const SIDE_PER_WIDTH: f64 = 4.5;
const HINGE_RADIUS: f64 = 0.15;
const NEAR_HINGE_RADIUS: f64 = 1.0;
const POINT_RADIUS: f64 = 2.0;

impl ContactView {
    /// Draws the figure.
    ///
    /// # Panics
    /// If one of the two benches has no board.
    pub fn draw(&self) -> Drawing {
        let width = 0.5 * (PAGE_WIDTH - 2.0 * LEFT_MARGIN - GAP);
        let benches = self.pair.benches;
        let entries = self.dragon.legend(&benches, self.pair.kind(), HINGE_RADIUS);
        let (mut drawing, top) = page(&self.caption, &entries, width + BOTTOM_MARGIN);
        let area = |left: f64| Rect::from_origin_size((left, top), (width, width));
        let [low, high] = bounds(self.dragon.boards.iter().flatten().copied(), self.board_width_m());
        let left = Plot::plan(area(LEFT_MARGIN), low, high);
        let side_m = SIDE_PER_WIDTH * self.board_width_m() + 2.0 * self.pair.clearance_m.max(0.0);
        let (point, half) = (self.pair.middle(), DVec2::splat(0.5 * side_m));
        let [near_low, near_high] = [point - half, point + half];
        let right = Plot::plan(area(PAGE_WIDTH - LEFT_MARGIN - width), near_low, near_high).with_y_at_the_right();

        self.dragon.draw(&mut drawing, &left, &benches, HINGE_RADIUS);
        let region = Rect::from_points(left.at(near_low), left.at(near_high));
        self.dragon.draw(&mut drawing, &right, &benches, NEAR_HINGE_RADIUS);
        self.draw_pair(&mut drawing, &right);
        left.draw_frame(&mut drawing);
        right.draw_frame(&mut drawing);
        draw_magnification(&mut drawing, region, right.area);
        left.label(&mut drawing, "x (m)", "y (m)");
        right.label(&mut drawing, "x (m)", "y (m)");
        drawing
    }

    fn board_width_m(&self) -> f64 {
        width_m(&self.dragon.boards[self.pair.benches[0]])
    }

    /// Marks the contact or the clearance, and writes the names of the two benches on their boards.
    fn draw_pair(&self, drawing: &mut Drawing, plot: &Plot) {
        if self.pair.touches() {
            let at = plot.at(self.pair.middle());
            drawing.push(Mark::stroked(circle(at, POINT_RADIUS), BLACK, LINE_WIDTH).labelled("contact"));
        } else {
            self.pair.draw_measure(drawing, plot);
        }
        let obstacles: Vec<DVec2> = self.dragon.hinges.iter().chain(&self.pair.points).copied().collect();
        write_names(drawing, plot, &self.dragon.boards, &self.pair.benches, &obstacles);
    }
}

/// Frames the region in the left plan, and connects it with the right plan, which shows it larger.
fn draw_magnification(drawing: &mut Drawing, region: Rect, part: Rect) {
    drawing.push(Mark::stroked(region.to_path(0.0), BLACK, LINE_WIDTH));
    for (y, part_y) in [(region.y0, part.y0), (region.y1, part.y1)] {
        let ends = [Point::new(region.x1, y), Point::new(part.x0, part_y)];
        drawing.push(Mark::stroked(polyline(ends), BLACK, 0.6 * AXIS_WIDTH));
    }
}

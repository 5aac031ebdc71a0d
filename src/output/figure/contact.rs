//! The boards where two of them touch, and the touch itself from near.

use glam::DVec2;
use kurbo::{Point, Rect, Shape as _};

use super::boards::{BoardsInPlan, bounds, width_m, write_names};
use super::drawing::{Drawing, Mark, area, circle, polyline};
use super::page::{Caption, head_height, page};
use super::plot::Plot;
use super::style::{AXIS_WIDTH, BLACK, BOTTOM_MARGIN, LEFT_MARGIN, LINE_WIDTH, PAGE_WIDTH};

/// The boards at a contact: the whole dragon on the left, the surroundings of the contact on the right.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactView {
    /// Stands over it.
    pub caption: Caption,
    /// The route from point to point.
    pub route: Vec<DVec2>,
    /// Corners of every board, the head's first.
    pub boards: Vec<[DVec2; 4]>,
    /// Every hinge.
    pub hinges: Vec<DVec2>,
    /// The two benches that touch.
    pub benches: [usize; 2],
    /// Where they touch.
    pub point: DVec2,
}

/// Between the whole and the part.
const GAP: f64 = 10.0;
/// Side of the part ÷ width of a board.
const SIDE_PER_WIDTH: f64 = 4.5;
const POINT_RADIUS: f64 = 2.0;

impl ContactView {
    /// Draws it.
    ///
    /// # Panics
    /// The two benches must have boards.
    pub fn draw(&self) -> Drawing {
        let width = 0.5 * (PAGE_WIDTH - 2.0 * LEFT_MARGIN - GAP);
        let whole = self.in_plan(0.15);
        let entries = whole.legend();
        let top = head_height(&self.caption, &entries);
        let mut drawing = page(&self.caption, &entries, width + BOTTOM_MARGIN);
        let [low, high] = bounds(self.boards.iter().flatten().copied(), self.board_width_m());
        let left = Plot::plan(area(LEFT_MARGIN, top, width, width), low, high);
        let half = DVec2::splat(0.5 * SIDE_PER_WIDTH * self.board_width_m());
        let [near_low, near_high] = [self.point - half, self.point + half];
        let right = Plot::plan(area(PAGE_WIDTH - LEFT_MARGIN - width, top, width, width), near_low, near_high)
            .with_y_at_the_right();

        whole.draw(&mut drawing, &left);
        let region = Rect::from_points(left.at(near_low), left.at(near_high));
        self.in_plan(1.0).draw(&mut drawing, &right);
        self.draw_touch(&mut drawing, &right);
        left.draw_frame(&mut drawing);
        right.draw_frame(&mut drawing);
        draw_magnification(&mut drawing, region, right.area);
        left.label_x(&mut drawing, "x (m)");
        left.label_y(&mut drawing, "y (m)");
        right.label_x(&mut drawing, "x (m)");
        right.label_y(&mut drawing, "y (m)");
        drawing
    }

    fn in_plan(&self, hinge_radius: f64) -> BoardsInPlan<'_> {
        let Self { route, boards, hinges, benches, .. } = self;
        BoardsInPlan { route, boards, hinges, marked: benches, marked_as: "in touch", hinge_radius }
    }

    fn board_width_m(&self) -> f64 {
        width_m(&self.boards[self.benches[0]])
    }

    /// Marks the point and names the two benches, each on its board.
    fn draw_touch(&self, drawing: &mut Drawing, plot: &Plot) {
        let at = plot.at(self.point);
        drawing.push(Mark::stroked(circle(at, POINT_RADIUS), BLACK, LINE_WIDTH).labelled("contact"));
        let obstacles: Vec<DVec2> = self.hinges.iter().chain([&self.point]).copied().collect();
        write_names(drawing, plot, &self.boards, &self.benches, &obstacles);
    }
}

/// Frames the region in the whole and leads from it to the part that shows it larger.
fn draw_magnification(drawing: &mut Drawing, region: Rect, part: Rect) {
    drawing.push(Mark::stroked(region.to_path(0.0), BLACK, LINE_WIDTH));
    for (y, part_y) in [(region.y0, part.y0), (region.y1, part.y1)] {
        let ends = [Point::new(region.x1, y), Point::new(part.x0, part_y)];
        drawing.push(Mark::stroked(polyline(ends), BLACK, 0.6 * AXIS_WIDTH));
    }
}

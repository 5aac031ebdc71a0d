//! The boards where two of them touch, and the touch itself from near.

use glam::DVec2;

use super::boards::{Standing, bounds};
use super::drawing::{Drawing, Text};
use super::mark::Mark;
use super::page::{head_height, page};
use super::palette::BLACK;
use super::path::{Path, Rect};
use super::plot::Plot;
use super::style::{AXIS_WIDTH, BOTTOM_MARGIN, LABEL_SIZE, LEFT_MARGIN, LINE_WIDTH, PAGE_WIDTH};

/// The boards at a contact: the whole dragon on the left, the surroundings of the contact on the right.
#[derive(Clone, Debug, PartialEq)]
pub struct ContactView {
    /// Stands over the plan.
    pub title: String,
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
/// Room around a bench's name that is as good as more.
const ENOUGH_FREE: f64 = 4.0;

impl ContactView {
    /// Draws it.
    ///
    /// # Panics
    /// The two benches must have boards.
    pub fn draw(&self) -> Drawing {
        let width = 0.5 * (PAGE_WIDTH - 2.0 * LEFT_MARGIN - GAP);
        let whole = self.standing(0.15);
        let entries = whole.legend();
        let top = head_height(&entries);
        let mut drawing = page(&self.title, &entries, width + BOTTOM_MARGIN);
        let [low, high] = bounds(self.boards.iter().flatten().copied(), self.board_width_m());
        let left = Plot::plan(Rect::new(LEFT_MARGIN, top, width, width), low, high);
        let half = DVec2::splat(0.5 * SIDE_PER_WIDTH * self.board_width_m());
        let [near_low, near_high] = [self.point - half, self.point + half];
        let right = Plot::plan(Rect::new(PAGE_WIDTH - LEFT_MARGIN - width, top, width, width), near_low, near_high)
            .with_y_at_the_right();

        whole.draw(&mut drawing, &left);
        let region = Rect {
            min: left.at(DVec2::new(near_low.x, near_high.y)),
            max: left.at(DVec2::new(near_high.x, near_low.y)),
        };
        self.standing(1.0).draw(&mut drawing, &right);
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

    fn standing(&self, hinge_radius: f64) -> Standing<'_> {
        let Self { route, boards, hinges, benches, .. } = self;
        Standing { route, boards, hinges, touching: benches, hinge_radius }
    }

    fn board_width_m(&self) -> f64 {
        let [front_left, _, _, front_right] = self.boards[self.benches[0]];
        front_left.distance(front_right)
    }

    /// Marks the point and names the two benches, each on its board.
    fn draw_touch(&self, drawing: &mut Drawing, plot: &Plot) {
        let at = plot.at(self.point);
        drawing.push(Mark::stroked(Path::circle(at, POINT_RADIUS), BLACK, LINE_WIDTH).labelled("contact"));
        for bench in self.benches {
            let words = if bench == 0 { "bench 0, head".to_owned() } else { format!("bench {bench}") };
            let text = Text::new(words, LABEL_SIZE);
            if let Some((middle, turn)) = self.place_on_board(bench, &text, plot) {
                drawing.write(&text.turned(turn), middle);
            }
        }
    }

    /// Where a text fits onto a board, along it and within the plot, free of hinges and of the contact, and the angle at
    /// which it reads from left to right.
    fn place_on_board(&self, bench: usize, text: &Text, plot: &Plot) -> Option<(DVec2, f64)> {
        const STEPS: u32 = 200;
        let [front_left, rear_left, rear_right, front_right] = self.boards[bench].map(|corner| plot.at(corner));
        let half = 0.5 * text.width() * (front_left - rear_left).normalize();
        let obstacles: Vec<DVec2> = self.hinges.iter().chain([&self.point]).map(|point| plot.at(*point)).collect();
        let free_mm = |middle: &DVec2| {
            let distances = obstacles.iter().map(|point| distance_to_stretch(*point, *middle - half, *middle + half));
            distances.fold(ENOUGH_FREE, f64::min)
        };
        let is_inside = |middle: &DVec2| [half, -half].iter().all(|end| plot.area.grown(-2.0).contains(*middle + *end));
        let middles = [0.5, 0.25, 0.75].into_iter().flat_map(|share| {
            let (front, rear) = (front_left.lerp(front_right, share) - half, rear_left.lerp(rear_right, share) + half);
            (0..=STEPS).map(move |step| rear.lerp(front, f64::from(step) / f64::from(STEPS)))
        });
        // Of equally free ones the first, so the middle line of the board before its sides.
        let best = middles.filter(is_inside).min_by(|a, b| free_mm(b).total_cmp(&free_mm(a)))?;
        let reading = if half.x < 0.0 { -half } else { half };
        Some((best, reading.to_angle()))
    }
}

/// Frames the region in the whole and leads from it to the part that shows it larger.
fn draw_magnification(drawing: &mut Drawing, region: Rect, part: Rect) {
    drawing.push(Mark::stroked(region.path(), BLACK, LINE_WIDTH));
    let [_, upper, lower, _] = region.corners();
    let [part_upper, _, _, part_lower] = part.corners();
    for ends in [[upper, part_upper], [lower, part_lower]] {
        drawing.push(Mark::stroked(Path::line(ends), BLACK, 0.6 * AXIS_WIDTH));
    }
}

fn distance_to_stretch(point: DVec2, from: DVec2, to: DVec2) -> f64 {
    let stretch = to - from;
    let share = ((point - from).dot(stretch) / stretch.length_squared()).clamp(0.0, 1.0);
    point.distance(from + share * stretch)
}

//! Boards, hinges and the route in a plan, and the names of benches on their boards.

use glam::DVec2;
use kurbo::Point;

use super::drawing::{Drawing, contains};
use super::page::{LegendEntry, Swatch};
use super::plot::Plot;
use super::stage::StageInPlan;
use super::style::{BLACK, FINE_WIDTH, GREY, LABEL_SIZE, LineStyle, ORANGE, SKY_BLUE, VERMILION};
use super::text::Text;

const OUTLINE_WIDTH: f64 = 0.1;
/// Sufficient room around a name in millimetres; more room counts as equal.
const ENOUGH_FREE: f64 = 4.0;
/// Number of tried positions along each of three lines of a board.
const STEPS: u32 = 200;

/// The dragon in a plan.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct DragonInPlan {
    /// The route from point to point, without parts far from the dragon.
    pub route: Vec<DVec2>,
    /// Corners of every board, the head's first.
    pub boards: Vec<[DVec2; 4]>,
    /// All hinges.
    pub hinges: Vec<DVec2>,
    /// The borders of the stage.
    pub stage: StageInPlan,
}

impl DragonInPlan {
    /// Draws the stage, the route, the boards from the tail to the head, then the hinges, clipped to the plot. Marked benches
    /// have a separate colour.
    pub(super) fn draw(&self, drawing: &mut Drawing, plot: &Plot, marked: &[usize], hinge_radius: f64) {
        self.stage.draw(drawing, plot);
        drawing.push(plot.line(&self.route, GREY, FINE_WIDTH));
        for (bench, corners) in self.boards.iter().enumerate().rev() {
            let colour = match bench {
                0 => VERMILION,
                _ if marked.contains(&bench) => ORANGE,
                _ => SKY_BLUE,
            };
            let board = plot.polygon(corners, colour).outlined(BLACK, OUTLINE_WIDTH);
            drawing.push(board.labelled(format!("bench {bench}")));
        }
        for hinge in &self.hinges {
            drawing.push(plot.dot(*hinge, hinge_radius, BLACK).clipped(plot.area));
        }
    }

    /// Entries of the legend, with a name for the marked benches.
    pub(super) fn legend(&self, marked: &[usize], marked_as: &str, hinge_radius: f64) -> Vec<LegendEntry> {
        let line = Swatch::Line { colour: GREY, width: FINE_WIDTH, style: LineStyle::Solid };
        let mut entries = self.stage.legend();
        if self.boards.is_empty() {
            entries.push(LegendEntry::new(line, "route"));
            return entries;
        }
        entries.push(LegendEntry::new(Swatch::Area(VERMILION), "head"));
        if marked.iter().any(|bench| *bench > 0) {
            entries.push(LegendEntry::new(Swatch::Area(ORANGE), marked_as));
        }
        if self.boards.len() > 1 {
            entries.push(LegendEntry::new(Swatch::Area(SKY_BLUE), "bench"));
        }
        entries.push(LegendEntry::new(Swatch::Dot { colour: BLACK, radius: hinge_radius.max(0.3) }, "hinge"));
        entries.push(LegendEntry::new(line, "route"));
        entries
    }
}

pub(super) fn width_m([front_left, _, _, front_right]: &[DVec2; 4]) -> f64 {
    front_left.distance(*front_right)
}

/// Low and high corner of the box around all points, plus a margin in metres.
pub(super) fn bounds(points: impl IntoIterator<Item = DVec2>, margin_m: f64) -> [DVec2; 2] {
    let empty = [DVec2::INFINITY, DVec2::NEG_INFINITY];
    let [low, high] = points.into_iter().fold(empty, |[low, high], point| [low.min(point), high.max(point)]);
    [low - margin_m, high + margin_m]
}

/// Writes the names of some benches on their boards, away from obstacles, which are points of the plot. A board without enough
/// room in the plot gets no name.
pub(super) fn write_names(
    drawing: &mut Drawing,
    plot: &Plot,
    boards: &[[DVec2; 4]],
    benches: &[usize],
    obstacles: &[DVec2],
) {
    let on_page = |point: DVec2| DVec2::from(<(f64, f64)>::from(plot.at(point)));
    let obstacles: Vec<DVec2> = obstacles.iter().map(|point| on_page(*point)).collect();
    for &bench in benches {
        let words = if bench == 0 { "bench 0, head".to_owned() } else { format!("bench {bench}") };
        let text = Text::new(words, LABEL_SIZE);
        let corners = boards[bench].map(on_page);
        if let Some((middle, turn)) = position_on_board(corners, &text, plot, &obstacles) {
            drawing.write(&text.turned(turn), point(middle));
        }
    }
}

/// Finds the position of a text along a board, inside the plot and away from obstacles on the page. Also returns the angle at
/// which the text reads from left to right.
fn position_on_board(corners: [DVec2; 4], text: &Text, plot: &Plot, obstacles: &[DVec2]) -> Option<(DVec2, f64)> {
    let [front_left, rear_left, rear_right, front_right] = corners;
    let half = 0.5 * text.width() * (front_left - rear_left).normalize();
    let free_mm = |middle: &DVec2| {
        let distances = obstacles.iter().map(|point| distance_to_stretch(*point, *middle - half, *middle + half));
        distances.fold(ENOUGH_FREE, f64::min)
    };
    let area = plot.area.inflate(-2.0, -2.0);
    let is_inside = |middle: &DVec2| [half, -half].iter().all(|end| contains(area, point(*middle + *end)));
    let middles = [0.5, 0.25, 0.75].into_iter().flat_map(|share| {
        let (front, rear) = (front_left.lerp(front_right, share) - half, rear_left.lerp(rear_right, share) + half);
        (0..=STEPS).map(move |step| rear.lerp(front, f64::from(step) / f64::from(STEPS)))
    });
    // Of equal positions, the first wins: the middle line of the board comes before its sides.
    let best = middles.filter(is_inside).min_by(|a, b| free_mm(b).total_cmp(&free_mm(a)))?;
    let reading = if half.x < 0.0 { -half } else { half };
    Some((best, reading.to_angle()))
}

fn distance_to_stretch(point: DVec2, from: DVec2, to: DVec2) -> f64 {
    let stretch = to - from;
    let share = ((point - from).dot(stretch) / stretch.length_squared()).clamp(0.0, 1.0);
    point.distance(from + share * stretch)
}

fn point(position: DVec2) -> Point {
    Point::new(position.x, position.y)
}

//! The names of benches, each written on its board.

use glam::DVec2;

use super::drawing::{Drawing, Text};
use super::plot::Plot;
use super::style::LABEL_SIZE;

/// Room around a name that is as good as more, in millimetres.
const ENOUGH_FREE: f64 = 4.0;
/// Places that are tried along each of three lines of a board.
const STEPS: u32 = 200;

/// Writes the names of some benches on their boards, free of the obstacles, which are points of the plot. A board of
/// which too little lies in the plot gets none.
pub(super) fn write_names(
    drawing: &mut Drawing,
    plot: &Plot,
    boards: &[[DVec2; 4]],
    benches: &[usize],
    obstacles: &[DVec2],
) {
    let obstacles: Vec<DVec2> = obstacles.iter().map(|point| plot.at(*point)).collect();
    for &bench in benches {
        let words = if bench == 0 { "bench 0, head".to_owned() } else { format!("bench {bench}") };
        let text = Text::new(words, LABEL_SIZE);
        let corners = boards[bench].map(|corner| plot.at(corner));
        if let Some((middle, turn)) = place_on_board(corners, &text, plot, &obstacles) {
            drawing.write(&text.turned(turn), middle);
        }
    }
}

/// Where a text fits onto a board, along it and within the plot, free of obstacles on the page, and the angle at which
/// it reads from left to right.
fn place_on_board(corners: [DVec2; 4], text: &Text, plot: &Plot, obstacles: &[DVec2]) -> Option<(DVec2, f64)> {
    let [front_left, rear_left, rear_right, front_right] = corners;
    let half = 0.5 * text.width() * (front_left - rear_left).normalize();
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

fn distance_to_stretch(point: DVec2, from: DVec2, to: DVec2) -> f64 {
    let stretch = to - from;
    let share = ((point - from).dot(stretch) / stretch.length_squared()).clamp(0.0, 1.0);
    point.distance(from + share * stretch)
}

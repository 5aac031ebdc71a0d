//! Notes at points of a plot, at positions where they hide as little as possible.

use std::f64::consts::TAU;

use kurbo::{Point, Rect, Shape as _, Size, Vec2};

use super::drawing::{Drawing, Mark, contains, polyline};
use super::style::{BLACK, GRID_WIDTH, TICK_SIZE, WHITE};
use super::text::{Anchor, Text};

#[derive(Clone, Debug)]
pub(super) struct Notes {
    area: Rect,
    /// Points of the page that notes should leave free.
    data: Vec<Point>,
    /// Areas of notes and of their dots.
    taken: Vec<Rect>,
    /// Size of the letters.
    size: f64,
}

/// A possible position of a note.
struct Candidate {
    bounds: Rect,
    /// Ends of the line from the point to the note.
    leader: [Point; 2],
    /// Distance from the point to the middle of the note.
    distance: f64,
    /// Number of data points under the note or its leader.
    hidden: usize,
}

/// Tried distances from the point to the nearest edge of the note, in millimetres.
const DISTANCES: [f64; 10] = [2.0, 3.5, 5.0, 7.0, 9.0, 12.0, 15.0, 19.0, 24.0, 30.0];
const DIRECTIONS: u32 = 36;
const MARGIN: f64 = 0.8;
/// Distance from a point to the begin of the leader of its note.
const LEADER_GAP: f64 = 1.2;
/// Least length of a leader.
const SHORTEST_LEADER: f64 = 0.5;
/// Distance between two lines of a note ÷ size of its letters.
const LINE_HEIGHT: f64 = 1.3;

impl Notes {
    /// Notes in an area with data lines, given as points of the page.
    pub(super) fn new(area: Rect, lines: &[Vec<Point>]) -> Self {
        let data = lines.iter().flat_map(|line| line.windows(2).flat_map(|ends| between(ends[0], ends[1]))).collect();
        Self { area, data, taken: Vec::new(), size: TICK_SIZE }
    }

    /// Notes in letters of another size.
    pub(super) fn sized(self, size: f64) -> Self {
        Self { size, ..self }
    }

    /// Keeps notes out of a rectangle.
    pub(super) fn keep_off(&mut self, taken: Rect) {
        self.taken.push(taken);
    }

    /// Writes a note near a point of the page, with a leader to the point. Without room, writes nothing.
    pub(super) fn write(&mut self, drawing: &mut Drawing, lines: &[String], point: Point) {
        let texts: Vec<Text> = lines.iter().map(|line| Text::new(line.as_str(), self.size)).collect();
        let width = texts.iter().map(Text::width).fold(0.0, f64::max);
        let size = Size::new(width + 2.0 * MARGIN, LINE_HEIGHT * self.size * texts.len() as f64 + 2.0 * MARGIN);
        let directions = (0..DIRECTIONS).map(|step| Vec2::from_angle(f64::from(step) * TAU / f64::from(DIRECTIONS)));
        let candidates =
            directions.flat_map(|direction| DISTANCES.map(|distance| self.candidate(point, size, distance, direction)));
        let best = candidates.flatten().min_by(|a, b| a.cost().total_cmp(&b.cost()));
        let Some(Candidate { bounds, leader, hidden, .. }) = best else { return };
        if hidden == 0 {
            // Covers the grid lines behind the letters.
            drawing.push(Mark::filled(bounds.to_path(0.0), WHITE));
        }
        if leader[0].distance(leader[1]) > SHORTEST_LEADER {
            drawing.push(Mark::stroked(polyline(leader), BLACK, GRID_WIDTH));
        }
        for (text, index) in texts.into_iter().zip(0..) {
            let drop = MARGIN + LINE_HEIGHT * self.size * (f64::from(index) + 0.5);
            drawing.write(&text.anchored(Anchor::Left), bounds.origin() + (MARGIN, drop));
        }
        self.taken.push(bounds);
    }

    /// The position in a direction, if it lies in the plot and overlaps no other note.
    fn candidate(&self, point: Point, size: Size, distance: f64, direction: Vec2) -> Option<Candidate> {
        // The nearest edge or corner of the note lies in that direction, its middle further out.
        let [across, down] = [direction.x, direction.y].map(|share| 0.5 * (1.5 * share).clamp(-1.0, 1.0));
        let middle = point + distance * direction + (across * size.width, down * size.height);
        let bounds = Rect::from_center_size(middle, size);
        let end = Point::new(point.x.clamp(bounds.x0, bounds.x1), point.y.clamp(bounds.y0, bounds.y1));
        let begin = point + LEADER_GAP / end.distance(point).max(f64::MIN_POSITIVE) * (end - point);
        let leader: Vec<Point> = between(begin, end).collect();
        let is_free = self.area.contains_rect(bounds.inflate(MARGIN, MARGIN))
            && !self.taken.iter().any(|taken| taken.overlaps(bounds))
            && !leader.iter().any(|at| self.taken.iter().any(|taken| contains(*taken, *at)));
        let under_note = self.data.iter().filter(|data| contains(bounds, **data)).count();
        let near = |at: &&Point| self.data.iter().any(|data| data.distance_squared(**at) < 0.25);
        let hidden = under_note + leader.iter().skip(1).filter(near).count();
        (is_free && !contains(bounds, point)).then_some(Candidate {
            bounds,
            leader: [begin, end],
            distance: middle.distance(point),
            hidden,
        })
    }
}

impl Candidate {
    /// Cost of a position. A distant note is better than a note on data. A note directly above or below its point is better
    /// than a note beside it.
    fn cost(&self) -> f64 {
        20.0 * self.hidden as f64 + self.leader[0].distance(self.leader[1]) + 0.15 * self.distance
    }
}

/// Points of a straight line, half a millimetre apart.
fn between(from: Point, to: Point) -> impl Iterator<Item = Point> {
    let steps = (2.0 * from.distance(to)).ceil().clamp(1.0, 1000.0) as u32;
    (0..=steps).map(move |step| from.lerp(to, f64::from(step) / f64::from(steps)))
}

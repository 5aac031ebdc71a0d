//! Notes at points of a plot, put where they hide nothing.

use std::f64::consts::TAU;

use glam::DVec2;

use super::drawing::{Anchor, Drawing, Text};
use super::mark::Mark;
use super::palette::{BLACK, WHITE};
use super::path::{Path, Rect};
use super::style::{GRID_WIDTH, TICK_SIZE};

/// Finds room for notes in a plot.
#[derive(Clone, Debug)]
pub(super) struct Notes {
    area: Rect,
    /// Points of the page that notes should leave free.
    data: Vec<DVec2>,
    /// What notes, and the dots that they belong to, cover.
    taken: Vec<Rect>,
}

/// A place for a note.
struct Room {
    bounds: Rect,
    /// From the point to the note.
    leader: [DVec2; 2],
    /// From the point to the note's middle.
    distance: f64,
    /// Points of data under the note or its leader.
    hidden: usize,
}

/// Distances at which room is looked for, from the point to the note's nearest edge, in millimetres.
const DISTANCES: [f64; 10] = [2.0, 3.5, 5.0, 7.0, 9.0, 12.0, 15.0, 19.0, 24.0, 30.0];
const DIRECTIONS: u32 = 36;
/// Room around a note.
const MARGIN: f64 = 0.8;
/// Distance from a point to the begin of the line that leads to its note.
const LEADER_GAP: f64 = 1.2;
/// Least length of such a line.
const SHORTEST_LEADER: f64 = 0.5;
/// From line to line of a note ÷ size of its letters.
const LINE_HEIGHT: f64 = 1.3;

impl Notes {
    /// Notes in an area, between lines that go from point to point of the page.
    pub(super) fn new(area: Rect, lines: &[Vec<DVec2>]) -> Self {
        let data = lines.iter().flat_map(|line| line.windows(2).flat_map(|ends| between(ends[0], ends[1]))).collect();
        Self { area, data, taken: Vec::new() }
    }

    /// Keeps notes off a rectangle.
    pub(super) fn keep_off(&mut self, taken: Rect) {
        self.taken.push(taken);
    }

    /// Writes a note of some lines near a point of the page, with a stroke that leads to it; not at all where there is
    /// no room.
    pub(super) fn write(&mut self, drawing: &mut Drawing, lines: &[String], point: DVec2) {
        let texts: Vec<Text> = lines.iter().map(|line| Text::new(line.as_str(), TICK_SIZE)).collect();
        let width = texts.iter().map(Text::width).fold(0.0, f64::max);
        let size = DVec2::new(width, LINE_HEIGHT * TICK_SIZE * texts.len() as f64) + 2.0 * MARGIN;
        let directions = (0..DIRECTIONS).map(|step| DVec2::from_angle(f64::from(step) * TAU / f64::from(DIRECTIONS)));
        let rooms =
            directions.flat_map(|direction| DISTANCES.map(|distance| self.room(point, size, distance, direction)));
        let best = rooms.flatten().min_by(|a, b| a.cost().total_cmp(&b.cost()));
        let Some(Room { bounds, leader, hidden, .. }) = best else { return };
        if hidden == 0 {
            // No grid line runs through the letters.
            drawing.push(Mark::filled(bounds.path(), WHITE));
        }
        if leader[0].distance(leader[1]) > SHORTEST_LEADER {
            drawing.push(Mark::stroked(Path::line(leader), BLACK, GRID_WIDTH));
        }
        for (text, index) in texts.into_iter().zip(0..) {
            let drop = MARGIN + LINE_HEIGHT * TICK_SIZE * (f64::from(index) + 0.5);
            drawing.write(&text.anchored(Anchor::Left), bounds.min + DVec2::new(MARGIN, drop));
        }
        self.taken.push(bounds);
    }

    /// The room in a direction, if the plot and other notes leave it.
    fn room(&self, point: DVec2, size: DVec2, distance: f64, direction: DVec2) -> Option<Room> {
        // The note's nearest edge or corner lies in that direction, its middle further on.
        let middle = point + distance * direction + 0.5 * size * (1.5 * direction).clamp(DVec2::NEG_ONE, DVec2::ONE);
        let bounds = Rect { min: middle - 0.5 * size, max: middle + 0.5 * size };
        let end = point.clamp(bounds.min, bounds.max);
        let begin = point + LEADER_GAP * (end - point).normalize_or_zero();
        let leader: Vec<DVec2> = between(begin, end).collect();
        let is_free = self.area.encloses(&bounds.grown(MARGIN))
            && !self.taken.iter().any(|taken| taken.overlaps(&bounds))
            && !leader.iter().any(|at| self.taken.iter().any(|taken| taken.contains(*at)));
        let under_note = self.data.iter().filter(|data| bounds.contains(**data)).count();
        let near = |at: &&DVec2| self.data.iter().any(|data| data.distance_squared(**at) < 0.25);
        let hidden = under_note + leader.iter().skip(1).filter(near).count();
        (is_free && !bounds.contains(point)).then_some(Room {
            bounds,
            leader: [begin, end],
            distance: middle.distance(point),
            hidden,
        })
    }
}

impl Room {
    /// A far note is better than one on the data, one right over or under its point better than one beside it.
    fn cost(&self) -> f64 {
        20.0 * self.hidden as f64 + self.leader[0].distance(self.leader[1]) + 0.15 * self.distance
    }
}

/// Points of a straight line, half a millimetre apart.
fn between(from: DVec2, to: DVec2) -> impl Iterator<Item = DVec2> {
    let steps = (2.0 * from.distance(to)).ceil().clamp(1.0, 1000.0) as u32;
    (0..=steps).map(move |step| from.lerp(to, f64::from(step) / f64::from(steps)))
}

//! A part of a path as its corners: lines, joined by arcs that round the corners.
//!
//! A run has 2n + 1 segments for n corners: line, arc, line, …, line. Its points are the beginning, the corners, at which the lines
//! would meet, and the end. A dragged point moves alone: the other points stay, and the lengths and turns between follow.

use bench_dragon_geometry::route::{PathSegment, Placement};
use glam::DVec2;

/// Largest turn of an arc that rounds a corner. The corner of a larger one is far away.
const MAX_TURN: f64 = 170.0 * std::f64::consts::PI / 180.0;
/// Allowed turns of a dragged corner, either way. An arc needs a turn, and a reversal has no corner.
const TURNS: [f64; 2] = [0.0002, 3.1];
/// Shortest line, in metres.
const MIN_LINE_M: f64 = 0.01;

/// Lines that are joined at corners.
#[derive(Clone, Debug)]
pub(super) struct CornerRun {
    /// Index of the first line among the segments.
    pub(super) first: usize,
    /// The beginning, the corners and the end, in metres.
    pub(super) points: Vec<DVec2>,
    /// Radii of the corners.
    pub(super) radii_m: Vec<f64>,
    /// Direction of the first line.
    heading: f64,
    /// Whether the path begins with this run, so that its first direction is free.
    pub(super) is_first: bool,
    pub(super) is_last: bool,
}

/// The runs of a path, in walking order. `placed`: where each segment begins, and the end.
pub(super) fn runs(segments: &[PathSegment], placed: &[Placement]) -> Vec<CornerRun> {
    let (mut runs, mut first) = (Vec::new(), 0);
    while first < segments.len() {
        if !is_line(segments, first) {
            first += 1;
            continue;
        }
        let mut last = first;
        while corner_at(segments, last + 1).is_some() {
            last += 2;
        }
        runs.push(CornerRun::of(segments, placed, first, last));
        first = last + 1;
    }
    runs
}

/// Radius and turn of the arc that rounds a corner.
fn corner_at(segments: &[PathSegment], number: usize) -> Option<(f64, f64)> {
    match segments.get(number) {
        Some(&PathSegment::Arc { radius_m, turn }) if turn.abs() <= MAX_TURN => {
            is_line(segments, number + 1).then_some((radius_m, turn))
        }
        _ => None,
    }
}

fn is_line(segments: &[PathSegment], number: usize) -> bool {
    matches!(segments.get(number), Some(PathSegment::Line { .. }))
}

impl CornerRun {
    fn of(segments: &[PathSegment], placed: &[Placement], first: usize, last: usize) -> Self {
        let mut points = vec![placed[first].position];
        let mut radii_m = Vec::new();
        for number in (first + 1..last).step_by(2) {
            let (radius_m, turn) = corner_at(segments, number).expect("the run has this corner");
            let Placement { position, heading } = placed[number];
            points.push(position + DVec2::from_angle(heading) * radius_m * (0.5 * turn.abs()).tan());
            radii_m.push(radius_m);
        }
        points.push(placed[last + 1].position);
        let (is_first, is_last) = (first == 0, last + 1 == segments.len());
        Self { first, points, radii_m, heading: placed[first].heading, is_first, is_last }
    }

    /// A new path through points, with equal radii; `None` for under two points, and for a corner that turns back so far that its
    /// arc would cut off most of its lines.
    pub(super) fn through(points: &[DVec2], radius_m: f64) -> Option<Self> {
        if points.windows(3).any(|three| turn(three[1] - three[0], three[2] - three[1]).abs() > MAX_TURN) {
            return None;
        }
        let heading = (*points.get(1)? - points[0]).to_angle();
        let radii_m = vec![radius_m; points.len() - 2];
        Some(Self { first: 0, points: points.to_vec(), radii_m, heading, is_first: true, is_last: true })
    }

    /// Number of corners.
    pub(super) fn corners(&self) -> usize {
        self.radii_m.len()
    }

    /// Index of the end among the points.
    pub(super) fn end(&self) -> usize {
        self.points.len() - 1
    }

    /// The same run with a point elsewhere. The first corner of a run whose direction is fixed stays on its line.
    pub(super) fn with_point(mut self, index: usize, to: DVec2) -> Self {
        self.points[index] = to;
        self.keep_direction()
    }

    /// The same run with a corner more, before a point.
    pub(super) fn with_corner(mut self, before: usize, at: DVec2, radius_m: f64) -> Self {
        self.points.insert(before, at);
        self.radii_m.insert(before - 1, radius_m);
        self.keep_direction()
    }

    /// The same run without a corner.
    pub(super) fn without_corner(mut self, index: usize) -> Self {
        self.points.remove(index);
        self.radii_m.remove(index - 1);
        self.keep_direction()
    }

    fn keep_direction(mut self) -> Self {
        if !self.is_first {
            let (begin, along) = (self.points[0], DVec2::from_angle(self.heading));
            self.points[1] = begin + along * (self.points[1] - begin).dot(along).max(MIN_LINE_M);
        }
        self
    }

    /// Direction of the first line.
    pub(super) fn heading(&self) -> f64 {
        if self.is_first { (self.points[1] - self.points[0]).to_angle() } else { self.heading }
    }

    /// The segments of the run. Where a corner has no room for its radius, the arc is smaller.
    pub(super) fn segments(&self) -> Vec<PathSegment> {
        let steps: Vec<DVec2> = self.points.windows(2).map(|ends| ends[1] - ends[0]).collect();
        let turns: Vec<f64> = steps.windows(2).map(|steps| turn(steps[0], steps[1])).collect();
        let cuts_m = self.cuts_m(&steps, &turns);
        let line = |number: usize| {
            let before_m = number.checked_sub(1).map_or(0.0, |corner| cuts_m[corner]);
            let after_m = cuts_m.get(number).copied().unwrap_or(0.0);
            PathSegment::Line { length_m: (steps[number].length() - before_m - after_m).max(MIN_LINE_M) }
        };
        let arc = |corner: usize| {
            let radius_m = cuts_m[corner] / (0.5 * turns[corner].abs()).tan();
            PathSegment::Arc { radius_m, turn: turns[corner] }
        };
        let rest = (0..turns.len()).flat_map(|corner| [arc(corner), line(corner + 1)]);
        std::iter::once(line(0)).chain(rest).collect()
    }

    /// The lengths that the arcs cut off the lines at each corner, so small that the lines have room for them.
    fn cuts_m(&self, steps: &[DVec2], turns: &[f64]) -> Vec<f64> {
        let wanted_m: Vec<f64> =
            self.radii_m.iter().zip(turns).map(|(radius_m, turn)| radius_m * (0.5 * turn.abs()).tan()).collect();
        let room = |number: usize| {
            let before_m = number.checked_sub(1).map_or(0.0, |corner| wanted_m[corner]);
            let both_m = before_m + wanted_m.get(number).copied().unwrap_or(0.0);
            ((steps[number].length() - MIN_LINE_M).max(0.0) / both_m).min(1.0)
        };
        wanted_m.iter().enumerate().map(|(corner, cut_m)| cut_m * room(corner).min(room(corner + 1))).collect()
    }
}

/// The turn from one direction to another.
fn turn(before: DVec2, after: DVec2) -> f64 {
    let turn = before.angle_to(after);
    // Two equal points have no direction.
    let turn = if turn.is_finite() { turn } else { 0.0 };
    turn.abs().clamp(TURNS[0], TURNS[1]).copysign(turn)
}

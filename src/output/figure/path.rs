//! Paths: lines and curves on a page.

use std::f64::consts::PI;

use glam::DVec2;

/// Lines and curves. Points are millimetres from the page's upper left corner, x right and y down.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Path {
    pub(super) steps: Vec<Step>,
}

/// A piece of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Step {
    /// Begins elsewhere.
    Move(DVec2),
    /// A straight line.
    Line(DVec2),
    /// A parabola: its control point and its end.
    Curve(DVec2, DVec2),
    /// Back to where it began.
    Close,
}

impl Path {
    /// Straight lines from point to point.
    pub(super) fn line(points: impl IntoIterator<Item = DVec2>) -> Self {
        let steps = points.into_iter().enumerate();
        Self {
            steps: steps.map(|(index, point)| if index == 0 { Step::Move(point) } else { Step::Line(point) }).collect(),
        }
    }

    /// Straight lines round an area.
    pub(super) fn polygon(points: impl IntoIterator<Item = DVec2>) -> Self {
        let mut path = Self::line(points);
        path.steps.push(Step::Close);
        path
    }

    /// A circle, of parabolas that are nowhere off by more than 0.2 ‰ of the radius.
    pub(super) fn circle(centre: DVec2, radius: f64) -> Self {
        const PIECES: u32 = 16;
        let half_piece = PI / f64::from(PIECES);
        let on = |halves: u32, radius: f64| centre + radius * DVec2::from_angle(f64::from(halves) * half_piece);
        let curves = (0..PIECES).map(|piece| {
            // The tangents at both ends meet further out.
            Step::Curve(on(2 * piece + 1, radius / half_piece.cos()), on(2 * piece + 2, radius))
        });
        Self { steps: std::iter::once(Step::Move(on(0, radius))).chain(curves).chain([Step::Close]).collect() }
    }

    /// Adds another path.
    pub(super) fn push(&mut self, other: &Self) {
        self.steps.extend_from_slice(&other.steps);
    }

    /// The rectangle around all points, control points among them; none around no point.
    pub(super) fn bounds(&self) -> Option<Rect> {
        let points = self.steps.iter().flat_map(|step| match *step {
            Step::Move(end) | Step::Line(end) => [Some(end), None],
            Step::Curve(control, end) => [Some(control), Some(end)],
            Step::Close => [None, None],
        });
        let around = |bounds: Rect, point: DVec2| Rect { min: bounds.min.min(point), max: bounds.max.max(point) };
        points.flatten().map(|point| Rect { min: point, max: point }).reduce(|bounds, point| around(bounds, point.min))
    }

    /// The path with every point put elsewhere.
    pub(super) fn map(&self, place: impl Fn(DVec2) -> DVec2) -> Self {
        let steps = self.steps.iter().map(|step| match *step {
            Step::Move(end) => Step::Move(place(end)),
            Step::Line(end) => Step::Line(place(end)),
            Step::Curve(control, end) => Step::Curve(place(control), place(end)),
            Step::Close => Step::Close,
        });
        Self { steps: steps.collect() }
    }
}

/// A rectangle on a page, in millimetres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Rect {
    /// Upper left corner.
    pub(super) min: DVec2,
    /// Lower right corner.
    pub(super) max: DVec2,
}

impl Rect {
    pub(super) fn new(left: f64, top: f64, width: f64, height: f64) -> Self {
        let min = DVec2::new(left, top);
        Self { min, max: min + DVec2::new(width, height) }
    }

    pub(super) fn size(&self) -> DVec2 {
        self.max - self.min
    }

    pub(super) fn centre(&self) -> DVec2 {
        0.5 * (self.min + self.max)
    }

    pub(super) fn corners(&self) -> [DVec2; 4] {
        let Self { min, max } = *self;
        [min, DVec2::new(max.x, min.y), max, DVec2::new(min.x, max.y)]
    }

    pub(super) fn path(&self) -> Path {
        Path::polygon(self.corners())
    }

    pub(super) fn contains(&self, point: DVec2) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }

    /// Whether the other rectangle lies in this one.
    pub(super) fn encloses(&self, other: &Self) -> bool {
        self.contains(other.min) && self.contains(other.max)
    }

    /// Whether the rectangles have a point in common.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// The rectangle with a margin round it.
    pub(super) fn grown(&self, margin: f64) -> Self {
        Self { min: self.min - margin, max: self.max + margin }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_circle_is_round_to_a_fifth_of_a_thousandth() {
        let circle = Path::circle(DVec2::ZERO, 1.0);
        let mut begin = DVec2::X;
        for step in circle.steps {
            let Step::Curve(control, end) = step else { continue };
            for tenth in 0..=10 {
                let at = f64::from(tenth) / 10.0;
                let point = begin.lerp(control, at).lerp(control.lerp(end, at), at);
                assert!((point.length() - 1.0).abs() < 2e-4, "{point} lies {} from the centre", point.length());
            }
            begin = end;
        }
    }
}

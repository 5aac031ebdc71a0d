//! Path data in double precision.

use bench_dragon_geometry::drawing::{Bezier, Piece};
use glam::DVec2;
use kurbo::{Arc, SvgArc};
use svgtypes::{PathParser, PathSegment};

use super::quoted;
use super::shape::ellipse;

/// Largest number of path data.
const MAX_NUMBER: f64 = 1e9;

/// The reason why a number of path data is not allowed, in words.
pub(super) fn numbers_fault(text: &str) -> Option<String> {
    let mut numbers = PathParser::from(text).map_while(Result::ok).flat_map(numbers);
    let number = numbers.find(|number| number.is_nan() || number.abs() > MAX_NUMBER)?;
    Some(format!("has the number {number:e}, must be from -{MAX_NUMBER:e} to {MAX_NUMBER:e}"))
}

/// The coordinates and radii of a command of path data, and zeros.
fn numbers(segment: PathSegment) -> [f64; 6] {
    match segment {
        PathSegment::MoveTo { x, y, .. }
        | PathSegment::LineTo { x, y, .. }
        | PathSegment::SmoothQuadratic { x, y, .. } => [x, y, 0.0, 0.0, 0.0, 0.0],
        PathSegment::HorizontalLineTo { x, .. } => [x, 0.0, 0.0, 0.0, 0.0, 0.0],
        PathSegment::VerticalLineTo { y, .. } => [0.0, y, 0.0, 0.0, 0.0, 0.0],
        PathSegment::CurveTo { x1, y1, x2, y2, x, y, .. } => [x1, y1, x2, y2, x, y],
        PathSegment::SmoothCurveTo { x2, y2, x, y, .. } => [x2, y2, x, y, 0.0, 0.0],
        PathSegment::Quadratic { x1, y1, x, y, .. } => [x1, y1, x, y, 0.0, 0.0],
        PathSegment::EllipticalArc { rx, ry, x, y, .. } => [rx, ry, x, y, 0.0, 0.0],
        PathSegment::ClosePath { .. } => [0.0; 6],
    }
}

/// The pieces of path data, and whether they are closed.
pub(super) fn data(text: &str) -> Result<(Vec<Piece>, bool), String> {
    let mut pen = Pen::default();
    for segment in PathParser::from(text) {
        pen.draw(segment.map_err(|error| wrong_data(text, &error))?)?;
    }
    if pen.pieces.is_empty() {
        return Err("has no length".to_owned());
    }
    Ok((pen.pieces, pen.is_closed))
}

/// The reason why path data is not valid, with the text at that place.
pub(super) fn wrong_data(text: &str, error: &svgtypes::Error) -> String {
    use svgtypes::Error::{InvalidChar, InvalidNumber, InvalidString, UnexpectedData};
    let near = match *error {
        InvalidChar(_, at) | InvalidNumber(at) | InvalidString(_, at) | UnexpectedData(at) => {
            format!("near {}", quoted(&text.chars().skip(at.saturating_sub(1)).collect::<String>()))
        }
        _ => "at its end".to_owned(),
    };
    format!("has wrong data {near}: {}", error.to_string().replace('\n', " "))
}

/// Draws path data.
#[derive(Default)]
struct Pen {
    pieces: Vec<Piece>,
    /// Where the path begins.
    begin: DVec2,
    at: DVec2,
    is_closed: bool,
    /// Whether the pen was lifted behind the last piece.
    is_lifted: bool,
    /// The last control point of a cubic or a quadratic curve, if that was the last command.
    cubic: Option<DVec2>,
    quadratic: Option<DVec2>,
}

impl Pen {
    /// Draws one command; otherwise returns a reason, in words.
    fn draw(&mut self, segment: PathSegment) -> Result<(), String> {
        let base = if segment.is_abs() { DVec2::ZERO } else { self.at };
        let point = |x: f64, y: f64| base + DVec2::new(x, y);
        let (cubic, quadratic) = (self.cubic.take(), self.quadratic.take());
        match segment {
            PathSegment::MoveTo { x, y, .. } => {
                let to = point(x, y);
                if self.pieces.is_empty() {
                    self.begin = to;
                } else {
                    self.is_lifted |= to != self.at;
                }
                self.at = to;
                return Ok(());
            }
            PathSegment::ClosePath { .. } if self.is_lifted || self.is_closed || self.pieces.is_empty() => {
                return Ok(());
            }
            _ if self.is_lifted || self.is_closed => {
                return Err("has several parts, must have one: draw each as a path with an id".to_owned());
            }
            PathSegment::ClosePath { .. } => {
                self.line(self.begin);
                self.is_closed = true;
            }
            PathSegment::LineTo { x, y, .. } => self.line(point(x, y)),
            PathSegment::HorizontalLineTo { x, .. } => self.line(DVec2::new(base.x + x, self.at.y)),
            PathSegment::VerticalLineTo { y, .. } => self.line(DVec2::new(self.at.x, base.y + y)),
            PathSegment::CurveTo { x1, y1, x2, y2, x, y, .. } => self.cubic(point(x1, y1), point(x2, y2), point(x, y)),
            PathSegment::SmoothCurveTo { x2, y2, x, y, .. } => {
                self.cubic(cubic.map_or(self.at, |last| 2.0 * self.at - last), point(x2, y2), point(x, y));
            }
            PathSegment::Quadratic { x1, y1, x, y, .. } => self.quadratic(point(x1, y1), point(x, y)),
            PathSegment::SmoothQuadratic { x, y, .. } => {
                self.quadratic(quadratic.map_or(self.at, |last| 2.0 * self.at - last), point(x, y));
            }
            PathSegment::EllipticalArc { rx, ry, x_axis_rotation, large_arc, sweep, x, y, .. } => {
                let (radii, x_rotation) = (kurbo::Vec2::new(rx, ry), x_axis_rotation.to_radians());
                let to = point(x, y);
                let [from, end] = [self.at, to].map(|point| kurbo::Point::new(point.x, point.y));
                self.arc(&SvgArc { from, to: end, radii, x_rotation, large_arc, sweep }, to);
            }
        }
        Ok(())
    }

    fn line(&mut self, to: DVec2) {
        self.pieces.push(Piece::Line { from: self.at, to });
        self.at = to;
    }

    fn cubic(&mut self, first: DVec2, second: DVec2, to: DVec2) {
        self.pieces.push(Piece::Bezier(Bezier::new(vec![self.at, first, second, to])));
        (self.at, self.cubic) = (to, Some(second));
    }

    fn quadratic(&mut self, control: DVec2, to: DVec2) {
        self.pieces.push(Piece::Bezier(Bezier::new(vec![self.at, control, to])));
        (self.at, self.quadratic) = (to, Some(control));
    }

    fn arc(&mut self, arc: &SvgArc, to: DVec2) {
        match Arc::from_svg_arc(arc) {
            Some(arc) => {
                let [centre, radii] = [[arc.center.x, arc.center.y], [arc.radii.x, arc.radii.y]].map(DVec2::from);
                self.pieces.extend(ellipse(centre, radii, arc.x_rotation, arc.start_angle, arc.sweep_angle));
                self.at = to;
            }
            None => self.line(to),
        }
    }
}

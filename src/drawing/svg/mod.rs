//! Paths of SVG files.
//!
//! usvg resolves what surrounds a shape: transforms, `use`, nested `svg` elements, styles and units. Its own coordinates have
//! single precision, and its arcs are curves that are 0.1 units away. So the numbers of a path are read here, in double
//! precision, and only its transform is taken from usvg. Arcs of circles stay arcs.

use std::collections::HashMap;
use std::f64::consts::TAU;

use bench_dragon_geometry::drawing::{Bezier, Drawing, Piece};
use glam::{DAffine2, DVec2};
use kurbo::{Arc, SvgArc};
use svgtypes::{PathParser, PathSegment, PointsParser};
use usvg::roxmltree::{Document, Node, ParsingOptions};
use usvg::{Group, Options, Transform, Tree};

use super::{DrawingFileError, PathChoice, listed, quoted, utf8};

/// Elements that are paths.
const SHAPES: [&str; 7] = ["path", "rect", "circle", "ellipse", "line", "polyline", "polygon"];
/// Prefix of the ids of elements that have none.
const UNNAMED: &str = "bench-dragon-unnamed-";
/// Most elements and texts of a file.
const MAX_NODES: u32 = 1_000_000;
/// Most `use` elements that refer to each other.
const MAX_USES: usize = 16;
/// Largest number of path data: usvg divides an arc into ever more curves, the larger its radius.
const MAX_NUMBER: f64 = 1e9;

/// A path that the file shows.
struct Shown<'a> {
    /// The shape, or the `use` element that shows it.
    element: Node<'a, 'a>,
    transform: Transform,
    /// The shape as usvg has it.
    resolved: usvg::tiny_skia_path::Path,
}

/// The path of a file. A unit is a pixel of SVG: a unit of the outermost coordinate system, of which 96 are an inch.
pub(super) fn path(bytes: &[u8], choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    let named = with_ids(utf8(bytes)?)?;
    let document = parsed(&named)?;
    document.descendants().try_for_each(require_moderate)?;
    let failed = |error: usvg::Error| DrawingFileError(format!("is not a valid SVG file: {error}"));
    let tree = Tree::from_xmltree(&document, &options()).map_err(failed)?;
    let elements = document.descendants().filter_map(|node| Some((node.attribute("id")?, node)));
    let mut shown = vec![];
    find(tree.root(), None, &elements.collect(), &mut shown);
    let chosen = choose(&document, &shown, choice.id)?;
    let name = name(chosen.element).or(choice.id);
    let shape = shape_of(chosen.element, 0)
        .ok_or_else(|| fault(name, "shows several paths, must show one: set id to another element"))?;
    let (pieces, is_closed) = local(shape, &chosen.resolved).map_err(|reason| fault(name, &reason))?;
    let scale = choice.metres_per_unit.unwrap_or(1.0);
    let map = DAffine2::from_scale(DVec2::new(scale, -scale)) * affine(chosen.transform);
    Ok(Drawing { pieces: pieces.iter().flat_map(|piece| piece.mapped(&map)).collect(), is_closed })
}

/// The error of a path, which may have a name.
fn fault(name: Option<&str>, reason: &str) -> DrawingFileError {
    let name = name.map_or(String::new(), |name| format!(" {}", quoted(name)));
    DrawingFileError(format!("the path{name} {reason}"))
}

/// Settings of usvg: it loads no other file, and keeps paths that are not painted.
fn options() -> Options<'static> {
    let image_href_resolver =
        usvg::ImageHrefResolver { resolve_data: Box::new(|_, _, _| None), resolve_string: Box::new(|_, _| None) };
    Options { image_href_resolver, ..Options::default() }
}

fn parsed(text: &str) -> Result<Document<'_>, DrawingFileError> {
    let options = ParsingOptions { allow_dtd: true, nodes_limit: MAX_NODES, ..ParsingOptions::default() };
    let failed = |error: usvg::roxmltree::Error| {
        DrawingFileError(format!("is not valid XML: {}", error.to_string().replace('\n', " ")))
    };
    Document::parse_with_options(text, options).map_err(failed)
}

/// The same file, where every element that shows a path has an id: usvg reports no other name.
fn with_ids(text: &str) -> Result<String, DrawingFileError> {
    let document = parsed(text)?;
    let mut places: Vec<usize> = vec![];
    let shows = |node: &Node<'_, '_>| is_shape(*node) || node.tag_name().name() == "use";
    for node in document.descendants().filter(|node| shows(node) && node.attribute("id").is_none()) {
        let tag = &text[node.range().start + 1..];
        let name_len = tag.find(|char: char| char.is_whitespace() || matches!(char, '/' | '>')).unwrap_or(tag.len());
        places.push(node.range().start + 1 + name_len);
    }
    places.sort_unstable();
    places.dedup();
    let (mut named, mut at) = (String::with_capacity(text.len() + 40 * places.len()), 0);
    for (number, place) in places.into_iter().enumerate() {
        named += &text[at..place];
        named.extend([" id=\"", UNNAMED, &number.to_string(), "\""]);
        at = place;
    }
    named += &text[at..];
    Ok(named)
}

fn is_shape(node: Node<'_, '_>) -> bool {
    SHAPES.contains(&node.tag_name().name())
}

/// The id of an element, if the file gives it one.
fn name<'a>(node: Node<'a, 'a>) -> Option<&'a str> {
    node.attribute("id").filter(|id| !id.starts_with(UNNAMED))
}

/// Adds the paths that a group shows. Inside a `use` element usvg drops the ids of shapes.
fn find<'a>(
    group: &Group,
    shown_by: Option<Node<'a, 'a>>,
    elements: &HashMap<&'a str, Node<'a, 'a>>,
    shown: &mut Vec<Shown<'a>>,
) {
    let element = |id: &str| elements.get(id).copied();
    for child in group.children() {
        match child {
            usvg::Node::Group(inner) => {
                let is_use = |node: &Node<'_, '_>| node.tag_name().name() == "use";
                find(inner, shown_by.or_else(|| element(inner.id()).filter(is_use)), elements, shown);
            }
            usvg::Node::Path(path) => {
                if let Some(element) = shown_by.or_else(|| element(path.id())) {
                    let (transform, resolved) = (path.abs_transform(), path.data().clone());
                    shown.push(Shown { element, transform, resolved });
                }
            }
            usvg::Node::Image(_) | usvg::Node::Text(_) => {}
        }
    }
}

/// The path with an id, or the only one.
fn choose<'s, 'a>(
    document: &'a Document<'a>,
    shown: &'s [Shown<'a>],
    id: Option<&str>,
) -> Result<&'s Shown<'a>, DrawingFileError> {
    let names = || listed(shown.iter().filter_map(|shown| name(shown.element)));
    let known =
        |names: String| if names.is_empty() { "no path has an id".to_owned() } else { format!("paths: {names}") };
    let Some(id) = id else {
        return match shown {
            [only] => Ok(only),
            [] => Err(unreadable(document.root()).unwrap_or(DrawingFileError("has no path".to_owned()))),
            _ => Err(DrawingFileError(format!("has {} paths: set id to one of them; {}", shown.len(), known(names())))),
        };
    };
    let chosen: Vec<&Shown<'a>> =
        shown.iter().filter(|shown| shown.element.ancestors().any(|node| node.attribute("id") == Some(id))).collect();
    let with_id = document.descendants().find(|node| node.attribute("id") == Some(id));
    if let (Some(error), []) = (with_id.and_then(unreadable), &chosen[..]) {
        return Err(error);
    }
    let quoted = quoted(id);
    Err(DrawingFileError(match &chosen[..] {
        [only] => return Ok(only),
        [] if with_id.is_some() => {
            format!("the element with id {quoted} is not a path that is shown; {}", known(names()))
        }
        [] => format!("has no path with id {quoted}; {}", known(names())),
        several => format!("the element with id {quoted} has {} paths, must have 1", several.len()),
    }))
}

/// The error of the first path in an element whose data is not valid. usvg shows no path whose data has no valid beginning.
fn unreadable(element: Node<'_, '_>) -> Option<DrawingFileError> {
    let mut paths = element.descendants().filter(|node| node.tag_name().name() == "path");
    paths.find_map(|path| {
        let text = path.attribute("d").unwrap_or_default();
        let error = PathParser::from(text).find_map(Result::err)?;
        Some(fault(name(path), &wrong_data(text, &error)))
    })
}

/// Fails for path data with a number beyond [`MAX_NUMBER`], of which usvg would make very many curves.
fn require_moderate(element: Node<'_, '_>) -> Result<(), DrawingFileError> {
    let text = element.attribute("d").filter(|_| element.tag_name().name() == "path").unwrap_or_default();
    let mut numbers = PathParser::from(text).map_while(Result::ok).flat_map(numbers);
    match numbers.find(|number| number.is_nan() || number.abs() > MAX_NUMBER) {
        Some(number) => Err(fault(
            name(element),
            &format!("has the number {number:e}, must be from -{MAX_NUMBER:e} to {MAX_NUMBER:e}"),
        )),
        None => Ok(()),
    }
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

/// The shape that an element shows; `None` if it shows several.
fn shape_of<'a>(element: Node<'a, 'a>, uses: usize) -> Option<Node<'a, 'a>> {
    if is_shape(element) {
        return Some(element);
    }
    if element.tag_name().name() == "use" {
        let href = element.attributes().filter(|attribute| attribute.name() == "href");
        let href = href.min_by_key(usvg::roxmltree::Attribute::namespace)?.value().trim().strip_prefix('#')?;
        let target = element.document().descendants().find(|node| node.attribute("id") == Some(href))?;
        return if uses < MAX_USES { shape_of(target, uses + 1) } else { None };
    }
    let mut inner = element.descendants().filter(|node| is_shape(*node) || node.tag_name().name() == "use");
    inner.next().filter(|_| inner.next().is_none()).and_then(|node| shape_of(node, uses))
}

fn affine(transform: Transform) -> DAffine2 {
    let Transform { sx, kx, ky, sy, tx, ty } = transform;
    DAffine2::from_cols_array(&[sx, ky, kx, sy, tx, ty].map(f64::from))
}

/// The pieces of a shape in its own coordinates, and whether it is closed; otherwise a reason, in words.
fn local(shape: Node<'_, '_>, resolved: &usvg::tiny_skia_path::Path) -> Result<(Vec<Piece>, bool), String> {
    let polyline = |is_closed: bool| {
        let points: Vec<DVec2> =
            PointsParser::from(shape.attribute("points").unwrap_or_default()).map(DVec2::from).collect();
        (Drawing::polyline(&points, is_closed).pieces, is_closed)
    };
    let bounds = resolved.bounds();
    let [left, right, top, bottom] = [bounds.left(), bounds.right(), bounds.top(), bounds.bottom()].map(f64::from);
    let points: Vec<DVec2> = resolved.points().iter().map(|point| DVec2::new(point.x.into(), point.y.into())).collect();
    Ok(match shape.tag_name().name() {
        "path" => return data(shape.attribute("d").unwrap_or_default()),
        "polyline" => polyline(false),
        "polygon" => polyline(true),
        "line" => (Drawing::polyline(&points, false).pieces, false),
        "rect" => {
            let corner = points[0] - DVec2::new(left, top);
            // The last line of a rounded rectangle ends ry under the top, before the curves of the last corner.
            let is_rounded = corner.x > 0.0;
            let ry = if is_rounded { rounded_ry(resolved, top) } else { 0.0 };
            (rectangle(DVec2::new(left, top), DVec2::new(right, bottom), DVec2::new(corner.x, ry)), true)
        }
        _ => {
            let (centre, radii) =
                (DVec2::new(left + right, top + bottom) / 2.0, DVec2::new(right - left, bottom - top) / 2.0);
            (ellipse(centre, radii, 0.0, 0.0, TAU), true)
        }
    })
}

/// The vertical radius of the corners of a rounded rectangle: where its last line ends.
fn rounded_ry(resolved: &usvg::tiny_skia_path::Path, top: f64) -> f64 {
    let lines = resolved.segments().filter_map(|segment| match segment {
        usvg::tiny_skia_path::PathSegment::LineTo(to) => Some(f64::from(to.y)),
        _ => None,
    });
    lines.last().map_or(0.0, |y| y - top)
}

/// A rectangle, clockwise on the screen from the end of its first corner.
fn rectangle(low: DVec2, high: DVec2, radii: DVec2) -> Vec<Piece> {
    let corners = [DVec2::new(high.x, low.y), high, DVec2::new(low.x, high.y), low];
    let inward = [DVec2::new(-1.0, 1.0), -DVec2::ONE, DVec2::new(1.0, -1.0), DVec2::ONE];
    let mut pieces: Vec<Piece> = vec![];
    let mut at = low + DVec2::new(radii.x, 0.0);
    for (i, (corner, inward)) in corners.into_iter().zip(inward).enumerate() {
        let along = if i % 2 == 0 { DVec2::X } else { DVec2::Y };
        pieces.push(Piece::Line { from: at, to: corner + inward * radii * along });
        if radii.x > 0.0 {
            let quarter = TAU / 4.0;
            pieces.extend(ellipse(corner + inward * radii, radii, 0.0, quarter * (i as f64 - 1.0), quarter));
        }
        at = corner + inward * radii * along.perp().abs();
    }
    pieces
}

/// An arc of an ellipse whose first axis has an angle from x, between two angles of its circle.
fn ellipse(centre: DVec2, radii: DVec2, rotation: f64, from_angle: f64, turn: f64) -> Vec<Piece> {
    let map = DAffine2::from_scale_angle_translation(radii, rotation, centre);
    Piece::Arc { centre: DVec2::ZERO, radius_m: 1.0, from_angle, turn }.mapped(&map)
}

/// The pieces of path data, and whether they are closed.
fn data(text: &str) -> Result<(Vec<Piece>, bool), String> {
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
fn wrong_data(text: &str, error: &svgtypes::Error) -> String {
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

//! Paths of SVG files.
//!
//! usvg resolves what surrounds a shape: transforms, `use`, nested `svg` elements and units. Its own coordinates have single
//! precision, and its arcs are curves that are 0.1 units away. So the numbers of a path are read here, in double precision, and only
//! its transform is taken from usvg. Arcs of circles stay arcs. usvg reads a reduced file ([`mod@reduced`]).

mod animation;
mod css_transform;
mod page;
mod path_data;
mod placed;
mod reduced;
mod shape;
mod sheet_text;
mod shown;
mod style;

use std::collections::HashMap;

use bench_dragon_geometry::drawing::{Drawing, Piece};
use glam::{DAffine2, DVec2};
use roxmltree::{Document, Node, NodeId, ParsingOptions};
use svgtypes::PathParser;
use usvg::{Group, Options, Transform, Tree};

use super::{DrawingFileError, ListedPath, PathChoice, listed, quoted};
use page::unit_m;
use path_data::{numbers_fault, wrong_data};
use reduced::{PAGE, Reduced, Sizes, element, reduced};
use shape::local;
use shown::{by_id, elsewhere, target};
use style::Faults;

/// Elements that are paths.
const SHAPES: [&str; 7] = ["path", "rect", "circle", "ellipse", "line", "polyline", "polygon"];
/// Most elements and texts of a file.
const MAX_NODES: u32 = 1_000_000;
/// Most `use` elements that refer to each other.
const MAX_USES: usize = 16;
/// Distance of two numbers of single precision, as a share of them.
const SINGLE_STEP: f64 = 1.0 / 8_388_608.0;
/// Largest rounding in a list of paths, which has no tolerance.
const LISTED_ROUNDING_M: f64 = 5e-4;
/// Namespace of Inkscape's labels and layers.
const INKSCAPE: &str = "http://www.inkscape.org/namespaces/inkscape";

/// The elements with each id.
type ById<'a> = HashMap<&'a str, Node<'a, 'a>>;

/// A path that the file shows.
struct Shown<'a> {
    /// The shape, or the `use` element that shows it.
    element: Node<'a, 'a>,
    transform: Transform,
    /// The shape as usvg has it.
    resolved: usvg::tiny_skia_path::Path,
}

/// A file, and what it shows.
struct File<'a> {
    document: &'a Document<'a>,
    by_id: ById<'a>,
    shown: Vec<Shown<'a>>,
    faults: Faults,
    /// A fault that any path may have.
    fault: Option<String>,
    /// Data of paths that a style sets.
    data: HashMap<NodeId, String>,
    sizes: Sizes,
    /// The map of the page, from its corner.
    page: DAffine2,
}

/// The path of a file. A unit is a pixel of SVG: a unit of the outermost coordinate system, of which 96 are an inch.
pub(super) fn path(text: &str, choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
    let document = parsed(text)?;
    let file = File::read(&document)?;
    let chosen = file.choose(choice)?;
    file.drawing(chosen, choice)
}

/// All paths that a file shows.
pub(super) fn list(text: &str, choice: &PathChoice<'_>) -> Result<Vec<ListedPath>, DrawingFileError> {
    let document = parsed(text)?;
    let file = File::read(&document)?;
    let listed = file.shown.iter().map(|shown| ListedPath {
        id: name(shown.element).map(str::to_owned),
        label: label(shown.element).map(str::to_owned),
        layer: layers(shown.element).next().and_then(|layer| label(layer).or(name(layer))).map(str::to_owned),
        drawing: file.drawing(shown, choice),
    });
    Ok(listed.collect())
}

impl<'a> File<'a> {
    fn read(document: &'a Document<'a>) -> Result<Self, DrawingFileError> {
        let by_id = by_id(document);
        let root = document.root_element().tag_name().name();
        if root != "svg" {
            return Err(DrawingFileError(format!("begins with the element {}, must be svg", quoted(root))));
        }
        let Reduced { text, faults, fault, data, sizes } = reduced(document, &by_id)?;
        let failed = |error: usvg::Error| DrawingFileError(format!("is not a valid SVG file: {error}"));
        let tree = Tree::from_xmltree(&parsed(&text)?, &options()).map_err(failed)?;
        let mut shown = vec![];
        find(tree.root(), None, document, &mut shown);
        let page = tree.node_by_id(PAGE).map_or(DAffine2::IDENTITY, |path| affine(path.abs_transform()));
        Ok(Self { document, by_id, shown, faults, fault, data, sizes, page })
    }

    /// A path in metres.
    fn drawing(&self, shown: &Shown<'a>, choice: &PathChoice<'_>) -> Result<Drawing, DrawingFileError> {
        let name = name(shown.element).or(choice.id);
        if let Some(reason) = &self.fault {
            return Err(DrawingFileError(reason.clone()));
        }
        self.require_placed(shown.element)?;
        let shape = self
            .shape_of(shown.element, 0)
            .ok_or_else(|| fault(name, "shows several paths, must show one: set id to another element"))?;
        self.require_sized(shown.element)?;
        let data = self.data.get(&shape.id()).map_or(shape.attribute("d").unwrap_or_default(), |data| data);
        if let Some(reason) = numbers_fault(data) {
            return Err(fault(name, &reason));
        }
        let (pieces, is_closed) = local(shape, data, &shown.resolved).map_err(|reason| fault(name, &reason))?;
        let scale = unit_m(&self.sizes.page, choice)?;
        let mut transform = affine(shown.transform);
        let around = shown.element.ancestors().chain(self.chain(shown.element));
        let places = around.filter_map(|node| self.sizes.places.get(&node.id()).copied());
        let size = places.fold(self.rounded_size(&transform, shape, shown, &pieces), f64::max);
        let rounded = size * SINGLE_STEP * scale;
        // The gap is a tenth of the tolerance.
        let allowed = if choice.gap_m > 0.0 { choice.gap_m } else { LISTED_ROUNDING_M };
        if rounded > allowed {
            let advice = if is_in_double(shape) { "apply the transform to the path" } else { "use a path" };
            return Err(fault(
                name,
                &format!(
                    "has coordinates too large for its shape or transform, which have seven digits: {advice}, or move the drawing"
                ),
            ));
        }
        transform.translation -= self.page.matrix2 * self.sizes.corner;
        let map = DAffine2::from_scale(DVec2::new(scale, -scale)) * transform;
        Ok(Drawing { pieces: pieces.iter().flat_map(|piece| piece.mapped(&map)).collect(), is_closed })
    }

    /// The largest number in pixels that has single precision: of the transform, and of a shape that usvg reads.
    fn rounded_size(&self, transform: &DAffine2, shape: Node<'_, '_>, shown: &Shown<'_>, pieces: &[Piece]) -> f64 {
        let largest = |vector: DVec2| vector.abs().max_element();
        let linear = transform.matrix2.to_cols_array();
        let factor = linear.iter().fold(0.0_f64, |most, entry| most.max(entry.abs()));
        // A map by whole numbers rounds nothing.
        let is_exact = linear.iter().all(|entry| entry.fract() == 0.0);
        // The map of the page is rounded for its corner as for a shape, so only the distance between them counts.
        let is_of_page = transform.matrix2 == self.page.matrix2;
        let corner = if is_of_page { self.sizes.corner } else { DVec2::ZERO };
        let size = if !is_in_double(shape) {
            let bounds = shown.resolved.bounds();
            [bounds.left(), bounds.right(), bounds.top(), bounds.bottom()]
                .map(|at| f64::from(at).abs())
                .into_iter()
                .fold(0.0, f64::max)
        } else if is_exact {
            0.0
        } else {
            let away = |at: DVec2| largest(at - corner);
            pieces.iter().map(|piece| away(piece.begin()).max(away(piece.end()))).fold(0.0, f64::max)
        };
        let moved = if is_of_page { DVec2::ZERO } else { self.page.matrix2 * self.sizes.corner };
        (size * factor).max(largest(transform.translation)).max(largest(moved))
    }

    /// Fails if what places a shape could not be resolved: of the shape, or of an element that shows or contains it.
    fn require_placed(&self, element: Node<'a, 'a>) -> Result<(), DrawingFileError> {
        let mut elements = self.chain(element).into_iter().rev().chain(element.ancestors());
        let found = elements.find_map(|node| Some((node, self.faults.get(&node.id())?)));
        found.map_or(Ok(()), |(node, reason)| {
            let called = name(node).map_or(String::new(), |name| format!(" {}", quoted(name)));
            Err(DrawingFileError(format!("the element <{}>{called} {reason}", node.tag_name().name())))
        })
    }

    /// Fails if a length depends on a symbol's size or on the size of a font, which the file does not give.
    fn require_sized(&self, element: Node<'a, 'a>) -> Result<(), DrawingFileError> {
        let unsized_by = |node: &Node<'a, 'a>, reason: &str| {
            let called = name(*node).map_or(String::new(), |name| format!(" {}", quoted(name)));
            Err(DrawingFileError(format!("the element <{}>{called} {reason}", node.tag_name().name())))
        };
        let shown = self.chain(element);
        let has_symbol = shown.iter().any(|node| node.tag_name().name() == "symbol");
        if let Some(node) = shown.iter().find(|node| has_symbol && self.sizes.percentages.contains(&node.id())) {
            return unsized_by(node, "has a size in per cent, which is not supported with a symbol: use numbers");
        }
        let mut outer: Vec<Node<'a, 'a>> = element.ancestors().skip(1).collect();
        outer.reverse();
        let mut has_font = false;
        for node in outer.iter().chain(&shown) {
            has_font |= self.sizes.own_fonts.contains(&node.id());
            if !has_font && self.sizes.in_em.contains(&node.id()) {
                return unsized_by(node, "has a length in em or ex, but no font-size: use another unit");
            }
        }
        Ok(())
    }

    /// An element and what it shows, the innermost last.
    fn chain(&self, element: Node<'a, 'a>) -> Vec<Node<'a, 'a>> {
        let (mut shown, mut last) = (vec![element], element);
        for _ in 0..MAX_USES {
            let Some(target) = target(last, &self.by_id).filter(|_| is_use(&last)) else { break };
            let inner = target.descendants().find(|node| is_shape(*node) || is_use(node)).unwrap_or(target);
            let begin = shown.len();
            shown.extend(inner.ancestors().take_while(|node| Some(*node) != target.parent()));
            shown[begin..].reverse();
            last = inner;
        }
        shown
    }

    /// The shape that an element shows; `None` if it shows several.
    fn shape_of(&self, element: Node<'a, 'a>, uses: usize) -> Option<Node<'a, 'a>> {
        if is_shape(element) {
            return Some(element);
        }
        if is_use(&element) {
            let target = target(element, &self.by_id)?;
            return if uses < MAX_USES { self.shape_of(target, uses + 1) } else { None };
        }
        let mut inner = element.descendants().filter(|node| is_shape(*node) || is_use(node));
        inner.next().filter(|_| inner.next().is_none()).and_then(|node| self.shape_of(node, uses))
    }
}

/// Whether the coordinates of a shape are read in double precision.
fn is_in_double(shape: Node<'_, '_>) -> bool {
    ["path", "polyline", "polygon"].contains(&shape.tag_name().name())
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
    let failed = |error: roxmltree::Error| {
        DrawingFileError(format!("is not valid XML: {}", error.to_string().replace('\n', " ")))
    };
    Document::parse_with_options(text, options).map_err(failed)
}

fn is_shape(node: Node<'_, '_>) -> bool {
    SHAPES.contains(&node.tag_name().name())
}

fn is_use(node: &Node<'_, '_>) -> bool {
    node.tag_name().name() == "use"
}

/// The id of an element.
fn name<'a>(node: Node<'a, 'a>) -> Option<&'a str> {
    node.attribute("id")
}

/// Inkscape's label of an element.
fn label<'a>(node: Node<'a, 'a>) -> Option<&'a str> {
    node.attribute((INKSCAPE, "label"))
}

/// Inkscape's layers around an element, the innermost first.
fn layers<'a>(node: Node<'a, 'a>) -> impl Iterator<Item = Node<'a, 'a>> {
    node.ancestors().filter(|node| node.attribute((INKSCAPE, "groupmode")) == Some("layer"))
}

/// Adds the paths that a group shows. Inside a `use` element usvg drops the ids of shapes.
fn find<'a>(group: &Group, shown_by: Option<Node<'a, 'a>>, document: &'a Document<'a>, shown: &mut Vec<Shown<'a>>) {
    for child in group.children() {
        match child {
            usvg::Node::Group(inner) => {
                find(inner, shown_by.or_else(|| element(document, inner.id()).filter(is_use)), document, shown);
            }
            usvg::Node::Path(path) => {
                if let Some(element) = shown_by.or_else(|| element(document, path.id())) {
                    let (transform, resolved) = (path.abs_transform(), path.data().clone());
                    shown.push(Shown { element, transform, resolved });
                }
            }
            usvg::Node::Image(_) | usvg::Node::Text(_) => {}
        }
    }
}

impl<'a> File<'a> {
    /// The path that is wanted, or the only one.
    fn choose(&self, choice: &PathChoice<'_>) -> Result<&Shown<'a>, DrawingFileError> {
        let shown = &self.shown;
        let names = || listed(shown.iter().filter_map(|shown| name(shown.element)));
        let known =
            |names: String| if names.is_empty() { "no path has an id".to_owned() } else { format!("paths: {names}") };
        if choice.is_open() {
            if let Some(elsewhere) = shown.iter().find(|shown| elsewhere(shown.element).is_some()) {
                return Ok(elsewhere);
            }
            return match &shown[..] {
                [only] => Ok(only),
                [] => Err(self.no_path()),
                _ => Err(DrawingFileError(format!(
                    "has {} paths: set id to one of them; {}",
                    shown.len(),
                    known(names())
                ))),
            };
        }
        if let Some(id) = choice.id.filter(|_| choice.is_id()) {
            return self.choose_by_id(id, &known(names()));
        }
        let is_wanted = |&(number, shown): &(usize, &Shown<'a>)| {
            let has = |attribute: fn(Node<'a, 'a>) -> Option<&'a str>, wanted: &str| {
                shown.element.ancestors().any(|node| attribute(node) == Some(wanted))
            };
            choice.id.is_none_or(|id| has(name, id))
                && choice.label.is_none_or(|wanted| has(label, wanted))
                && choice.layer.is_none_or(|wanted| {
                    layers(shown.element).any(|layer| label(layer) == Some(wanted) || name(layer) == Some(wanted))
                })
                && choice.number.is_none_or(|wanted| wanted as usize == number)
        };
        let found: Vec<(usize, &Shown<'a>)> = (1..).zip(shown).filter(is_wanted).collect();
        match found[..] {
            [(_, only)] => Ok(only),
            ref several => Err(choice.not_one(several.len(), shown.len())),
        }
    }

    /// The error of a file that shows no path.
    fn no_path(&self) -> DrawingFileError {
        let root = self.document.root();
        let reason = if root.descendants().any(is_shape) {
            "has no path that is shown: a path needs a length, and a transform whose scale is not 0"
        } else {
            "has no path"
        };
        unreadable(root).unwrap_or_else(|| DrawingFileError(reason.to_owned()))
    }

    fn choose_by_id(&self, id: &str, known: &str) -> Result<&Shown<'a>, DrawingFileError> {
        let has_id = |shown: &&Shown<'a>| shown.element.ancestors().any(|node| node.attribute("id") == Some(id));
        let chosen: Vec<&Shown<'a>> = self.shown.iter().filter(has_id).collect();
        let with_id = self.by_id.get(id).copied();
        if let (Some(error), []) = (with_id.and_then(unreadable), &chosen[..]) {
            return Err(error);
        }
        if let Some(elsewhere) = chosen.iter().find(|shown| elsewhere(shown.element).is_some()) {
            return Ok(elsewhere);
        }
        let quoted = quoted(id);
        Err(DrawingFileError(match &chosen[..] {
            [only] => return Ok(only),
            [] if with_id.is_some() => {
                format!("the element with id {quoted} is not a path that is shown; {known}")
            }
            [] => format!("has no path with id {quoted}; {known}"),
            several => format!("the element with id {quoted} has {} paths, must have 1", several.len()),
        }))
    }
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

fn affine(transform: Transform) -> DAffine2 {
    let Transform { sx, kx, ky, sy, tx, ty } = transform;
    DAffine2::from_cols_array(&[sx, ky, kx, sy, tx, ty].map(f64::from))
}

//! The same file for usvg, with no more than it needs to place shapes.
//!
//! usvg resolves transforms, `use`, nested `svg` elements and units, but its work on paints, masks, markers and style sheets is
//! not bounded, and it leaves out styles that it does not know. So styles are resolved here, paints are left out, and the data of
//! paths is replaced: the caller reads it itself. A style that cannot be resolved is a fault of its element. Each element has its number
//! as its id.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::str::FromStr as _;

use glam::DVec2;
use roxmltree::{Document, Node, NodeId};
use svgtypes::{Length, LengthUnit, SimplePathSegment, SimplifyingPathParser, ViewBox};

use super::super::DrawingFileError;
use super::animation::animated;
use super::placed::{LENGTHS, Placed};
use super::shown::{MAX_DEPTH, elsewhere, require_few, target, too_deep};
use super::style::{Faults, Sheets, style_texts};

/// The id of a path that has the map of the page alone.
pub(super) const PAGE: &str = "page";
/// Largest coordinate of a page's corner.
const MAX_CORNER: f64 = 1e9;
/// Begins the id of an element in the reduced file.
const PREFIX: &str = "n";
/// Namespace of elements that count.
pub(super) const SVG: &str = "http://www.w3.org/2000/svg";
/// Elements that are written with their children.
const CONTAINERS: [&str; 5] = ["svg", "g", "a", "switch", "symbol"];
/// Elements that show nothing themselves. Their children are written, because a `use` element may show them.
const HIDDEN: [&str; 5] = ["defs", "clipPath", "marker", "mask", "pattern"];
/// Elements that may stand in the place of a shape in a `switch` element.
const EMPTY: [&str; 2] = ["text", "image"];

/// A reduced file, and the faults of elements that the chosen path must not have.
pub(super) struct Reduced {
    pub(super) text: String,
    pub(super) faults: Faults,
    /// A fault that any path may have.
    pub(super) fault: Option<String>,
    /// Data of paths that a style sets.
    pub(super) data: HashMap<NodeId, String>,
    pub(super) sizes: Sizes,
}

/// The values on which the sizes of a file depend.
#[derive(Default)]
pub(super) struct Sizes {
    /// The width and the height of the page.
    pub(super) page: [Option<String>; 2],
    /// The upper left corner of the page in its own coordinates. In the reduced file it is the origin, because its
    /// coordinates may be too large for single precision.
    pub(super) corner: DVec2,
    /// Elements with a length in per cent.
    pub(super) percentages: HashSet<NodeId>,
    /// Elements with a length in em or ex.
    pub(super) in_em: HashSet<NodeId>,
    /// Elements with a font size that needs no other one.
    pub(super) own_fonts: HashSet<NodeId>,
    /// The largest numbers that place elements.
    pub(super) places: HashMap<NodeId, f64>,
}

impl Sizes {
    fn add(&mut self, node: Node<'_, '_>, placed: &Placed<'_>) {
        use LengthUnit::{Em, Ex, Percent};
        let tag = node.tag_name().name();
        let is_root = node.parent_element().is_none();
        if is_root {
            self.page = ["width", "height"].map(|name| placed.get(name).map(str::to_owned));
        }
        let lengths = placed.values.iter().filter(|(name, _)| LENGTHS.contains(name));
        let lengths: Vec<Length> = lengths.filter_map(|(_, value)| Length::from_str(value).ok()).collect();
        let fills = tag == "svg" && placed.get("viewBox").is_some() && lacks_a_length(placed);
        if !is_root && (fills || lengths.iter().any(|length| length.unit == Percent)) {
            self.percentages.insert(node.id());
        }
        let origin = placed.get("transform-origin").unwrap_or_default().split_whitespace();
        let origin = origin.filter_map(|part| Length::from_str(part).ok());
        if lengths.into_iter().chain(origin).any(|length| matches!(length.unit, Em | Ex)) {
            self.in_em.insert(node.id());
        }
        let texts = ["transform", "transform-origin"].into_iter().filter_map(|name| placed.get(name));
        let moves = placed.values.iter().filter(|(name, _)| ["x", "y"].contains(name));
        let corner = placed.get("viewBox").filter(|_| !is_root).into_iter().flat_map(|text| numbers(text).take(2));
        let place = texts.chain(moves.map(|(_, value)| &**value)).flat_map(numbers).chain(corner);
        let place = place.map(f64::abs).fold(0.0, f64::max);
        if place > 0.0 {
            self.places.insert(node.id(), place);
        }
        let font_size = placed.get("font-size").and_then(|size| Length::from_str(size).ok());
        if font_size.is_some_and(|size| !matches!(size.unit, Em | Ex | Percent)) {
            self.own_fonts.insert(node.id());
        }
    }
}

/// The numbers of a text.
fn numbers(text: &str) -> impl Iterator<Item = f64> {
    let parts = text.split(|char: char| char.is_whitespace() || "(),".contains(char));
    parts.filter_map(|part| {
        let part = part.trim_end_matches(|char: char| char.is_ascii_alphabetic());
        part.parse().ok()
    })
}

fn lacks_a_length(placed: &Placed<'_>) -> bool {
    ["width", "height"].into_iter().any(|name| placed.get(name).is_none())
}

/// The element with an id of the reduced file.
pub(super) fn element<'a>(document: &'a Document<'a>, id: &str) -> Option<Node<'a, 'a>> {
    let number: u32 = id.strip_prefix(PREFIX)?.parse().ok()?;
    document.get_node(NodeId::from(number))
}

/// Reduces a document.
///
/// # Errors
/// It is too deep, shows too many elements, or its style sheets take too long.
pub(super) fn reduced<'a>(
    document: &'a Document<'a>,
    by_id: &HashMap<&'a str, Node<'a, 'a>>,
) -> Result<Reduced, DrawingFileError> {
    let texts = style_texts(document);
    // The texts live as long as the sheets, and the sheets as long as this call.
    let sheets = Sheets::of(&texts);
    require_few(document, by_id)?;
    let mut writer = Writer {
        document,
        sheets,
        by_id,
        text: String::new(),
        faults: animated(document, by_id),
        data: HashMap::new(),
        sizes: Sizes::default(),
    };
    writer.write(document.root_element(), 0)?;
    let fault = writer.sheets.unknown().map(str::to_owned);
    Ok(Reduced { text: writer.text, faults: writer.faults, fault, data: writer.data, sizes: writer.sizes })
}

/// Writes the reduced file.
struct Writer<'s, 'a> {
    document: &'a Document<'a>,
    sheets: Sheets<'s>,
    by_id: &'s HashMap<&'a str, Node<'a, 'a>>,
    text: String,
    faults: Faults,
    data: HashMap<NodeId, String>,
    sizes: Sizes,
}

impl<'a> Writer<'_, 'a> {
    fn write(&mut self, node: Node<'a, 'a>, depth: usize) -> Result<(), DrawingFileError> {
        if depth > MAX_DEPTH {
            return Err(too_deep());
        }
        let tag = node.tag_name();
        if !matches!(tag.namespace(), None | Some(SVG)) {
            return Ok(());
        }
        let name = tag.name();
        let is_hidden = HIDDEN.contains(&name);
        let is_group = is_hidden || CONTAINERS.contains(&name);
        if !(is_group || EMPTY.contains(&name) || name == "use" || super::is_shape(node)) {
            return Ok(());
        }
        let name = match name {
            _ if is_hidden => "defs",
            // A path stands for what another file shows, so that it counts among the paths to choose from.
            "use" if elsewhere(node).is_some() => "path",
            name => name,
        };
        let _ = write!(self.text, "<{name} id=\"{PREFIX}{}\"", node.id().get());
        if node == self.document.root_element() {
            let _ = write!(self.text, " xmlns=\"{SVG}\"");
        }
        self.write_attributes(node)?;
        if !is_group {
            self.text += "/>";
            return Ok(());
        }
        self.text.push('>');
        if node == self.document.root_element() {
            let _ = write!(self.text, "<path id=\"{PAGE}\" d=\"M0 0H1\"/>");
        }
        for child in node.children().filter(Node::is_element) {
            self.write(child, depth + 1)?;
        }
        let _ = write!(self.text, "</{name}>");
        Ok(())
    }

    fn write_attributes(&mut self, node: Node<'a, 'a>) -> Result<(), DrawingFileError> {
        let placed = Placed::of(node, &self.sheets)?;
        self.sizes.add(node, &placed);
        let (mut values, mut fault) = (placed.values, placed.fault);
        if node == self.document.root_element() {
            self.move_corner(&mut values);
        }
        match node.tag_name().name() {
            "use" if elsewhere(node).is_some() => {
                fault = fault.or(elsewhere(node));
                values.push(("d", "M0 0H1".to_owned()));
            }
            "use" => {
                if let Some(target) = target(node, self.by_id) {
                    values.retain(|(name, _)| *name != "href");
                    values.push(("href", format!("#{PREFIX}{}", target.id().get())));
                    if target.tag_name().name() == "symbol" {
                        let own = Placed::of(target, &self.sheets)?.values;
                        let missing = |name: &str| !values.iter().any(|(known, _)| *known == name);
                        let sizes =
                            own.into_iter().filter(|(name, _)| ["width", "height"].contains(name) && missing(name));
                        let sizes: Vec<_> = sizes.collect();
                        values.extend(sizes);
                    }
                }
            }
            "path" => {
                let data = values.iter().position(|(name, _)| *name == "d").map(|at| values.remove(at).1);
                values.extend(data.as_deref().is_some_and(has_segment).then(|| ("d", "M0 0H1".to_owned())));
                if let Some(data) = data.filter(|data| Some(&**data) != node.attribute("d").map(str::trim)) {
                    self.data.insert(node.id(), data);
                }
            }
            _ => {}
        }
        for (name, value) in values {
            let _ = write!(self.text, " {name}=\"{}\"", escaped(&value));
        }
        if let Some(fault) = fault {
            self.faults.entry(node.id()).or_insert(fault);
        }
        Ok(())
    }

    /// Moves the corner of the page to the origin.
    fn move_corner(&mut self, values: &mut [(&'a str, String)]) {
        let Some((_, value)) = values.iter_mut().find(|(name, _)| *name == "viewBox") else { return };
        let Ok(ViewBox { x, y, w, h }) = ViewBox::from_str(value) else { return };
        let corner = DVec2::new(x, y);
        if corner.abs().max_element() <= MAX_CORNER {
            *value = format!("0 0 {w} {h}");
            self.sizes.corner = corner;
        }
    }
}

/// Whether path data shows something: it has a line or a curve before its first error.
fn has_segment(data: &str) -> bool {
    let mut segments = SimplifyingPathParser::from(data).map_while(Result::ok);
    segments.any(|segment| !matches!(segment, SimplePathSegment::MoveTo { .. } | SimplePathSegment::ClosePath))
}

fn escaped(value: &str) -> String {
    value.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;").replace(['\n', '\t', '\r'], " ")
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use crate::drawing::{DrawingFormat, PathChoice, parse};

    /// The ends of a path on a page with these attributes, or its fault.
    fn ends(page: &str, body: &str) -> Result<[DVec2; 2], String> {
        let choice = PathChoice { metres_per_unit: Some(1.0), gap_m: 5e-4, ..PathChoice::default() };
        let text = format!("<svg xmlns=\"http://www.w3.org/2000/svg\" {page}>{body}</svg>");
        let drawing = parse(text.as_bytes(), DrawingFormat::Svg, &choice).map_err(|error| error.to_string())?;
        Ok([drawing.pieces[0].begin(), drawing.pieces[drawing.pieces.len() - 1].end()])
    }

    #[test]
    fn a_page_whose_corner_is_far_away_is_read_in_full_precision() {
        let corner = "viewBox=\"500000 -4000000 400 400\"";
        let path = "<path d=\"M500000.1 -3999999H500003.4\"/>";
        for (size, scale) in [("", 1.0), ("width=\"800\" height=\"800\"", 2.0), ("width=\"500\" height=\"500\"", 1.25)]
        {
            for group in [path.to_owned(), format!("<g transform=\"translate(0 0)\">{path}</g>")] {
                let [begin, end] = ends(&format!("{corner} {size}"), &group).expect(size);
                assert!(begin.distance(scale * DVec2::new(0.1, -1.0)) < 1e-6, "{size}: {begin}");
                assert!(end.distance(scale * DVec2::new(3.4, -1.0)) < 1e-6, "{size}: {end}");
            }
        }
        let turned = "<path transform=\"rotate(30)\" d=\"M500000 -4000000H500100\"/>";
        let large = "the path has coordinates too large for its shape or transform, which have seven digits";
        let fault = format!("{large}: apply the transform to the path, or move the drawing");
        assert_eq!(ends(corner, turned), Err(fault));
        let line = "<line x1=\"500000.1\" y1=\"-4000000\" x2=\"500003.4\" y2=\"-4000000\"/>";
        assert_eq!(ends(corner, line), Err(format!("{large}: use a path, or move the drawing")));
    }

    #[test]
    fn a_shape_is_where_its_page_and_its_transforms_place_it() {
        let page = "viewBox=\"10 20 400 200\" width=\"800\" height=\"800\"";
        let half = "<g transform=\"translate(10 20) scale(0.5)\"><path d=\"M0 0H100\"/></g>";
        // The page is 800 by 400 pixels, in the middle of its height.
        let [begin, end] = ends(page, half).expect("a path");
        assert!(begin.distance(DVec2::new(0.0, -200.0)) < 1e-4 && end.distance(DVec2::new(100.0, -200.0)) < 1e-4);
    }
}

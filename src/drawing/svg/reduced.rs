//! The same file for usvg, with no more than it needs to place shapes.
//!
//! usvg resolves transforms, `use`, nested `svg` elements and units, but its work on paints, masks, markers and style sheets is
//! not bounded, and it leaves out styles that it does not know. So styles are resolved here, paints are left out, and the data of
//! paths is replaced: the caller reads it itself. A style that cannot be resolved is a fault of its element. Each element has its number
//! as its id.

use std::collections::{HashMap, HashSet};
use std::fmt::Write as _;
use std::str::FromStr as _;

use svgtypes::{
    FontShorthand, Length, LengthUnit, PointsParser, SimplePathSegment, SimplifyingPathParser, TransformOrigin,
};
use usvg::roxmltree::{Attribute, Document, Node, NodeId};

use super::super::DrawingFileError;
use super::css_transform;
use super::quoted;
use super::style::{Faults, Sheets, style_texts};

/// Begins the id of an element in the reduced file.
const PREFIX: &str = "n";
/// Namespaces of elements and attributes that count.
const SVG: &str = "http://www.w3.org/2000/svg";
const XLINK: &str = "http://www.w3.org/1999/xlink";
/// Elements that are written with their children.
const CONTAINERS: [&str; 5] = ["svg", "g", "a", "switch", "symbol"];
/// Elements that show nothing themselves. Their children are written, because a `use` element may show them.
const HIDDEN: [&str; 5] = ["defs", "clipPath", "marker", "mask", "pattern"];
/// Elements that may stand in the place of a shape in a `switch` element.
const EMPTY: [&str; 2] = ["text", "image"];
/// Attributes and properties with a length.
const LENGTHS: [&str; 13] = ["cx", "cy", "height", "r", "rx", "ry", "width", "x", "x1", "x2", "y", "y1", "y2"];
/// Properties that usvg does not know, and their values that change nothing.
const UNKNOWN: [(&str, &[&str]); 7] = [
    ("offset", &["none", "auto"]),
    ("offset-path", &["none"]),
    ("rotate", &["none", "0deg"]),
    ("scale", &["none", "1"]),
    ("transform-box", &["view-box"]),
    ("translate", &["none"]),
    ("zoom", &["normal", "1", "100%"]),
];
/// Most elements with those that `use` elements show again, and most steps to find them.
const MAX_SHOWN: u64 = 400_000;
const MAX_STEPS: u64 = 50_000_000;
/// Most levels of elements, as in usvg.
const MAX_DEPTH: usize = 1000;

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
        let corner = placed.get("viewBox").into_iter().flat_map(|text| numbers(text).take(2));
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

/// The element that a `use` element shows.
pub(super) fn target<'a>(use_element: Node<'a, 'a>, by_id: &HashMap<&'a str, Node<'a, 'a>>) -> Option<Node<'a, 'a>> {
    let href = |namespace: Option<&str>| {
        let mut attributes = use_element.attributes();
        attributes.find(|attribute| attribute.name() == "href" && attribute.namespace() == namespace)
    };
    let href = href(None).or_else(|| href(Some(XLINK)))?;
    by_id.get(href.value().trim().strip_prefix('#')?).copied()
}

/// The first element with each id.
pub(super) fn by_id<'a>(document: &'a Document<'a>) -> HashMap<&'a str, Node<'a, 'a>> {
    let mut found = HashMap::new();
    for node in document.descendants() {
        if let Some(id) = node.attribute("id") {
            found.entry(id).or_insert(node);
        }
    }
    found
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
        faults: Faults::new(),
        data: HashMap::new(),
        sizes: Sizes::default(),
    };
    writer.write(document.root_element(), 0)?;
    let fault = writer.sheets.unknown().map(str::to_owned);
    Ok(Reduced { text: writer.text, faults: writer.faults, fault, data: writer.data, sizes: writer.sizes })
}

/// Fails if `use` elements show very many elements again and again.
fn require_few<'a>(document: &'a Document<'a>, by_id: &HashMap<&'a str, Node<'a, 'a>>) -> Result<(), DrawingFileError> {
    let mut counts = Counts { by_id, known: HashMap::new() };
    let (shown, steps) = counts.of(document.root_element(), 0)?;
    if shown > MAX_SHOWN || steps > MAX_STEPS {
        let shown = shown.min(1_000_000_000);
        return Err(DrawingFileError(format!(
            "shows {shown} elements, those of use elements counted each time, at most {MAX_SHOWN} are allowed"
        )));
    }
    Ok(())
}

/// The number of elements that each element shows, and of steps to find them.
struct Counts<'c, 'a> {
    by_id: &'c HashMap<&'a str, Node<'a, 'a>>,
    /// No number while an element is being counted: it shows itself.
    known: HashMap<NodeId, Option<(u64, u64)>>,
}

impl<'a> Counts<'_, 'a> {
    fn of(&mut self, node: Node<'a, 'a>, depth: usize) -> Result<(u64, u64), DrawingFileError> {
        if depth > MAX_DEPTH {
            return Err(too_deep());
        }
        match self.known.get(&node.id()) {
            Some(&Some(known)) => return Ok(known),
            // usvg leaves out what shows itself, after a look at it.
            Some(None) => return Ok((0, 1)),
            None => {}
        }
        self.known.insert(node.id(), None);
        let mut sum = (1_u64, 1_u64);
        let mut add = |(shown, steps): (u64, u64)| {
            sum = (sum.0.saturating_add(shown), sum.1.saturating_add(steps));
        };
        for child in node.children().filter(Node::is_element) {
            add(self.of(child, depth + 1)?);
        }
        if node.tag_name().name() == "use"
            && let Some(target) = target(node, self.by_id)
        {
            let (shown, steps) = self.of(target, depth + 1)?;
            // usvg looks through all of the target for loops.
            let looked_at = u64::from(target.range().len() as u32 / 8);
            add((shown, steps.saturating_add(looked_at)));
        }
        self.known.insert(node.id(), Some(sum));
        Ok(sum)
    }
}

fn too_deep() -> DrawingFileError {
    DrawingFileError(format!("has elements in more than {MAX_DEPTH} levels, the most that is allowed"))
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
        let name = if is_hidden { "defs" } else { name };
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
        for child in node.children().filter(Node::is_element) {
            self.write(child, depth + 1)?;
        }
        let _ = write!(self.text, "</{name}>");
        Ok(())
    }

    fn write_attributes(&mut self, node: Node<'a, 'a>) -> Result<(), DrawingFileError> {
        let placed = Placed::of(node, &self.sheets)?;
        self.sizes.add(node, &placed);
        let mut values = placed.values;
        match node.tag_name().name() {
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
        if let Some(fault) = placed.fault {
            self.faults.insert(node.id(), fault);
        }
        Ok(())
    }
}

/// The attributes of an element for usvg, after its styles.
pub(super) struct Placed<'a> {
    pub(super) values: Vec<(&'a str, String)>,
    fault: Option<String>,
}

impl<'a> Placed<'a> {
    /// # Errors
    /// The style sheets take too long.
    pub(super) fn of(node: Node<'a, 'a>, sheets: &Sheets<'_>) -> Result<Self, DrawingFileError> {
        let tag = node.tag_name().name();
        let is_root = node.parent_element().is_none();
        let mut placed = Self { values: vec![], fault: None };
        for attribute in node.attributes().filter(|attribute| attribute.namespace().is_none()) {
            if let Some(name) = kept(&attribute) {
                placed.values.push((name, attribute.value().trim().to_owned()));
            }
        }
        let mut box_of_origin = None;
        for property in sheets.properties(node).map_err(DrawingFileError)? {
            let (name, value) = (property.name, property.value);
            match name {
                "font" => {
                    if let Ok(font) = FontShorthand::from_str(value) {
                        placed.set("font-size", font.font_size);
                    }
                }
                "display" | "overflow" | "font-size" | "transform" | "transform-origin" => placed.set(name, value),
                "d" if tag == "path" => placed.set_data(value),
                "transform-box" => box_of_origin = Some(value).filter(|value| !is_neutral(name, value)),
                _ if LENGTHS.contains(&name) && !is_root && has_length(tag, name) => placed.set(name, value),
                "width" | "height" if is_root => placed.set_page(name, value),
                _ if UNKNOWN.iter().any(|(known, _)| *known == name) && !is_neutral(name, value) => {
                    placed.refuse(&format!(
                        "has the property {name} {}, which is not supported: use transform",
                        quoted(value)
                    ));
                }
                _ => {}
            }
        }
        placed.resolve_transform(box_of_origin);
        if !is_root {
            placed.require_lengths();
        }
        match tag {
            "symbol" => placed.require_plain_symbol(node),
            "polyline" | "polygon" => {
                let has_points = PointsParser::from(node.attribute("points").unwrap_or_default()).nth(1).is_some();
                placed.values.extend(has_points.then(|| ("points", "0,0 1,1".to_owned())));
            }
            _ => {}
        }
        Ok(placed)
    }

    fn get(&self, name: &str) -> Option<&str> {
        self.values.iter().find(|(known, _)| *known == name).map(|(_, value)| &**value)
    }

    /// Sets a property. Words of CSS for its initial value remove it.
    fn set(&mut self, name: &str, value: &str) {
        let Some(name) = PLACED.into_iter().find(|known| *known == name) else { return };
        self.values.retain(|(known, _)| *known != name);
        let resets = |word: &str| value.eq_ignore_ascii_case(word);
        let is_initial = ["initial", "unset", "revert"].into_iter().any(resets) || resets("auto") && name != "overflow";
        if !is_initial {
            self.values.push((name, value.to_owned()));
        }
    }

    /// Sets a size of the page. Without one, or with all of the window, the page is as large as its `viewBox`.
    fn set_page(&mut self, name: &str, value: &str) {
        let is_known = Length::from_str(value).is_ok_and(|length| length.unit != LengthUnit::Percent);
        let is_word =
            ["100%", "auto", "initial", "unset", "revert"].iter().any(|word| value.eq_ignore_ascii_case(word));
        if is_known || is_word {
            self.set(name, if value == "100%" { "auto" } else { value });
        } else {
            self.refuse(&format!("has the property {name} {}, which is not supported for the page", quoted(value)));
        }
    }

    /// Sets path data by `path("…")`.
    fn set_data(&mut self, value: &str) {
        let inner = value.trim().strip_prefix("path(").and_then(|value| value.strip_suffix(')'));
        let data = inner
            .map(str::trim)
            .and_then(|inner| ['"', '\''].into_iter().find_map(|quote| inner.strip_prefix(quote)?.strip_suffix(quote)));
        match data {
            Some(data) => self.set("d", data),
            None if value.eq_ignore_ascii_case("none") => self.values.retain(|(known, _)| *known != "d"),
            None => self.refuse(&format!("has the property d {}, must be path(\"…\")", quoted(value))),
        }
    }

    /// Converts a transform with units, which usvg does not know.
    fn resolve_transform(&mut self, box_of_origin: Option<&str>) {
        let Some(value) = self.get("transform").map(str::to_owned) else { return };
        if value.is_empty() || value.eq_ignore_ascii_case("none") {
            self.values.retain(|(known, _)| *known != "transform");
            return;
        }
        let map = css_transform::parsed(&value);
        if svgtypes::Transform::from_str(&value).is_err() {
            match map {
                Some(map) => {
                    let [a, b, c, d, e, f] = map.to_cols_array();
                    self.set("transform", &format!("matrix({a} {b} {c} {d} {e} {f})"));
                }
                None => self.refuse(&format!("has the transform {}, which is not supported", quoted(&value))),
            }
        }
        let is_translation = map.is_some_and(|map| map.matrix2 == glam::DMat2::IDENTITY);
        if is_translation {
            return;
        }
        if let Some(reference) = box_of_origin {
            self.refuse(&format!("has the transform-box {}, must be view-box", quoted(reference)));
        }
        let origin = self.get("transform-origin").filter(|origin| TransformOrigin::from_str(origin).is_err());
        if let Some(origin) = origin.map(quoted) {
            self.refuse(&format!("has the transform-origin {origin}, which is not supported"));
        }
    }

    /// A shape with an unknown length gets another one, so that usvg shows it, and it counts among the paths to choose from.
    fn require_lengths(&mut self) {
        let lengths = self.values.iter_mut().filter(|(name, _)| LENGTHS.contains(name));
        let mut wrong = None;
        for (name, value) in lengths.filter(|(_, value)| !value.is_empty() && Length::from_str(value).is_err()) {
            wrong.get_or_insert(format!("has the {name} {}, which is not a known length", quoted(value)));
            "1".clone_into(value);
        }
        if let Some(reason) = wrong {
            self.refuse(&reason);
        }
    }

    /// usvg leaves out the place of a symbol itself.
    fn require_plain_symbol(&mut self, node: Node<'_, '_>) {
        let is_zero = |value: &str| Length::from_str(value).is_ok_and(|length| length.number == 0.0);
        let moved = ["x", "y", "refX", "refY"].into_iter().find_map(|name| {
            let value = node.attribute(name).or(self.get(name))?;
            (!is_zero(value)).then(|| format!("has {name} {}", quoted(value)))
        });
        let transform = self.get("transform").map(|value| format!("has the transform {}", quoted(value)));
        if let Some(found) = moved.or(transform) {
            self.refuse(&format!("{found}, which is not supported for a symbol: move its use element"));
        }
    }

    fn refuse(&mut self, reason: &str) {
        self.fault.get_or_insert_with(|| reason.to_owned());
    }
}

/// The names of the attributes that are written.
const PLACED: [&str; 24] = [
    "cx",
    "cy",
    "d",
    "display",
    "font-size",
    "height",
    "overflow",
    "preserveAspectRatio",
    "r",
    "requiredExtensions",
    "requiredFeatures",
    "rx",
    "ry",
    "systemLanguage",
    "transform",
    "transform-origin",
    "viewBox",
    "width",
    "x",
    "x1",
    "x2",
    "y",
    "y1",
    "y2",
];

/// The name of an attribute that is written.
fn kept(attribute: &Attribute<'_, '_>) -> Option<&'static str> {
    PLACED.into_iter().find(|name| *name == attribute.name())
}

/// Whether a length is a property of an element in CSS.
fn has_length(tag: &str, name: &str) -> bool {
    let tags: &[&str] = match name {
        "cx" | "cy" => &["circle", "ellipse"],
        "r" => &["circle"],
        "rx" | "ry" => &["ellipse", "rect"],
        _ => &["image", "rect", "svg", "symbol", "use"],
    };
    tags.contains(&tag)
}

/// Whether a value of a property that usvg does not know changes nothing.
fn is_neutral(name: &str, value: &str) -> bool {
    let words = UNKNOWN.iter().find(|(known, _)| *known == name).map_or(&[][..], |(_, words)| words);
    words.iter().chain(&["initial", "unset", "revert"]).any(|word| value.eq_ignore_ascii_case(word))
}

/// Whether path data shows something: it has a line or a curve before its first error.
fn has_segment(data: &str) -> bool {
    let mut segments = SimplifyingPathParser::from(data).map_while(Result::ok);
    segments.any(|segment| !matches!(segment, SimplePathSegment::MoveTo { .. } | SimplePathSegment::ClosePath))
}

fn escaped(value: &str) -> String {
    value.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;").replace(['\n', '\t', '\r'], " ")
}

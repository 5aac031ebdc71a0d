//! The attributes of an element for usvg, after its styles.

use std::str::FromStr as _;

use glam::{DAffine2, DMat2, DVec2};
use roxmltree::{Attribute, Node};
use svgtypes::{FontShorthand, Length, LengthUnit, PointsParser, TransformOrigin};

use super::super::DrawingFileError;
use super::css_transform;
use super::quoted;
use super::style::Sheets;

/// Attributes and properties with a length.
pub(super) const LENGTHS: [&str; 13] =
    ["cx", "cy", "height", "r", "rx", "ry", "width", "x", "x1", "x2", "y", "y1", "y2"];
/// Scales of a transform, other than 0, and its largest movement. usvg leaves out what has a scale near 0, or
/// beyond single precision.
const SCALES: [f64; 2] = [1e-6, 1e6];
const MAX_MOVE: f64 = 1e9;
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

/// The attributes of an element for usvg, after its styles.
pub(super) struct Placed<'a> {
    pub(super) values: Vec<(&'a str, String)>,
    pub(super) fault: Option<String>,
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
        // usvg knows words in lower case alone.
        for (_, value) in placed.values.iter_mut().filter(|(name, _)| *name == "display") {
            value.make_ascii_lowercase();
        }
        let mut origin_fault = None;
        for property in sheets.properties(node).map_err(DrawingFileError)? {
            let (name, value) = (property.name, property.value);
            match name {
                "font" => {
                    if let Ok(font) = FontShorthand::from_str(value) {
                        placed.set("font-size", font.font_size);
                    }
                }
                "all" => {
                    placed
                        .refuse(&format!("has the property all {}, which is not supported: remove it", quoted(value)));
                }
                "display" => placed.set(name, &value.to_ascii_lowercase()),
                "animation" | "animation-name" if sheets.moves(value) => {
                    placed.refuse(&format!("has the {name} {}, which is not supported: remove it", quoted(value)));
                }
                "transform" => placed.set_transform(value),
                "transform-origin" if css_transform::origin_lacks_unit(value) => {
                    let quoted = quoted(value);
                    origin_fault.get_or_insert(format!(
                        "has the transform-origin {quoted} in a style, where lengths must have a unit"
                    ));
                }
                "overflow" | "font-size" | "transform-origin" => placed.set(name, value),
                "d" if tag == "path" => placed.set_data(value),
                "transform-box" if !is_neutral(name, value) => {
                    origin_fault.get_or_insert(format!("has the transform-box {}, must be view-box", quoted(value)));
                }
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
        placed.resolve_transform(origin_fault);
        if tag == "svg" && !is_root {
            placed.hide_without_size();
        }
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

    pub(super) fn get(&self, name: &str) -> Option<&str> {
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

    /// Sets the property `transform` in the words of the attribute, which usvg knows.
    fn set_transform(&mut self, value: &str) {
        self.values.retain(|(known, _)| *known != "transform");
        if ["none", "initial", "unset", "revert"].iter().any(|word| value.eq_ignore_ascii_case(word)) {
            return;
        }
        match css_transform::of_style(value) {
            Some(map) if is_in_range(&map) => self.values.push(("transform", matrix(&map))),
            Some(_) => self.refuse_range(value),
            None if css_transform::lacks_unit(value) => self.refuse(&format!(
                "has the transform {} in a style, where lengths and angles must have a unit",
                quoted(value)
            )),
            None => self.refuse(&format!(
                "has the transform {}, which is not supported: in a style it must be functions such as \
                 translate(10px, 5px), rotate(30deg) or scale(2, 3)",
                quoted(value)
            )),
        }
    }

    fn refuse_range(&mut self, transform: &str) {
        let [least, most] = SCALES;
        self.refuse(&format!(
            "has the transform {}, must have scales from {least} to {most}, or 0, and move by at most {MAX_MOVE}",
            quoted(transform)
        ));
    }

    /// Removes a transform that is none, or that cannot be applied.
    fn resolve_transform(&mut self, origin_fault: Option<String>) {
        let Some(at) = self.values.iter().position(|(name, _)| *name == "transform") else { return };
        let (name, value) = self.values.remove(at);
        if value.is_empty() || value.eq_ignore_ascii_case("none") {
            return;
        }
        let Some(map) = css_transform::of_attribute(&value) else {
            return self.refuse(&format!(
                "has the transform {}, which is not supported: as an attribute it must be functions such as \
                 translate(10, 5), rotate(30) or scale(2, 3)",
                quoted(&value)
            ));
        };
        if !is_in_range(&map) {
            return self.refuse_range(&value);
        }
        self.values.push((name, value));
        if map.matrix2 == DMat2::IDENTITY {
            return;
        }
        if let Some(reason) = origin_fault {
            self.refuse(&reason);
        }
        let origin = self.get("transform-origin").filter(|origin| TransformOrigin::from_str(origin).is_err());
        if let Some(origin) = origin.map(quoted) {
            self.refuse(&format!("has the transform-origin {origin}, which is not supported"));
        }
    }

    /// An element whose width or height is 0 is not shown.
    fn hide_without_size(&mut self) {
        let is_zero = |value: &str| Length::from_str(value).is_ok_and(|length| length.number == 0.0);
        if ["width", "height"].into_iter().any(|name| self.get(name).is_some_and(is_zero)) {
            self.set("display", "none");
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
        let transform = self.get("transform").map(|_| "has a transform".to_owned());
        if let Some(found) = moved.or(transform) {
            self.refuse(&format!("{found}, which is not supported for a symbol: move its use element"));
        }
    }

    fn refuse(&mut self, reason: &str) {
        self.fault.get_or_insert_with(|| reason.to_owned());
    }
}

/// A map as a function of the attribute `transform`.
fn matrix(map: &DAffine2) -> String {
    let [a, b, c, d, e, f] = map.to_cols_array();
    format!("matrix({a} {b} {c} {d} {e} {f})")
}

fn is_in_range(map: &DAffine2) -> bool {
    let [least, most] = SCALES;
    let rows = map.matrix2.transpose();
    let are_scales = [rows.x_axis, rows.y_axis].map(DVec2::length).iter().all(|&scale| scale == 0.0 || scale >= least);
    are_scales
        && map.matrix2.to_cols_array().iter().all(|entry| entry.abs() <= most)
        && map.translation.abs().max_element() <= MAX_MOVE
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

#[cfg(test)]
mod tests {
    use crate::drawing::{DrawingFormat, PathChoice, parse};

    /// The error of a drawing of one shown path, and of this element.
    fn error(element: &str) -> Option<String> {
        let shown = "<path d=\"M 0 0 L 9 0\"/>";
        let text =
            format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\"><g>{shown}</g>{element}</svg>");
        let choice = PathChoice { metres_per_unit: Some(1.0), ..PathChoice::default() };
        parse(text.as_bytes(), DrawingFormat::Svg, &choice).err().map(|error| error.to_string())
    }

    #[test]
    fn what_is_not_displayed_is_left_out_in_any_case() {
        for hidden in ["display=\"NONE\"", "style=\"display: None\"", "style=\"display: none\""] {
            assert_eq!(error(&format!("<path {hidden} d=\"M 0 5 L 9 5\"/>")), None, "{hidden}");
        }
        assert!(error("<path d=\"M 0 5 L 9 5\"/>").is_some());
    }

    #[test]
    fn an_svg_element_without_a_size_is_not_shown() {
        for hidden in ["width=\"0\"", "height=\"0mm\"", "style=\"width: 0px\""] {
            assert_eq!(error(&format!("<svg {hidden}><path d=\"M 0 5 L 9 5\"/></svg>")), None, "{hidden}");
        }
        assert!(error("<svg width=\"9\"><path d=\"M 0 5 L 9 5\"/></svg>").is_some());
    }

    #[test]
    fn a_transform_of_a_style_without_units_is_refused() {
        let turned = |how: &str| {
            let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\">";
            let choice = PathChoice { metres_per_unit: Some(1.0), ..PathChoice::default() };
            let text = format!("{svg}<path {how} d=\"M 0 5 L 9 5\"/></svg>");
            parse(text.as_bytes(), DrawingFormat::Svg, &choice).err().map(|error| error.to_string())
        };
        let reason =
            "the element <path> has the transform \"rotate(90)\" in a style, where lengths and angles must have a unit";
        assert_eq!(turned("style=\"transform: rotate(90)\"").as_deref(), Some(reason));
        assert_eq!([turned("style=\"transform: rotate(90deg)\""), turned("transform=\"rotate(90)\"")], [None, None]);
    }

    /// The error of a drawing of one path with these attributes.
    fn error_of(attributes: &str) -> Option<String> {
        let svg = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\">";
        let choice = PathChoice { metres_per_unit: Some(1.0), ..PathChoice::default() };
        let text = format!("{svg}<path {attributes} d=\"M0 0H9\"/></svg>");
        parse(text.as_bytes(), DrawingFormat::Svg, &choice).err().map(|error| error.to_string())
    }

    #[test]
    fn a_transform_that_browsers_ignore_is_refused_with_what_is_allowed() {
        let allowed = "translate(10px, 5px), rotate(30deg) or scale(2, 3)";
        for value in ["scale(2 3)", "scale(2),scale(2)", "scale (2)", "scale(3)!ie", "rotate(10deg, 5px, 5px)"] {
            for attribute in ["", "transform=\"scale(3)\""] {
                let reason = format!(
                    "the element <path> has the transform \"{value}\", which is not supported: in a style it must be \
                     functions such as {allowed}"
                );
                assert_eq!(error_of(&format!("style=\"transform: {value}\" {attribute}")), Some(reason));
            }
        }
        for value in ["translate(10px,5px)", "rotate(10deg)", "scaleX(2)", "SCALE(2)", "scale(2),"] {
            let reason = format!(
                "the element <path> has the transform \"{value}\", which is not supported: as an attribute it must be \
                 functions such as translate(10, 5), rotate(30) or scale(2, 3)"
            );
            assert_eq!(error_of(&format!("transform=\"{value}\"")), Some(reason));
            assert_eq!(error_of(&format!("transform=\"{value}\" style=\"transform: scale(2)\"")), None, "{value}");
        }
        let origin = "the element <path> has the transform-origin \"100\" in a style, where lengths must have a unit";
        let turned = |origin: &str| error_of(&format!("style=\"transform: scale(2); transform-origin: {origin}\""));
        assert_eq!(turned("100").as_deref(), Some(origin));
        assert_eq!([turned("100px"), turned("0 0"), error_of("style=\"transform-origin: 100\"")], [None, None, None]);
        assert_eq!(error_of("transform=\"scale(2)\" transform-origin=\"100\""), None);
    }

    #[test]
    fn a_transform_beyond_single_precision_is_refused_with_its_limits() {
        let limits = "must have scales from 0.000001 to 1000000, or 0, and move by at most 1000000000";
        for value in ["scale(1e300)", "scale(1e-8)", "scale(1 1e-8)", "translate(1e300)"] {
            let reason = format!("the element <path> has the transform \"{value}\", {limits}");
            assert_eq!(error_of(&format!("transform=\"{value}\"")), Some(reason));
        }
        let reason = format!("the element <path> has the transform \"scale(1e-8)\", {limits}");
        assert_eq!(error_of("style=\"transform: scale(1e-8)\""), Some(reason));
        let reason = "has no path that is shown: a path needs a length, and a transform whose scale is not 0";
        assert_eq!(error_of("transform=\"scale(0)\"").as_deref(), Some(reason));
    }

    #[test]
    fn the_property_of_all_properties_is_refused() {
        let text = "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 9 9\">\
                    <path transform=\"scale(2)\" style=\"all: unset\" d=\"M 0 5 L 9 5\"/></svg>";
        let choice = PathChoice { metres_per_unit: Some(1.0), ..PathChoice::default() };
        let error = parse(text.as_bytes(), DrawingFormat::Svg, &choice).expect_err("a refusal").to_string();
        assert_eq!(error, "the element <path> has the property all \"unset\", which is not supported: remove it");
    }
}

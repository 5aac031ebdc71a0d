//! Elements that an animation moves or changes. A drawing stands still, so such an element is a fault.
//!
//! Source: W3C *SVG Animations Level 2*.

use std::collections::HashMap;

use roxmltree::{Document, Node, NodeId};

use super::placed::LENGTHS;
use super::reduced::SVG;
use super::shown::{href, target};

/// Attributes other than lengths that place a shape or change it.
const ATTRIBUTES: [&str; 8] =
    ["d", "href", "points", "preserveAspectRatio", "transform", "transform-origin", "viewBox", "xlink:href"];

/// The animated elements, each with a reason, in words.
pub(super) fn animated<'a>(
    document: &'a Document<'a>,
    by_id: &HashMap<&'a str, Node<'a, 'a>>,
) -> HashMap<NodeId, String> {
    let animations = document.descendants().filter(changes_shape);
    let targets = animations.filter_map(|node| {
        let element = if href(node).is_some() { target(node, by_id) } else { node.parent_element() }?;
        let name = node.tag_name().name();
        Some((element.id(), format!("is animated by <{name}>, which is not supported: remove the animation")))
    });
    targets.collect()
}

fn changes_shape(node: &Node<'_, '_>) -> bool {
    let tag = node.tag_name();
    let attribute = node.attribute("attributeName").unwrap_or_default().trim();
    matches!(tag.namespace(), None | Some(SVG))
        && match tag.name() {
            "animateMotion" | "animateTransform" => true,
            "animate" | "set" => ATTRIBUTES.contains(&attribute) || LENGTHS.contains(&attribute),
            _ => false,
        }
}

#[cfg(test)]
mod tests {
    use crate::drawing::{DrawingFormat, PathChoice, parse};

    const SVG: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" xmlns:xlink=\"http://www.w3.org/1999/xlink\">";

    /// The length of the path with the id r, or its fault.
    fn length(body: &str) -> Result<f64, String> {
        let choice = PathChoice { id: Some("r"), metres_per_unit: Some(1.0), ..PathChoice::default() };
        let drawing = parse(format!("{SVG}{body}</svg>").as_bytes(), DrawingFormat::Svg, &choice);
        drawing.map(|drawing| drawing.length_m()).map_err(|error| error.to_string())
    }

    #[test]
    fn a_path_that_an_animation_moves_or_changes_is_refused() {
        let path = |inner: &str| format!("<path id=\"r\" d=\"M0 0H100\">{inner}</path>");
        let animation =
            "<animateTransform attributeName=\"transform\" type=\"scale\" to=\"2\" dur=\"1s\" fill=\"freeze\"/>";
        let fault = |element: &str, name: &str| {
            Err(format!("the element {element} is animated by <{name}>, which is not supported: remove the animation"))
        };
        for (inner, name) in [
            (animation, "animateTransform"),
            ("<animateMotion path=\"M0 0H9\"/>", "animateMotion"),
            ("<animate attributeName=\"d\" to=\"M0 0H9\"/>", "animate"),
            ("<set attributeName=\"x\" to=\"9\"/>", "set"),
        ] {
            assert_eq!(length(&path(inner)), fault("<path> \"r\"", name), "{inner}");
        }
        assert_eq!(length(&format!("<g>{animation}{}</g>", path(""))), fault("<g>", "animateTransform"));
        let elsewhere = |href: &str| path("") + &animation.replace("type", &format!("{href} type"));
        assert_eq!(length(&elsewhere("href=\"#r\"")), fault("<path> \"r\"", "animateTransform"));
        assert_eq!(length(&elsewhere("xlink:href=\"#r\"")), fault("<path> \"r\"", "animateTransform"));
        assert_eq!(length(&elsewhere("href=\"#other\"")), Ok(100.0));
        assert_eq!(length(&path("<animate attributeName=\"opacity\" to=\"0\"/>")), Ok(100.0));
        assert_eq!(length(&format!("<path d=\"M0 9H9\">{animation}</path>{}", path(""))), Ok(100.0));
    }

    #[test]
    fn a_path_that_a_style_animates_is_refused_if_its_keyframes_place_it() {
        let styled = |to: &str| {
            length(&format!(
                "<style>#r {{ animation: z 1s }} @keyframes z {{ to {{ {to} }} }}</style><path id=\"r\" d=\"M0 0H100\"/>"
            ))
        };
        let fault = "the element <path> \"r\" has the animation \"z 1s\", which is not supported: remove it";
        assert_eq!(styled("transform: scale(3)"), Err(fault.to_owned()));
        assert_eq!(styled("opacity: 0"), Ok(100.0));
    }
}

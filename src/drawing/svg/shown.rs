//! The elements that `use` elements show, each time that they do.

use std::collections::HashMap;

use roxmltree::{Document, Node, NodeId};

use super::super::{DrawingFileError, quoted};

/// Namespace of an older `href`.
const XLINK: &str = "http://www.w3.org/1999/xlink";
/// Most elements with those that `use` elements show again, and most steps to find them.
const MAX_SHOWN: u64 = 400_000;
const MAX_STEPS: u64 = 50_000_000;
/// Most levels of elements, as in usvg.
pub(super) const MAX_DEPTH: usize = 1000;

/// The address to which an element refers.
pub(super) fn href<'a>(node: Node<'a, 'a>) -> Option<&'a str> {
    let of = |namespace: Option<&str>| {
        let mut attributes = node.attributes();
        attributes.find(|attribute| attribute.name() == "href" && attribute.namespace() == namespace)
    };
    Some(of(None).or_else(|| of(Some(XLINK)))?.value().trim())
}

/// The element to which another one refers, such as that which a `use` element shows.
pub(super) fn target<'a>(node: Node<'a, 'a>, by_id: &HashMap<&'a str, Node<'a, 'a>>) -> Option<Node<'a, 'a>> {
    by_id.get(href(node)?.strip_prefix('#')?).copied()
}

/// The fault of a `use` element that shows something of another file, in words.
pub(super) fn elsewhere(node: Node<'_, '_>) -> Option<String> {
    let href = href(node).filter(|_| node.tag_name().name() == "use")?;
    let is_elsewhere = !href.is_empty() && !href.starts_with('#');
    is_elsewhere.then(|| format!("shows {}, must be in the file itself, such as \"#a\"", quoted(href)))
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

/// Fails if `use` elements show very many elements again and again.
pub(super) fn require_few<'a>(
    document: &'a Document<'a>,
    by_id: &HashMap<&'a str, Node<'a, 'a>>,
) -> Result<(), DrawingFileError> {
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

pub(super) fn too_deep() -> DrawingFileError {
    DrawingFileError(format!("has elements in more than {MAX_DEPTH} levels, the most that is allowed"))
}

#[cfg(test)]
mod tests {
    use crate::drawing::{DrawingFileError, DrawingFormat, PathChoice, parse};

    use super::super::list;

    const BEGIN: &str = "<svg xmlns=\"http://www.w3.org/2000/svg\" \
                         xmlns:inkscape=\"http://www.inkscape.org/namespaces/inkscape\" viewBox=\"0 0 400 400\">";

    #[test]
    fn what_another_file_shows_is_a_fault_of_its_own_place_alone() {
        let layer = "<g inkscape:groupmode=\"layer\" inkscape:label=\"L\">\
                     <path id=\"r\" inkscape:label=\"rr\" d=\"M0 0H100\"/></g>";
        let text = format!("{BEGIN}<g id=\"q\"><use x=\"3\" href=\"o.svg#a\"/></g>{layer}</svg>");
        let any = PathChoice { metres_per_unit: Some(1.0), ..PathChoice::default() };
        let fault = "the element <use> shows \"o.svg#a\", must be in the file itself, such as \"#a\"";
        let length = |choice: PathChoice<'_>| {
            let drawing = parse(text.as_bytes(), DrawingFormat::Svg, &choice);
            drawing.map(|drawing| drawing.length_m()).map_err(|error| error.to_string())
        };
        for chosen in [
            PathChoice { id: Some("r"), ..any },
            PathChoice { label: Some("rr"), ..any },
            PathChoice { layer: Some("L"), ..any },
            PathChoice { number: Some(2), ..any },
        ] {
            assert_eq!(length(chosen), Ok(100.0), "{chosen:?}");
        }
        for chosen in [any, PathChoice { id: Some("q"), ..any }, PathChoice { number: Some(1), ..any }] {
            assert_eq!(length(chosen), Err(fault.to_owned()), "{chosen:?}");
        }
        let listed = list(&text, &any).expect("a list");
        let faults = listed.iter().map(|path| path.drawing.as_ref().err().map(DrawingFileError::to_string));
        assert_eq!(faults.collect::<Vec<_>>(), [Some(fault.to_owned()), None]);
    }

    #[test]
    fn a_use_element_that_shows_another_files_element_by_way_of_a_second_one_is_refused() {
        let text = format!("{BEGIN}<defs><use id=\"u\" href=\"o.svg#a\"/></defs><use href=\"#u\"/></svg>");
        let choice = PathChoice { metres_per_unit: Some(1.0), ..PathChoice::default() };
        let error = parse(text.as_bytes(), DrawingFormat::Svg, &choice).expect_err("a refusal").to_string();
        assert_eq!(error, "the element <use> \"u\" shows \"o.svg#a\", must be in the file itself, such as \"#a\"");
    }
}

//! The elements that `use` elements show, each time that they do.

use std::collections::HashMap;

use roxmltree::{Document, Node, NodeId};

use super::super::DrawingFileError;

/// Namespace of an older `href`.
const XLINK: &str = "http://www.w3.org/1999/xlink";
/// Most elements with those that `use` elements show again, and most steps to find them.
const MAX_SHOWN: u64 = 400_000;
const MAX_STEPS: u64 = 50_000_000;
/// Most levels of elements, as in usvg.
pub(super) const MAX_DEPTH: usize = 1000;

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

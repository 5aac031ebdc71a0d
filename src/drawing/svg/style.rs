//! Styles of elements: the properties that place or hide a shape, from attributes, `style` attributes and style sheets.
//!
//! Only those properties are kept, so that rules about colours cost nothing. simplecss matches selectors. Its matching goes back
//! on its steps, and can take time exponential in the depth of a file, so the steps of all matches are counted and limited.

use std::cell::Cell;
use std::collections::HashMap;

use roxmltree::{Document, Node, NodeId};
use simplecss::{AttributeOperator, PseudoClass, Selector};

use super::quoted;
use super::sheet_text::{Statement, divided, find_outside_strings, is_import, next_statement, without_comments};

/// Properties that place, size or hide a shape.
const PROPERTIES: [&str; 26] = [
    "all",
    "animation",
    "animation-name",
    "cx",
    "cy",
    "d",
    "display",
    "font",
    "font-size",
    "height",
    "offset-path",
    "overflow",
    "r",
    "rotate",
    "rx",
    "ry",
    "scale",
    "transform",
    "transform-box",
    "transform-origin",
    "translate",
    "width",
    "x",
    "y",
    "zoom",
    "offset",
];
/// Pseudo-classes that are resolved. Nobody points at an element of a drawing.
const PSEUDO_CLASSES: [&str; 4] = ["active", "first-child", "focus", "hover"];
/// Namespace of elements of web pages.
const XHTML: &str = "http://www.w3.org/1999/xhtml";
/// Most steps of matching elements with selectors: about a second.
const MAX_STEPS: u64 = 20_000_000;
/// A part of the addresses of style sheets that have only fonts.
const FONTS: &str = "//fonts.googleapis.com/";
/// Rules that never place a shape.
const AT_RULES_WITHOUT_PLACE: [&str; 8] = [
    "@charset",
    "@counter-style",
    "@font-face",
    "@font-feature-values",
    "@import",
    "@keyframes",
    "@namespace",
    "@page",
];

/// A declared property of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Property<'a> {
    pub(super) name: &'a str,
    pub(super) value: &'a str,
    is_important: bool,
}

impl Property<'_> {
    fn is_animation(&self) -> bool {
        self.name.starts_with("animation")
    }
}

/// A selector and what it declares.
struct Rule<'a> {
    selector: Selector<'a>,
    properties: Vec<Property<'a>>,
}

/// The texts of a file's styles, without comments.
pub(super) struct StyleTexts {
    sheets: Vec<SheetText>,
    /// Those of `style` attributes that have a comment.
    attributes: HashMap<NodeId, String>,
    /// A style sheet in another file.
    other: Option<String>,
}

/// The text of a `style` element.
struct SheetText {
    text: String,
    /// What limits it: its media, as an `@media` rule, or its type, if that is not CSS.
    limit: Option<String>,
}

/// All style sheets of a file.
#[derive(Default)]
pub(super) struct Sheets<'a> {
    rules: Vec<Rule<'a>>,
    /// `style` attributes that have a comment, without it.
    attributes: Option<&'a HashMap<NodeId, String>>,
    /// The names of keyframes that place, size or hide a shape.
    moving: Vec<&'a str>,
    /// The first rule about the place of a shape that cannot be applied, in words.
    unknown: Option<String>,
    steps: Cell<u64>,
}

impl<'a> Sheets<'a> {
    /// The sheets of a document.
    pub(super) fn of(texts: &'a StyleTexts) -> Self {
        let mut sheets = Self { attributes: Some(&texts.attributes), ..Self::default() };
        let unlimited = texts.sheets.iter().filter(|sheet| sheet.limit.is_none());
        sheets.moving = unlimited.flat_map(|sheet| moving_keyframes(&sheet.text)).collect();
        for SheetText { text, limit } in &texts.sheets {
            match limit {
                None => sheets.read(text),
                Some(limit) if !is_neutral(limit) && sheets.places(text) => sheets.refuse(limit),
                Some(_) => {}
            }
        }
        if let Some(other) = &texts.other {
            sheets
                .unknown
                .get_or_insert_with(|| format!("has the style sheet {}, which is not read: remove it", quoted(other)));
        }
        // Later rules win over earlier ones with the same specificity: the order is stable.
        sheets.rules.sort_by_cached_key(|rule| rule.selector.specificity());
        sheets
    }

    fn read(&mut self, text: &'a str) {
        let mut rest = text;
        while let Some(statement) = next_statement(&mut rest) {
            let Statement { prelude, block } = statement;
            let properties = self.declared(block);
            if is_import(prelude) && !prelude.contains(FONTS) {
                self.refuse(prelude);
            }
            if prelude.starts_with('@') {
                if !is_neutral(prelude) && self.places(block) {
                    self.refuse(prelude);
                }
                continue;
            }
            if find_outside_strings(block, |char| char == '{').is_some() && self.places(block) {
                self.refuse(&format!("{prelude} {{ {}", block.trim_start()));
                continue;
            }
            if properties.is_empty() {
                continue;
            }
            for selector in divided(prelude, ',').into_iter().filter(|selector| !selector.contains("::")) {
                let begins = selector.starts_with(|char: char| char.is_ascii_alphanumeric() || "*#.[:_".contains(char));
                match (begins && is_known(selector)).then(|| Selector::parse(selector)).flatten() {
                    Some(parsed) => self.rules.push(Rule { selector: parsed, properties: properties.clone() }),
                    None => self.refuse(selector),
                }
            }
        }
    }

    /// The declarations of a block that place, size or hide a shape.
    fn declared<'b>(&self, block: &'b str) -> Vec<Property<'b>> {
        let properties = declarations(block);
        properties.filter(|property| !property.is_animation() || !self.moving.is_empty()).collect()
    }

    /// Whether a block of any depth declares such a property.
    fn places(&self, block: &str) -> bool {
        block.split(['{', '}', ';']).any(|part| !self.declared(part).is_empty())
    }

    /// Whether a value of `animation` names keyframes that place, size or hide a shape.
    pub(super) fn moves(&self, animation: &str) -> bool {
        let words = animation.split(|char: char| char.is_whitespace() || char == ',');
        words.map(|word| word.trim_matches(['"', '\''])).any(|word| self.moving.contains(&word))
    }

    fn refuse(&mut self, what: &str) {
        self.unknown.get_or_insert_with(|| {
            format!("has a style sheet with {}, which is not supported for the place of shapes", quoted(what))
        });
    }

    /// The first rule that cannot be applied, in words.
    pub(super) fn unknown(&self) -> Option<&str> {
        self.unknown.as_deref()
    }

    /// The properties of an element by rules, and by its `style` attribute.
    ///
    /// # Errors
    /// Matching takes too long, in words.
    pub(super) fn properties(&self, node: Node<'a, 'a>) -> Result<Vec<Property<'a>>, String> {
        let mut found: Vec<Property<'a>> = vec![];
        let mut add = |property: &Property<'a>| match found.iter_mut().find(|other| other.name == property.name) {
            Some(other) if other.is_important && !property.is_important => {}
            Some(other) => *other = *property,
            None => found.push(*property),
        };
        for rule in &self.rules {
            if rule.selector.matches(&Matched { node, steps: &self.steps }) {
                rule.properties.iter().for_each(&mut add);
            }
        }
        let without_comment = self.attributes.and_then(|attributes| attributes.get(&node.id()));
        let style = without_comment.map_or(node.attribute("style").unwrap_or_default(), |style| style);
        self.declared(style).iter().for_each(&mut add);
        if self.steps.get() >= MAX_STEPS {
            let rules = self.rules.len();
            return Err(format!(
                "has a style sheet whose {rules} rules take too long: remove it, or those about transforms"
            ));
        }
        Ok(found)
    }
}

/// The texts of a document's styles.
pub(super) fn style_texts(document: &Document<'_>) -> StyleTexts {
    let sheets = document.descendants().filter(|node| node.tag_name().name() == "style");
    let sheets = sheets.map(|node| {
        // The text of a comment of XML is no text of the element.
        let texts = node.children().filter(Node::is_text).filter_map(|child| child.text());
        let media = node
            .attribute("media")
            .map(str::trim)
            .filter(|media| !["", "all", "screen"].iter().any(|shown| media.eq_ignore_ascii_case(shown)));
        let kind = node.attribute("type").map(str::trim);
        let kind = kind.filter(|kind| !["", "text/css"].iter().any(|css| kind.eq_ignore_ascii_case(css)));
        SheetText {
            text: without_comments(&texts.collect::<String>()),
            limit: kind.map(|kind| format!("type={kind}")).or_else(|| media.map(|media| format!("@media {media}"))),
        }
    });
    let styles = document.descendants().filter_map(|node| Some((node.id(), node.attribute("style")?)));
    let commented = styles.filter(|(_, style)| style.contains("/*"));
    let mut instructions = document.descendants().filter_map(|node| node.pi());
    let other = instructions.find(|instruction| instruction.target == "xml-stylesheet");
    let other = other.map(|instruction| instruction.value.unwrap_or_default().to_owned()).or_else(|| link(document));
    StyleTexts {
        other,
        sheets: sheets.collect(),
        attributes: commented.map(|(id, style)| (id, without_comments(style))).collect(),
    }
}

/// The address of a style sheet that an element of a web page links.
fn link(document: &Document<'_>) -> Option<String> {
    let mut links = document.descendants().filter(|node| node.has_tag_name((XHTML, "link")));
    let is_sheet = |node: &Node<'_, '_>| {
        let mut words = node.attribute("rel").unwrap_or_default().split_whitespace();
        words.any(|word| word.eq_ignore_ascii_case("stylesheet"))
    };
    links.find(is_sheet).map(|node| node.attribute("href").unwrap_or_default().to_owned())
}

/// The declarations of properties of [`PROPERTIES`] in a block.
fn declarations(block: &str) -> impl Iterator<Item = Property<'_>> {
    let declarations = divided(block, ';').into_iter().filter_map(|part| part.split_once(':'));
    declarations.filter_map(|(name, value)| {
        let name = known_name(name)?;
        // Another word behind the mark makes the value invalid.
        let important = value.rsplit_once('!').filter(|(_, word)| word.trim().eq_ignore_ascii_case("important"));
        let (value, is_important) = important.map_or((value, false), |(value, _)| (value, true));
        Some(Property { name, value: value.trim(), is_important })
    })
}

/// The names of keyframes in a style sheet that declare a property of [`PROPERTIES`].
fn moving_keyframes(text: &str) -> Vec<&str> {
    let (mut names, mut rest) = (vec![], text);
    while let Some(Statement { prelude, block }) = next_statement(&mut rest) {
        let mut words = prelude.split_whitespace();
        let rule = words.next().unwrap_or_default().to_ascii_lowercase();
        let is_moving = || block.split(['{', '}', ';']).any(|part| declarations(part).next().is_some());
        if ["@keyframes", "@-webkit-keyframes"].contains(&&*rule) && is_moving() {
            names.extend(words.next().map(|name| name.trim_matches(['"', '\''])));
        }
    }
    names
}

/// The name of a property of [`PROPERTIES`]. Browsers know some by two names.
fn known_name(name: &str) -> Option<&'static str> {
    let name = name.trim();
    let name = match name.get(..8) {
        Some(prefix) if prefix.eq_ignore_ascii_case("-webkit-") => &name[8..],
        _ => name,
    };
    PROPERTIES.into_iter().find(|known| known.eq_ignore_ascii_case(name))
}

/// Whether an at-rule never places a shape on a screen.
fn is_neutral(prelude: &str) -> bool {
    let prelude = prelude.to_ascii_lowercase();
    prelude.strip_prefix("@media").is_some_and(are_print)
        || prelude.starts_with("@-")
        || AT_RULES_WITHOUT_PLACE.iter().any(|name| prelude.starts_with(name))
}

/// Whether all media queries of a list are about print alone.
fn are_print(queries: &str) -> bool {
    divided(queries, ',').into_iter().all(|query| {
        let query = query.strip_prefix("only ").unwrap_or(query);
        let mut words = query.split_whitespace();
        words.next() == Some("print") && words.next().is_none_or(|word| word == "and")
    })
}

/// Whether all pseudo-classes of a selector are resolved.
fn is_known(selector: &str) -> bool {
    let classes = divided(selector, ':').into_iter().skip(1);
    let end =
        |class: &str| class.find(|char: char| !char.is_ascii_alphanumeric() && char != '-').unwrap_or(class.len());
    classes.map(|class| &class[..end(class)]).all(|class| PSEUDO_CLASSES.contains(&class))
}

/// An element for simplecss. Every look at one counts as a step; once they are spent, it has no parents.
#[derive(Clone, Copy)]
struct Matched<'a> {
    node: Node<'a, 'a>,
    steps: &'a Cell<u64>,
}

impl simplecss::Element for Matched<'_> {
    fn parent_element(&self) -> Option<Self> {
        let node = self.node.parent_element().filter(|_| self.steps.get() < MAX_STEPS)?;
        self.steps.set(self.steps.get() + 1);
        Some(Self { node, ..*self })
    }

    fn prev_sibling_element(&self) -> Option<Self> {
        let node = self.node.prev_sibling_element().filter(|_| self.steps.get() < MAX_STEPS)?;
        self.steps.set(self.steps.get() + 1);
        Some(Self { node, ..*self })
    }

    fn has_local_name(&self, name: &str) -> bool {
        self.steps.set(self.steps.get() + 1);
        self.node.tag_name().name() == name
    }

    fn attribute_matches(&self, name: &str, operator: AttributeOperator<'_>) -> bool {
        let value = self.node.attribute(name);
        self.steps.set(self.steps.get() + 1 + value.map_or(0, |value| value.len() as u64 / 64));
        value.is_some_and(|value| operator.matches(value))
    }

    fn pseudo_class_matches(&self, class: PseudoClass<'_>) -> bool {
        matches!(class, PseudoClass::FirstChild) && self.node.prev_sibling_element().is_none()
    }
}

/// The faults of elements that the chosen path must not have.
pub(super) type Faults = HashMap<NodeId, String>;

#[cfg(test)]
mod tests {
    use super::*;

    /// Why the styles of a drawing cannot be applied.
    fn unknown(body: &str) -> Option<String> {
        let text = format!("<svg xmlns=\"http://www.w3.org/2000/svg\">{body}</svg>");
        let document = Document::parse(&text).expect(body);
        Sheets::of(&style_texts(&document)).unknown().map(str::to_owned)
    }

    #[test]
    fn only_styles_of_print_alone_are_left_out() {
        const MOVE: &str = "path { transform: scale(2) }";
        for media in ["print", "PRINT", "only print", "print and (color), only  print", "print, print"] {
            assert_eq!(unknown(&format!("<style>@media {media} {{ {MOVE} }}</style>")), None, "{media}");
            assert_eq!(unknown(&format!("<style media=\"{media}\">{MOVE}</style>")), None, "{media}");
        }
        for media in ["not print", "all, print", "print, (min-width: 1px)", "print, screen", "not all and print"] {
            for body in [
                format!("<style>@media {media} {{ {MOVE} }}</style>"),
                format!("<style media=\"{media}\">{MOVE}</style>"),
            ] {
                let reason = format!("has a style sheet with \"@media {media}\", which is not supported");
                assert!(unknown(&body).is_some_and(|found| found.starts_with(&reason)), "{body}: {:?}", unknown(&body));
            }
        }
    }

    #[test]
    fn the_type_of_a_style_sheet_is_css_without_one_and_in_any_case() {
        for kind in ["", "type=\"\"", "type=\"TEXT/CSS\"", "type=\"text/css\""] {
            let text = format!("<svg><style {kind}>path {{ d: none }}</style></svg>");
            let document = Document::parse(&text).expect(kind);
            let texts = style_texts(&document);
            assert_eq!(Sheets::of(&texts).rules.len(), 1, "{kind}");
        }
        let reason = "has a style sheet with \"type=text/less\", which is not supported for the place of shapes";
        assert_eq!(unknown("<style type=\"text/less\">path { x: 1 }</style>").as_deref(), Some(reason));
        assert_eq!(unknown("<style type=\"text/less\">path { fill: red }</style>"), None);
    }

    #[test]
    fn a_comment_of_xml_is_no_text_of_a_style_sheet() {
        let text = "<svg><style>path { x: 1 } <!-- path { x: 2 } --></style></svg>";
        let document = Document::parse(text).expect(text);
        let texts = style_texts(&document);
        let sheets = Sheets::of(&texts);
        let values: Vec<&str> = sheets.rules.iter().map(|rule| rule.properties[0].value).collect();
        assert_eq!(values, ["1"]);
    }

    #[test]
    fn an_animation_counts_if_its_keyframes_place_a_shape() {
        let moves = |keyframes: &str, animation: &str| {
            let text = format!("<svg><style>{keyframes} path {{ animation: {animation} }}</style></svg>");
            let document = Document::parse(&text).expect(animation);
            let texts = style_texts(&document);
            let sheets = Sheets::of(&texts);
            (sheets.rules.len(), sheets.moves(animation))
        };
        let grow = "@keyframes grow { to { transform: scale(3) } }";
        assert_eq!(moves(grow, "1s grow forwards"), (1, true));
        assert_eq!(moves(&grow.replace("@k", "@-WEBKIT-k"), "blink 1s, 'grow'"), (1, true));
        assert_eq!(moves(grow, "blink 1s"), (1, false));
        assert_eq!(moves("@keyframes blink { 50% { opacity: 0; fill: red } }", "blink 1s"), (0, false));
    }

    #[test]
    fn a_selector_with_an_unresolved_pseudo_class_is_refused() {
        let rule = |selector: &str| unknown(&format!("<style>{selector} {{ transform: scale(2) }}</style>"));
        for selector in ["path:lang(de)", "a:link path", "path, :visited", ":hover:link", "path:LINK"] {
            let found = rule(selector).unwrap_or_default();
            assert!(found.contains("which is not supported for the place of shapes"), "{selector}: {found:?}");
        }
        for selector in ["path:hover", ":first-child", "a:active > path:focus", "[a=\"b:link\"]"] {
            assert_eq!(rule(selector), None, "{selector}");
        }
        assert_eq!(unknown("<style>a:link { fill: red }</style>"), None);
    }

    #[test]
    fn a_linked_style_sheet_is_refused() {
        let link = "<link xmlns=\"http://www.w3.org/1999/xhtml\" rel=\"StyleSheet\" href=\"a.css\"/>";
        assert_eq!(unknown(link).as_deref(), Some("has the style sheet \"a.css\", which is not read: remove it"));
        assert_eq!(unknown(&link.replace("StyleSheet", "icon")), None);
    }
}

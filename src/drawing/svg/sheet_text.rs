//! The text of a style sheet: its statements, and the parts of a value.
//!
//! Source: W3C *CSS Syntax Module Level 3*.

/// A text with a space for each comment.
pub(super) fn without_comments(text: &str) -> String {
    let (mut kept, mut rest) = (String::with_capacity(text.len()), text);
    while let Some(begin) = rest.find("/*") {
        kept += &rest[..begin];
        kept.push(' ');
        rest = rest[begin + 2..].find("*/").map_or("", |end| &rest[begin + 2 + end + 2..]);
    }
    (kept + rest).replace("<!--", " ").replace("-->", " ")
}

/// A rule of a style sheet.
pub(super) struct Statement<'a> {
    /// The text before the block, such as a selector.
    pub(super) prelude: &'a str,
    /// The text between the braces.
    pub(super) block: &'a str,
}

/// Takes the next statement from the beginning of a text.
pub(super) fn next_statement<'a>(rest: &mut &'a str) -> Option<Statement<'a>> {
    loop {
        let text = rest.trim_start();
        // Only a rule with an `@` ends at a semicolon. Elsewhere it, and a brace without its pair, make the selector invalid.
        let is_at_rule = text.starts_with('@');
        let begin = find_outside_strings(text, |char| char == '{' || is_at_rule && char == ';');
        let begin = begin.or((!text.is_empty()).then_some(text.len()))?;
        let prelude = text[..begin].trim();
        if !text[begin..].starts_with('{') {
            *rest = text.get(begin + 1..).unwrap_or_default();
            if is_import(prelude) {
                return Some(Statement { prelude, block: "" });
            }
            continue;
        }
        let inner = &text[begin + 1..];
        let mut depth = 0_usize;
        let end = find_outside_strings(inner, |char| {
            match char {
                '{' => depth += 1,
                '}' if depth == 0 => return true,
                '}' => depth -= 1,
                _ => {}
            }
            false
        });
        let end = end.unwrap_or(inner.len());
        *rest = inner.get(end + 1..).unwrap_or_default();
        return Some(Statement { prelude, block: &inner[..end] });
    }
}

/// Where the first wanted character outside of quotes is.
pub(super) fn find_outside_strings(text: &str, mut is_wanted: impl FnMut(char) -> bool) -> Option<usize> {
    let mut quote = None;
    let found = text.char_indices().find(|&(_, char)| {
        if let Some(open) = quote {
            quote = quote.filter(|_| char != open);
            return false;
        }
        quote = matches!(char, '"' | '\'').then_some(char);
        is_wanted(char)
    });
    found.map(|(at, _)| at)
}

/// The parts of a text between separators outside of quotes and parentheses, without spaces around them.
pub(super) fn divided(text: &str, separator: char) -> Vec<&str> {
    let (mut parts, mut rest) = (vec![], text);
    loop {
        let mut depth = 0_usize;
        let end = find_outside_strings(rest, |char| {
            match char {
                '(' | '[' => depth += 1,
                ')' | ']' => depth = depth.saturating_sub(1),
                _ => {}
            }
            char == separator && depth == 0
        });
        let Some(end) = end else { break };
        parts.push(rest[..end].trim());
        rest = &rest[end + separator.len_utf8()..];
    }
    parts.push(rest.trim());
    parts
}

/// Whether a statement imports another style sheet.
pub(super) fn is_import(prelude: &str) -> bool {
    prelude.get(..7).is_some_and(|name| name.eq_ignore_ascii_case("@import"))
}

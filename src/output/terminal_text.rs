//! Text for a terminal: colours only if the terminal shows them, and escapes for control characters.

use std::borrow::Cow;
use std::fmt::{self, Display, Formatter, Write as _};
use std::path::Path;

use anstream::stream::RawStream;
use anstream::{AutoStream, ColorChoice};
use clap::builder::styling::Style;

/// Whether a stream shows colours: it is a terminal with colours, and `NO_COLOR` is not set.
pub(crate) fn is_coloured(stream: &impl RawStream) -> bool {
    AutoStream::choice(stream) != ColorChoice::Never
}

/// A text with its style on a stream; without style if the stream shows no colours.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Painted<Text> {
    text: Text,
    style: Style,
}

impl<Text: Display> Painted<Text> {
    pub(crate) fn on(stream: &impl RawStream, style: Style, text: Text) -> Self {
        Self { text, style: if is_coloured(stream) { style } else { Style::new() } }
    }
}

impl<Text: Display> Display for Painted<Text> {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let Self { text, style } = self;
        write!(f, "{style}{text}{style:#}")
    }
}

/// A path in a message.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Printable<'a>(pub(crate) &'a Path);

impl Display for Printable<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str(&printable(&self.0.to_string_lossy()))
    }
}

/// Escapes the control characters of a text, including line breaks, in the notation of Rust strings.
pub(crate) fn printable(text: &str) -> Cow<'_, str> {
    if !text.contains(is_control) {
        return Cow::Borrowed(text);
    }
    let mut escaped = String::with_capacity(text.len());
    for char in text.chars() {
        if is_control(char) {
            // Writing into a String cannot fail.
            let _ = write!(escaped, "{}", char.escape_default());
        } else {
            escaped.push(char);
        }
    }
    Cow::Owned(escaped)
}

/// Whether a character is a control character, a line separator, or changes the direction of writing.
fn is_control(char: char) -> bool {
    char.is_control() || matches!(char, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_cannot_move_the_cursor_or_begin_a_new_line() {
        assert_eq!(printable("bühne 1.toml"), "bühne 1.toml");
        assert_eq!(printable("a\u{1b}[2Jb\nerror: c\r\u{9b}\u{202e}"), r"a\u{1b}[2Jb\nerror: c\r\u{9b}\u{202e}");
        assert_eq!(Printable(Path::new("x\u{7}.svg")).to_string(), r"x\u{7}.svg");
    }
}

//! Text for a terminal: coloured only where the terminal shows colours, with its control characters escaped.

use std::borrow::Cow;
use std::fmt::{self, Display, Formatter, Write as _};
use std::path::Path;

use anstream::stream::RawStream;
use anstream::{AutoStream, ColorChoice};
use clap::builder::styling::Style;

/// Whether a stream shows colours: it is a terminal that can, and `NO_COLOR` does not say otherwise.
pub(crate) fn is_coloured(stream: &impl RawStream) -> bool {
    AutoStream::choice(stream) != ColorChoice::Never
}

/// A text in the style that it has on a stream: none where that shows no colours.
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

/// The text with its control characters escaped, as Rust writes them in a string; ends of lines too.
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

/// Control characters, and those that turn the direction of writing round.
fn is_control(char: char) -> bool {
    char.is_control() || matches!(char, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_cannot_move_the_cursor_or_begin_a_line_of_its_own() {
        assert_eq!(printable("bühne 1.toml"), "bühne 1.toml");
        assert_eq!(printable("a\u{1b}[2Jb\nerror: c\r\u{9b}\u{202e}"), r"a\u{1b}[2Jb\nerror: c\r\u{9b}\u{202e}");
        assert_eq!(Printable(Path::new("x\u{7}.svg")).to_string(), r"x\u{7}.svg");
    }
}

//! Colours: only where a terminal shows them, by the rule that clap has for its help and its errors.

use std::fmt::{self, Display};

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
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { text, style } = self;
        write!(f, "{style}{text}{style:#}")
    }
}

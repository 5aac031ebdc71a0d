//! What kind of terminal there is.

use std::env;
use std::io::{self, IsTerminal as _};

use crate::cli::GlyphSet;
use crate::command::BadInput;
use crate::display::watch::{Glyphs, Look, Theme};

/// How this process's terminal is drawn on, with the characters that were asked for.
pub(super) fn look(asked: Option<GlyphSet>) -> Result<Look, BadInput> {
    let (name, is_terminal) = (variable("TERM"), io::stdin().is_terminal() && io::stdout().is_terminal());
    if !is_terminal {
        return Err(BadInput(
            "watch needs a terminal; in a pipe use `bench-dragon hz` or `bench-dragon echo`".to_owned(),
        ));
    }
    if name.is_empty() || name == "dumb" {
        let told = if name.is_empty() { "TERM is not set".to_owned() } else { format!("TERM is {name}") };
        return Err(BadInput(format!(
            "watch needs a terminal that can be drawn on, and {told}; `bench-dragon hz` and `bench-dragon echo` need none"
        )));
    }
    let glyphs = match asked {
        Some(GlyphSet::Braille) => Glyphs::Braille,
        Some(GlyphSet::Blocks) => Glyphs::Blocks,
        Some(GlyphSet::Ascii) => Glyphs::Ascii,
        None => Glyphs::of_terminal(&name, is_utf8()),
    };
    let theme = if variable("NO_COLOR").is_empty() { Theme::Coloured } else { Theme::Plain };
    Ok(Look { theme, glyphs })
}

/// Whether characters are UTF-8, by the first of the locale's variables that says something.
fn is_utf8() -> bool {
    let locale = ["LC_ALL", "LC_CTYPE", "LANG"].map(variable).into_iter().find(|locale| !locale.is_empty());
    locale.is_some_and(|locale| {
        let locale = locale.to_ascii_lowercase();
        locale.contains("utf-8") || locale.contains("utf8")
    })
}

fn variable(name: &str) -> String {
    env::var_os(name).unwrap_or_default().to_string_lossy().into_owned()
}

//! Colours and characters for each kind of terminal.

use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::bar::{NINE_LEVELS, THREE_LEVELS};
use ratatui::symbols::{Marker, bar, border, line};

/// The style of the drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// With colours or without.
    pub theme: Theme,
    /// The set of characters.
    pub glyphs: Glyphs,
}

/// Whether to use colours. Words show the same information.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// The sixteen standard colours, as the user has set them for a light or a dark background.
    #[default]
    Coloured,
    /// No colours: only bold, dim and reversed text.
    Plain,
}

/// The urgency of a text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tone {
    /// Works as expected.
    Good,
    /// For information.
    Calm,
    /// Needs attention.
    Caution,
    /// Needs action.
    Danger,
}

impl Tone {
    fn colour(self) -> Color {
        match self {
            Self::Good => Color::Green,
            Self::Calm => Color::Blue,
            Self::Caution => Color::Yellow,
            Self::Danger => Color::Red,
        }
    }
}

impl Theme {
    /// The colour, or the terminal's default if the theme has no colours.
    pub(super) fn colour(self, colour: Color) -> Color {
        match self {
            Self::Coloured => colour,
            Self::Plain => Color::Reset,
        }
    }

    pub(super) fn text(self, tone: Tone) -> Style {
        let style = Style::new().fg(self.colour(tone.colour()));
        if tone == Tone::Danger { style.add_modifier(Modifier::BOLD) } else { style }
    }

    /// The style of a conspicuous block, filled with the tone's colour.
    pub(super) fn block(self, tone: Tone) -> Style {
        self.text(tone).add_modifier(Modifier::BOLD | Modifier::REVERSED)
    }

    /// The style of labels and explanations.
    pub(super) fn faint(self) -> Style {
        Style::new().fg(self.colour(Color::Gray)).add_modifier(Modifier::DIM)
    }
}

/// The style of the most important text.
pub(super) fn strong() -> Style {
    Style::new().add_modifier(Modifier::BOLD)
}

/// The set of characters.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Glyphs {
    // A cell has two by four dots.
    /// Braille patterns.
    #[default]
    Braille,
    // One by two dots.
    /// Half blocks, which the Linux console has.
    Blocks,
    // One dot.
    /// Only ASCII.
    Ascii,
}

impl Glyphs {
    /// Returns the set for a terminal of this type (`TERM`), with UTF-8 or without.
    ///
    /// ```
    /// use bench_dragon::display::watch::Glyphs;
    ///
    /// assert_eq!(Glyphs::of_terminal("tmux-256color", true), Glyphs::Braille);
    /// assert_eq!(Glyphs::of_terminal("linux", true), Glyphs::Blocks);
    /// assert_eq!(Glyphs::of_terminal("xterm", false), Glyphs::Ascii);
    /// ```
    pub fn of_terminal(terminal: &str, is_utf8: bool) -> Self {
        match (is_utf8, terminal) {
            (false, _) => Self::Ascii,
            (true, "linux") => Self::Blocks,
            (true, _) => Self::Braille,
        }
    }

    /// The marker of the plan's dots.
    pub(super) fn marker(self) -> Marker {
        match self {
            Self::Braille => Marker::Braille,
            Self::Blocks => Marker::HalfBlock,
            Self::Ascii => Marker::Custom('.'),
        }
    }

    /// Number of dots of a cell, across and up.
    pub(super) fn dots(self) -> [u16; 2] {
        match self {
            Self::Braille => [2, 4],
            Self::Blocks => [1, 2],
            Self::Ascii => [1, 1],
        }
    }

    pub(super) fn bars(self) -> bar::Set<'static> {
        match self {
            Self::Braille => NINE_LEVELS,
            Self::Blocks => THREE_LEVELS,
            Self::Ascii => bar::Set {
                full: "#",
                seven_eighths: "#",
                three_quarters: "+",
                five_eighths: "+",
                half: "+",
                three_eighths: "-",
                one_quarter: "-",
                one_eighth: ".",
                empty: " ",
            },
        }
    }

    pub(super) fn border(self) -> border::Set<'static> {
        const ASCII: border::Set<'static> = border::Set {
            top_left: "+",
            top_right: "+",
            bottom_left: "+",
            bottom_right: "+",
            vertical_left: "|",
            vertical_right: "|",
            horizontal_top: "-",
            horizontal_bottom: "-",
        };
        if self == Self::Ascii { ASCII } else { border::PLAIN }
    }

    pub(super) fn signs(self) -> &'static Signs {
        if self == Self::Ascii { &ASCII_SIGNS } else { &UNICODE_SIGNS }
    }
}

/// Characters with a meaning.
pub(super) struct Signs {
    pub(super) head: &'static str,
    /// Marks the nearest pair and the next contact, and means "times".
    pub(super) cross: &'static str,
    /// Points at the current show time.
    pub(super) pointer: &'static str,
    /// Prefix of microseconds.
    pub(super) micro: &'static str,
    /// The four keys that move the plan.
    pub(super) arrows: &'static str,
    /// The left end of a horizontal line, the line itself, and the right end.
    pub(super) span: [&'static str; 3],
    /// Lamps: off, good, warning, danger.
    pub(super) lamps: [&'static str; 4],
    /// States: the head walks, stands or is held, or the show is over.
    pub(super) states: [&'static str; 4],
}

const UNICODE_SIGNS: Signs = Signs {
    head: "\u{25cf}",
    cross: "\u{d7}",
    pointer: "\u{25b2}",
    micro: "\u{b5}",
    arrows: "\u{2190}\u{2191}\u{2193}\u{2192}",
    span: [line::VERTICAL_RIGHT, line::HORIZONTAL, line::VERTICAL_LEFT],
    lamps: ["\u{b7}", "\u{25cf}", "\u{25b2}", "\u{25a0}"],
    states: ["\u{25ba}", "\u{2016}", "\u{25a0}", "\u{25c6}"],
};
const ASCII_SIGNS: Signs = Signs {
    head: "@",
    cross: "x",
    pointer: "^",
    micro: "u",
    arrows: "arrows",
    span: ["|", "-", "|"],
    lamps: ["-", "o", "!", "X"],
    states: [">", "=", "#", "*"],
};

//! Colours and characters, by what a terminal can show.

use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::bar::{NINE_LEVELS, THREE_LEVELS};
use ratatui::symbols::{Marker, bar, border, line};

/// How a terminal is drawn on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Look {
    /// With colours or without.
    pub theme: Theme,
    /// With which characters.
    pub glyphs: Glyphs,
}

/// Whether there are colours. What they say is said in words as well.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Theme {
    /// The sixteen of every terminal, as its owner has set them for a light or a dark background.
    #[default]
    Coloured,
    /// None: bold, dim and reversed text alone.
    Plain,
}

/// What something is to the one who looks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Tone {
    /// As it should be.
    Good,
    /// To be known.
    Calm,
    /// To be kept an eye on.
    Caution,
    /// To be acted upon.
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
    /// A colour, where there are any.
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

    /// A block that is filled with a tone, not to be overlooked.
    pub(super) fn block(self, tone: Tone) -> Style {
        self.text(tone).add_modifier(Modifier::BOLD | Modifier::REVERSED)
    }

    /// What explains something else.
    pub(super) fn faint(self) -> Style {
        Style::new().fg(self.colour(Color::Gray)).add_modifier(Modifier::DIM)
    }
}

/// What is read first.
pub(super) fn strong() -> Style {
    Style::new().add_modifier(Modifier::BOLD)
}

/// Which characters are drawn with.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum Glyphs {
    // A cell has two by four dots.
    /// Braille patterns.
    #[default]
    Braille,
    // One by two dots.
    /// Half blocks, as a console has them.
    Blocks,
    // One dot.
    /// ASCII alone.
    Ascii,
}

impl Glyphs {
    /// What suits a terminal of this type (`TERM`), whose characters are UTF-8 or are not.
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

    /// What the dots of the plan are made of.
    pub(super) fn marker(self) -> Marker {
        match self {
            Self::Braille => Marker::Braille,
            Self::Blocks => Marker::HalfBlock,
            Self::Ascii => Marker::Custom('.'),
        }
    }

    /// Dots of a cell, across and up.
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

/// The characters that stand for something.
pub(super) struct Signs {
    pub(super) head: &'static str,
    /// Marks where benches are nearest to each other or will touch, and stands for "times".
    pub(super) cross: &'static str,
    /// Points at the present.
    pub(super) pointer: &'static str,
    /// Of microseconds.
    pub(super) micro: &'static str,
    /// The four keys that move the plan.
    pub(super) arrows: &'static str,
    /// A horizontal line's ends, and the line between them.
    pub(super) span: [&'static str; 3],
    /// Of lamps: off, good, a warning, danger.
    pub(super) lamps: [&'static str; 4],
    /// Of a head that walks, stands, is held, or is done.
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

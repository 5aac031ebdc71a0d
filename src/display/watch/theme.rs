//! Colours, or what stands in for them.

use ratatui::style::{Color, Modifier, Style};

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

    /// Text of a tone.
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

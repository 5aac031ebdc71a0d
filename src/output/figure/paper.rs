//! Sheets of paper.

use std::str::FromStr;

use glam::DVec2;

/// A size of paper on which a figure fills the sheet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paper {
    /// 841 × 1189 mm.
    A0,
    /// 594 × 841 mm.
    A1,
    /// 420 × 594 mm.
    A2,
    /// 297 × 420 mm.
    A3,
    /// 210 × 297 mm.
    A4,
    /// 8.5 × 11 inches.
    Letter,
    /// 11 × 17 inches.
    Tabloid,
}

/// Room that is left free at each edge, in millimetres: what printers cannot print on.
pub(super) const EDGE: f64 = 10.0;

const INCH: f64 = 25.4;

impl Paper {
    /// Every size.
    pub const ALL: [Self; 7] = [Self::A0, Self::A1, Self::A2, Self::A3, Self::A4, Self::Letter, Self::Tabloid];

    /// What the size is called on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::A0 => "a0",
            Self::A1 => "a1",
            Self::A2 => "a2",
            Self::A3 => "a3",
            Self::A4 => "a4",
            Self::Letter => "letter",
            Self::Tabloid => "tabloid",
        }
    }

    /// Width and height of an upright sheet in millimetres.
    pub(super) fn size(self) -> DVec2 {
        match self {
            Self::A0 => DVec2::new(841.0, 1189.0),
            Self::A1 => DVec2::new(594.0, 841.0),
            Self::A2 => DVec2::new(420.0, 594.0),
            Self::A3 => DVec2::new(297.0, 420.0),
            Self::A4 => DVec2::new(210.0, 297.0),
            Self::Letter => DVec2::new(8.5 * INCH, 11.0 * INCH),
            Self::Tabloid => DVec2::new(11.0 * INCH, 17.0 * INCH),
        }
    }
}

/// Reads a name, in capitals or not.
impl FromStr for Paper {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.into_iter().find(|paper| paper.name().eq_ignore_ascii_case(text));
        found.ok_or_else(|| format!("must be one of {}", Self::ALL.map(Self::name).join(", ")))
    }
}

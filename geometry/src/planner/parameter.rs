//! What a choreographer can vary.

use std::fmt::{self, Display, Formatter};

/// A value that a choreographer can vary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Parameter {
    /// Distance between neighbouring turns of the route, its other measures being held.
    Pitch,
    /// Length of the head's board.
    HeadLength,
    /// Length of every other board.
    BodyLength,
    /// Width of every board.
    Width,
    /// Distance of the hinge holes from the ends of the boards.
    HoleOffset,
    /// Speed of the head: it changes times alone.
    Speed,
}

impl Parameter {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Pitch, Self::HeadLength, Self::BodyLength, Self::Width, Self::HoleOffset, Self::Speed];

    /// The configuration's name of the value.
    pub fn key(self) -> &'static str {
        match self {
            Self::Pitch => "pitch_m",
            Self::HeadLength => "head_length_m",
            Self::BodyLength => "body_length_m",
            Self::Width => "width_m",
            Self::HoleOffset => "hole_offset_m",
            Self::Speed => "speed_mps",
        }
    }

    /// The unit that the value is given in.
    pub fn unit(self) -> &'static str {
        if self == Self::Speed { "m/s" } else { "m" }
    }
}

impl Display for Parameter {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Pitch => "pitch",
            Self::HeadLength => "head length",
            Self::BodyLength => "body length",
            Self::Width => "width",
            Self::HoleOffset => "hole offset",
            Self::Speed => "speed",
        })
    }
}

//! Colours that people with any kind of colour vision tell apart, and that stay apart in grey: Okabe and Ito, "Color
//! Universal Design" (2008).

/// A colour, opaque.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Colour {
    pub(super) red: u8,
    pub(super) green: u8,
    pub(super) blue: u8,
}

impl Colour {
    const fn new(rgb: u32) -> Self {
        let [_, red, green, blue] = rgb.to_be_bytes();
        Self { red, green, blue }
    }
}

pub(super) const BLACK: Colour = Colour::new(0x00_0000);
pub(super) const ORANGE: Colour = Colour::new(0xE6_9F00);
pub(super) const SKY_BLUE: Colour = Colour::new(0x56_B4E9);
pub(super) const GREEN: Colour = Colour::new(0x00_9E73);
pub(super) const BLUE: Colour = Colour::new(0x00_72B2);
pub(super) const VERMILION: Colour = Colour::new(0xD5_5E00);
pub(super) const PURPLE: Colour = Colour::new(0xCC_79A7);

pub(super) const WHITE: Colour = Colour::new(0xFF_FFFF);
/// For an area behind lines: the palette's blue, a fifth of it.
pub(super) const PALE_BLUE: Colour = Colour::new(0xCC_E3F0);
/// For lines that only guide the eye.
pub(super) const LIGHT_GREY: Colour = Colour::new(0xDD_DDDD);
/// For lines behind the data.
pub(super) const GREY: Colour = Colour::new(0x99_9999);

/// For lines in one plot, in this order. The palette's yellow is left out: it is too faint for a line on white.
pub(super) const LINES: [Colour; 7] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY_BLUE, BLACK];

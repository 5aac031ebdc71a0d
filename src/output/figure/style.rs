//! The common style of all figures: colours, dashes, and sizes in millimetres on the printed page.
//!
//! The colours are those of Okabe and Ito, "Color Universal Design" (2008). People with any kind of colour vision can
//! distinguish them. They also differ in grey.

use std::fmt;

/// An opaque colour: red, green, blue.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Colour(pub(super) [u8; 3]);

pub(super) const BLACK: Colour = Colour([0x00, 0x00, 0x00]);
pub(super) const ORANGE: Colour = Colour([0xE6, 0x9F, 0x00]);
pub(super) const SKY_BLUE: Colour = Colour([0x56, 0xB4, 0xE9]);
pub(super) const GREEN: Colour = Colour([0x00, 0x9E, 0x73]);
pub(super) const BLUE: Colour = Colour([0x00, 0x72, 0xB2]);
pub(super) const VERMILION: Colour = Colour([0xD5, 0x5E, 0x00]);
pub(super) const PURPLE: Colour = Colour([0xCC, 0x79, 0xA7]);

pub(super) const WHITE: Colour = Colour([0xFF, 0xFF, 0xFF]);
/// For an area behind lines: a fifth of the palette's blue.
pub(super) const PALE_BLUE: Colour = Colour([0xCC, 0xE3, 0xF0]);
/// For lines that only guide the eye.
pub(super) const LIGHT_GREY: Colour = Colour([0xDD, 0xDD, 0xDD]);
/// For lines behind the data.
pub(super) const GREY: Colour = Colour([0x99, 0x99, 0x99]);

/// For lines in one plot, in this order. The palette's yellow is missing: it is too faint for a line on white.
pub(super) const LINES: [Colour; 7] = [BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY_BLUE, BLACK];

/// Prints a colour as in SVG: `#rrggbb`.
impl fmt::Display for Colour {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self([red, green, blue]) = self;
        write!(formatter, "#{red:02x}{green:02x}{blue:02x}")
    }
}

/// Dashes of a line. They distinguish lines with the same colour.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum LineStyle {
    /// No gaps.
    #[default]
    Solid,
    /// Long dashes.
    Dashed,
    /// Dots.
    Dotted,
    /// Dashes and dots in turn.
    DashDotted,
}

impl LineStyle {
    /// Lengths of dashes and gaps in millimetres, in turn; empty for a line without gaps.
    pub(super) fn lengths(self) -> &'static [f32] {
        match self {
            Self::Solid => &[],
            Self::Dashed => &[2.0, 1.0],
            Self::Dotted => &[0.5, 0.7],
            Self::DashDotted => &[2.0, 0.8, 0.5, 0.8],
        }
    }
}

/// Width of every figure: a page of A4 or letter between its margins.
pub(super) const PAGE_WIDTH: f64 = 160.0;

/// Size of a figure's title: 10 points.
pub(super) const TITLE_SIZE: f64 = 3.5;
/// Size of axis labels and legend entries: 8.5 points.
pub(super) const LABEL_SIZE: f64 = 3.0;
/// Size of the numbers at an axis, and of notes in a plot: 7.5 points.
pub(super) const TICK_SIZE: f64 = 2.65;

pub(super) const LINE_WIDTH: f64 = 0.35;
/// Width of a line that accompanies the data.
pub(super) const FINE_WIDTH: f64 = 0.2;
pub(super) const AXIS_WIDTH: f64 = 0.2;
/// Width of a line that only guides the eye.
pub(super) const GRID_WIDTH: f64 = 0.12;

/// Least distance between two ticks of an x axis.
pub(super) const X_TICK_SPACING: f64 = 11.0;
/// Least distance between two times of day at an x axis.
pub(super) const CLOCK_TICK_SPACING: f64 = 18.0;
/// Least distance between two ticks of a y axis.
pub(super) const Y_TICK_SPACING: f64 = 8.0;
pub(super) const TICK_LENGTH: f64 = 1.0;
/// Distance from the axis down to the middle of its numbers.
pub(super) const X_TICK_DROP: f64 = 3.0;
/// Distance from the axis down to the middle of its label.
pub(super) const X_LABEL_DROP: f64 = 7.5;
/// Distance from the axis to the right end of its numbers.
pub(super) const Y_TICK_GAP: f64 = 1.8;
/// Distance from the numbers to the middle of the axis label.
pub(super) const Y_LABEL_GAP: f64 = 3.0;

/// Room beside a plot for the numbers and the label of its y axis.
pub(super) const LEFT_MARGIN: f64 = 16.0;
/// Room at the right of a plot for half of the last number.
pub(super) const RIGHT_MARGIN: f64 = 4.0;
/// Width of a plot beside its y axis.
pub(super) const PLOT_WIDTH: f64 = PAGE_WIDTH - LEFT_MARGIN - RIGHT_MARGIN;
/// Room below a plot for its numbers and label.
pub(super) const BOTTOM_MARGIN: f64 = 11.0;
/// Distance from the legend to the plots.
pub(super) const LEGEND_GAP: f64 = 1.0;
/// Distance from the numbers and label of an x axis to the plot below.
pub(super) const ROW_GAP: f64 = 4.0;

/// Colour and dashes of the line with an index. They repeat after 21 lines.
pub(super) fn line_look(index: usize) -> (Colour, LineStyle) {
    const DASHES: [LineStyle; 3] = [LineStyle::Solid, LineStyle::Dashed, LineStyle::DashDotted];
    (LINES[index % LINES.len()], DASHES[index % DASHES.len()])
}

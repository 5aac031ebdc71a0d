//! Lines of text as outlines of letters, so that a figure looks the same on every machine, with or without fonts.
//!
//! The outlines are those of Noto Sans 1.04 (Google, Apache License 2.0), for the letters that figures need. Each line of
//! `noto_sans.txt` has a character, its advance width, a blank and its outline as an SVG path. The unit is 1/2048 of the font
//! size; y is up from the baseline.

use std::collections::HashMap;
use std::sync::LazyLock;

use kurbo::{Affine, BezPath, Point, Vec2};

#[derive(Clone, Debug, PartialEq)]
pub(super) struct Text {
    pub(super) words: String,
    /// Font size in millimetres.
    size: f64,
    anchor: Anchor,
    /// Angle of the baseline in radians, clockwise because y is down.
    turn: f64,
}

/// The reference point of a line of text, at half the height of a capital.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Left,
    Middle,
    Right,
}

const OUTLINES: &str = include_str!("noto_sans.txt");
const UNITS_PER_SIZE: f64 = 2048.0;

/// Height of capitals and digits ÷ size.
const CAP_HEIGHT: f64 = 0.714;

struct Glyph {
    advance: f64,
    outline: BezPath,
}

static GLYPHS: LazyLock<HashMap<char, Glyph>> = LazyLock::new(|| OUTLINES.lines().map(parse_line).collect());

impl Text {
    /// A horizontal line of text with its anchor in the middle.
    pub(super) fn new(words: impl Into<String>, size: f64) -> Self {
        Self { words: words.into(), size, anchor: Anchor::Middle, turn: 0.0 }
    }

    pub(super) fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    pub(super) fn turned(self, turn: f64) -> Self {
        Self { turn, ..self }
    }

    pub(super) fn width(&self) -> f64 {
        self.size * width(&self.words)
    }

    /// Returns the outline with its anchor at a point of the page.
    pub(super) fn outline(&self, at: Point) -> BezPath {
        let before_anchor = match self.anchor {
            Anchor::Left => 0.0,
            Anchor::Middle => 0.5 * self.width(),
            Anchor::Right => self.width(),
        };
        let begin = Vec2::new(-before_anchor, 0.5 * CAP_HEIGHT * self.size);
        let place = Affine::translate(at.to_vec2()) * Affine::rotate(self.turn) * Affine::translate(begin);
        place * Affine::scale(self.size) * outline(&self.words)
    }
}

/// Width of a line of text ÷ its size.
pub(super) fn width(text: &str) -> f64 {
    text.chars().map(|char| glyph(char).advance).sum()
}

/// Returns the outline of a line of text at size 1, y down, from the left end of its baseline.
fn outline(text: &str) -> BezPath {
    let mut path = BezPath::new();
    let mut pen = Vec2::ZERO;
    for char in text.chars() {
        let glyph = glyph(char);
        path.extend(Affine::translate(pen) * &glyph.outline);
        pen.x += glyph.advance;
    }
    path
}

pub(super) fn has_glyph(char: char) -> bool {
    GLYPHS.contains_key(&char)
}

/// Glyph of a character; the question mark for a character that is not in the table.
fn glyph(char: char) -> &'static Glyph {
    GLYPHS.get(&char).unwrap_or_else(|| &GLYPHS[&'?'])
}

fn parse_line(line: &str) -> (char, Glyph) {
    let mut chars = line.chars();
    let char = chars.next().expect("a line begins with its character");
    let (advance, path) = chars.as_str().split_once(' ').unwrap_or((chars.as_str(), ""));
    let advance: f64 = advance.parse().expect("the advance width is a number");
    let outline = BezPath::from_svg(path).expect("an outline is an SVG path");
    let to_size = Affine::scale_non_uniform(1.0 / UNITS_PER_SIZE, -1.0 / UNITS_PER_SIZE);
    (char, Glyph { advance: advance / UNITS_PER_SIZE, outline: to_size * outline })
}

#[cfg(test)]
mod tests {
    use kurbo::Shape as _;

    use super::*;

    #[test]
    fn all_printable_ascii_characters_and_all_symbols_of_the_figures_have_a_glyph() {
        for char in (' '..='~').chain("°±²·×÷Δαµ–−≤≥→".chars()) {
            assert!(GLYPHS.contains_key(&char), "{char:?}");
        }
    }

    #[test]
    fn all_digits_have_the_same_width() {
        for digit in '0'..='9' {
            assert_eq!(glyph(digit).advance, glyph('0').advance, "{digit}");
        }
    }

    #[test]
    fn capitals_stand_on_the_baseline_and_have_the_capital_height() {
        let capital = outline("H").bounding_box();
        assert_eq!(capital.y1, 0.0);
        assert!((-capital.y0 - CAP_HEIGHT).abs() < 1e-3, "{}", -capital.y0);
    }
}

//! Letters as outlines, so that a figure looks the same on every machine, with fonts or without.
//!
//! The outlines are those of Noto Sans 1.04 (Google, Apache License 2.0), as far as the figures need them. Each line of
//! `noto_sans.txt` is a character, its advance width, a blank and its outline as an SVG path of M, L, Q and Z, in units
//! of which 2048 are the size of the font, y up from the baseline.

use std::collections::HashMap;
use std::sync::LazyLock;

use glam::DVec2;

use super::path::{Path, Step};

const OUTLINES: &str = include_str!("noto_sans.txt");
const UNITS_PER_SIZE: f64 = 2048.0;

/// Height of capitals and digits ÷ size.
pub(super) const CAP_HEIGHT: f64 = 0.714;

struct Glyph {
    advance: f64,
    outline: Path,
}

static GLYPHS: LazyLock<HashMap<char, Glyph>> = LazyLock::new(|| OUTLINES.lines().map(parse_line).collect());

/// Width of a line of text ÷ its size.
pub(super) fn width(text: &str) -> f64 {
    text.chars().map(|char| glyph(char).advance).sum()
}

/// The outline of a line of text at size 1, y down, from the left end of its baseline.
pub(super) fn outline(text: &str) -> Path {
    let mut path = Path::default();
    let mut pen = DVec2::ZERO;
    for char in text.chars() {
        let glyph = glyph(char);
        path.push(&glyph.outline.map(|point| pen + point));
        pen.x += glyph.advance;
    }
    path
}

/// Whether the table has a glyph for a character.
pub(super) fn has(char: char) -> bool {
    GLYPHS.contains_key(&char)
}

/// The character's glyph; a question mark's where the table has none.
fn glyph(char: char) -> &'static Glyph {
    GLYPHS.get(&char).unwrap_or_else(|| &GLYPHS[&'?'])
}

fn parse_line(line: &str) -> (char, Glyph) {
    let mut chars = line.chars();
    let char = chars.next().expect("a line begins with its character");
    let (advance, path) = chars.as_str().split_once(' ').unwrap_or((chars.as_str(), ""));
    let advance: f64 = advance.parse().expect("the advance width is a number");
    (char, Glyph { advance: advance / UNITS_PER_SIZE, outline: parse_path(path) })
}

fn parse_path(path: &str) -> Path {
    let mut outline = Path::default();
    for (at, command) in path.char_indices().filter(|(_, char)| char.is_ascii_alphabetic()) {
        let numbers = &path[at + 1..];
        let end = numbers.find(|char: char| char.is_ascii_alphabetic()).unwrap_or(numbers.len());
        outline.steps.push(parse_step(command, &numbers[..end]));
    }
    outline
}

fn parse_step(command: char, numbers: &str) -> Step {
    let numbers: Vec<f64> =
        numbers.split_whitespace().map(|number| number.parse().expect("a coordinate is a number")).collect();
    let point = |index: usize| DVec2::new(numbers[index], -numbers[index + 1]) / UNITS_PER_SIZE;
    match command {
        'M' => Step::Move(point(0)),
        'L' => Step::Line(point(0)),
        'Q' => Step::Curve(point(0), point(2)),
        'Z' => Step::Close,
        other => panic!("the table of outlines has a step {other}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_ascii_character_and_every_sign_of_the_figures_has_a_glyph() {
        for char in (' '..='~').chain("°±²·×÷Δαµ–−≤≥→".chars()) {
            assert!(GLYPHS.contains_key(&char), "{char:?}");
        }
    }

    #[test]
    fn digits_are_all_as_wide_as_each_other() {
        for digit in '0'..='9' {
            assert_eq!(glyph(digit).advance, glyph('0').advance, "{digit}");
        }
    }

    #[test]
    fn a_capital_stands_on_the_baseline_and_is_as_high_as_capitals_are() {
        let heights = outline("H").steps.into_iter().filter_map(|step| match step {
            Step::Move(end) | Step::Line(end) | Step::Curve(_, end) => Some(-end.y),
            Step::Close => None,
        });
        let (lowest, highest) = heights.fold((f64::MAX, f64::MIN), |(low, high), y| (low.min(y), high.max(y)));
        assert_eq!(lowest, 0.0);
        assert!((highest - CAP_HEIGHT).abs() < 1e-3, "{highest}");
    }
}

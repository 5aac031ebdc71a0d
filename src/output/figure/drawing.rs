//! A drawing: marks on a page.

use std::f64::consts::FRAC_PI_2;

use glam::{DVec2, Vec2Swizzles as _};

use super::font;
use super::mark::Mark;
use super::palette::BLACK;
use super::paper::{EDGE, Paper};
use super::path::{Path, Rect};
use super::{FigureFormat, png, svg};

/// A finished figure: marks on a white page, the later ones over the earlier ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    title: String,
    size: DVec2,
    sheet: Sheet,
    marks: Vec<Mark>,
}

/// The sheet that a drawing is printed on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Sheet {
    /// What lies on it, in millimetres of the drawing.
    pub(super) area: Rect,
    /// How much larger the drawing is printed.
    pub(super) scale: f64,
}

/// A line of text.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Text {
    words: String,
    /// Millimetres.
    size: f64,
    anchor: Anchor,
    /// Angle of the baseline in radians, clockwise as y is down.
    turn: f64,
}

/// The point of a line of text that is put in place; its height is the middle of a capital.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Left,
    Middle,
    Right,
}

impl Drawing {
    /// An empty page of a size in millimetres.
    pub(super) fn new(title: &str, size: DVec2) -> Self {
        let sheet = Sheet { area: Rect { min: DVec2::ZERO, max: size }, scale: 1.0 };
        Self { title: title.to_owned(), size, sheet, marks: Vec::new() }
    }

    /// The drawing on a sheet of paper, as large as the sheet holds it, upright or across.
    #[must_use]
    pub fn on_paper(self, paper: Paper) -> Self {
        let fit = |sheet: DVec2| ((sheet - 2.0 * EDGE) / self.size).min_element();
        let [upright, across] = [paper.size(), paper.size().yx()];
        let sheet = if fit(across) > fit(upright) { across } else { upright };
        let scale = fit(sheet);
        let free = sheet / scale - self.size;
        let area = Rect { min: -0.5 * free, max: self.size + 0.5 * free };
        Self { sheet: Sheet { area, scale }, ..self }
    }

    /// The bytes of a file. Equal drawings give equal bytes.
    pub fn encode(&self, format: FigureFormat) -> Vec<u8> {
        match format {
            FigureFormat::Svg => svg::document(self).into_bytes(),
            FigureFormat::Png => png::file(self),
        }
    }

    pub(super) fn title(&self) -> &str {
        &self.title
    }

    pub(super) fn sheet(&self) -> Sheet {
        self.sheet
    }

    pub(super) fn marks(&self) -> &[Mark] {
        &self.marks
    }

    /// Adds a mark over all others, unless nothing of it is to be seen.
    pub(super) fn push(&mut self, mark: Mark) {
        if mark.clip.is_none_or(|clip| mark.path.bounds().is_some_and(|bounds| clip.overlaps(&bounds))) {
            self.marks.push(mark);
        }
    }

    /// Adds a line of text over all others.
    pub(super) fn write(&mut self, text: &Text, at: DVec2) {
        self.push(Mark::filled(text.outline(at), BLACK).labelled(text.words.as_str()));
    }
}

impl Text {
    /// A level line of text, put in place by its middle.
    pub(super) fn new(words: impl Into<String>, size: f64) -> Self {
        Self { words: words.into(), size, anchor: Anchor::Middle, turn: 0.0 }
    }

    pub(super) fn anchored(self, anchor: Anchor) -> Self {
        Self { anchor, ..self }
    }

    /// The text read upwards.
    pub(super) fn upwards(self) -> Self {
        self.turned(-FRAC_PI_2)
    }

    pub(super) fn turned(self, turn: f64) -> Self {
        Self { turn, ..self }
    }

    pub(super) fn width(&self) -> f64 {
        self.size * font::width(&self.words)
    }

    fn outline(&self, at: DVec2) -> Path {
        let begin = DVec2::new(-self.before_anchor(), 0.5 * font::CAP_HEIGHT * self.size);
        let turn = DVec2::from_angle(self.turn);
        font::outline(&self.words).map(|point| at + turn.rotate(begin + self.size * point))
    }

    /// Millimetres of text to the left of its anchor.
    fn before_anchor(&self) -> f64 {
        match self.anchor {
            Anchor::Left => 0.0,
            Anchor::Middle => 0.5 * self.width(),
            Anchor::Right => self.width(),
        }
    }
}

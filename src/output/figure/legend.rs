//! A legend: what colours and dashes stand for, in rows above the data.

use glam::DVec2;

use super::drawing::{Anchor, Drawing, Text};
use super::font;
use super::mark::{LineStyle, Mark};
use super::palette::{BLACK, Colour};
use super::path::{Path, Rect};
use super::style::{FINE_WIDTH, LABEL_SIZE};

/// What is named, and how it is drawn.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Entry {
    pub(super) sample: Sample,
    pub(super) words: String,
}

/// How something is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sample {
    Line { colour: Colour, width: f64, style: LineStyle },
    Area(Colour),
    Dot { colour: Colour, radius: f64 },
    Ring { colour: Colour, radius: f64 },
}

const ROW_HEIGHT: f64 = 5.0;
const SAMPLE_WIDTH: f64 = 7.0;
const DOT_SAMPLE_WIDTH: f64 = 2.0;
const SAMPLE_GAP: f64 = 1.5;
const ENTRY_GAP: f64 = 5.0;

impl Entry {
    pub(super) fn new(sample: Sample, words: impl Into<String>) -> Self {
        Self { sample, words: words.into() }
    }

    fn width(&self) -> f64 {
        self.sample.width() + SAMPLE_GAP + LABEL_SIZE * font::width(&self.words)
    }

    fn draw(&self, drawing: &mut Drawing, at: DVec2) {
        let end = at + self.sample.width() * DVec2::X;
        let middle = at.midpoint(end);
        drawing.push(match self.sample {
            Sample::Line { colour, width, style } => Mark::stroked(Path::line([at, end]), colour, width).styled(style),
            Sample::Area(colour) => {
                let area = Rect { min: at - DVec2::Y, max: end + DVec2::Y };
                Mark::filled(area.path(), colour).outlined(BLACK, FINE_WIDTH)
            }
            Sample::Dot { colour, radius } => Mark::filled(Path::circle(middle, radius), colour),
            Sample::Ring { colour, radius } => Mark::stroked(Path::circle(middle, radius), colour, FINE_WIDTH),
        });
        let text = Text::new(self.words.as_str(), LABEL_SIZE).anchored(Anchor::Left);
        drawing.write(&text, end + SAMPLE_GAP * DVec2::X);
    }
}

impl Sample {
    fn width(self) -> f64 {
        match self {
            Self::Line { .. } | Self::Area(_) => SAMPLE_WIDTH,
            Self::Dot { .. } | Self::Ring { .. } => DOT_SAMPLE_WIDTH,
        }
    }
}

/// Height of the rows that the entries take in a given width.
pub(super) fn height(entries: &[Entry], width: f64) -> f64 {
    rows(entries, width).len() as f64 * ROW_HEIGHT
}

/// Draws the entries in rows from the upper left corner on.
pub(super) fn draw(drawing: &mut Drawing, entries: &[Entry], corner: DVec2, width: f64) {
    for (row, number) in rows(entries, width).into_iter().zip(0..) {
        let mut at = corner + ROW_HEIGHT * (f64::from(number) + 0.5) * DVec2::Y;
        for entry in row {
            entry.draw(drawing, at);
            at.x += entry.width() + ENTRY_GAP;
        }
    }
}

/// As many entries to a row as it holds, one at least.
fn rows(entries: &[Entry], width: f64) -> Vec<Vec<&Entry>> {
    let mut rows: Vec<Vec<&Entry>> = Vec::new();
    let mut left = 0.0;
    for entry in entries {
        let needed = entry.width();
        match rows.last_mut() {
            Some(row) if needed <= left => row.push(entry),
            _ => {
                rows.push(vec![entry]);
                left = width;
            }
        }
        left -= needed + ENTRY_GAP;
    }
    rows
}

//! The page of a figure: its caption, its legend, and the room for its plots.

use kurbo::{Point, Rect, Shape as _, Size};

use super::drawing::{Drawing, Mark, circle, polyline};
use super::stage::hatching;
use super::style::{
    BLACK, Colour, FINE_WIDTH, LABEL_SIZE, LEFT_MARGIN, LEGEND_GAP, LineStyle, PAGE_WIDTH, PLOT_WIDTH, TICK_SIZE,
    TITLE_SIZE,
};
use super::text::{self, Anchor, Text, has_glyph};

/// The words above a figure, from the largest to the smallest: its heading, its title and its facts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Caption {
    /// Large words above the title, such as the name of the show. Words wider than the figure are drawn smaller. For letters
    /// that cannot be drawn, see [`missing_letter`].
    pub heading: Option<String>,
    /// Subject of the figure.
    pub title: String,
    /// Facts about the drawn dragon, under the title in small print.
    pub facts: Vec<String>,
}

/// An entry of a legend: a name, and a sample of its line, area or dot.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LegendEntry {
    pub(super) swatch: Swatch,
    pub(super) words: String,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Swatch {
    Line { colour: Colour, width: f64, style: LineStyle },
    Area(Colour),
    Hatched,
    Dot { colour: Colour, radius: f64 },
    Ring { colour: Colour, radius: f64 },
}

/// Size of a heading: 16 points.
const HEADING_SIZE: f64 = 5.6;
/// Distances from the top of the page, or from the line above, to the middle of a line.
const FIRST_DROP: f64 = 5.0;
const TITLE_DROP: f64 = 7.0;
const FACTS_DROP: f64 = 4.6;
/// Distance from the middle of the last line to the legend.
const BOTTOM_GAP: f64 = 3.6;
/// Separator of two facts in a line.
const SEPARATOR: &str = " · ";

const ROW_HEIGHT: f64 = 5.0;
const SWATCH_WIDTH: f64 = 7.0;
const DOT_SWATCH_WIDTH: f64 = 2.0;
const SWATCH_GAP: f64 = 1.5;
const ENTRY_GAP: f64 = 5.0;

/// Returns a page with its caption and its legend, and the top of an area of `height` below them.
pub(super) fn page(caption: &Caption, entries: &[LegendEntry], height: f64) -> (Drawing, f64) {
    let rows = rows_of(entries, LegendEntry::width, ENTRY_GAP);
    let top = caption.height() + rows.len() as f64 * ROW_HEIGHT + LEGEND_GAP;
    let mut drawing = Drawing::new(caption.name(), Size::new(PAGE_WIDTH, top + height));
    for (text, drop) in caption.lines() {
        drawing.write(&text, Point::new(LEFT_MARGIN, drop));
    }
    for (row, number) in rows.into_iter().zip(0..) {
        let mut at = Point::new(LEFT_MARGIN, caption.height() + ROW_HEIGHT * (f64::from(number) + 0.5));
        for entry in row {
            entry.draw(&mut drawing, at);
            at.x += entry.width() + ENTRY_GAP;
        }
    }
    (drawing, top)
}

impl Caption {
    /// A caption with a title only.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// Heading and title, for people who cannot see the figure.
    fn name(&self) -> String {
        match &self.heading {
            Some(heading) => format!("{heading}: {}", self.title),
            None => self.title.clone(),
        }
    }

    fn height(&self) -> f64 {
        self.lines().last().map_or(0.0, |(_, drop)| drop + BOTTOM_GAP)
    }

    /// Returns the lines, with the distance of their middles from the top of the page.
    fn lines(&self) -> Vec<(Text, f64)> {
        let mut lines: Vec<(Text, f64)> = Vec::new();
        let mut add = |words: &str, size: f64, drop: f64| {
            let drop = lines.last().map_or(FIRST_DROP, |(_, above)| above + drop);
            lines.push((Text::new(words, fitting(words, size)).anchored(Anchor::Left), drop));
        };
        if let Some(heading) = &self.heading {
            add(heading, HEADING_SIZE, 0.0);
        }
        add(&self.title, TITLE_SIZE, TITLE_DROP);
        let width = |words: &str| TICK_SIZE * text::width(words);
        for facts in rows_of(&self.facts, |fact| width(fact), width(SEPARATOR)) {
            let facts: Vec<&str> = facts.into_iter().map(String::as_str).collect();
            add(&facts.join(SEPARATOR), TICK_SIZE, FACTS_DROP);
        }
        lines
    }
}

/// Returns the first letter without an outline. Figures draw a question mark instead of such a letter.
///
/// ```
/// use bench_dragon::output::figure::missing_letter;
///
/// assert_eq!(missing_letter("Dragon of 2026, 223 benches"), None);
/// assert_eq!(missing_letter("板凳龙"), Some('板'));
/// ```
pub fn missing_letter(words: &str) -> Option<char> {
    words.chars().find(|letter| !has_glyph(*letter))
}

/// Returns the given font size, or the smaller one at which the words are as wide as a plot.
fn fitting(words: &str, size: f64) -> f64 {
    size.min(PLOT_WIDTH / text::width(words).max(f64::MIN_POSITIVE))
}

impl LegendEntry {
    pub(super) fn new(swatch: Swatch, words: impl Into<String>) -> Self {
        Self { swatch, words: words.into() }
    }

    fn width(&self) -> f64 {
        self.swatch.width() + SWATCH_GAP + LABEL_SIZE * text::width(&self.words)
    }

    fn draw(&self, drawing: &mut Drawing, at: Point) {
        let end = at + (self.swatch.width(), 0.0);
        let middle = at.midpoint(end);
        drawing.push(match self.swatch {
            Swatch::Line { colour, width, style } => Mark::stroked(polyline([at, end]), colour, width).styled(style),
            Swatch::Area(colour) => {
                let area = Rect::from_points(at - (0.0, 1.0), end + (0.0, 1.0));
                Mark::filled(area.to_path(0.0), colour).outlined(BLACK, FINE_WIDTH)
            }
            Swatch::Hatched => {
                let area = Rect::from_points(at - (0.0, 1.0), end + (0.0, 1.0));
                let corners = [(area.x0, area.y0), (area.x1, area.y0), (area.x1, area.y1), (area.x0, area.y1)];
                let mut lines = hatching(&corners.map(Point::from));
                lines.extend(area.to_path(0.0));
                Mark::stroked(lines, BLACK, FINE_WIDTH)
            }
            Swatch::Dot { colour, radius } => Mark::filled(circle(middle, radius), colour),
            Swatch::Ring { colour, radius } => Mark::stroked(circle(middle, radius), colour, FINE_WIDTH),
        });
        let text = Text::new(self.words.as_str(), LABEL_SIZE).anchored(Anchor::Left);
        drawing.write(&text, end + (SWATCH_GAP, 0.0));
    }
}

impl Swatch {
    fn width(self) -> f64 {
        match self {
            Self::Line { .. } | Self::Area(_) | Self::Hatched => SWATCH_WIDTH,
            Self::Dot { .. } | Self::Ring { .. } => DOT_SWATCH_WIDTH,
        }
    }
}

/// Groups items into rows of at most a plot's width, with at least one item per row.
fn rows_of<T>(items: &[T], width: impl Fn(&T) -> f64, gap: f64) -> Vec<Vec<&T>> {
    let mut rows: Vec<Vec<&T>> = Vec::new();
    let mut left = 0.0;
    for item in items {
        let needed = width(item);
        match rows.last_mut() {
            Some(row) if needed <= left => row.push(item),
            _ => {
                rows.push(vec![item]);
                left = PLOT_WIDTH;
            }
        }
        left -= needed + gap;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_words_never_make_a_line_wider_than_a_plot() {
        let facts = (0..20).map(|fact| format!("fact number {fact}")).collect();
        let caption = Caption { heading: Some("W".repeat(200)), title: "W".repeat(100), facts };
        let lines = caption.lines();
        assert!(lines.len() > 3, "{lines:?}");
        for (text, _) in &lines {
            assert!(text.width() <= PLOT_WIDTH * 1.000_001, "{text:?} is {} mm wide", text.width());
        }
        assert!(lines.windows(2).all(|two| two[0].1 < two[1].1) && caption.height() > lines[lines.len() - 1].1);
    }

    #[test]
    fn caption_without_heading_and_facts_is_its_title() {
        let caption = Caption::new("The dragon at 300 s");
        assert_eq!((caption.lines().len(), caption.name().as_str()), (1, "The dragon at 300 s"));
        let caption = Caption { heading: Some("Dragon of 2026".to_owned()), ..caption };
        assert_eq!((caption.lines().len(), caption.name().as_str()), (2, "Dragon of 2026: The dragon at 300 s"));
    }
}

//! The words over a figure.

use glam::DVec2;

use super::drawing::{Anchor, Drawing, Text};
use super::font;
use super::style::{LEFT_MARGIN, PLOT_WIDTH, TICK_SIZE, TITLE_SIZE};

/// The words over a figure, from the largest to the smallest: its heading, its title and its facts.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Caption {
    heading: Option<String>,
    title: String,
    facts: Vec<String>,
}

/// Size of a heading: 16 points.
const HEADING_SIZE: f64 = 5.6;
/// From the page's top, or from the line above, to the middle of a line.
const FIRST_DROP: f64 = 5.0;
const TITLE_DROP: f64 = 7.0;
const FACTS_DROP: f64 = 4.6;
/// From the middle of the last line to what comes below.
const BOTTOM_GAP: f64 = 3.6;
/// Between two facts of a line.
const SEPARATOR: &str = " · ";

impl Caption {
    /// A caption that says what the figure shows.
    pub fn new(title: impl Into<String>) -> Self {
        Self { title: title.into(), ..Self::default() }
    }

    /// The caption with large words over its title, such as the name of the show.
    ///
    /// They are drawn smaller where they would be wider than the figure. For letters that cannot be drawn see
    /// [`missing_letter`].
    #[must_use]
    pub fn with_heading(self, heading: Option<String>) -> Self {
        Self { heading, ..self }
    }

    /// The caption with facts under its title, in small print: what the figure is drawn for.
    #[must_use]
    pub fn with_facts(self, facts: Vec<String>) -> Self {
        Self { facts, ..self }
    }

    /// All that it says in large words, for those who cannot see the figure.
    pub(super) fn name(&self) -> String {
        match &self.heading {
            Some(heading) => format!("{heading}: {}", self.title),
            None => self.title.clone(),
        }
    }

    /// Height that it takes of a page.
    pub(super) fn height(&self) -> f64 {
        self.lines().last().map_or(0.0, |(_, drop)| drop + BOTTOM_GAP)
    }

    pub(super) fn draw(&self, drawing: &mut Drawing) {
        for (text, drop) in self.lines() {
            drawing.write(&text, DVec2::new(LEFT_MARGIN, drop));
        }
    }

    /// The lines, and where their middles are below the page's top.
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
        for line in joined(&self.facts) {
            add(&line, TICK_SIZE, FACTS_DROP);
        }
        lines
    }
}

/// The first letter of some words that figures have no outline of; they draw a question mark in its place.
///
/// ```
/// use bench_dragon::output::figure::missing_letter;
///
/// assert_eq!(missing_letter("Dragon of 2026, 223 benches"), None);
/// assert_eq!(missing_letter("板凳龙"), Some('板'));
/// ```
pub fn missing_letter(words: &str) -> Option<char> {
    words.chars().find(|letter| !font::has(*letter))
}

/// The size at which words are as wide as a plot, or a given smaller one.
fn fitting(words: &str, size: f64) -> f64 {
    size.min(PLOT_WIDTH / font::width(words).max(f64::MIN_POSITIVE))
}

/// As many facts to a line as it holds, one at least.
fn joined(facts: &[String]) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for fact in facts {
        let longer = lines.last().map(|line| format!("{line}{SEPARATOR}{fact}"));
        match longer.filter(|longer| TICK_SIZE * font::width(longer) <= PLOT_WIDTH) {
            Some(longer) => *lines.last_mut().expect("a line was made longer") = longer,
            None => lines.push(fact.clone()),
        }
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_line_is_wider_than_a_plot_however_long_its_words() {
        let facts = (0..20).map(|fact| format!("fact number {fact}")).collect();
        let caption = Caption::new("W".repeat(100)).with_heading(Some("W".repeat(200))).with_facts(facts);
        let lines = caption.lines();
        assert!(lines.len() > 3, "{lines:?}");
        for (text, _) in &lines {
            assert!(text.width() <= PLOT_WIDTH * 1.000_001, "{text:?} is {} mm wide", text.width());
        }
        assert!(lines.windows(2).all(|two| two[0].1 < two[1].1) && caption.height() > lines[lines.len() - 1].1);
    }

    #[test]
    fn a_caption_without_heading_and_facts_is_its_title() {
        let caption = Caption::new("The dragon at 300 s");
        assert_eq!((caption.lines().len(), caption.name().as_str()), (1, "The dragon at 300 s"));
        let caption = caption.with_heading(Some("Dragon of 2026".to_owned()));
        assert_eq!((caption.lines().len(), caption.name().as_str()), (2, "Dragon of 2026: The dragon at 300 s"));
    }
}

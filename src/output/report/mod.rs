//! Reports for people: sections in, one printable HTML file out.
//!
//! A [`Report`] is plain data: words, tables and figures. Its HTML has everything in it (style, pictures), loads nothing, and
//! runs no script. All words are escaped. Printed, it fills pages of A4.

mod html;

use crate::output::figure::Drawing;

/// A report. Its first page has the title, the verdict, and the sections up to the first one that begins a page.
#[derive(Clone, Debug)]
pub struct Report {
    /// The kind of report, in a few words above the title, and in the title of the browser's window.
    pub kind: String,
    /// The title: the name of what is reported.
    pub title: String,
    /// Words under the title, such as the date.
    pub subtitle: String,
    /// The result in a sentence.
    pub verdict: Verdict,
    /// The sections, in order.
    pub sections: Vec<Section>,
    /// How much fits on a page.
    pub layout: Layout,
    /// A report on the first page, before this one.
    pub cover: Option<Box<Report>>,
}

/// How much fits on a printed page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// As many pages as needed.
    #[default]
    Pages,
    /// One page, in smaller print.
    Sheet,
}

/// A result in a sentence, with its weight.
#[derive(Clone, Debug, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names of the fields describe them")]
pub struct Verdict {
    pub weight: Weight,
    pub words: String,
}

/// The weight of a fact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Weight {
    /// As it should be, or without judgement.
    #[default]
    Good,
    /// Worth a look.
    Attention,
    /// Something went wrong.
    Danger,
}

/// A section of a report.
#[derive(Clone, Debug, Default)]
pub struct Section {
    /// The heading; empty for a section without one.
    pub heading: String,
    /// Whether the section begins a page in print.
    pub begins_page: bool,
    /// The contents, in order.
    pub blocks: Vec<Block>,
}

/// A part of a section.
#[derive(Clone, Debug)]
pub enum Block {
    /// A paragraph.
    Words(String),
    /// The most important facts, in large print.
    Tiles(Vec<Fact>),
    /// Facts, a line each.
    Facts(Vec<Fact>),
    /// A picture, with words for people who cannot see it.
    Figure(Drawing, String),
    /// A table.
    Table(Table),
    /// Text with its own line breaks, such as a configuration.
    Text(String),
    /// Sentences with a box each, to tick by hand.
    Ticks(Vec<String>),
    /// Names of the lines to fill in by hand, side by side.
    ToSign(Vec<String>),
}

/// A fact: its name, its value, and more words about it.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
#[expect(missing_docs, reason = "the names of the fields describe them")]
pub struct Fact {
    pub name: String,
    pub value: String,
    pub more: String,
    pub weight: Weight,
}

/// A table: a heading for each column, and rows with a cell for each column.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Table {
    /// Names of the columns. Numbers, in columns whose name is in [`Table::numbers`], are aligned at the right.
    pub columns: Vec<&'static str>,
    /// Names of the columns with numbers.
    pub numbers: Vec<&'static str>,
    /// The cells, row by row.
    pub rows: Vec<Vec<String>>,
    /// Words in place of a table without rows.
    pub empty: String,
    /// Number of rows that were left out, with words for them; none for a whole table.
    pub left_out: Option<String>,
}

impl Fact {
    /// A fact without more words.
    pub fn new(name: impl Into<String>, value: impl Into<String>) -> Self {
        Self { name: name.into(), value: value.into(), ..Self::default() }
    }

    /// Adds words.
    #[must_use]
    pub fn more(self, more: impl Into<String>) -> Self {
        Self { more: more.into(), ..self }
    }

    /// Adds a weight if a condition holds.
    #[must_use]
    pub fn weighs(self, weight: Weight, holds: bool) -> Self {
        if holds { Self { weight, ..self } } else { self }
    }
}

impl Report {
    /// The report as an HTML file.
    ///
    /// ```
    /// use bench_dragon::output::report::{Layout, Report, Verdict, Weight};
    ///
    /// let report = Report {
    ///     kind: "Report of a show".to_owned(),
    ///     title: "<tonight>".to_owned(),
    ///     subtitle: String::new(),
    ///     verdict: Verdict { weight: Weight::Good, words: "It ended as planned.".to_owned() },
    ///     sections: Vec::new(),
    ///     layout: Layout::Pages,
    ///     cover: None,
    /// };
    /// assert!(report.html().contains("<h1>&lt;tonight&gt;</h1>"));
    /// ```
    pub fn html(&self) -> String {
        html::page(self).into_string()
    }
}

//! Tables: answers in rows and columns, for people and for the programs that they go on working with.
//!
//! A [`Table`] knows nothing of files. An [`Exporter`] turns tables into the bytes of one, the same bytes each time:
//! [`Text`] for people, [`Csv`] for programs, [`Xlsx`] for spreadsheets. [`CsvWriter`] takes row after row, for a table
//! that is not to be in memory as a whole; so does a workbook that is in files until it is finished.

mod book;
mod csv;
mod text;
mod xlsx;

pub(crate) use book::Book;
pub use csv::{Csv, CsvWriter};
pub use text::Text;
pub use xlsx::Xlsx;

/// Rows under titled columns.
///
/// ```
/// use bench_dragon::output::table::{Cell, Column, Csv, Exporter, Table};
///
/// let columns = vec![Column::text("handle"), Column::number("speed_mps", 6)];
/// let mut table = Table::new("speeds", columns);
/// table.push(vec![Cell::from("head"), Cell::from(1.0)]);
/// assert_eq!(Csv.export(&[table])?, b"handle,speed_mps\nhead,1.0\n");
/// # Ok::<(), bench_dragon::output::table::ExportError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    name: String,
    columns: Vec<Column>,
    rows: Vec<Vec<Cell>>,
}

/// A column's title, and how its numbers are shown.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    title: String,
    kind: Kind,
}

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Text,
    Whole,
    Number { decimals: usize },
}

/// What stands in a row under one column.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Nothing: there is no answer.
    Blank,
    /// Words.
    Text(String),
    /// A count or an index.
    Whole(u64),
    /// A number, whole. Exporters for people round it to the column's decimals.
    Number(f64),
}

/// Turns tables into the bytes of a file. Equal tables give equal bytes.
pub trait Exporter {
    /// The tables, one behind the other.
    ///
    /// # Errors
    /// The tables must fit into the format.
    fn export(&self, tables: &[Table]) -> Result<Vec<u8>, ExportError>;
}

/// Why tables cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// The format has no room for it.
    #[error("the table \"{table}\" has {count} {what}, a sheet has at most {most}")]
    TooLarge {
        /// The table's name.
        table: String,
        /// Rows or columns.
        what: &'static str,
        /// How many.
        count: usize,
        /// How many there may be.
        most: usize,
    },
    /// The workbook's writer refused.
    #[error(transparent)]
    Workbook(#[from] rust_xlsxwriter::XlsxError),
}

impl Table {
    /// A table without rows. Its name is short: a spreadsheet shows the first 31 letters.
    pub fn new(name: impl Into<String>, columns: Vec<Column>) -> Self {
        Self { name: name.into(), columns, rows: Vec::new() }
    }

    /// Adds a row.
    ///
    /// # Panics
    /// It must have a cell under each column.
    pub fn push(&mut self, row: Vec<Cell>) {
        assert_eq!(row.len(), self.columns.len(), "a row of \"{}\" has a cell under each column", self.name);
        self.rows.push(row);
    }
}

impl Column {
    /// A column of words.
    pub fn text(title: impl Into<String>) -> Self {
        Self { title: title.into(), kind: Kind::Text }
    }

    /// A column of counts or indices.
    pub fn whole(title: impl Into<String>) -> Self {
        Self { title: title.into(), kind: Kind::Whole }
    }

    /// A column of numbers, of which people see this many decimals.
    pub fn number(title: impl Into<String>, decimals: usize) -> Self {
        Self { title: title.into(), kind: Kind::Number { decimals } }
    }

    /// Decimals that people see.
    fn decimals(&self) -> usize {
        if let Kind::Number { decimals } = self.kind { decimals } else { 0 }
    }
}

impl From<&str> for Cell {
    fn from(text: &str) -> Self {
        Self::Text(text.to_owned())
    }
}

impl From<String> for Cell {
    fn from(text: String) -> Self {
        Self::Text(text)
    }
}

impl From<usize> for Cell {
    fn from(whole: usize) -> Self {
        Self::Whole(whole as u64)
    }
}

impl From<f64> for Cell {
    fn from(number: f64) -> Self {
        Self::Number(number)
    }
}

impl From<Option<f64>> for Cell {
    fn from(number: Option<f64>) -> Self {
        number.map_or(Self::Blank, Self::Number)
    }
}

/// A number rounded to decimals as it prints, without the sign of a zero that has nothing but zeros.
fn rounded(number: f64, decimals: usize) -> f64 {
    let text = format!("{number:.decimals$}");
    text.parse::<f64>().expect("a printed number reads back") + 0.0
}

//! Tables: answers in rows and columns, for people and for other programs.
//!
//! A [`Table`] is independent of file formats. [`text`] is for people, [`csv()`] for programs, `workbook` for spreadsheets. Equal
//! tables give equal bytes. `CsvWriter` and `Book` take one row at a time, for a table that does not fit into memory.

use std::io::{self, Write};

pub(crate) use super::workbook::{Book, MAX_COLUMNS, MAX_ROWS, WorkbookError, workbook};

/// A table: rows under titled columns.
///
/// ```
/// use bench_dragon::output::table::{Cell, Column, Table, csv};
///
/// let columns = vec![Column::text("handle"), Column::number("speed_mps", 6)];
/// let mut table = Table::new("speeds", columns);
/// table.push(vec![Cell::from("head"), Cell::from(1.0)]);
/// assert_eq!(csv(&[table]), b"handle,speed_mps\nhead,1.0\n");
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    pub(super) name: String,
    pub(super) columns: Vec<Column>,
    pub(super) rows: Vec<Vec<Cell>>,
}

/// A column: its title, and the format of its numbers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    pub(super) title: String,
    pub(super) kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Text,
    Whole,
    Number { decimals: usize },
}

/// The contents of a row in one column.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Empty: there is no answer.
    Blank,
    /// Words.
    Text(String),
    /// A count or an index.
    Whole(u64),
    /// A number with full precision. Text for people shows it rounded to the column's decimals.
    Number(f64),
}

impl Table {
    /// A table without rows. Keep the name short: a sheet of a workbook has a name of at most 31 letters.
    pub fn new(name: impl Into<String>, columns: Vec<Column>) -> Self {
        Self { name: name.into(), columns, rows: Vec::new() }
    }

    /// Adds a row.
    ///
    /// # Panics
    /// If the row does not have one cell per column.
    pub fn push(&mut self, row: Vec<Cell>) {
        assert_eq!(row.len(), self.columns.len(), "a row of \"{}\" must have one cell per column", self.name);
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

    /// A column of numbers that are shown with this many decimals.
    pub fn number(title: impl Into<String>, decimals: usize) -> Self {
        Self { title: title.into(), kind: Kind::Number { decimals } }
    }

    pub(super) fn decimals(&self) -> usize {
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
        // Adding 0 removes the sign of a negative zero.
        Self::Number(number + 0.0)
    }
}

impl From<Option<f64>> for Cell {
    fn from(number: Option<f64>) -> Self {
        number.map_or(Self::Blank, Self::from)
    }
}

const GAP: &str = "  ";

/// Prints tables as aligned columns under their names, with words to the left and numbers to the right. An empty line separates
/// two tables.
pub fn text(tables: &[Table]) -> String {
    tables.iter().map(text_lines).collect::<Vec<_>>().join("\n")
}

fn text_lines(table: &Table) -> String {
    let titles = table.columns.iter().map(|column| column.title.clone()).collect();
    let shown_row =
        |row: &Vec<Cell>| row.iter().zip(&table.columns).map(|(cell, column)| shown(cell, column)).collect();
    let rows: Vec<Vec<String>> = std::iter::once(titles).chain(table.rows.iter().map(shown_row)).collect();
    let width = |index: usize| rows.iter().map(|row| row[index].chars().count()).max().unwrap_or(0);
    let widths: Vec<usize> = (0..table.columns.len()).map(width).collect();
    let mut text = format!("{}\n", table.name);
    for row in &rows {
        let cells = row.iter().zip(&table.columns).zip(&widths).map(|((cell, column), width)| match column.kind {
            Kind::Text => format!("{cell:<width$}"),
            Kind::Whole | Kind::Number { .. } => format!("{cell:>width$}"),
        });
        let line = cells.collect::<Vec<_>>().join(GAP);
        text.push_str(line.trim_end());
        text.push('\n');
    }
    text
}

fn shown(cell: &Cell, column: &Column) -> String {
    match cell {
        Cell::Blank => "–".to_owned(),
        Cell::Text(words) => words.clone(),
        Cell::Whole(whole) => whole.to_string(),
        Cell::Number(number) => {
            let decimals = column.decimals();
            format!("{:.decimals$}", rounded(*number, decimals))
        }
    }
}

/// Prints tables as comma-separated values (RFC 4180, with line feeds): a line of titles, then one line per row. Numbers have
/// full precision, in the shortest form that reads back as the same value. A blank cell is empty. An empty line separates two
/// tables.
pub fn csv(tables: &[Table]) -> Vec<u8> {
    let lines = |table: &Table| {
        let mut writer = CsvWriter::begin(Vec::new(), &table.columns)?;
        table.rows.iter().try_for_each(|row| writer.write(row))?;
        Ok(writer.sink)
    };
    let lines = tables.iter().map(lines).collect::<io::Result<Vec<_>>>();
    lines.expect("a Vec takes every byte").join(&b'\n')
}

/// Writes one table as comma-separated values, one row at a time, so that the whole table is never in memory.
#[derive(Debug)]
pub(crate) struct CsvWriter<W> {
    sink: W,
}

impl<W: Write> CsvWriter<W> {
    pub(crate) fn begin(mut sink: W, columns: &[Column]) -> io::Result<Self> {
        let titles: Vec<String> = columns.iter().map(|column| quoted(&column.title)).collect();
        writeln!(sink, "{}", titles.join(","))?;
        Ok(Self { sink })
    }

    pub(crate) fn write(&mut self, row: &[Cell]) -> io::Result<()> {
        for (index, cell) in row.iter().enumerate() {
            let comma = if index == 0 { "" } else { "," };
            match cell {
                Cell::Blank => write!(self.sink, "{comma}")?,
                Cell::Text(words) => write!(self.sink, "{comma}{}", quoted(words))?,
                Cell::Whole(whole) => write!(self.sink, "{comma}{whole}")?,
                Cell::Number(number) => write!(self.sink, "{comma}{number:?}")?,
            }
        }
        writeln!(self.sink)
    }

    /// Flushes the sink.
    pub(crate) fn finish(mut self) -> io::Result<()> {
        self.sink.flush()
    }
}

/// Puts words in quotes if they contain a comma, a quote or a line break.
fn quoted(words: &str) -> String {
    if words.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", words.replace('"', "\"\""))
    } else {
        words.to_owned()
    }
}

/// Rounds a number to the decimals with which it prints. A result of −0 becomes 0.
pub(super) fn rounded(number: f64, decimals: usize) -> f64 {
    let text = format!("{number:.decimals$}");
    text.parse::<f64>().expect("a printed number reads back") + 0.0
}

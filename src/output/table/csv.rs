//! Tables as comma-separated values (RFC 4180, with line feeds).

use std::io::{self, Write};

use super::{Cell, Column, ExportError, Exporter, Table};

/// Comma-separated values: a line of titles, then a line for each row. Numbers stand whole, in the shortest form that
/// reads back the same; a blank cell is empty. An empty line parts two tables.
#[derive(Clone, Copy, Debug)]
pub struct Csv;

impl Exporter for Csv {
    fn export(&self, tables: &[Table]) -> Result<Vec<u8>, ExportError> {
        let tables: Vec<Vec<u8>> = tables.iter().map(lines).collect();
        Ok(tables.join(&b'\n'))
    }
}

fn lines(table: &Table) -> Vec<u8> {
    let mut lines = Vec::new();
    let write = |lines: &mut Vec<u8>| {
        let mut writer = CsvWriter::begin(lines, &table.columns)?;
        table.rows.iter().try_for_each(|row| writer.write(row))
    };
    write(&mut lines).expect("a Vec takes every byte");
    lines
}

/// The lines of one table, each written as it comes: for a table that is not to be in memory as a whole.
#[derive(Debug)]
pub struct CsvWriter<W> {
    sink: W,
}

impl<W: Write> CsvWriter<W> {
    /// Writes the line of titles.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn begin(mut sink: W, columns: &[Column]) -> io::Result<Self> {
        let titles: Vec<String> = columns.iter().map(|column| quoted(&column.title)).collect();
        writeln!(sink, "{}", titles.join(","))?;
        Ok(Self { sink })
    }

    /// Writes a row.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn write(&mut self, row: &[Cell]) -> io::Result<()> {
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

    /// Hands what has been written on to its end.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(mut self) -> io::Result<()> {
        self.sink.flush()
    }
}

/// Words as they are, or between quotes where they hold what parts cells.
fn quoted(words: &str) -> String {
    if words.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", words.replace('"', "\"\""))
    } else {
        words.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::table::Column;

    #[test]
    fn words_that_hold_commas_or_quotes_stand_between_quotes() {
        let mut table = Table::new("t", vec![Column::text("who, what"), Column::number("x", 1)]);
        table.push(vec![Cell::from("the \"tail\""), Cell::Blank]);
        table.push(vec![Cell::from("head"), Cell::from(0.1 + 0.2)]);
        let text = Csv.export(&[table]).expect("a table of any size fits");
        assert_eq!(
            String::from_utf8(text).expect("it is text"),
            "\"who, what\",x\n\"the \"\"tail\"\"\",\nhead,0.30000000000000004\n"
        );
    }
}

//! Tables as comma-separated values (RFC 4180, with line feeds).

use std::fmt::Write as _;

use super::{Cell, ExportError, Exporter, Table};

/// Comma-separated values: a line of titles, then a line for each row. Numbers stand whole, in the shortest form that
/// reads back the same; a blank cell is empty. An empty line parts two tables.
#[derive(Clone, Copy, Debug)]
pub struct Csv;

impl Exporter for Csv {
    fn export(&self, tables: &[Table]) -> Result<Vec<u8>, ExportError> {
        let tables: Vec<String> = tables.iter().map(lines).collect();
        Ok(tables.join("\n").into_bytes())
    }
}

fn lines(table: &Table) -> String {
    let titles: Vec<String> = table.columns.iter().map(|column| quoted(&column.title)).collect();
    let mut text = format!("{}\n", titles.join(","));
    for row in &table.rows {
        for (index, cell) in row.iter().enumerate() {
            let comma = if index == 0 { "" } else { "," };
            // Writing into a String cannot fail.
            let _ = match cell {
                Cell::Blank => write!(text, "{comma}"),
                Cell::Text(words) => write!(text, "{comma}{}", quoted(words)),
                Cell::Whole(whole) => write!(text, "{comma}{whole}"),
                Cell::Number(number) => write!(text, "{comma}{number:?}"),
            };
        }
        text.push('\n');
    }
    text
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
    use crate::table::Column;

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

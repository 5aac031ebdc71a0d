//! Tables as people read them in a terminal.

use super::{Cell, Column, ExportError, Exporter, Kind, Table};

/// Aligned columns under the table's name, words to the left and numbers to the right. An empty line parts two tables.
#[derive(Clone, Copy, Debug)]
pub struct Text;

/// Blanks between two columns.
const GAP: &str = "  ";

impl Exporter for Text {
    fn export(&self, tables: &[Table]) -> Result<Vec<u8>, ExportError> {
        let tables: Vec<String> = tables.iter().map(lines).collect();
        Ok(tables.join("\n").into_bytes())
    }
}

fn lines(table: &Table) -> String {
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
            format!("{:.decimals$}", super::rounded(*number, decimals))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_as_wide_as_their_widest_cell() {
        let mut table = Table::new("at 0 s", vec![Column::text("handle"), Column::number("x m", 3)]);
        table.push(vec![Cell::from("head"), Cell::from(8.8)]);
        table.push(vec![Cell::from("tail rear"), Cell::from(-0.000_4)]);
        table.push(vec![Cell::from("nobody"), Cell::Blank]);
        let text = String::from_utf8(Text.export(&[table]).expect("a table of any size fits")).expect("it is text");
        assert_eq!(text, "at 0 s\nhandle       x m\nhead       8.800\ntail rear  0.000\nnobody         –\n");
    }
}

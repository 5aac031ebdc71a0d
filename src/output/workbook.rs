//! Tables as a workbook (Office Open XML) with one sheet per table: from whole tables, or row by row.

use rust_xlsxwriter::{DocProperties, ExcelDateTime, Format, FormatAlign, Worksheet};

use super::table::{Cell, Column, Kind, Table, rounded};

const LABEL_WIDTH: u32 = 20;
const COLUMN_WIDTH: u32 = 12;

/// Greatest number of columns of a sheet.
pub(crate) const MAX_COLUMNS: usize = 16_384;
/// Greatest number of rows of a sheet, including the titles.
pub(crate) const MAX_ROWS: usize = 1_048_576;

/// Reason why tables cannot become a workbook.
#[derive(Debug, thiserror::Error)]
pub(crate) enum WorkbookError {
    /// The table does not fit into a sheet.
    #[error("the table \"{table}\" has {count} {what}; a sheet has at most {most}")]
    TooLarge {
        table: String,
        /// Rows or columns.
        what: &'static str,
        count: usize,
        most: usize,
    },
    /// The library that writes workbooks returned an error.
    #[error(transparent)]
    Writer(#[from] rust_xlsxwriter::XlsxError),
}

/// Writes a workbook with one sheet per table. The row of titles and the first column are frozen.
///
/// Numbers are rounded to their column's decimals and shown with as many. So a cell shows exactly its value.
pub(crate) fn workbook(tables: &[Table]) -> Result<Vec<u8>, WorkbookError> {
    let mut workbook = timeless_workbook()?;
    for table in tables {
        require_room(table)?;
        let shown = |(cell, column): (&Cell, &Column)| match cell {
            Cell::Number(number) => Cell::Number(rounded(*number, column.decimals())),
            other => other.clone(),
        };
        let rows = table.rows.iter().map(|row| row.iter().zip(&table.columns).map(shown).collect());
        write_sheet(workbook.add_worksheet(), &table.name, &table.columns, rows)?;
    }
    Ok(workbook.save_to_buffer()?)
}

/// A workbook that writes its rows to temporary files as they arrive. Its numbers have full precision, and are shown with their
/// column's decimals.
pub(crate) struct Book(rust_xlsxwriter::Workbook);

impl Book {
    pub(crate) fn new() -> Result<Self, WorkbookError> {
        Ok(Self(timeless_workbook()?))
    }

    /// Adds a sheet. It takes at most [`MAX_COLUMNS`] and [`MAX_ROWS`], and a name of at most 31 letters.
    pub(crate) fn add_sheet(
        &mut self,
        name: &str,
        columns: &[Column],
        rows: impl Iterator<Item = Vec<Cell>>,
    ) -> Result<(), WorkbookError> {
        write_sheet(self.0.add_worksheet_with_constant_memory()?, name, columns, rows)
    }

    pub(crate) fn finish(mut self) -> Result<Vec<u8>, WorkbookError> {
        Ok(self.0.save_to_buffer()?)
    }
}

/// An empty workbook with a fixed creation time, so that equal tables give equal bytes. The time is the day from which
/// spreadsheets count.
fn timeless_workbook() -> Result<rust_xlsxwriter::Workbook, WorkbookError> {
    let mut workbook = rust_xlsxwriter::Workbook::new();
    let created = ExcelDateTime::from_ymd(1900, 1, 1)?;
    workbook.set_properties(&DocProperties::new().set_creation_datetime(&created));
    Ok(workbook)
}

fn require_room(table: &Table) -> Result<(), WorkbookError> {
    let sizes = [("rows", table.rows.len() + 1, MAX_ROWS), ("columns", table.columns.len(), MAX_COLUMNS)];
    match sizes.into_iter().find(|(_, count, most)| count > most) {
        None => Ok(()),
        Some((what, count, most)) => Err(WorkbookError::TooLarge { table: table.name.clone(), what, count, most }),
    }
}

/// Writes the titles and the rows. Titles and first column stay visible when the sheet scrolls.
fn write_sheet(
    sheet: &mut Worksheet,
    name: &str,
    columns: &[Column],
    rows: impl Iterator<Item = Vec<Cell>>,
) -> Result<(), WorkbookError> {
    sheet.set_name(name)?;
    sheet.set_freeze_panes(1, 1)?;
    for (column, index) in columns.iter().zip(0..) {
        sheet.set_column_width(index, if index == 0 { LABEL_WIDTH } else { COLUMN_WIDTH })?;
        let title = Format::new().set_bold().set_align(alignment(column));
        sheet.write_string_with_format(0, index, &column.title, &title)?;
    }
    let formats: Vec<Format> = columns.iter().map(number_format).collect();
    for (cells, row) in rows.zip(1..) {
        for ((cell, format), index) in cells.iter().zip(&formats).zip(0..) {
            match cell {
                Cell::Blank => continue,
                Cell::Text(words) => sheet.write_string(row, index, words)?,
                Cell::Whole(whole) => sheet.write_number(row, index, *whole as f64)?,
                Cell::Number(number) => sheet.write_number_with_format(row, index, *number, format)?,
            };
        }
    }
    Ok(())
}

fn number_format(column: &Column) -> Format {
    let decimals = column.decimals();
    if decimals == 0 {
        return Format::new().set_num_format("0");
    }
    Format::new().set_num_format(format!("0.{}", "0".repeat(decimals)))
}

fn alignment(column: &Column) -> FormatAlign {
    match column.kind {
        Kind::Text => FormatAlign::Left,
        Kind::Whole | Kind::Number { .. } => FormatAlign::Right,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_tables_give_equal_bytes() {
        let mut table = Table::new("positions", vec![Column::text("handle"), Column::number("0 s", 6)]);
        table.push(vec![Cell::from("head x (m)"), Cell::from(8.8)]);
        let bytes = || workbook(std::slice::from_ref(&table)).expect("a small table fits");
        assert_eq!(bytes(), bytes());
        assert_eq!(&bytes()[..4], b"PK\x03\x04");
    }

    #[test]
    fn error_names_the_table_with_too_many_columns() {
        let table = Table::new("speeds", vec![Column::number("x", 1); MAX_COLUMNS + 1]);
        let error = workbook(&[table]).expect_err("one too many");
        assert_eq!(error.to_string(), "the table \"speeds\" has 16385 columns; a sheet has at most 16384");
    }
}

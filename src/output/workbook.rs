//! Tables as a workbook (Office Open XML), a sheet each: whole tables, or row by row.

use rust_xlsxwriter::{DocProperties, ExcelDateTime, Format, FormatAlign, Worksheet};

use super::table::{Cell, Column, ExportError, Exporter, Kind, Table, rounded};

/// A workbook with a sheet for each table, the row of titles and the first column frozen.
///
/// Numbers are rounded to their column's decimals and shown with as many, so that what is read is what is there.
#[derive(Clone, Copy, Debug)]
pub struct Xlsx;

/// Width of the first column, in characters.
const LABEL_WIDTH: u32 = 20;
/// Width of the other columns, in characters.
const COLUMN_WIDTH: u32 = 12;

impl Xlsx {
    /// Columns that a sheet has room for.
    pub const MAX_COLUMNS: usize = 16_384;
    /// Rows that a sheet has room for, the titles among them.
    pub const MAX_ROWS: usize = 1_048_576;
}

impl Exporter for Xlsx {
    fn export(&self, tables: &[Table]) -> Result<Vec<u8>, ExportError> {
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
}

/// A workbook whose rows go to temporary files as they come. Its numbers are whole, and shown with their column's decimals.
pub(crate) struct Book(rust_xlsxwriter::Workbook);

impl Book {
    /// A workbook without sheets.
    ///
    /// # Errors
    /// The error of the workbook's writer.
    pub(crate) fn new() -> Result<Self, ExportError> {
        Ok(Self(timeless_workbook()?))
    }

    /// Adds a sheet. Its name, its columns and its rows must fit: [`Xlsx`] has how many there may be.
    ///
    /// # Errors
    /// The error of the workbook's writer.
    pub(crate) fn add_sheet(
        &mut self,
        name: &str,
        columns: &[Column],
        rows: impl Iterator<Item = Vec<Cell>>,
    ) -> Result<(), ExportError> {
        write_sheet(self.0.add_worksheet_with_constant_memory()?, name, columns, rows)
    }

    /// The bytes of the workbook.
    ///
    /// # Errors
    /// The error of the workbook's writer.
    pub(crate) fn finish(mut self) -> Result<Vec<u8>, ExportError> {
        Ok(self.0.save_to_buffer()?)
    }
}

/// A workbook has the time at which it was made. For equal bytes, it is the day from which spreadsheets count.
fn timeless_workbook() -> Result<rust_xlsxwriter::Workbook, ExportError> {
    let mut workbook = rust_xlsxwriter::Workbook::new();
    let created = ExcelDateTime::from_ymd(1900, 1, 1)?;
    workbook.set_properties(&DocProperties::new().set_creation_datetime(&created));
    Ok(workbook)
}

fn require_room(table: &Table) -> Result<(), ExportError> {
    let sizes = [("rows", table.rows.len() + 1, Xlsx::MAX_ROWS), ("columns", table.columns.len(), Xlsx::MAX_COLUMNS)];
    match sizes.into_iter().find(|(_, count, most)| count > most) {
        None => Ok(()),
        Some((what, count, most)) => Err(ExportError::TooLarge { table: table.name.clone(), what, count, most }),
    }
}

/// Writes the titles, which stay in sight with the first column, and the rows.
fn write_sheet(
    sheet: &mut Worksheet,
    name: &str,
    columns: &[Column],
    rows: impl Iterator<Item = Vec<Cell>>,
) -> Result<(), ExportError> {
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

/// As many decimals as the column has.
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
        let workbook = |table: &Table| Xlsx.export(std::slice::from_ref(table)).expect("a small table fits");
        assert_eq!(workbook(&table), workbook(&table));
        assert_eq!(&workbook(&table)[..4], b"PK\x03\x04");
    }

    #[test]
    fn a_table_with_too_many_columns_is_named() {
        let table = Table::new("speeds", vec![Column::number("x", 1); Xlsx::MAX_COLUMNS + 1]);
        let error = Xlsx.export(&[table]).expect_err("one too many");
        assert_eq!(error.to_string(), "the table \"speeds\" has 16385 columns, a sheet has at most 16384");
    }
}

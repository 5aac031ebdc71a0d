//! Large tables as a workbook (Office Open XML), written row by row.

use rust_xlsxwriter::{Format, Workbook, Worksheet};

use super::xlsx::{begin_sheet, number_format, timeless_workbook};
use super::{Cell, Column, ExportError};

/// A workbook whose rows go to temporary files as they come. Its numbers are whole, and shown with their column's decimals.
pub(crate) struct Book {
    workbook: Workbook,
}

impl Book {
    /// A workbook without sheets.
    ///
    /// # Errors
    /// What the workbook's writer refuses.
    pub(crate) fn new() -> Result<Self, ExportError> {
        Ok(Self { workbook: timeless_workbook()? })
    }

    /// Adds a sheet. Its name, its columns and its rows must fit: [`Xlsx`](super::Xlsx) has how many there may be.
    ///
    /// # Errors
    /// What the workbook's writer refuses.
    pub(crate) fn add_sheet(
        &mut self,
        name: &str,
        columns: &[Column],
        rows: impl Iterator<Item = Vec<Cell>>,
    ) -> Result<(), ExportError> {
        let sheet = self.workbook.add_worksheet_with_constant_memory()?;
        begin_sheet(sheet, name, columns)?;
        let formats: Vec<Format> = columns.iter().map(number_format).collect();
        rows.zip(1..).try_for_each(|(cells, row)| write_row(sheet, row, &cells, &formats))
    }

    /// The bytes of the workbook.
    ///
    /// # Errors
    /// What the workbook's writer refuses.
    pub(crate) fn finish(mut self) -> Result<Vec<u8>, ExportError> {
        Ok(self.workbook.save_to_buffer()?)
    }
}

fn write_row(sheet: &mut Worksheet, row: u32, cells: &[Cell], formats: &[Format]) -> Result<(), ExportError> {
    for ((cell, format), column) in cells.iter().zip(formats).zip(0..) {
        match cell {
            Cell::Blank => continue,
            Cell::Text(words) => sheet.write_string(row, column, words)?,
            Cell::Whole(whole) => sheet.write_number(row, column, *whole as f64)?,
            Cell::Number(number) => sheet.write_number_with_format(row, column, *number, format)?,
        };
    }
    Ok(())
}

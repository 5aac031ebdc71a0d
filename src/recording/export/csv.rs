//! A recording as comma-separated values, written as it is read.

use std::io::Write;

use super::error::ExportError;
use super::rows::{columns, for_each_row};
use super::selection::Selection;
use crate::output::table::{Cell, CsvWriter};

/// Writes a line of titles, and a row for each of what the selection's subject names. `look` is shown how far it has come,
/// after each frame.
///
/// # Errors
/// What cannot be read, [`ExportError::Write`] where a row cannot be written, and as [`Selection::next_recorded`] where
/// there is no frame; then nothing was written.
pub fn write_csv(
    selection: &mut Selection,
    sink: impl Write,
    mut look: impl FnMut(&Selection),
) -> Result<(), ExportError> {
    let subject = selection.settings().subject;
    let mut recorded = selection.next_recorded()?;
    selection.count_rows(0);
    let mut csv = CsvWriter::begin(sink, &columns(subject)).map_err(ExportError::Write)?;
    while let Some(frame) = recorded {
        let mut rows = 0;
        let write = |row: Vec<Cell>| {
            rows += 1;
            csv.write(&row)
        };
        for_each_row(subject, &frame, write).map_err(ExportError::Write)?;
        selection.count_rows(rows);
        look(selection);
        recorded = selection.next_recorded()?;
    }
    csv.finish().map_err(ExportError::Write)
}

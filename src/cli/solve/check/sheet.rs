//! Sheets of a workbook, or the one table of a CSV file, as cells.

use std::io::Cursor;
use std::path::Path;

use anyhow::{Context as _, anyhow, ensure};
use calamine::{Data, DataRef, Reader as _, Xlsx};

use crate::system::input_file;

/// Greatest number of cells of a file.
const MOST_CELLS: usize = 4_000_000;

/// A sheet: its rows that are not empty.
#[derive(Debug)]
pub(super) struct Sheet {
    pub(super) name: String,
    pub(super) rows: Vec<Row>,
}

/// A row: its number, from 1, and its cells that are not empty, in the order of their columns.
#[derive(Debug)]
pub(super) struct Row {
    pub(super) number: usize,
    pub(super) cells: Vec<(usize, Value)>,
}

#[derive(Clone, Debug, PartialEq)]
pub(super) enum Value {
    Number(f64),
    Text(String),
}

impl Value {
    /// The number, which may be written as text.
    pub(super) fn number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            Self::Text(text) => text.trim().parse().ok().filter(|number: &f64| number.is_finite()),
        }
    }

    pub(super) fn text(&self) -> Option<&str> {
        match self {
            Self::Text(text) => Some(text),
            Self::Number(_) => None,
        }
    }
}

impl Row {
    /// The cell of a column.
    pub(super) fn at(&self, column: usize) -> Option<&Value> {
        self.cells.binary_search_by_key(&column, |(at, _)| *at).ok().map(|at| &self.cells[at].1)
    }
}

/// Reads all sheets of a file.
pub(super) fn read(path: &Path) -> anyhow::Result<Vec<Sheet>> {
    let suffix = path.extension().map(|suffix| suffix.to_string_lossy().to_ascii_lowercase());
    match suffix.as_deref() {
        Some("xlsx") => of_workbook(input_file::read(path)?),
        Some("csv") => Ok(vec![of_csv(&input_file::read(path)?)?]),
        _ => Err(anyhow!("must end in .xlsx or .csv")),
    }
}

fn of_workbook(bytes: Vec<u8>) -> anyhow::Result<Vec<Sheet>> {
    let mut workbook = Xlsx::new(Cursor::new(bytes)).context("is no workbook")?;
    let mut sheets = Vec::new();
    let mut count = 0;
    for name in workbook.sheet_names() {
        let unreadable = || format!("the sheet \"{name}\" cannot be read");
        // Cell by cell: a range of all cells would be as large as their rectangle.
        let mut reader = workbook.worksheet_cells_reader(&name).with_context(unreadable)?;
        let mut rows: Vec<Row> = Vec::new();
        while let Some(cell) = reader.next_cell().with_context(unreadable)? {
            let (row, column) = cell.get_position();
            let value = match cell.get_value() {
                DataRef::Empty => continue,
                DataRef::Int(whole) => Value::Number(*whole as f64),
                DataRef::Float(number) => Value::Number(*number),
                other => Value::Text(Data::from(other.clone()).to_string()),
            };
            count += 1;
            ensure!(count <= MOST_CELLS, "has more than {MOST_CELLS} cells, the most that is allowed");
            let number = row as usize + 1;
            if rows.last().is_none_or(|row| row.number != number) {
                rows.push(Row { number, cells: Vec::new() });
            }
            rows.last_mut().expect("a row was added").cells.push((column as usize, value));
        }
        for row in &mut rows {
            row.cells.sort_by_key(|(column, _)| *column);
        }
        sheets.push(Sheet { name, rows });
    }
    Ok(sheets)
}

fn of_csv(bytes: &[u8]) -> anyhow::Result<Sheet> {
    let text = input_file::utf8(bytes)?.trim_start_matches('\u{feff}');
    let mut rows = Vec::new();
    let mut count = 0;
    for (line, number) in text.lines().zip(1..) {
        let cells = line.split(',').map(|cell| cell.trim().trim_matches('"').trim()).enumerate();
        let cells: Vec<_> = cells
            .filter(|(_, cell)| !cell.is_empty())
            .map(|(column, cell)| (column, Value::Text(cell.to_owned())))
            .collect();
        count += cells.len();
        ensure!(count <= MOST_CELLS, "has more than {MOST_CELLS} cells, the most that is allowed");
        if !cells.is_empty() {
            rows.push(Row { number, cells });
        }
    }
    Ok(Sheet { name: String::new(), rows })
}

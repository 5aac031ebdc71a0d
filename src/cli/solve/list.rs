//! `solve route --list`: the paths of a drawing, with the names by which a configuration chooses one.

use std::path::Path;

use anyhow::Context as _;
use serde::Serialize;

use crate::cli::flags::{BadInput, Format};
use crate::cli::print::print_report;
use crate::cli::reading::within_limits;
use crate::drawing::{self, ListedPath, PathChoice, PathList};
use crate::output::Counted;
use crate::output::terminal_text::{Printable, printable};

#[derive(Serialize)]
struct PrintedList {
    /// The unit of the lengths: `m`, or `drawing` for a file without a unit.
    unit: &'static str,
    /// The paths in the order of the file.
    paths: Vec<PathRow>,
}

#[derive(Serialize)]
struct PathRow {
    /// Number from 1.
    number: usize,
    id: Option<String>,
    label: Option<String>,
    layer: Option<String>,
    /// Length in the unit; null for what is no path.
    length: Option<f64>,
    closed: Option<bool>,
    /// The reason for which it is no path.
    fault: Option<String>,
}

/// Prints the paths of a drawing.
pub(super) fn run(file: &Path, format: Format) -> anyhow::Result<()> {
    let read = || drawing::list(file, &PathChoice::default());
    let listed = within_limits(Some(file), read).map_err(|error| BadInput(error.to_string()));
    let PathList { paths, is_in_metres } = listed.with_context(|| file.display().to_string())?;
    let paths = (1..).zip(paths).map(|(number, path)| PathRow::of(number, path)).collect();
    let list = PrintedList { unit: if is_in_metres { "m" } else { "drawing" }, paths };
    print_report(format, &list, list.text(file))
}

impl PathRow {
    fn of(number: usize, ListedPath { id, label, layer, drawing }: ListedPath) -> Self {
        let (length, closed, fault) = match drawing {
            Ok(drawing) => (Some(drawing.length_m()), Some(drawing.is_closed), None),
            Err(error) => (None, None, Some(error.to_string())),
        };
        Self { number, id, label, layer, length, closed, fault }
    }
}

impl PrintedList {
    fn text(&self, file: &Path) -> String {
        let cell = |text: &Option<String>| text.as_ref().map_or("-".to_owned(), |text| printable(text).into_owned());
        let length = if self.unit == "m" { "length in m" } else { "length in units of the drawing" };
        let mut rows = vec![["number", "id", "label", "layer", length, ""].map(str::to_owned)];
        rows.extend(self.paths.iter().map(|path| {
            let length = path.length.map_or("-".to_owned(), |length| format!("{length:.3}"));
            let kind = match (path.closed, &path.fault) {
                (_, Some(fault)) => fault.clone(),
                (Some(true), None) => "closed".to_owned(),
                _ => "open".to_owned(),
            };
            [path.number.to_string(), cell(&path.id), cell(&path.label), cell(&path.layer), length, kind]
        }));
        let widths: Vec<usize> =
            (0..5).map(|column| rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0)).collect();
        let line = |row: &[String; 6]| {
            let cells = row.iter().zip(&widths).map(|(cell, &width)| format!("{cell:<width$}  "));
            let line: String = cells.collect();
            format!("{line}{}", row[5]).trim_end().to_owned()
        };
        let count = Counted(self.paths.len() as u64, "path");
        let mut lines = vec![format!("{count} in {}", Printable(file))];
        lines.extend(rows.iter().map(line));
        lines.join("\n")
    }
}

//! The responses as tables.

use bench_dragon_geometry::planner::{Curve, Response, Sample, Sensitivity};

use crate::output::table::{Cell, Column, Table};

/// Decimals that people see.
const DECIMALS: usize = 6;

/// For a terminal: a table for each quantity that there is.
pub(super) fn texts(sensitivity: &Sensitivity, responses: &[Response]) -> Vec<Table> {
    let table = |response: &Response| {
        let mut table = Table::new(titled(response), columns(sensitivity, Vec::new()));
        response.curves.iter().for_each(|curve| table.push(row(curve, Vec::new())));
        table
    };
    responses.iter().filter(|response| response.value.is_ok()).map(table).collect()
}

/// For a workbook: what the terminal shows in one sheet, every sample in another.
pub(super) fn sheets(sensitivity: &Sensitivity, responses: &[Response]) -> [Table; 2] {
    let quantity = || vec![Column::text("quantity")];
    let mut summary = Table::new("summary", columns(sensitivity, quantity()));
    let numbers = ["change (%)", "parameter value", "value"].map(|title| Column::number(title, DECIMALS));
    let mut all = quantity();
    all.push(Column::text("parameter"));
    all.extend(numbers);
    all.push(Column::text("reason"));
    let mut samples = Table::new("samples", all);
    for response in responses {
        for curve in &response.curves {
            summary.push(row(curve, vec![titled(response).into()]));
            curve.samples.iter().for_each(|sample| samples.push(sample_row(response, curve, sample)));
        }
    }
    [summary, samples]
}

/// Why there are blanks, a line each.
pub(super) fn notes(responses: &[Response]) -> Vec<String> {
    let mut notes = Vec::new();
    for response in responses {
        let quantity = response.quantity;
        if let Err(reason) = &response.value {
            notes.push(format!("– {quantity}: {reason}"));
            continue;
        }
        for curve in &response.curves {
            let reasons = ends(curve).into_iter().filter_map(|sample| sample.value.as_ref().err());
            let derivative = curve.derivative.as_ref().err();
            let mut reasons: Vec<String> =
                reasons.map(ToString::to_string).chain(derivative.map(ToString::to_string)).collect();
            reasons.dedup();
            notes.extend(reasons.iter().map(|reason| format!("– {quantity} over {}: {reason}", curve.parameter)));
        }
    }
    notes
}

fn columns(sensitivity: &Sensitivity, mut columns: Vec<Column>) -> Vec<Column> {
    let percent = 100.0 * sensitivity.range;
    columns.push(Column::text("parameter"));
    let numbers = [
        "value".to_owned(),
        format!("-{percent} %"),
        "as planned".to_owned(),
        format!("+{percent} %"),
        "per m or m/s".to_owned(),
        "per 1 %".to_owned(),
    ];
    columns.extend(numbers.map(|title| Column::number(title, DECIMALS)));
    columns
}

fn row(curve: &Curve, mut cells: Vec<Cell>) -> Vec<Cell> {
    let [low, high] = ends(curve).map(|sample| sample.value.clone().ok());
    let planned = curve.samples[curve.samples.len() / 2].value.clone().ok();
    let derivative = curve.derivative.clone().ok();
    cells.push(format!("{} ({})", curve.parameter, curve.parameter.unit()).into());
    cells.push(curve.parameter_value.into());
    let percent = derivative.map(|derivative| 0.01 * curve.parameter_value * derivative);
    cells.extend([low, planned, high, derivative, percent].map(Cell::from));
    cells
}

fn sample_row(response: &Response, curve: &Curve, sample: &Sample) -> Vec<Cell> {
    let change = if curve.parameter_value == 0.0 {
        Cell::Blank
    } else {
        Cell::from(100.0 * (sample.parameter_value / curve.parameter_value - 1.0))
    };
    vec![
        titled(response).into(),
        format!("{} ({})", curve.parameter, curve.parameter.unit()).into(),
        change,
        sample.parameter_value.into(),
        sample.value.clone().ok().into(),
        sample.value.as_ref().err().map_or(Cell::Blank, |reason| reason.to_string().into()),
    ]
}

/// The first and the last sample.
fn ends(curve: &Curve) -> [&Sample; 2] {
    [curve.samples.first(), curve.samples.last()].map(|sample| sample.expect("a curve has samples"))
}

/// The quantity with its unit.
pub(super) fn titled(response: &Response) -> String {
    match response.quantity.unit() {
        "" => response.quantity.to_string(),
        unit => format!("{} ({unit})", response.quantity),
    }
}

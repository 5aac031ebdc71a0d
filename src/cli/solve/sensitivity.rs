//! `solve sensitivity`: computes how the answers change with each parameter.

use std::path::PathBuf;

use bench_dragon_geometry::planner::{Curve, Parameter, Response, Sample, Sensitivity, Setting};
use clap::{Args, ValueHint};
use serde::Serialize;

use super::figure::FigureArgs;
use super::{WorkArgs, formation_survey, interrupt, load_any_plan, require_no_cues, work_default, xlsx};
use crate::cli::flags::{BadInput, ConfigArgs, Format, FormatArgs, within};
use crate::cli::in_file;
use crate::cli::print::{Progress, print_bytes, print_json, print_line};
use crate::config::{Config, PlanDocument};
use crate::output::figure;
use crate::output::table::{self, Cell, Column, Table};

/// Compute how first contact, least clearance, largest speed and smallest pitch change with each parameter.
#[derive(Clone, Debug, Args)]
#[command(mut_arg("work", |arg| work_default(arg, "300")))]
#[command(after_help = "Examples:
  bench-dragon solve sensitivity
  bench-dragon solve sensitivity --range 10 --parameter pitch,width --xlsx sensitivity.xlsx --figure sensitivity.svg")]
pub(crate) struct SensitivityArgs {
    /// Largest change of each parameter, up and down, in percent, above 0 and under 100.
    #[arg(long, value_name = "PERCENT", default_value = "5", allow_negative_numbers = true, value_parser = range_percent)]
    pub(crate) range: f64,
    /// Number of values on each side of the planned value, 1 to 100.
    #[arg(long, value_name = "COUNT", default_value_t = 2, allow_negative_numbers = true, value_parser = within(1..=100_u32))]
    pub(crate) steps: u32,
    /// Parameters to vary, separated by commas: pitch, head-length, body-length, width, hole-offset, hole-diameter,
    /// pole-diameter, speed, acceleration, turn-diameter, radius-ratio, turn-line [default: all that the plan has].
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = parameter)]
    pub(crate) parameter: Vec<Parameter>,
    /// Diameter in metres of the circle that the head must reach on a spiral [default: the configured turnaround's, else 9].
    #[arg(long, value_name = "METRES", allow_negative_numbers = true, value_parser = diameter)]
    pub(crate) turn_diameter: Option<f64>,
    /// Write a workbook with a sheet of the printed tables and a sheet of all values; an existing file is replaced.
    #[arg(long, value_name = "FILE.xlsx", value_hint = ValueHint::FilePath, value_parser = xlsx)]
    pub(crate) xlsx: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) figure: FigureArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) work: WorkArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

fn range_percent(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok().filter(|value| *value > 0.0 && *value < 100.0);
    value.ok_or_else(|| "must be above 0 and under 100".to_owned())
}

fn diameter(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok().filter(|value: &f64| *value > 0.0 && value.is_finite());
    value.ok_or_else(|| "must be above 0 and finite".to_owned())
}

fn parameter(text: &str) -> Result<Parameter, String> {
    let name = |parameter: &Parameter| parameter.to_string().replace(' ', "-");
    let found = Parameter::ALL.into_iter().find(|parameter| name(parameter) == text);
    found.ok_or_else(|| format!("must be one of {}", Parameter::ALL.each_ref().map(name).join(", ")))
}

pub(super) fn run(args: &SensitivityArgs) -> anyhow::Result<()> {
    let config = match load_any_plan(&args.config, args.work)? {
        PlanDocument::OneDragon(document) => in_file(&args.config, document.build())?,
        PlanDocument::Formation(document) => return formation_survey::sensitivity(args, &document),
    };
    args.figure.keep_drawing(config.document())?;
    in_file(&args.config, require_no_cues(config.cues(), "solve sensitivity"))?;
    let sensitivity = sensitivity(&config, args)?;
    let progress = Progress::new("answers", sensitivity.questions() as f64);
    let responses = sensitivity.study(&args.work.long_meter(), || progress.add(1.0));
    drop(progress);
    print(args, &sensitivity, &responses)?;
    if let Some(path) = &args.xlsx {
        interrupt::write(path, &table::workbook(&sheets(&sensitivity, &responses))?)?;
    }
    if args.figure.is_asked() {
        let caption = args.figure.caption(&config, "How the answers change with each measure");
        args.figure.save(chart(caption, &sensitivity, &responses).draw())?;
    }
    Ok(())
}

fn print(args: &SensitivityArgs, sensitivity: &Sensitivity, responses: &[Response]) -> anyhow::Result<()> {
    if args.format.format == Format::Json {
        return print_json(&answer(sensitivity, responses));
    }
    print_bytes(table::text(&texts(sensitivity, responses)))?;
    let notes = notes(responses);
    if !notes.is_empty() {
        print_line("")?;
    }
    Ok(notes.into_iter().try_for_each(print_line)?)
}

fn sensitivity(config: &Config, args: &SensitivityArgs) -> Result<Sensitivity, BadInput> {
    let planned_diameter_m = config.route().turn_diameter_m();
    let setting = Setting {
        dimensions: *config.lead().dimensions(),
        route: config.document().route_on_map(),
        speed_mps: config.tables().head.speed_mps,
        accel_mps2: config.tables().head.accel_mps2,
    };
    if let Some(parameter) = args.parameter.iter().find(|parameter| !setting.has(**parameter)) {
        let owner = match parameter {
            Parameter::Accel => "a [head] without accel_mps2".to_owned(),
            Parameter::HoleDiameter | Parameter::PoleDiameter => "a [dragon] without play".to_owned(),
            Parameter::TurnLine if config.route().as_turnaround().is_some() => "a turnaround without line_m".to_owned(),
            _ => format!("a route of the kind \"{}\"", config.route().shape.kind()),
        };
        return Err(BadInput(format!("--parameter is {parameter}, which {owner} does not have")));
    }
    let is_asked = |parameter: &Parameter| {
        setting.has(*parameter) && (args.parameter.is_empty() || args.parameter.contains(parameter))
    };
    Ok(Sensitivity {
        turn_diameter_m: args.turn_diameter.unwrap_or(planned_diameter_m),
        range: 0.01 * args.range,
        steps: args.steps,
        parameters: Parameter::ALL.into_iter().filter(is_asked).collect(),
        setting,
    })
}

#[derive(Serialize)]
struct SensitivityAnswer {
    turn_diameter_m: f64,
    range_percent: f64,
    quantities: Vec<ResponseAnswer>,
}

#[derive(Serialize)]
struct ResponseAnswer {
    quantity: &'static str,
    value: Option<f64>,
    reason: Option<String>,
    parameters: Vec<CurveAnswer>,
}

#[derive(Serialize)]
struct CurveAnswer {
    parameter: &'static str,
    value: f64,
    /// In the quantity's unit per unit of the parameter.
    derivative: Option<f64>,
    derivative_reason: Option<String>,
    samples: Vec<SampleAnswer>,
}

#[derive(Serialize)]
struct SampleAnswer {
    parameter_value: f64,
    value: Option<f64>,
    reason: Option<String>,
}

fn answer(sensitivity: &Sensitivity, responses: &[Response]) -> SensitivityAnswer {
    let sample_answer = |sample: &Sample| {
        let (value, reason) = number_or_reason(&sample.value);
        SampleAnswer { parameter_value: sample.parameter_value, value, reason }
    };
    let curve_answer = |curve: &Curve| {
        let (derivative, derivative_reason) = number_or_reason(&curve.derivative);
        let samples = curve.samples.iter().map(sample_answer).collect();
        let (parameter, value) = (curve.parameter.key(), curve.parameter_value);
        CurveAnswer { parameter, value, derivative, derivative_reason, samples }
    };
    let response_answer = |response: &Response| {
        let (value, reason) = number_or_reason(&response.value);
        let parameters = response.curves.iter().map(curve_answer).collect();
        ResponseAnswer { quantity: response.quantity.key(), value, reason, parameters }
    };
    SensitivityAnswer {
        turn_diameter_m: sensitivity.turn_diameter_m,
        range_percent: 100.0 * sensitivity.range,
        quantities: responses.iter().map(response_answer).collect(),
    }
}

fn number_or_reason<E: ToString>(result: &Result<f64, E>) -> (Option<f64>, Option<String>) {
    (result.as_ref().ok().copied(), result.as_ref().err().map(E::to_string))
}

const DECIMALS: usize = 6;

/// The tables for a terminal: one per quantity that has a value.
fn texts(sensitivity: &Sensitivity, responses: &[Response]) -> Vec<Table> {
    let table = |response: &Response| {
        let mut table = Table::new(titled(response), columns(sensitivity, Vec::new()));
        response.curves.iter().for_each(|curve| table.push(row(curve, Vec::new())));
        table
    };
    responses.iter().filter(|response| response.value.is_ok()).map(table).collect()
}

/// The sheets of a workbook: the terminal's tables in one sheet, all samples in the other.
fn sheets(sensitivity: &Sensitivity, responses: &[Response]) -> [Table; 2] {
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

/// The reasons for blank cells of each quantity, one line each.
fn notes(responses: &[Response]) -> Vec<String> {
    let mut notes = Vec::new();
    for response in responses {
        let quantity = response.quantity;
        if let Err(reason) = &response.value {
            notes.push(format!("– {quantity}: {reason}"));
            continue;
        }
        let mut reasons: Vec<(String, Vec<String>)> = Vec::new();
        for curve in &response.curves {
            for reason in reasons_of(curve) {
                match reasons.iter_mut().find(|(other, _)| *other == reason) {
                    Some((_, parameters)) => parameters.push(curve.parameter.to_string()),
                    None => reasons.push((reason, vec![curve.parameter.to_string()])),
                }
            }
        }
        let note = |(reason, parameters): (String, Vec<String>)| {
            format!("– {quantity} over {}: {reason}", parameters.join(", "))
        };
        notes.extend(reasons.into_iter().map(note));
    }
    notes
}

/// The reasons for blank cells in the row of a curve, each once.
fn reasons_of(curve: &Curve) -> Vec<String> {
    let samples = ends(curve).into_iter().filter_map(|sample| sample.value.as_ref().err());
    let derivative = curve.derivative.as_ref().err();
    let mut reasons: Vec<String> =
        samples.map(ToString::to_string).chain(derivative.map(ToString::to_string)).collect();
    reasons.dedup();
    reasons
}

fn columns(sensitivity: &Sensitivity, mut columns: Vec<Column>) -> Vec<Column> {
    let percent = 100.0 * sensitivity.range;
    columns.push(Column::text("parameter"));
    let numbers = [
        "value".to_owned(),
        format!("-{percent} %"),
        "as planned".to_owned(),
        format!("+{percent} %"),
        "per unit".to_owned(),
        "per 1 %".to_owned(),
    ];
    columns.extend(numbers.map(|title| Column::number(title, DECIMALS)));
    columns
}

fn row(curve: &Curve, mut cells: Vec<Cell>) -> Vec<Cell> {
    let [low, high] = ends(curve).map(|sample| sample.value.clone().ok());
    let planned = curve.samples[curve.samples.len() / 2].value.clone().ok();
    let derivative = curve.derivative.clone().ok();
    cells.push(named(curve.parameter).into());
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
        named(curve.parameter).into(),
        change,
        sample.parameter_value.into(),
        sample.value.clone().ok().into(),
        sample.value.as_ref().err().map_or(Cell::Blank, |reason| reason.to_string().into()),
    ]
}

fn ends(curve: &Curve) -> [&Sample; 2] {
    [curve.samples.first(), curve.samples.last()].map(|sample| sample.expect("a curve has samples"))
}

/// The parameter with its unit.
fn named(parameter: Parameter) -> String {
    match parameter.unit() {
        "" => parameter.to_string(),
        unit => format!("{parameter} ({unit})"),
    }
}

fn titled(response: &Response) -> String {
    match response.quantity.unit() {
        "" => response.quantity.to_string(),
        unit => format!("{} ({unit})", response.quantity),
    }
}

/// The figure, with one plot per quantity that has a value.
fn chart(caption: figure::Caption, sensitivity: &Sensitivity, responses: &[Response]) -> figure::SensitivityChart {
    let answered = responses.iter().filter(|response| response.value.is_ok());
    let plot = |response: &Response| figure::ChartQuantity {
        name: titled(response),
        curves: response.curves.iter().map(|curve| points(sensitivity, curve)).collect(),
    };
    figure::SensitivityChart {
        caption,
        parameters: sensitivity.parameters.iter().map(ToString::to_string).collect(),
        quantities: answered.map(plot).collect(),
    }
}

fn points(sensitivity: &Sensitivity, curve: &Curve) -> Vec<(f64, Option<f64>)> {
    let point = |(sample, step): (&Sample, i32)| {
        let change_percent = 100.0 * sensitivity.range * f64::from(step) / f64::from(sensitivity.steps);
        (change_percent, sample.value.clone().ok())
    };
    curve.samples.iter().zip(-sensitivity.steps.cast_signed()..).map(point).collect()
}

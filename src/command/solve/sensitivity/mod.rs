//! `solve sensitivity`: how do the answers change with each measure?

use bench_dragon_geometry::planner::{Parameter, Response, Sensitivity, Setting};
use bench_dragon_geometry::route::{RouteSpec, TurnaroundSpec};

use crate::cli::{Format, SensitivityArgs};
use crate::command::output::{print_bytes, print_json, print_line};
use crate::command::progress::Progress;
use crate::command::solve::caption::caption;
use crate::command::solve::figures;
use crate::command::{load_config, whole_file};
use crate::config::{Config, Overrides};
use crate::output::table::{Exporter as _, Text, Xlsx};

mod answer;
mod chart;
mod tables;

pub(super) fn run(args: &SensitivityArgs) -> anyhow::Result<()> {
    let config = load_config(&args.config, Overrides::default())?;
    let sensitivity = sensitivity(&config, args);
    let responses = study(&sensitivity, args);
    if let Some(path) = &args.xlsx {
        whole_file::write(path, &Xlsx.export(&tables::sheets(&sensitivity, &responses))?)?;
    }
    if args.figure.figure.is_some() {
        let caption = caption(&args.figure, &config, "How the answers change with each measure");
        figures::save(chart::chart(caption, &sensitivity, &responses).draw(), &args.figure)?;
    }
    if args.format.format == Format::Json {
        return print_json(&answer::answer(&sensitivity, &responses));
    }
    print_bytes(Text.export(&tables::texts(&sensitivity, &responses))?)?;
    let notes = tables::notes(&responses);
    if !notes.is_empty() {
        print_line("")?;
    }
    for note in notes {
        print_line(note)?;
    }
    Ok(())
}

fn sensitivity(config: &Config, args: &SensitivityArgs) -> Sensitivity {
    let planned_diameter_m = match config.route() {
        RouteSpec::Spiral(_) => TurnaroundSpec::default().turn_diameter_m,
        RouteSpec::Turnaround(plan) => plan.turn_diameter_m,
    };
    let is_asked = |parameter: &Parameter| args.parameter.is_empty() || args.parameter.contains(parameter);
    Sensitivity {
        setting: Setting {
            dimensions: *config.dragon().dimensions(),
            route: config.route(),
            speed_mps: config.head_speed_mps(),
            accel_mps2: config.head_accel_mps2(),
        },
        turn_diameter_m: args.turn_diameter.unwrap_or(planned_diameter_m),
        range: 0.01 * args.range,
        steps: args.steps,
        parameters: Parameter::ALL.into_iter().filter(is_asked).collect(),
    }
}

/// With a bar while it takes long.
fn study(sensitivity: &Sensitivity, args: &SensitivityArgs) -> Vec<Response> {
    let progress = Progress::new("answers", sensitivity.questions() as f64);
    sensitivity.study(&args.work.long_meter(), || progress.add(1.0))
}

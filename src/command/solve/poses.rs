//! `solve poses`: where is every handle, and how fast?

use bench_dragon_geometry::dragon::ChainSolver;
use serde::Serialize;

use super::figures;
use super::times::{MAX_POSITIONS, times_s};
use crate::cli::{PosesArgs, TableFormat};
use crate::command::output::{print_bytes, print_json, print_line};
use crate::command::printable::Printable;
use crate::command::{BadInput, load_config, whole_file};
use crate::config::{Config, Overrides};
use crate::output::number::Counted;
use crate::output::table::{Cell, Column, Csv, Exporter as _, Table, Text, Xlsx};

/// Decimals that people see, of metres and of metres per second.
const DECIMALS: usize = 6;

#[derive(Serialize)]
struct Answer {
    poses: Vec<Pose>,
}

#[derive(Serialize)]
struct Pose {
    time_s: f64,
    handles: Vec<Handle>,
}

#[derive(Serialize)]
struct Handle {
    index: usize,
    x_m: f64,
    y_m: f64,
    speed_mps: f64,
}

pub(super) fn run(args: &PosesArgs) -> anyhow::Result<()> {
    let config = load_config(&args.config, Overrides::default())?;
    let mut most = MAX_POSITIONS / config.dragon().dimensions().handles();
    if args.xlsx.is_some() {
        // One column tells what the row is.
        most = most.min(Xlsx::MAX_COLUMNS - 1);
    }
    let times_s = times_s(&args.times, &(config.start_s()..=config.end_s()), most)?;
    let figure_s = args.figure.figure.as_ref().map(|_| one_time(&times_s)).transpose()?;
    let answer = Answer::at(&times_s, &config);
    match args.format {
        TableFormat::Json => print_json(&answer)?,
        TableFormat::Csv => print_bytes(Csv.export(&[answer.by_time()])?)?,
        TableFormat::Text if args.xlsx.is_some() => (),
        TableFormat::Text => print_bytes(Text.export(&answer.poses.iter().map(Pose::table).collect::<Vec<_>>())?)?,
    }
    if let Some(path) = &args.xlsx {
        whole_file::write(path, &Xlsx.export(&answer.sheets())?)?;
    }
    if let Some(time_s) = figure_s {
        let view = figures::plan_view(&args.figure, &config, time_s, travel_m(time_s, &config));
        figures::save(view.draw(), &args.figure)?;
    }
    if args.format == TableFormat::Text { answer.print_files(args) } else { Ok(()) }
}

/// The time of a figure, which shows one.
fn one_time(times_s: &[f64]) -> Result<f64, BadInput> {
    match times_s {
        [time_s] => Ok(*time_s),
        _ => Err(BadInput(format!("--figure shows one time, not {}: give one with --at", times_s.len()))),
    }
}

/// Travel at a time of the run, which rounding must not put outside it.
fn travel_m(time_s: f64, config: &Config) -> f64 {
    let dragon = config.dragon();
    config.timetable().travel_m(time_s).clamp(dragon.start_travel_m(), dragon.end_travel_m())
}

impl Answer {
    fn at(times_s: &[f64], config: &Config) -> Self {
        let mut chain = ChainSolver::new(config.dragon());
        Self { poses: times_s.iter().map(|&time_s| Pose::at(time_s, config, &mut chain)).collect() }
    }

    /// A row for every handle at every time.
    fn by_time(&self) -> Table {
        let numbers = ["x_m", "y_m", "speed_mps"].map(|title| Column::number(title, DECIMALS));
        let columns = [Column::number("time_s", DECIMALS), Column::whole("handle")].into_iter().chain(numbers);
        let mut table = Table::new("poses", columns.collect());
        for Pose { time_s, handles } in &self.poses {
            for Handle { index, x_m, y_m, speed_mps } in handles {
                table.push(vec![(*time_s).into(), (*index).into(), (*x_m).into(), (*y_m).into(), (*speed_mps).into()]);
            }
        }
        table
    }

    /// Positions and speeds with a column for every time, as the paper saved them.
    fn sheets(&self) -> [Table; 2] {
        let mut positions = Table::new("positions", self.columns());
        let mut speeds = Table::new("speeds", self.columns());
        let count = self.poses.first().map_or(0, |pose| pose.handles.len());
        for index in 0..count {
            let name = name(index, count);
            positions.push(self.row(format!("{name} x (m)"), index, |handle| handle.x_m));
            positions.push(self.row(format!("{name} y (m)"), index, |handle| handle.y_m));
            speeds.push(self.row(format!("{name} (m/s)"), index, |handle| handle.speed_mps));
        }
        [positions, speeds]
    }

    fn columns(&self) -> Vec<Column> {
        let times = self.poses.iter().map(|pose| Column::number(format!("{} s", pose.time_s), DECIMALS));
        std::iter::once(Column::text("handle")).chain(times).collect()
    }

    fn row(&self, label: String, index: usize, value: impl Fn(&Handle) -> f64) -> Vec<Cell> {
        let values = self.poses.iter().map(|pose| Cell::from(value(&pose.handles[index])));
        std::iter::once(Cell::from(label)).chain(values).collect()
    }

    /// Tells which files were written; a workbook is printed in no other way.
    fn print_files(&self, args: &PosesArgs) -> anyhow::Result<()> {
        if let Some(path) = &args.xlsx {
            let handles = self.poses.first().map_or(0, |pose| pose.handles.len());
            let times = self.poses.len();
            let (handles, times) = (Counted(handles as u64, "handle"), Counted(times as u64, "time"));
            let path = Printable(path);
            print_line(format_args!("positions and speeds of {handles} at {times} written to {path}"))?;
        }
        if let Some(file) = &args.figure.figure {
            print_line(format_args!("the dragon at {} s drawn to {}", self.poses[0].time_s, Printable(&file.path)))?;
        }
        Ok(())
    }
}

impl Pose {
    fn at(time_s: f64, config: &Config, chain: &mut ChainSolver) -> Self {
        let head_speed_mps = config.timetable().speed_mps(time_s);
        let handles = chain.solve(config.dragon(), travel_m(time_s, config)).expect("the travel is in the run");
        let handles = handles.iter().enumerate().map(|(index, handle)| Handle {
            index,
            x_m: handle.position.x,
            y_m: handle.position.y,
            speed_mps: handle.speed_ratio * head_speed_mps,
        });
        Self { time_s, handles: handles.collect() }
    }

    fn table(&self) -> Table {
        let numbers = ["x m", "y m", "m/s"].map(|title| Column::number(title, DECIMALS));
        let columns = std::iter::once(Column::whole("handle")).chain(numbers);
        let mut table = Table::new(format!("at {} s", self.time_s), columns.collect());
        for Handle { index, x_m, y_m, speed_mps } in &self.handles {
            table.push(vec![(*index).into(), (*x_m).into(), (*y_m).into(), (*speed_mps).into()]);
        }
        table
    }
}

/// What people call a handle: the bench whose front hinge it is, or the tail's rear hinge.
fn name(index: usize, count: usize) -> String {
    match index {
        0 => "head".to_owned(),
        _ if index + 1 == count => "tail rear".to_owned(),
        _ => format!("bench {index}"),
    }
}

//! `solve`: the planner's questions.

use std::fmt::Write as _;
use std::process::ExitCode;

use bench_dragon::config::{Config, Overrides};
use bench_dragon::dragon::{ChainSolver, first_contact};
use bench_dragon::number::Number;
use serde::Serialize;

use crate::cli::{Format, Question};
use crate::command::output::{print_json, print_line};
use crate::command::{BadInput, load_config};

#[derive(Serialize)]
struct PosesAnswer {
    poses: Vec<Pose>,
}

#[derive(Serialize)]
struct Pose {
    time_s: f64,
    handles: Vec<HandleAnswer>,
}

#[derive(Serialize)]
struct HandleAnswer {
    index: usize,
    x_m: f64,
    y_m: f64,
    speed_mps: f64,
}

#[derive(Serialize)]
struct ContactAnswer {
    time_s: Option<f64>,
    benches: Option<[usize; 2]>,
    point_m: Option<[f64; 2]>,
}

pub(crate) fn run(question: Question) -> anyhow::Result<ExitCode> {
    match question {
        Question::Poses { at, config, format } => {
            poses(&at, &load_config(&config, Overrides::default())?, format.format)?;
        }
        Question::Contact { config, format } => {
            contact(&load_config(&config, Overrides::default())?, format.format)?;
        }
    }
    Ok(ExitCode::SUCCESS)
}

fn poses(at_s: &[f64], config: &Config, format: Format) -> anyhow::Result<()> {
    let (start_s, end_s) = (config.start_s(), config.end_s());
    if let Some(time_s) = at_s.iter().find(|time_s| !(start_s..=end_s).contains(*time_s)) {
        return Err(BadInput(format!(
            "--at is {}, must be from {start_s} to {end_s}, where the run ends",
            Number(*time_s)
        ))
        .into());
    }
    let mut chain = ChainSolver::new(config.dragon());
    let answer = PosesAnswer { poses: at_s.iter().map(|&time_s| pose(time_s, config, &mut chain)).collect() };
    match format {
        Format::Json => print_json(&answer),
        Format::Text => Ok(print_line(poses_text(&answer).trim_end())?),
    }
}

fn pose(time_s: f64, config: &Config, chain: &mut ChainSolver) -> Pose {
    let speed_mps = config.head_speed_mps();
    let handles = chain.solve(config.dragon(), speed_mps * time_s).expect("the time was checked against the run");
    let answer = |(index, handle): (usize, &bench_dragon::dragon::Handle)| HandleAnswer {
        index,
        x_m: handle.position.x,
        y_m: handle.position.y,
        speed_mps: handle.speed_ratio * speed_mps,
    };
    Pose { time_s, handles: handles.iter().enumerate().map(answer).collect() }
}

fn poses_text(answer: &PosesAnswer) -> String {
    let mut text = String::new();
    for Pose { time_s, handles } in &answer.poses {
        // Writing into a String cannot fail.
        let _ = writeln!(text, "at {time_s} s\n{:>7} {:>12} {:>12} {:>10}", "handle", "x m", "y m", "m/s");
        for HandleAnswer { index, x_m, y_m, speed_mps } in handles {
            let _ = writeln!(text, "{index:>7} {x_m:>12.6} {y_m:>12.6} {speed_mps:>10.6}");
        }
    }
    text
}

fn contact(config: &Config, format: Format) -> anyhow::Result<()> {
    let dragon = config.dragon();
    let contact = first_contact(dragon, dragon.start_travel_m(), dragon.end_travel_m());
    let time_s = contact.map(|contact| contact.travel_m / config.head_speed_mps());
    if format == Format::Json {
        return print_json(&ContactAnswer {
            time_s,
            benches: contact.map(|contact| contact.benches),
            point_m: contact.map(|contact| contact.point.to_array()),
        });
    }
    match (contact, time_s) {
        (Some(contact), Some(time_s)) => {
            let [a, b] = contact.benches;
            let point = contact.point;
            print_line(format_args!(
                "first contact at {time_s:.6} s, benches {a} and {b}, at ({:.6}, {:.6}) m",
                point.x, point.y
            ))?;
        }
        _ => print_line(format_args!("no contact before the run ends, at {:.6} s", config.end_s()))?,
    }
    Ok(())
}

//! `echo`: prints one line per frame.

use std::fmt::Write as _;
use std::process::ExitCode;

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::{Frame, FrameHeader, HandleState};
use clap::Args;
use serde::Serialize;

use crate::cli::bus_readers::{WAIT_PERIOD, open_frames};
use crate::cli::flags::{BusArgs, Format, FormatArgs, count};
use crate::cli::print::{print_json, print_line};

/// Print each frame as it arrives, one line per frame.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon echo --count 1
  bench-dragon echo --format json | jq .sim_time_ns")]
pub(crate) struct EchoArgs {
    /// Number of frames to print [default: all, until Ctrl-C].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = count())]
    pub(crate) count: Option<u64>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

#[derive(Serialize)]
struct FrameLine {
    #[serde(flatten, with = "HeaderLine")]
    header: FrameHeader,
    handles: Vec<HandleLine>,
}

#[derive(Serialize)]
#[serde(remote = "FrameHeader")]
struct HeaderLine {
    run_id: u64,
    tick: u64,
    #[serde(rename = "sim_time_ns")]
    show_time_ns: i64,
    scheduled_ns: u64,
    published_ns: u64,
    head_travel_m: f64,
    head_speed_mps: f64,
    time_scale: f64,
    bench_count: u32,
    state: u32,
}

#[derive(Serialize)]
struct HandleLine {
    position_m: [f64; 3],
    velocity_mps: [f64; 3],
}

pub(crate) fn run(args: &EchoArgs) -> anyhow::Result<ExitCode> {
    let Some((mut frames, stop)) = open_frames(&args.bus, "echo")? else { return Ok(ExitCode::SUCCESS) };
    let mut left = args.count.unwrap_or(u64::MAX);
    while left > 0 && !stop.is_set() {
        let Some(frame) = frames.wait(WAIT_PERIOD)? else { continue };
        match args.format.format {
            Format::Json => print_json(&json_line(&frame))?,
            Format::Text => print_line(text_line(&frame))?,
        }
        left -= 1;
    }
    Ok(ExitCode::SUCCESS)
}

fn json_line(frame: &Frame) -> FrameLine {
    let handle = |&HandleState { position_m, velocity_mps }: &HandleState| HandleLine { position_m, velocity_mps };
    FrameLine { header: *frame.header(), handles: frame.handles().iter().map(handle).collect() }
}

fn text_line(frame: &Frame) -> String {
    let header = frame.header();
    let state = header.show_state().map_or("unknown", bench_dragon_ipc::ShowState::name);
    let mut line = format!("tick {:>8}  {:>12} s  {state:<8}", header.tick, Fixed::<6>(header.show_time_s()));
    let ends = [("front hinge", frame.handles().first()), ("rear hinge", frame.handles().last())];
    for (name, handle) in ends {
        let Some(handle) = handle else { continue };
        let [x, y, z] = handle.position_m;
        let height = if z == 0.0 { String::new() } else { format!(", {:>10}", Fixed::<6>(z)) };
        // Writing into a String cannot fail.
        let _ = write!(
            line,
            "  {name} ({:>11}, {:>11}{height}) m {:.6} m/s",
            Fixed::<6>(x),
            Fixed::<6>(y),
            handle.speed_mps()
        );
    }
    line
}

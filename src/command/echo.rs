//! `echo`: frames as they come, a line each.

use std::fmt::Write as _;
use std::process::ExitCode;

use bench_dragon_ipc::{Domain, Frame, FrameHeader, FrameSubscriber, HandleState};
use serde::Serialize;

use crate::cli::{EchoArgs, Format};
use crate::command::follow::{WAIT_PERIOD, open_when_there};
use crate::command::print::{print_json, print_line};
use crate::output::wait_for_reader;
use crate::system::stop::StopFlag;

#[derive(Serialize)]
struct FrameLine {
    run_id: u64,
    tick: u64,
    sim_time_ns: i64,
    scheduled_ns: u64,
    published_ns: u64,
    head_travel_m: f64,
    head_speed_mps: f64,
    time_scale: f64,
    bench_count: u32,
    state: u32,
    handles: Vec<HandleLine>,
}

#[derive(Serialize)]
struct HandleLine {
    position_m: [f64; 3],
    velocity_mps: [f64; 3],
}

pub(crate) fn run(args: &EchoArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    wait_for_reader(Some(&stop));
    let opened = open_when_there(domain.instance(), &stop, || FrameSubscriber::open(&domain, "echo"))?;
    let Some(mut frames) = opened else { return Ok(ExitCode::SUCCESS) };
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
    let FrameHeader { run_id, tick, sim_time_ns, scheduled_ns, published_ns, head_travel_m, .. } = *frame.header();
    let FrameHeader { head_speed_mps, time_scale, bench_count, state, .. } = *frame.header();
    let handle = |&HandleState { position_m, velocity_mps }: &HandleState| HandleLine { position_m, velocity_mps };
    let handles = frame.handles().iter().map(handle).collect();
    FrameLine {
        run_id,
        tick,
        sim_time_ns,
        scheduled_ns,
        published_ns,
        head_travel_m,
        head_speed_mps,
        time_scale,
        bench_count,
        state,
        handles,
    }
}

fn text_line(frame: &Frame) -> String {
    let header = frame.header();
    let state = header.show_state().map_or("unknown", bench_dragon_ipc::ShowState::name);
    let mut line = format!("tick {:>8}  {:>12.6} s  {state:<8}", header.tick, header.sim_time_s());
    let ends = [("head", frame.handles().first()), ("tail", frame.handles().last())];
    for (name, handle) in ends {
        let Some(handle) = handle else { continue };
        let [x, y, _] = handle.position_m;
        // Writing into a String cannot fail.
        let _ = write!(line, "  {name} ({x:>11.6}, {y:>11.6}) m {:.6} m/s", handle.speed_mps());
    }
    line
}

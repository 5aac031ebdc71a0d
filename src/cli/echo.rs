//! `echo`: prints one line per frame.

use std::fmt::Write as _;
use std::process::ExitCode;

use bench_dragon_geometry::number::Fixed;
use bench_dragon_ipc::{DragonMotion, Frame, FrameHeader, HandleState};
use clap::Args;
use serde::Serialize;

use crate::cli::bus_readers::{Descriptions, WAIT_PERIOD, open_frames};
use crate::cli::flags::{BusArgs, Format, FormatArgs, count};
use crate::cli::print::{print_json, print_line};
use crate::config::NamedLayout;
use crate::system::stop::StopFlag;

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
struct FrameLine<'a> {
    #[serde(flatten, with = "HeaderLine")]
    header: FrameHeader,
    #[serde(flatten)]
    dragons: DragonsLine<'a>,
}

/// What follows the values of the show: the handles of one dragon, or the dragons of a plan.
#[derive(Serialize)]
#[serde(untagged)]
enum DragonsLine<'a> {
    One { handles: Vec<HandleLine> },
    Plan { course_m: f64, course_mps: f64, dragons: Vec<DragonLine<'a>> },
}

#[derive(Serialize)]
struct DragonLine<'a> {
    name: &'a str,
    travel_m: f64,
    speed_mps: f64,
    first_handle: u32,
    bench_count: u32,
    state: u32,
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
    let mut names = RunNames::default();
    let mut left = args.count.unwrap_or(u64::MAX);
    while left > 0 && !stop.is_set() {
        let Some(frame) = frames.wait(WAIT_PERIOD)? else { continue };
        let Some(names) = names.of(frame.header(), args, &stop)? else { break };
        match args.format.format {
            Format::Json => print_json(&json_line(&frame, names))?,
            Format::Text => print_line(text_line(&frame, names))?,
        }
        left -= 1;
    }
    Ok(ExitCode::SUCCESS)
}

/// The names of the dragons of the present run.
#[derive(Default)]
struct RunNames {
    /// Opened for the first frame of a plan.
    descriptions: Option<Descriptions>,
    run_id: Option<u64>,
    names: NamedLayout,
}

impl RunNames {
    /// Returns the names of a frame's dragons, none for the short form for one dragon. `None` if a signal arrives first.
    fn of(&mut self, header: &FrameHeader, args: &EchoArgs, stop: &StopFlag) -> anyhow::Result<Option<&NamedLayout>> {
        if self.run_id != Some(header.run_id) {
            self.names = NamedLayout::default();
            if header.is_plan == 1 {
                let descriptions = match &mut self.descriptions {
                    Some(descriptions) => descriptions,
                    none => none.insert(Descriptions::open(&args.bus.domain()?, "echo-description", stop)?),
                };
                let Some(description) = descriptions.of(header.run_id, stop)? else { return Ok(None) };
                self.names = NamedLayout::of_toml(&description.toml);
            }
            self.run_id = Some(header.run_id);
        }
        Ok(Some(&self.names))
    }
}

fn json_line<'a>(frame: &Frame, names: &'a NamedLayout) -> FrameLine<'a> {
    let header = *frame.header();
    let lines = |handles: &[HandleState]| {
        let line = |&HandleState { position_m, velocity_mps }: &HandleState| HandleLine { position_m, velocity_mps };
        handles.iter().map(line).collect()
    };
    let dragon = |(number, motion): (usize, &DragonMotion)| {
        let &DragonMotion { travel_m, speed_mps, first_handle, bench_count, state, .. } = motion;
        let (name, handles) = (names.name(number).unwrap_or_default(), lines(&frame.handles()[motion.handles()]));
        DragonLine { name, travel_m, speed_mps, first_handle, bench_count, state, handles }
    };
    let dragons = if header.is_plan == 1 {
        let dragons = header.dragons().iter().enumerate().map(dragon).collect();
        DragonsLine::Plan { course_m: header.course_m, course_mps: header.course_mps, dragons }
    } else {
        DragonsLine::One { handles: lines(frame.handles()) }
    };
    FrameLine { header, dragons }
}

fn text_line(frame: &Frame, names: &NamedLayout) -> String {
    let header = frame.header();
    let state = header.show_state().map_or("unknown", bench_dragon_ipc::ShowState::name);
    let mut line = format!("tick {:>8}  {:>12} s  {state:<8}", header.tick, Fixed::<6>(header.show_time_s()));
    for (number, motion) in header.dragons().iter().enumerate() {
        let handles = &frame.handles()[motion.handles()];
        let name = names.name(number).map(|name| format!("{name} ")).unwrap_or_default();
        let ends = [("front hinge", handles.first()), ("rear hinge", handles.last())];
        for (hinge, handle) in ends {
            let Some(handle) = handle else { continue };
            let [x, y, z] = handle.position_m;
            let height = if z == 0.0 { String::new() } else { format!(", {:>10}", Fixed::<6>(z)) };
            // Writing into a String cannot fail.
            let _ = write!(
                line,
                "  {name}{hinge} ({:>11}, {:>11}{height}) m {:.6} m/s",
                Fixed::<6>(x),
                Fixed::<6>(y),
                handle.speed_mps()
            );
        }
    }
    line
}

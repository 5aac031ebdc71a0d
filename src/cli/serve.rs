//! `serve`: the server process.

use std::net::SocketAddr;
use std::process::ExitCode;

use anyhow::Context as _;
use bench_dragon_geometry::number::{Fixed, Number};
use bench_dragon_geometry::route::RouteShape;
use bench_dragon_ipc::{Request, RunStart};
use clap::{Args, Parser as _};
use serde::{Deserialize, Serialize};

use crate::cli::flags::{BadInput, BusArgs, ConfigArgs, Format, FormatArgs, ReaderArgs, finite, within};
use crate::cli::print::{behind, percentiles, print_notice, print_report, print_to_stderr};
use crate::cli::timecode::{AwaitedTimecode, FollowedTimecode, TimecodeArgs};
use crate::cli::{Cli, Subcommand, in_file, load_config};
use crate::config::{CATCH_UP_S, CPU, Config, Document, Priority, RATE_HZ, SPIN_US, TIME_SCALE};
use crate::output::Counted;
use crate::source::server::{Server, ServerSettings, ServerSummary, TimecodeNews};
use crate::source::timecode::TimecodeCounts;
use crate::system::processors::Processors;
use crate::system::stop::StopFlag;

/// Run the server: advance the dragon at a fixed rate and publish every frame.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon serve
  bench-dragon serve --config stage.toml --rate 250 --start-at 120 --held
  bench-dragon serve --cpu 1 --priority fifo:80
  bench-dragon serve --timecode osc:7000 --timecode-offset -3600
  bench-dragon serve --timecode artnet:0.0.0.0
  bench-dragon serve --guarded                needs a guard to move: monitor --guard

With --timecode, show time is the timecode plus the offset. The show stands still until the first timecode, then seeks to its \
position and follows it, up to a tenth faster or slower. If show and timecode differ by more than half a second, the show \
seeks again. If the timecode repeats a position, the show stands still. If the timecode falls silent, it is lost, and the show \
goes on without it. An operator's pause or hold takes precedence. OSC messages are \"HH:MM:SS:FF\", \"HH:MM:SS.mmm\", four \
whole numbers, or seconds.")]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag")]
pub(crate) struct ServeArgs {
    #[command(flatten)]
    pub(crate) run: RunArgs,
    /// Wait at the start: the dragon stands still until `ctl release`.
    #[arg(long)]
    pub(crate) held: bool,
    /// Start held, as the continuation of a server that has ended.
    #[arg(long, hide = true, conflicts_with = "held")]
    pub(crate) restarted: bool,
    /// Move the head only on travel that `monitor --guard` has proved free of contact.
    #[arg(long)]
    pub(crate) guarded: bool,
    /// Stand finished at the time of --until, instead of ending.
    #[arg(long, hide = true)]
    pub(crate) stay: bool,
    /// Start paused, or be paused once the hold is lifted.
    #[arg(long, hide = true)]
    pub(crate) paused: bool,
    #[command(flatten)]
    pub(crate) readers: ReaderArgs,
    /// Travel in metres to start at, for a run whose speed was changed earlier.
    #[arg(long, value_name = "METRES", hide = true, allow_negative_numbers = true, value_parser = finite)]
    pub(crate) start_travel: Option<f64>,
    /// Speed of the head in m/s to start with, for a run whose speed was changed earlier.
    #[arg(long, value_name = "MPS", hide = true, value_parser = finite)]
    pub(crate) start_speed: Option<f64>,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Arguments of a run: the bus, the configuration, the pace and the timecode.
#[derive(Clone, Debug, Args)]
pub(crate) struct RunArgs {
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) pace: PaceArgs,
    #[command(flatten)]
    pub(crate) timecode: TimecodeArgs,
}

/// Arguments for the rate, the time scale and the interval of a run.
#[derive(Clone, Debug, Args)]
pub(crate) struct PaceArgs {
    /// Frames per second, 1 to 100000 [default: configured, else 1000].
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = within(RATE_HZ))]
    pub(crate) rate: Option<u32>,
    /// Show seconds per wall-clock second, 0.001 to 1000 [default: configured, else 1].
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = within(TIME_SCALE))]
    pub(crate) time_scale: Option<f64>,
    /// Longest standstill in wall-clock seconds that the show makes up in one jump, 0 to 10; it makes up a longer one slowly
    /// [default: configured, else 0.25].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = within(CATCH_UP_S))]
    pub(crate) catch_up: Option<f64>,
    /// Show time to start at, in seconds [default: the start of the plan].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) start_at: Option<f64>,
    /// Show time to end at, in seconds [default: the end of the plan].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) until: Option<f64>,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArgs,
}

/// Requests of a server to the kernel, to keep its schedule.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct RealTimeArgs {
    /// Keep the server's loop on the processor of this number, 0 to 1023 [default: configured, else any].
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = within(CPU))]
    pub(crate) cpu: Option<u32>,
    /// Scheduling of the server's loop: other, fifo:N or rr:N, N from 1 to 99; fifo and rr also lock its memory [default:
    /// configured, else other].
    #[arg(long, value_name = "POLICY")]
    pub(crate) priority: Option<Priority>,
    /// Microseconds before each due instant in which the server's loop spins instead of sleeping, 0 to 1000 [default: configured,
    /// else 0].
    #[arg(long, value_name = "MICROSECONDS", allow_negative_numbers = true, value_parser = within(SPIN_US))]
    pub(crate) spin_us: Option<u32>,
}

/// A line that `serve` prints.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub enum ServeLine {
    /// The server has opened its services.
    Started {
        /// The run's number.
        run_id: u64,
    },
    /// The server listens for timecode.
    Listening {
        /// The address and port.
        listen: SocketAddr,
    },
    /// A change of the timecode that the server follows.
    Timecode(TimecodeNews),
    /// Counts of the received timecode, at the end.
    TimecodeSummary(TimecodeCounts),
    /// The server has ended.
    Summary(ServerSummary),
}

pub(crate) fn run(args: &ServeArgs) -> anyhow::Result<ExitCode> {
    let settings = settings(args)?;
    let domain = args.run.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    warn_of_early_end(&settings.config);
    let timecode =
        AwaitedTimecode::start(&args.run.timecode, &settings.config, settings.start.until_s, args.format.format)?;
    let mut server = Server::create(&domain, settings)?;
    announce(args, &server)?;
    let timecode = timecode.map(|timecode| timecode.lead(&mut server)).transpose()?;
    let summary = server.run(stop.as_atomic())?;
    timecode.map_or(Ok(()), FollowedTimecode::finish)?;
    let text = summary_text(&summary);
    print_report(args.format.format, &ServeLine::Summary(summary), text)?;
    Ok(ExitCode::SUCCESS)
}

/// Reads the configuration, overrides it with the flags, and checks it for a server on this machine.
pub(crate) fn configure(args: &ConfigArgs, pace: &PaceArgs, is_guarded: bool) -> anyhow::Result<Config> {
    let RealTimeArgs { cpu, priority, spin_us } = pace.real_time;
    let config = load_config(args, |Document { serve, monitor, .. }| {
        serve.rate_hz = pace.rate.unwrap_or(serve.rate_hz);
        serve.time_scale = pace.time_scale.unwrap_or(serve.time_scale);
        serve.catch_up_s = pace.catch_up.unwrap_or(serve.catch_up_s);
        serve.cpu = cpu.or(serve.cpu);
        serve.priority = priority.unwrap_or(serve.priority);
        serve.spin_us = spin_us.unwrap_or(serve.spin_us);
        monitor.guard |= is_guarded;
    })?;
    check_cpu(&config)?;
    in_file(args, config.require_start())?;
    Ok(config)
}

/// Checks that the server's loop may run on the configured processor.
fn check_cpu(config: &Config) -> anyhow::Result<()> {
    let Some(cpu) = config.tables().serve.cpu else { return Ok(()) };
    let allowed = Processors::of_this_process().context("cannot read the processors of this process")?;
    if allowed.contains(cpu) {
        return Ok(());
    }
    Err(BadInput(format!("cpu is {cpu}, must be one that this process may run on: {allowed}")).into())
}

/// Checks the start and the end of a show that walks at the planned speed.
pub(crate) fn check_pace(config: &Config, pace: &PaceArgs) -> Result<(), BadInput> {
    let start_s = start_s(config, pace);
    require("--start-at", start_s, config.start_s(), config.last_seek_s())?;
    pace.until.map_or(Ok(()), |until_s| require("--until", until_s, start_s, end_s(config, start_s)))
}

/// Show time in seconds at which a show ends that starts at `start_s`.
pub(crate) fn end_s(config: &Config, start_s: f64) -> f64 {
    config.end_from_s(start_s)
}

fn start_s(config: &Config, pace: &PaceArgs) -> f64 {
    pace.start_at.unwrap_or_else(|| config.start_s())
}

fn settings(args: &ServeArgs) -> anyhow::Result<ServerSettings> {
    let config = configure(&args.run.config, &args.run.pace, args.guarded)?;
    let start = start(args, &config)?;
    Ok(ServerSettings { config, start, readers: args.readers.expected() })
}

/// The start of a run of this configuration by these arguments of `serve`. Arguments that change the configuration have no effect.
///
/// # Errors
/// An argument is unknown or not valid.
pub fn run_start(args: &[String], config: &Config) -> anyhow::Result<RunStart> {
    let words = ["bench-dragon", "serve"].map(str::to_owned).into_iter().chain(args.iter().cloned());
    match Cli::try_parse_from(words)?.subcommand {
        Subcommand::Serve(args) => start(&args, config),
        _ => unreachable!("the first word is serve"),
    }
}

fn start(args: &ServeArgs, config: &Config) -> anyhow::Result<RunStart> {
    match args.start_travel {
        // The speed was changed earlier, so show time does not determine the travel.
        Some(travel_m) => {
            let formation = config.formation();
            require("--start-travel", travel_m, formation.begin_m(), formation.end_m())?;
            args.run.pace.until.map_or(Ok(()), |until_s| require_from("--until", until_s, config.start_s()))?;
        }
        None => check_pace(config, &args.run.pace)?,
    }
    if let Some(speed_mps) = args.start_speed {
        require("--start-speed", speed_mps, 0.0, Request::MAX_SPEED_MPS)?;
    }
    let planned = ServerSettings::planned_start(config, start_s(config, &args.run.pace));
    Ok(RunStart {
        travel_m: args.start_travel.unwrap_or(planned.travel_m),
        speed_mps: args.start_speed.unwrap_or(planned.speed_mps),
        until_s: args.run.pace.until,
        is_ready: args.held,
        is_held: args.restarted,
        is_restarted: args.restarted,
        is_paused: args.paused,
        stays: args.stay,
        ..planned
    })
}

/// Warns if the dragon cannot walk up to the planned end. On a spiral without an end, no dragon reaches the centre.
fn warn_of_early_end(config: &Config) {
    let Some(named) = config.named() else { return warn_of_early_end_of("the run", config, config.end_s()) };
    for (dragon, planned) in named.dragons().iter().zip(config.formation().dragons()) {
        warn_of_early_end_of(&dragon.name, &dragon.config, planned.timetable.end_s());
    }
}

fn warn_of_early_end_of(name: &str, config: &Config, end_s: f64) {
    let Some(spot) = config.lead().tight_spot() else { return };
    let end = config.lead().feasible_end();
    match (config.route().end_s, &config.route().shape) {
        (None, RouteShape::Spiral(_)) => {}
        (Some(planned_s), _) => {
            tracing::warn!("{name} ends at {} s, not at end_s {planned_s}: there {end}: {spot}", Fixed::<6>(end_s));
        }
        (None, _) => {
            tracing::warn!("{name} ends at {} s, before the route ends: there {end}: {spot}", Fixed::<6>(end_s));
        }
    }
}

fn require(flag: &str, value: f64, lowest: f64, highest: f64) -> Result<(), BadInput> {
    if (lowest..=highest).contains(&value) {
        return Ok(());
    }
    Err(BadInput(format!("{flag} is {}, must be from {lowest} to {highest}", Number(value))))
}

fn require_from(flag: &str, value: f64, lowest: f64) -> Result<(), BadInput> {
    if value >= lowest {
        return Ok(());
    }
    Err(BadInput(format!("{flag} is {}, must be at least {lowest}", Number(value))))
}

fn announce(args: &ServeArgs, server: &Server) -> anyhow::Result<()> {
    let (format, instance, run_id) = (args.format.format, &args.run.bus.instance, server.run_id());
    let text = format!("serving instance {instance}, run {run_id}; Ctrl-C ends it");
    print_notice(format, &ServeLine::Started { run_id }, &text)?;
    if format == Format::Text && server.is_guarded() {
        print_to_stderr(
            "guarded: the head walks only on travel that `bench-dragon monitor --guard` has proved free of contact",
        );
    }
    Ok(())
}

fn summary_text(summary: &ServerSummary) -> String {
    let &ServerSummary { frames, show_time_s, overruns, behind_s, most_behind_s, lateness_us, tick_us, .. } = summary;
    format!(
        "{} to {} s, {}{}, lateness {}, tick {} \u{b5}s",
        Counted(frames, "frame"),
        Fixed::<6>(show_time_s),
        Counted(overruns, "overrun"),
        behind(behind_s, most_behind_s),
        percentiles(lateness_us),
        percentiles(tick_us)
    )
}

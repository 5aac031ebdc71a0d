//! `serve`: the server process.

use std::process::ExitCode;

use anyhow::Context as _;
use bench_dragon_geometry::dragon::RunEnd;
use bench_dragon_geometry::number::Number;
use bench_dragon_geometry::route::RouteSpec;
use bench_dragon_ipc::{Domain, Request};

use crate::cli::{BadInput, ConfigArgs, Format, PaceArgs, RealTimeArgs, ServeArgs};
use crate::command::load_config;
use crate::command::print::{behind, complain, percentiles, print_notice, print_report};
use crate::command::timecode::{AwaitedTimecode, FollowedTimecode};
use crate::config::{Config, Overrides};
use crate::output::Counted;
use crate::output::report::ServeLine;
use crate::source::server::{Server, ServerSettings, ServerSummary};
use crate::system::processors::Processors;
use crate::system::stop::StopFlag;

pub(crate) fn run(args: &ServeArgs) -> anyhow::Result<ExitCode> {
    let settings = settings(args)?;
    let domain = Domain::new(args.run.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    warn_of_early_end(&settings.config);
    let timecode = AwaitedTimecode::start(&args.run.timecode, &settings.config, settings.until_s, args.format.format)?;
    let mut server = Server::create(&domain, settings)?;
    announce(args, &server)?;
    let timecode = timecode.map(|timecode| timecode.lead(&mut server)).transpose()?;
    let summary = server.run(stop.as_atomic())?;
    timecode.map_or(Ok(()), FollowedTimecode::finish)?;
    let text = summary_text(&summary);
    print_report(args.format.format, &ServeLine::Summary(summary), text)?;
    Ok(ExitCode::SUCCESS)
}

/// The configuration with the flags over it, for a server on this machine.
pub(crate) fn configure(args: &ConfigArgs, pace: &PaceArgs, guard: bool) -> anyhow::Result<Config> {
    let RealTimeArgs { cpu, priority, spin_us } = pace.real_time;
    let PaceArgs { rate: rate_hz, time_scale, catch_up: catch_up_s, .. } = *pace;
    let overrides = Overrides { rate_hz, time_scale, catch_up_s, cpu, priority, spin_us, guard };
    let config = load_config(args, overrides)?;
    check_cpu(&config)?;
    Ok(config)
}

/// Checks that the server's loop may run where it is to.
fn check_cpu(config: &Config) -> anyhow::Result<()> {
    let Some(cpu) = config.cpu() else { return Ok(()) };
    let allowed = Processors::of_this_process().context("cannot tell the processors")?;
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

/// Show time at which a show ends that starts at a time.
pub(crate) fn end_s(config: &Config, start_s: f64) -> f64 {
    if start_s == config.start_s() { config.end_s() } else { config.timetable_from(start_s).end_s() }
}

fn start_s(config: &Config, pace: &PaceArgs) -> f64 {
    pace.start_at.unwrap_or_else(|| config.start_s())
}

fn settings(args: &ServeArgs) -> anyhow::Result<ServerSettings> {
    let config = configure(&args.run.config, &args.run.pace, args.guarded)?;
    match args.start_travel {
        // The speed was changed on the way, so show time says nothing of the travel.
        Some(travel_m) => {
            let dragon = config.dragon();
            require("--start-travel", travel_m, dragon.start_travel_m(), dragon.end_travel_m())?;
            args.run.pace.until.map_or(Ok(()), |until_s| require_from("--until", until_s, config.start_s()))?;
        }
        None => check_pace(&config, &args.run.pace)?,
    }
    if let Some(speed_mps) = args.start_speed {
        require("--start-speed", speed_mps, 0.0, Request::MAX_SPEED_MPS)?;
    }
    Ok(ServerSettings {
        start_s: start_s(&config, &args.run.pace),
        config,
        start_travel_m: args.start_travel,
        start_speed_mps: args.start_speed,
        until_s: args.run.pace.until,
        held: args.held,
        paused: args.paused,
        readers: args.readers,
    })
}

/// Warns where the dragon cannot walk all of a planned turnaround.
fn warn_of_early_end(config: &Config) {
    if let (RouteSpec::Turnaround(plan), end) = (config.route(), config.dragon().run_end())
        && end != RunEnd::RouteEnd
    {
        tracing::warn!("the run ends at {:.6} s, not at end_s {}: there {end}", config.end_s(), plan.end_s);
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
        complain("guarded: the head walks where `bench-dragon monitor --guard` has proved the way free");
    }
    Ok(())
}

fn summary_text(summary: &ServerSummary) -> String {
    let &ServerSummary { frames, sim_time_s, overruns, behind_s, most_behind_s, lateness_us, tick_us, .. } = summary;
    format!(
        "{} to {sim_time_s:.6} s, {}{}, lateness {}, tick {} \u{b5}s",
        Counted(frames, "frame"),
        Counted(overruns, "overrun"),
        behind(behind_s, most_behind_s),
        percentiles(lateness_us),
        percentiles(tick_us)
    )
}

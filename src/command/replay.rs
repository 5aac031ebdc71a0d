//! `replay`: a recording back onto the bus.

use std::process::ExitCode;

use bench_dragon::replay::{Pass, PassSummary, Replay, ReplaySettings};
use bench_dragon::report::ReplayLine;
use bench_dragon::stop::StopFlag;
use bench_dragon_ipc::Domain;

use crate::cli::{Format, ReplayArgs};
use crate::command::output::{complain, complain_of_flaws, percentiles, print_json, print_line};
use crate::command::printable::Printable;

pub(crate) fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let mut replay = Replay::open(&domain, settings(args)?)?;
    while let Some(pass) = replay.next_pass(stop.as_atomic())? {
        announce(args, &pass)?;
        print_pass(args.format.format, pass.play(stop.as_atomic())?)?;
    }
    let summary = replay.finish();
    complain_of_flaws(&args.file, summary.flaws, "replayed");
    if args.format.format == Format::Json {
        print_json(&ReplayLine::Summary(summary))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn settings(args: &ReplayArgs) -> anyhow::Result<ReplaySettings> {
    let laps = match args.repeat {
        None => Some(1),
        Some(laps) => laps,
    };
    let interval = args.interval.interval()?;
    Ok(ReplaySettings { file: args.file.clone(), interval, rate: args.rate, laps, readers: args.readers })
}

fn announce(args: &ReplayArgs, pass: &Pass<'_>) -> anyhow::Result<()> {
    let (run_id, recorded_run_id) = (pass.run_id(), pass.recorded_run_id());
    match args.format.format {
        Format::Json => print_json(&ReplayLine::Started { run_id, recorded_run_id }),
        Format::Text => {
            let (file, instance) = (Printable(&args.file), &args.bus.instance);
            complain(&format!("replaying {file} on instance {instance}, run {run_id}; Ctrl-C ends it"));
            Ok(())
        }
    }
}

fn print_pass(format: Format, pass: PassSummary) -> anyhow::Result<()> {
    if format == Format::Json {
        return print_json(&ReplayLine::Pass(pass));
    }
    let PassSummary { frames, missing, sim_time_s, overruns, lateness_us, tick_us, .. } = pass;
    let missing = if missing > 0 { format!(" ({missing} missing in the recording)") } else { String::new() };
    print_line(format_args!(
        "{frames} frames{missing} to {sim_time_s:.6} s, {overruns} overruns, lateness {}, tick {} \u{b5}s",
        percentiles(lateness_us),
        percentiles(tick_us)
    ))?;
    Ok(())
}

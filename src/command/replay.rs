//! `replay`: a recording back onto the bus.

use std::path::Path;
use std::process::ExitCode;

use bench_dragon_ipc::Domain;

use crate::cli::{Format, ReplayArgs};
use crate::command::BadInput;
use crate::command::output::{complain, complain_of_flaws, percentiles, print_json, print_line};
use crate::command::printable::Printable;
use crate::command::verify;
use crate::output::number::Counted;
use crate::output::report::ReplayLine;
use crate::source::replay::{Pass, PassSummary, Replay, ReplaySettings};
use crate::system::stop::StopFlag;

pub(crate) fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    if args.verify {
        return verify::run(&args.files, args.format.format);
    }
    let [file] = &args.files[..] else {
        return Err(BadInput(format!("{} FILEs are given: only --verify takes several", args.files.len())).into());
    };
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let mut replay = Replay::open(&domain, settings(args, file)?)?;
    while let Some(pass) = replay.next_pass(stop.as_atomic())? {
        announce(args, file, &pass)?;
        print_pass(args.format.format, pass.play(stop.as_atomic())?)?;
    }
    let summary = replay.finish();
    complain_of_flaws(file, summary.flaws, "replayed");
    if args.format.format == Format::Json {
        print_json(&ReplayLine::Summary(summary))?;
    }
    Ok(ExitCode::SUCCESS)
}

fn settings(args: &ReplayArgs, file: &Path) -> anyhow::Result<ReplaySettings> {
    let laps = match args.repeat {
        None => Some(1),
        Some(laps) => laps,
    };
    let interval = args.interval.interval()?;
    Ok(ReplaySettings { file: file.to_owned(), interval, rate: args.rate, laps, readers: args.readers })
}

fn announce(args: &ReplayArgs, file: &Path, pass: &Pass<'_>) -> anyhow::Result<()> {
    let (run_id, recorded_run_id) = (pass.run_id(), pass.recorded_run_id());
    match args.format.format {
        Format::Json => print_json(&ReplayLine::Started { run_id, recorded_run_id }),
        Format::Text => {
            let (file, instance) = (Printable(file), &args.bus.instance);
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
        "{}{missing} to {sim_time_s:.6} s, {}, lateness {}, tick {} \u{b5}s",
        Counted(frames, "frame"),
        Counted(overruns, "overrun"),
        percentiles(lateness_us),
        percentiles(tick_us)
    ))?;
    Ok(())
}

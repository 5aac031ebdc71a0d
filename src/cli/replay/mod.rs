//! `replay`: plays a recording back onto the bus, or with `--verify` simulates it again and compares.

mod verification;

use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bench_dragon_geometry::number::Fixed;
use clap::{Args, ValueHint};
use serde::Serialize;

use crate::cli::flags::{BusArgs, Format, FormatArgs, IntervalArgs, ReaderArgs, count, within};
use crate::cli::parts::{find_parts, warn_of_gaps, warn_of_part};
use crate::cli::print::{percentiles, print_json, print_notice, print_report, warn_of_flaws};
use crate::output::Counted;
use crate::output::terminal_text::Printable;
use crate::source::replay::{Pass, PassSummary, RATE, Replay, ReplaySettings, ReplaySummary};
use crate::system::stop::StopFlag;

/// Play a recording back onto the bus, at its recorded pace or at another one.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon replay tonight                                  the folder of a show
  bench-dragon replay tonight --paused --stay                  to look at it with view or watch
  bench-dragon replay tonight --verify
  bench-dragon replay rehearsal.mcap --instance archive --readers 2
  bench-dragon replay rehearsal.mcap --from 60 --to 90 --rate 0.5 --loop

A folder stands for all its recordings: their parts are joined in the order in which they were recorded, and gaps between them \
are named. Each pass of a recorded run gets a new run id. Its ticks count from 0, its frames are due now, and its time_scale is \
multiplied by the rate. All other values are as recorded. Recorded alerts and commands are published in step with the frames. \
--from and --to select frames by show time, anywhere in the recording; the replay leaves out all other frames.

A replay accepts `ctl pause`, `resume`, `seek`, `pace` and `stop`. A seek takes a position: seconds since the first frame of the \
recording.

Exit status of --verify: 0 if every recorded frame is as simulated, 1 if a frame differs, 2 if a part cannot be verified. A gap \
is no wrong frame: it does not change the exit status, and is reported with the number of missing frames.")]
#[expect(clippy::struct_excessive_bools, reason = "each is a flag")]
pub(crate) struct ReplayArgs {
    /// Recording to play, or the folder of a show; several files are joined.
    #[arg(value_name = "FILE|FOLDER", required = true, num_args = 1.., value_hint = ValueHint::AnyPath)]
    pub(crate) files: Vec<PathBuf>,
    /// Instead of playing, simulate the recorded runs again, compare every frame bit for bit, and report the first difference.
    /// Needs no server.
    #[arg(long, conflicts_with_all = ["from", "to", "rate", "repeat", "readers", "instance", "frames_only", "paused", "stay"])]
    pub(crate) verify: bool,
    #[command(flatten)]
    pub(crate) interval: IntervalArgs,
    /// Recorded seconds to play per wall-clock second, 0.01 to 100.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, allow_negative_numbers = true, value_parser = within(RATE))]
    pub(crate) rate: f64,
    /// Number of times to play the recording; without a number, until Ctrl-C [default: once].
    #[arg(long = "loop", value_name = "TIMES", num_args = 0..=1, allow_negative_numbers = true, value_parser = count())]
    #[allow(clippy::option_option, reason = "not given, given without a number, given with one")]
    pub(crate) repeat: Option<Option<u64>>,
    #[command(flatten)]
    pub(crate) readers: ReaderArgs,
    /// Leave out the recorded alerts and commands, for example where a monitor reports its own alerts.
    #[arg(long)]
    pub(crate) frames_only: bool,
    /// Begin paused: `ctl resume` or the page plays on.
    #[arg(long)]
    pub(crate) paused: bool,
    /// At the end, stand on the last frame until `ctl stop` or Ctrl-C.
    #[arg(long)]
    pub(crate) stay: bool,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// A line that `replay` prints.
#[derive(Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
enum ReplayLine {
    /// The services of a pass are open.
    Started {
        /// The run id of the pass on the bus.
        run_id: u64,
        /// The run id in the recording.
        recorded_run_id: u64,
    },
    Pass(PassSummary),
    Summary(ReplaySummary),
}

pub(crate) fn run(args: &ReplayArgs) -> anyhow::Result<ExitCode> {
    if args.verify {
        return verification::run(&args.files, args.format.format);
    }
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let settings = settings(args)?;
    let (named, are_joined) = (settings.parts.named.clone(), settings.parts.are_joined());
    warn_of_part(&settings.parts);
    let mut replay = Replay::open(&domain, settings)?;
    while let Some(pass) = replay.next_pass(stop.as_atomic())? {
        announce(args, &named, &pass)?;
        print_pass(args.format.format, pass.play(stop.as_atomic())?)?;
    }
    let (summary, findings) = replay.finish();
    for file in findings.flawed {
        warn_of_flaws(&file.file, file.flaws, "replayed");
    }
    if let Some(coverage) = findings.coverage.filter(|_| are_joined) {
        warn_of_gaps(&coverage);
    }
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
    Ok(ReplaySettings {
        parts: find_parts(&args.files)?,
        interval,
        rate: args.rate,
        laps,
        readers: args.readers.expected(),
        is_frames_only: args.frames_only,
        is_paused: args.paused,
        stays: args.stay,
    })
}

fn announce(args: &ReplayArgs, named: &Path, pass: &Pass<'_>) -> anyhow::Result<()> {
    let (run_id, recorded_run_id) = (pass.run_id(), pass.recorded_run_id());
    let (file, instance) = (Printable(named), &args.bus.instance);
    let text = format!("replaying {file} on instance {instance}, run {run_id}; Ctrl-C ends it");
    print_notice(args.format.format, &ReplayLine::Started { run_id, recorded_run_id }, &text)
}

fn print_pass(format: Format, pass: PassSummary) -> anyhow::Result<()> {
    let PassSummary { frames, missing, show_time_s, overruns, lateness_us, tick_us, .. } = pass;
    let missing = if missing > 0 { format!(" ({missing} missing in the recording)") } else { String::new() };
    let text = format!(
        "{}{missing} to {} s, {}, lateness {}, tick {} \u{b5}s",
        Counted(frames, "frame"),
        Fixed::<6>(show_time_s),
        Counted(overruns, "overrun"),
        percentiles(lateness_us),
        percentiles(tick_us)
    );
    print_report(format, &ReplayLine::Pass(pass), text)
}

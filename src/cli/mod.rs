//! The command line's types. What the commands do is in [`crate::command`].

mod bridge;
mod recording;
mod solve;
mod timecode;
mod value;
#[cfg(feature = "zenoh")]
mod zenoh;

use std::path::PathBuf;

use bench_dragon::config::Priority;
use bench_dragon_ipc::Instance;
use clap::{Args, Parser, Subcommand, ValueEnum};

pub(crate) use bridge::{Angle, Bridge, BridgeArgs, NetworkArgs, OscArgs, PsnArgs};
pub(crate) use recording::{ExportArgs, ReplayArgs, TableFile};
pub(crate) use solve::{
    ContactArgs, FigureArgs, FigureFile, PitchArgs, PosesArgs, Question, SaveConfigArgs, SensitivityArgs, SolveArgs,
    SpeedLimitArgs, TableFormat, TimesArgs, TurnArgs, TurnPlanArgs,
};
#[cfg(feature = "zenoh")]
pub(crate) use zenoh::ZenohArgs;

pub(crate) use timecode::TimecodeArgs;

use value::{
    count, cpu, duration, file_megabytes, finite, instance, period, priority, rate, readers, speed, spin, time_scale,
    total_megabytes,
};

/// Real-time motion server for the bench dragon.
#[derive(Debug, Parser)]
#[command(name = "bench-dragon", version, about, propagate_version = true, disable_help_subcommand = true)]
#[command(after_help = "Examples:
  bench-dragon show --time-scale 20           the paper's dragon, to its first contact
  bench-dragon serve --config stage.toml      a server alone
  bench-dragon ctl pause                      a command to it
  bench-dragon solve contact --format json    when do two benches touch?

Exit status: 0 done, 1 failed, 2 bad arguments or configuration, 3 contact seen with --fail-on-contact.
RUST_LOG=debug tells more of what goes on.")]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Play a show: serve, monitor and record until contact, the end or Ctrl-C, then report.
    #[command(after_help = "Examples:
  bench-dragon show --time-scale 20
  bench-dragon show --config stage.toml --out rehearsal-3 --fail-on-contact
  bench-dragon show --guard --start-at 405")]
    Show(ShowArgs),
    /// Advance the dragon at a fixed rate and publish every frame.
    #[command(after_help = "Examples:
  bench-dragon serve
  bench-dragon serve --config stage.toml --rate 250 --start-at 120 --held
  bench-dragon serve --cpu 1 --priority fifo:80
  bench-dragon serve --timecode osc:7000 --timecode-offset -3600
  bench-dragon serve --timecode artnet:0.0.0.0
  bench-dragon serve --guarded                moves only while a guard runs: monitor --guard

With --timecode, show time is the timecode plus the offset. The show stands until the first timecode, is put to its
position, and follows by its pace, up to a tenth faster or slower; over half a second of difference it is put there anew. A
timecode that is repeated stands, and the show with it; one that falls silent is lost, and the show goes on. An operator's
pause and hold come first. OSC messages are \"HH:MM:SS:FF\", \"HH:MM:SS.mmm\", four whole numbers, or seconds.")]
    Serve(ServeArgs),
    /// Watch for benches that come near, touch and part.
    #[command(after_help = "Examples:
  bench-dragon monitor
  bench-dragon monitor --format json --fail-on-contact
  bench-dragon monitor --guard                for a server that was started with --guarded")]
    Monitor(MonitorArgs),
    /// Record every frame into an MCAP file.
    #[command(after_help = "Examples:
  bench-dragon record rehearsal.mcap
  bench-dragon record rehearsal.mcap --rotate-mb 1000 --max-total-mb 20000
  bench-dragon record --repair rehearsal.mcap")]
    Record(RecordArgs),
    /// Put a recording back onto the bus, at its pace.
    #[command(after_help = "Examples:
  bench-dragon replay rehearsal.mcap
  bench-dragon replay rehearsal.mcap --instance archive --readers 2
  bench-dragon replay rehearsal.mcap --from 60 --to 90 --rate 0.5 --loop

Each recorded run gets a new run id, each time that it is played; its ticks count from 0, its frames are due now, and its
time_scale is multiplied by the rate. All else is as it was recorded. --from and --to choose frames by their show time,
wherever in the recording they are; what lies between is cut out. Of the commands, only `ctl stop` is taken.")]
    Replay(ReplayArgs),
    /// Write a recording as a table, .csv or .xlsx.
    #[command(after_help = "Examples:
  bench-dragon export rehearsal.mcap rehearsal.xlsx
  bench-dragon export rehearsal.mcap dance.csv --benches --from 60 --to 90 --every 0.04
  bench-dragon export rehearsal.mcap - --alerts | grep contact

A frame of every second of show time, or every --every. Numbers are whole. A workbook has sheets of frames, of positions
and speeds with a column for each frame, of alerts and of the configuration; whether it fits is known before it is begun.
Of several recorded runs and after a seek, each begins with a frame; the column run_id parts the runs.")]
    Export(ExportArgs),
    /// Hand the poses on to desks, media servers and other machines.
    #[command(after_help = "Examples:
  bench-dragon bridge psn --interface 10.0.0.5
  bench-dragon bridge osc --to 10.0.0.30:7000 --bundle

A bridge is a reader like any other: it polls, and the server never waits for it.")]
    Bridge(BridgeArgs),
    /// Send one command to the server and print its reply.
    #[command(after_help = "Examples:
  bench-dragon ctl pause
  bench-dragon ctl speed 0.8
  bench-dragon ctl seek 300")]
    Ctl(CtlArgs),
    /// Print frames as they come.
    #[command(after_help = "Examples:
  bench-dragon echo --count 1
  bench-dragon echo --format json | jq .sim_time_ns")]
    Echo(EchoArgs),
    /// Print rate, gaps and latency of the frames that arrive.
    #[command(after_help = "Examples:
  bench-dragon hz
  bench-dragon hz --seconds 10 --format json")]
    Hz(HzArgs),
    /// Measure latency and loss of the running bus.
    #[command(after_help = "Examples:
  bench-dragon latency
  bench-dragon latency --poll --seconds 60 --hgrm tonight.hgrm
  bench-dragon latency --format json | jq .sent_us.p99

Due is the instant at which the server meant to begin the frame, sent the one at which the frame was ready; read is
when every handle of it has been read. --poll takes a core for itself.")]
    Latency(LatencyArgs),
    /// Answer a choreographer's question, without a server.
    #[command(after_help = "Examples:
  bench-dragon solve poses --at 0,60,300 --format json
  bench-dragon solve contact --config stage.toml
  bench-dragon solve pitch --turn-diameter 9
  bench-dragon solve turn --shortest
  bench-dragon solve speed-limit --limit 2 --save-config fast.toml
  bench-dragon solve sensitivity --figure sensitivity.svg")]
    Solve(SolveArgs),
    /// Check the machine and the installation, and say how to mend what is wrong.
    #[command(after_help = "Examples:
  bench-dragon doctor
  bench-dragon doctor --config stage.toml --instance main
  bench-dragon doctor --fix
  bench-dragon doctor --format json | jq .healthy

Status 1 where something is a problem; a warning is none. A running show does not notice an examination.")]
    Doctor(DoctorArgs),
    /// Print the iceoryx2 configuration of an instance.
    #[command(after_help = "Example, with the iox2 command:
  mkdir -p config && bench-dragon iox2-config > config/iceoryx2.toml && iox2 service list")]
    Iox2Config(BusArgs),
}

/// How to print.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// For people.
    #[default]
    Text,
    /// For machines; stable.
    Json,
}

/// Which instance to talk to.
#[derive(Clone, Debug, Args)]
pub(crate) struct BusArgs {
    /// The instance: 1 to 24 of a-z, 0-9 and -.
    #[arg(long, value_name = "NAME", default_value_t, value_parser = instance, global = true)]
    pub(crate) instance: Instance,
}

/// How to print.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct FormatArgs {
    /// How to print.
    #[arg(long, value_enum, value_name = "FORMAT", default_value_t, global = true)]
    pub(crate) format: Format,
}

/// Which dragon.
#[derive(Clone, Debug, Args)]
pub(crate) struct ConfigArgs {
    /// The configuration, TOML; the paper's dragon without one.
    #[arg(long, value_name = "FILE")]
    pub(crate) config: Option<PathBuf>,
}

/// How a server paces.
#[derive(Clone, Debug, Args)]
pub(crate) struct PaceArgs {
    /// Frames a second.
    #[arg(long, value_name = "HZ", allow_negative_numbers = true, value_parser = rate)]
    pub(crate) rate: Option<u32>,
    /// Show seconds per wall-clock second, 0.001 to 1000.
    #[arg(long, value_name = "FACTOR", allow_negative_numbers = true, value_parser = time_scale)]
    pub(crate) time_scale: Option<f64>,
    /// Show time in seconds to start at [default: the run's start].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) start_at: Option<f64>,
    /// Show time in seconds to end at.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
    pub(crate) until: Option<f64>,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArgs,
}

/// What a server asks of the kernel to keep its schedule.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct RealTimeArgs {
    /// Keep the server's loop on this processor.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = cpu)]
    pub(crate) cpu: Option<u32>,
    /// Run the server's loop as other, fifo:N or rr:N, N from 1 to 99, and lock its memory unless as other.
    #[arg(long, value_name = "POLICY", value_parser = priority)]
    pub(crate) priority: Option<Priority>,
    /// Microseconds before each release from which on the server's loop does not sleep but spins, 0 to 1000.
    #[arg(long, value_name = "MICROSECONDS", allow_negative_numbers = true, value_parser = spin)]
    pub(crate) spin_us: Option<u32>,
}

/// Arguments of `show`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ShowArgs {
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) pace: PaceArgs,
    #[command(flatten)]
    pub(crate) timecode: TimecodeArgs,
    /// Folder for the recording and summary.json [default: show-DATE-TIME in the current folder].
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Let a restarted server walk on at once, instead of standing held until `ctl release`.
    #[arg(long)]
    pub(crate) auto_resume: bool,
    /// Keep benches from touching: the head rests before they would, and the show ends there.
    #[arg(long)]
    pub(crate) guard: bool,
    /// Exit with status 3 where benches touched.
    #[arg(long)]
    pub(crate) fail_on_contact: bool,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Arguments of `serve`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ServeArgs {
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) pace: PaceArgs,
    #[command(flatten)]
    pub(crate) timecode: TimecodeArgs,
    /// Stand held at the start, until `ctl release`.
    #[arg(long)]
    pub(crate) held: bool,
    /// Move the head only where `monitor --guard` has proved the way free.
    #[arg(long)]
    pub(crate) guarded: bool,
    /// Stand paused at the start, or once the hold is lifted.
    #[arg(long, hide = true)]
    pub(crate) paused: bool,
    /// Begin once this many readers are connected, after ten seconds at the latest.
    #[arg(long, value_name = "COUNT", default_value_t = 0, allow_negative_numbers = true, value_parser = readers)]
    pub(crate) readers: usize,
    /// Travel in metres to start at, where the speed was changed on the way.
    #[arg(long, value_name = "METRES", hide = true, allow_negative_numbers = true, value_parser = finite)]
    pub(crate) start_travel: Option<f64>,
    /// Speed in m/s to start with, where it was changed on the way.
    #[arg(long, value_name = "MPS", hide = true, value_parser = finite)]
    pub(crate) start_speed: Option<f64>,
    #[command(flatten)]
    pub(crate) child: ChildArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Arguments of a process that `show` starts.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct ChildArgs {
    /// End when this process, the parent, ends.
    #[arg(long, value_name = "PID", hide = true)]
    pub(crate) parent: Option<u32>,
}

/// Arguments of `monitor`.
#[derive(Clone, Debug, Args)]
pub(crate) struct MonitorArgs {
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    /// Keep the benches of a guarded server from touching: let the head walk only where the way is proved free.
    #[arg(long)]
    pub(crate) guard: bool,
    /// End with status 3 at the first contact.
    #[arg(long)]
    pub(crate) fail_on_contact: bool,
    /// With --format json, print a line of progress this often.
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = period)]
    pub(crate) progress: Option<f64>,
    #[command(flatten)]
    pub(crate) child: ChildArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Arguments of `record`.
#[derive(Clone, Debug, Args)]
pub(crate) struct RecordArgs {
    /// The recording to write, or with --repair to finish.
    #[arg(value_name = "FILE")]
    pub(crate) file: PathBuf,
    /// Finish a recording whose recorder was killed, instead of recording.
    #[arg(long, conflicts_with_all = ["rotate_mb", "max_total_mb"])]
    pub(crate) repair: bool,
    /// Begin a new file after this many megabytes.
    #[arg(long, value_name = "MB", allow_negative_numbers = true, value_parser = file_megabytes)]
    pub(crate) rotate_mb: Option<u64>,
    /// Remove the oldest files of this recording over this many megabytes in all.
    #[arg(long, value_name = "MB", allow_negative_numbers = true, value_parser = total_megabytes)]
    pub(crate) max_total_mb: Option<u64>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) child: ChildArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Arguments of `ctl`.
#[derive(Clone, Debug, Args)]
pub(crate) struct CtlArgs {
    /// The command.
    #[command(subcommand)]
    pub(crate) order: Order,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Commands to the server.
#[derive(Clone, Copy, Debug, Subcommand)]
pub(crate) enum Order {
    /// Stop walking until `resume`.
    Pause,
    /// Go on after a pause.
    Resume,
    /// Walk at another speed of the head.
    Speed {
        /// Metres per show second, 0 to 10.
        #[arg(value_name = "MPS", allow_negative_numbers = true, value_parser = speed)]
        speed_mps: f64,
    },
    /// Go to a show time.
    Seek {
        /// Seconds.
        #[arg(value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
        sim_time_s: f64,
    },
    /// Stop for safety; only `release` lifts it.
    Hold,
    /// Lift a hold.
    Release,
    /// End the server.
    Stop,
}

/// Arguments of `echo`.
#[derive(Clone, Debug, Args)]
pub(crate) struct EchoArgs {
    /// Frames to print; until Ctrl-C without it.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = count)]
    pub(crate) count: Option<u64>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Arguments of `hz`.
#[derive(Clone, Debug, Args)]
pub(crate) struct HzArgs {
    /// Lines to print, one a second; until Ctrl-C without it.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = count)]
    pub(crate) seconds: Option<u64>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Arguments of `latency`.
#[derive(Clone, Debug, Args)]
pub(crate) struct LatencyArgs {
    /// How long to measure; Ctrl-C ends it early, with the report.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, allow_negative_numbers = true, value_parser = duration)]
    pub(crate) seconds: f64,
    /// Look for the next frame all the time, instead of being woken by it.
    #[arg(long)]
    pub(crate) poll: bool,
    /// Write the distribution from due to read as .hgrm, which the HDR histogram plotter reads, in microseconds.
    #[arg(long, value_name = "FILE")]
    pub(crate) hgrm: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Arguments of `doctor`.
#[derive(Clone, Debug, Args)]
pub(crate) struct DoctorArgs {
    /// First clean up what no living process of the instance owns.
    #[arg(long)]
    pub(crate) fix: bool,
    #[command(flatten)]
    pub(crate) config: ConfigArgs,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

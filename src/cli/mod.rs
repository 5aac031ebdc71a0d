//! The command line's types. What the commands do is in [`crate::command`].

#![allow(rustdoc::broken_intra_doc_links, reason = "doc comments here are help: brackets mean what may be left out")]

mod bridge;
mod bus_readers;
mod ctl;
mod epilogue;
mod flags;
mod recording;
mod serve;
mod solve;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueHint};
use clap_complete::Shell;

pub(crate) use bridge::*;
pub(crate) use bus_readers::*;
pub(crate) use ctl::{CtlArgs, CtlCommand};
pub(crate) use epilogue::Epilogue;
pub(crate) use flags::{BadInput, BusArgs, ChildArgs, ConfigArgs, Format, FormatArgs};
pub(crate) use recording::*;
pub(crate) use serve::*;
pub(crate) use solve::*;

/// Real-time motion server for the bench dragon.
#[derive(Debug, Parser)]
#[command(name = "bench-dragon", version, about, propagate_version = true, disable_help_subcommand = true)]
#[command(after_help = "Examples:
  bench-dragon show --time-scale 20           the paper's dragon, to its first contact
  bench-dragon serve --config stage.toml      a server alone
  bench-dragon ctl pause                      a command to it
  bench-dragon solve contact --format json    when do two benches touch?

Exit status: 0 done, 1 failed, 2 bad arguments or configuration, 3 contact seen with --fail-on-contact.
RUST_LOG=debug tells more of what goes on, NO_COLOR=1 without colours.")]
pub(crate) struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub(crate) command: Command,
    #[command(flatten)]
    pub(crate) child: ChildArgs,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Play a show: serve, monitor and record until contact, the end or Ctrl-C, then report.
    #[command(after_help = "Examples:
  bench-dragon show --time-scale 20
  bench-dragon show --config stage.toml --out rehearsal-3 --fail-on-contact
  bench-dragon show --guard --start-at 405
  bench-dragon show --view --time-scale 20    with a page for the browser, whose address is printed

With --timecode it goes on until Ctrl-C or `ctl stop`: the timecode may come back from wherever it has gone.

The configuration may name up to eight commands that run beside the show and are started again as its own children are: \
[[show.also]] command = \"bridge psn --interface 10.0.0.5\". They may be bridge, view, metrics, monitor, hz and echo.")]
    Show(ShowArgs),
    /// Advance the dragon at a fixed rate and publish every frame.
    #[command(after_help = "Examples:
  bench-dragon serve
  bench-dragon serve --config stage.toml --rate 250 --start-at 120 --held
  bench-dragon serve --cpu 1 --priority fifo:80
  bench-dragon serve --timecode osc:7000 --timecode-offset -3600
  bench-dragon serve --timecode artnet:0.0.0.0
  bench-dragon serve --guarded                moves only while a guard runs: monitor --guard

With --timecode, show time is the timecode plus the offset. The show stands until the first timecode, is put to its \
position, and follows by its pace, up to a tenth faster or slower; over half a second of difference it is put there anew. A \
timecode that is repeated stands, and the show with it; one that falls silent is lost, and the show goes on. An operator's \
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
  bench-dragon record --repair rehearsal.mcap
  bench-dragon record --repair --check rehearsal.mcap")]
    Record(RecordArgs),
    /// Put a recording back onto the bus, at its pace.
    #[command(after_help = "Examples:
  bench-dragon replay rehearsal.mcap
  bench-dragon replay rehearsal.mcap --instance archive --readers 2
  bench-dragon replay rehearsal.mcap --from 60 --to 90 --rate 0.5 --loop

Each recorded run gets a new run id, each time that it is played; its ticks count from 0, its frames are due now, and its \
time_scale is multiplied by the rate. All else is as it was recorded. --from and --to choose frames by their show time, \
wherever in the recording they are; what lies between is cut out. Of the commands, only `ctl stop` is taken.")]
    Replay(ReplayArgs),
    /// Write a recording as a table, .csv or .xlsx.
    #[command(after_help = "Examples:
  bench-dragon export rehearsal.mcap rehearsal.xlsx
  bench-dragon export rehearsal.mcap dance.csv --benches --from 60 --to 90 --every 0.04
  bench-dragon export rehearsal.mcap - --alerts | grep contact

A frame of every second of show time, or every --every. Numbers are whole. A workbook has sheets of frames, of positions \
and speeds with a column for each frame, of alerts and of the configuration; whether it fits is known before it is begun. \
Of several recorded runs and after a seek, each begins with a frame; the column run_id parts the runs.")]
    Export(ExportArgs),
    /// Hand the poses on to desks, media servers and other machines.
    #[command(after_help = "Examples:
  bench-dragon bridge psn --interface 10.0.0.5
  bench-dragon bridge osc --to 10.0.0.30:7000 --bundle

A bridge is a reader like any other: it polls, and the server never waits for it.")]
    Bridge(BridgeArgs),
    /// Show what goes on in a browser, and steer from there.
    #[command(after_help = "Examples:
  bench-dragon view                              prints the address to open
  bench-dragon view --listen 0.0.0.0:8223        for tablets in the house, with the token that is printed
  bench-dragon view --read-only --instance main

Looking from this machine is free; to steer, and to look from elsewhere, takes the token in the printed address. It is a new \
one each time, unless the environment has one in BENCH_DRAGON_TOKEN. What is sent is not encrypted: through a network that is \
not your own use a tunnel, `ssh -L 8223:localhost:8223 booth`.")]
    View(ViewArgs),
    /// Serve metrics to Prometheus, without a page.
    #[command(after_help = "Examples:
  bench-dragon metrics                           at http://127.0.0.1:9223/metrics
  bench-dragon metrics --listen 0.0.0.0:9223     for a scraper on another machine
  curl http://127.0.0.1:9223/metrics

`view` serves the same at /metrics. Whoever can reach the address can read them, and nothing else. docs/metrics.md tells \
them all.")]
    Metrics(MetricsArgs),
    /// Send one command to the server and print its reply, or print how the show does.
    #[command(after_help = "Examples:
  bench-dragon ctl status
  bench-dragon ctl pause
  bench-dragon ctl speed 0.8
  bench-dragon ctl seek 300")]
    Ctl(CtlArgs),
    /// Watch the show in the terminal: the dragon, its clearance, alerts; keys give commands.
    #[command(after_help = "Examples:
  bench-dragon watch
  bench-dragon watch --instance main --read-only
  ssh -t stage bench-dragon watch

? shows all keys. Without colours under NO_COLOR. Where there is no terminal, `hz` and `echo` tell in lines.")]
    Watch(WatchArgs),
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

Due is the instant at which the server meant to begin the frame, sent the one at which the frame was ready; read is \
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
    /// Print what completes this program's commands, options and files in a shell.
    #[command(after_help = "Examples:
  bench-dragon completions bash > ~/.local/share/bash-completion/completions/bench-dragon
  bench-dragon completions zsh > ~/.zfunc/_bench-dragon
  bench-dragon completions fish > ~/.config/fish/completions/bench-dragon.fish
  bench-dragon completions elvish > ~/.config/elvish/lib/bench-dragon.elv
  source <(bench-dragon completions bash)     for this shell alone

The folder must be there; shells that are started then know it. bash needs its package bash-completion, zsh the line \
fpath+=~/.zfunc before compinit in ~/.zshrc, Elvish the line use bench-dragon in its rc.elv; PowerShell reads what is \
printed from its $PROFILE.")]
    Completions(CompletionsArgs),
    /// Print a page of the manual, or write all.
    #[command(after_help = "Examples:
  bench-dragon man | man -l -
  bench-dragon man solve contact | man -l -
  bench-dragon man --out ~/.local/share/man/man1

After the last one, man bench-dragon and man bench-dragon-solve-contact find their pages.")]
    Man(ManArgs),
}

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

#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct CompletionsArgs {
    /// The shell.
    #[arg(value_enum, value_name = "SHELL")]
    pub(crate) shell: Shell,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct ManArgs {
    /// The command whose page it is, as in `solve contact`; the program's own without one.
    #[arg(value_name = "COMMAND", conflicts_with = "out")]
    pub(crate) command: Vec<String>,
    /// Write all pages, one a command, into this folder, which is made where it is missing.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub(crate) out: Option<PathBuf>,
}

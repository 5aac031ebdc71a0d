//! `ctl`: sends one command and prints its reply, or prints the status of the show.

use std::ops::RangeInclusive;
use std::process::ExitCode;

use anyhow::anyhow;
use bench_dragon_ipc::guard::GuardLock;
use bench_dragon_ipc::source::ShowLock;
use bench_dragon_ipc::{BusError, Domain, Refusal, Request, Sender};
use clap::{Args, Subcommand};
use serde::Serialize;

use crate::cli::flags::{BusArgs, Format, FormatArgs, finite, within};
use crate::cli::print::{print_json, print_line, print_to_stderr};
use crate::cli::{cues, status};
use crate::command_queue;
use crate::system::stop::StopFlag;

/// Allowed paces, of servers and of replays.
const PACE: RangeInclusive<f64> = 0.0..=10_000.0;

/// Send one command to the server and print its reply, or print the status of the show.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon ctl status
  bench-dragon ctl pause
  bench-dragon ctl speed 0.8
  bench-dragon ctl seek 300
  bench-dragon ctl go")]
pub(crate) struct CtlArgs {
    /// The command to send, or `status` or `cues`.
    #[command(subcommand)]
    pub(crate) command: CtlCommand,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// The commands to the server, and what sends nothing: `status` and `cues`.
#[derive(Clone, Debug, Subcommand)]
pub(crate) enum CtlCommand {
    /// Pause the show: the dragon stands still until `resume`.
    #[command(after_help = "Example:
  bench-dragon ctl pause

A pause is an operator's stop. For safety use ctl hold.")]
    Pause,
    /// Resume a paused show.
    #[command(after_help = "Example:
  bench-dragon ctl resume

The server refuses this command while the dragon is held: only ctl release lifts a hold.")]
    Resume,
    /// Change the speed of the head.
    #[command(after_help = "Examples:
  bench-dragon ctl speed 0.8
  bench-dragon ctl speed 1 --instance rehearsal")]
    Speed {
        /// Speed of the head in metres per show second, 0 to 10.
        #[arg(value_name = "MPS", allow_negative_numbers = true, value_parser = within(0.0..=Request::MAX_SPEED_MPS))]
        speed_mps: f64,
    },
    /// Move the dragon to another show time, or to a cue.
    #[command(after_help = "Examples:
  bench-dragon ctl seek 300
  bench-dragon ctl seek --cue 'into the S'
  bench-dragon ctl seek -50                   on a turnaround, before the turn

On a replay the position in the recording: seconds since its first frame. A position beyond the end is the end.")]
    Seek {
        /// Show time in seconds; on a replay, seconds since the first frame of the recording.
        #[arg(value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite, required_unless_present = "cue")]
        show_time_s: Option<f64>,
        /// Name of a cue of the configuration. A cue that waits, waits again.
        #[arg(long, value_name = "NAME", conflicts_with = "show_time_s")]
        cue: Option<String>,
    },
    /// Change the pace of the whole show, or of a replay.
    #[command(after_help = "Examples:
  bench-dragon ctl pace 0.8                   all dragons walk at 0.8 of their planned speeds
  bench-dragon ctl pace 4                     on a replay, four recorded seconds per second

The pace lasts over cues. ctl speed sets the pace at which the leading dragon walks at this speed now.")]
    Pace {
        /// Planned seconds per show second, at least 0; on a replay, recorded seconds per second, 0.01 to 100.
        #[arg(value_name = "FACTOR", allow_negative_numbers = true, value_parser = within(PACE))]
        factor: f64,
    },
    /// Let the show walk on from a cue that waits.
    #[command(after_help = "Example:
  bench-dragon ctl go

The server refuses this command where no cue waits. Two of them within 0.3 s count as one.")]
    Go,
    /// List the cues of the show, with the next one.
    #[command(after_help = "Examples:
  bench-dragon ctl cues
  bench-dragon ctl cues --format json | jq .next

This command sends nothing.")]
    Cues,
    /// Hold the dragon for safety: it stands still until `release`.
    #[command(after_help = "Example:
  bench-dragon ctl hold")]
    Hold,
    /// Lift a hold, or start a show that is ready.
    #[command(after_help = "Example:
  bench-dragon ctl release

This command does not lift a guard's stop: the guard lifts it with its next grant.")]
    Release,
    /// Print the status of the show: its state, its forecast, and a lamp for each part.
    #[command(after_help = "Examples:
  bench-dragon ctl status
  bench-dragon ctl status --format json | jq .lamps
  bench-dragon ctl status > /dev/null || echo 'look at the show'

The command reads the bus for two seconds and sends nothing. The exit status is 0 if frames arrive and no lamp is red, else 1. \
A missing monitor is a warning. docs/reference/metrics.md explains the lamps and the JSON.")]
    Status,
    /// End the server, after the head has come to rest.
    #[command(after_help = "Example:
  bench-dragon ctl stop

With [head] accel_mps2 the head brakes. The last frame of the run has the state ended.")]
    Stop,
}

#[derive(Serialize)]
struct ReplyLine {
    accepted: bool,
    run_id: u64,
    tick: u64,
    reason: Option<String>,
}

pub(crate) fn run(args: &CtlArgs) -> anyhow::Result<ExitCode> {
    let domain = args.bus.domain()?.for_operators();
    match args.command {
        CtlCommand::Status => return status::run(&domain, args.format.format),
        CtlCommand::Cues => return cues::run(&domain, args.format.format),
        _ => {}
    }
    let stop = StopFlag::on_signals()?;
    let request = request(&args.command, &domain, &stop)?;
    let reply = command_queue::call(&domain, "ctl", Sender::Ctl, request, &|| stop.is_set(), &|| false)
        .map_err(|error| without_server(error, &domain))?;
    let outcome = reply.outcome();
    let reason = outcome.err().map(|refusal| match refusal {
        Refusal::NotProved if GuardLock::holder(&domain).is_none() => {
            format!("{}: no guard runs, start `bench-dragon monitor --guard`", refusal.explain(&request))
        }
        _ => refusal.explain(&request),
    });
    match (args.format.format, &reason) {
        (Format::Json, _) => {
            let accepted = reason.is_none();
            print_json(&ReplyLine { accepted, run_id: reply.run_id, tick: reply.tick, reason })?;
        }
        (Format::Text, None) => print_line(format_args!("accepted, from tick {} on", reply.tick))?,
        (Format::Text, Some(reason)) => print_to_stderr(&format!("refused: {reason}")),
    }
    Ok(if outcome.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The error of a command that no server takes. A running `show` starts its server again: nobody has to do it by hand.
fn without_server(error: BusError, domain: &Domain) -> anyhow::Error {
    match error {
        BusError::NoServer { instance } if ShowLock::holder(domain).is_some() => {
            anyhow!("no server runs on instance {instance:?}: `show` starts it again, wait for up to 30 s")
        }
        error => error.into(),
    }
}

/// The request of a command. That of a seek to a cue needs the description of the show.
fn request(command: &CtlCommand, domain: &Domain, stop: &StopFlag) -> anyhow::Result<Request> {
    Ok(match *command {
        CtlCommand::Status | CtlCommand::Cues => unreachable!("they send nothing"),
        CtlCommand::Pause => Request::Pause,
        CtlCommand::Resume => Request::Resume,
        CtlCommand::Speed { speed_mps } => Request::Speed { speed_mps },
        CtlCommand::Seek { show_time_s: Some(show_time_s), .. } => Request::Seek { show_time_s },
        CtlCommand::Seek { ref cue, .. } => {
            Request::Seek { show_time_s: cues::time_of(domain, cue.as_deref().unwrap_or_default(), stop)? }
        }
        CtlCommand::Pace { factor } => Request::Pace { factor },
        CtlCommand::Go => Request::Go,
        CtlCommand::Hold => Request::Hold,
        CtlCommand::Release => Request::Release,
        CtlCommand::Stop => Request::Stop,
    })
}

//! `ctl`: sends one command and prints its reply, or prints the status of the show.

use std::process::ExitCode;

use bench_dragon_ipc::guard::GuardLock;
use bench_dragon_ipc::{Refusal, Request, Sender};
use clap::{Args, Subcommand};
use serde::Serialize;

use crate::cli::flags::{BusArgs, Format, FormatArgs, finite, within};
use crate::cli::print::{complain, print_json, print_line};
use crate::cli::status;
use crate::command_queue;
use crate::source::replay::RATE;
use crate::system::stop::StopFlag;

/// Send one command to the server and print its reply, or print the status of the show.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon ctl status
  bench-dragon ctl pause
  bench-dragon ctl speed 0.8
  bench-dragon ctl seek 300")]
pub(crate) struct CtlArgs {
    /// The command to send, or `status`.
    #[command(subcommand)]
    pub(crate) command: CtlCommand,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// The commands to the server, and `status`.
#[derive(Clone, Copy, Debug, Subcommand)]
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
    /// Move the dragon to another show time.
    #[command(after_help = "Examples:
  bench-dragon ctl seek 300
  bench-dragon ctl seek -50                   on a turnaround, before the turn

On a replay the position in the recording: seconds since its first frame. A position beyond the end is the end.")]
    Seek {
        /// Show time in seconds; on a replay, seconds since the first frame of the recording.
        #[arg(value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
        show_time_s: f64,
    },
    /// Change the pace of a replay.
    #[command(after_help = "Examples:
  bench-dragon ctl pace 4
  bench-dragon ctl pace 0.25

Only a replay has a recorded pace. A server walks faster or slower by ctl speed.")]
    Pace {
        /// Recorded seconds per second, 0.01 to 100.
        #[arg(value_name = "FACTOR", allow_negative_numbers = true, value_parser = within(RATE))]
        factor: f64,
    },
    /// Hold the dragon for safety: it stands still until `release`.
    #[command(after_help = "Example:
  bench-dragon ctl hold")]
    Hold,
    /// Lift a hold.
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
    let Some(request) = request(args.command) else { return status::run(&domain, args.format.format) };
    let stop = StopFlag::on_signals()?;
    let reply = command_queue::call(&domain, "ctl", Sender::Ctl, request, &|| stop.is_set(), &|| false)?;
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
        (Format::Text, Some(reason)) => complain(&format!("refused: {reason}")),
    }
    Ok(if outcome.is_ok() { ExitCode::SUCCESS } else { ExitCode::FAILURE })
}

/// The request of a command; `None` for `status`.
fn request(command: CtlCommand) -> Option<Request> {
    Some(match command {
        CtlCommand::Status => return None,
        CtlCommand::Pause => Request::Pause,
        CtlCommand::Resume => Request::Resume,
        CtlCommand::Speed { speed_mps } => Request::Speed { speed_mps },
        CtlCommand::Seek { show_time_s } => Request::Seek { show_time_s },
        CtlCommand::Pace { factor } => Request::Pace { factor },
        CtlCommand::Hold => Request::Hold,
        CtlCommand::Release => Request::Release,
        CtlCommand::Stop => Request::Stop,
    })
}

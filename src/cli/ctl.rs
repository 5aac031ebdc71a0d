//! `ctl`.

use bench_dragon_ipc::Request;
use clap::{Args, Subcommand};

use super::flags::{BusArgs, FormatArgs, finite, within};

#[derive(Clone, Debug, Args)]
pub(crate) struct CtlArgs {
    /// The command, or `status`.
    #[command(subcommand)]
    pub(crate) command: CtlCommand,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// Commands to the server.
#[derive(Clone, Copy, Debug, Subcommand)]
pub(crate) enum CtlCommand {
    /// Stop walking until `resume`.
    #[command(after_help = "Example:
  bench-dragon ctl pause

An operator's stop. One for safety is ctl hold.")]
    Pause,
    /// Go on after a pause.
    #[command(after_help = "Example:
  bench-dragon ctl resume

It is refused while the dragon is held: only ctl release lifts a hold.")]
    Resume,
    /// Walk at another speed of the head.
    #[command(after_help = "Examples:
  bench-dragon ctl speed 0.8
  bench-dragon ctl speed 1 --instance rehearsal")]
    Speed {
        /// Metres per show second, 0 to 10.
        #[arg(value_name = "MPS", allow_negative_numbers = true, value_parser = within(0.0..=Request::MAX_SPEED_MPS))]
        speed_mps: f64,
    },
    /// Go to a show time.
    #[command(after_help = "Examples:
  bench-dragon ctl seek 300
  bench-dragon ctl seek -50                   on a turnaround, before the turn")]
    Seek {
        /// Seconds.
        #[arg(value_name = "SECONDS", allow_negative_numbers = true, value_parser = finite)]
        sim_time_s: f64,
    },
    /// Stop for safety; only `release` lifts it.
    #[command(after_help = "Example:
  bench-dragon ctl hold")]
    Hold,
    /// Lift a hold.
    #[command(after_help = "Example:
  bench-dragon ctl release

A guard's stop is no hold: the guard lifts it, by its next grant.")]
    Release,
    /// Print how the show does: its state, what lies ahead, and a lamp for each part.
    #[command(after_help = "Examples:
  bench-dragon ctl status
  bench-dragon ctl status --format json | jq .lamps
  bench-dragon ctl status > /dev/null || echo 'look at the show'

It looks at the bus for two seconds, and sends nothing. The exit status is 0 where frames come and no lamp is red, and 1 \
otherwise. A missing monitor is a warning. docs/metrics.md explains the lamps and the JSON.")]
    Status,
    /// End the server: the head comes to rest first.
    #[command(after_help = "Example:
  bench-dragon ctl stop

With [head] accel_mps2 the head brakes. The last frame of the run says that it has ended.")]
    Stop,
}

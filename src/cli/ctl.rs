//! `ctl`.

use clap::{Args, Subcommand};

use super::value::{finite, speed};
use super::{BusArgs, FormatArgs};

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

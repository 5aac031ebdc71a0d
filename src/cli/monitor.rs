//! `monitor`.

use clap::Args;

use super::value::period;
use super::{BusArgs, FormatArgs};

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
    pub(crate) format: FormatArgs,
}

//! `doctor`.

use clap::Args;

use super::{BusArgs, ConfigArgs, FormatArgs};

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

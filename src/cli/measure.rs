//! The commands that look at what arrives: `echo`, `hz`, `latency`.

use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::value::{count, duration};
use super::{BusArgs, FormatArgs};

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
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) hgrm: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

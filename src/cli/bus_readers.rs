//! The commands that read the bus: `monitor`, `echo`, `hz`, `latency`, `watch`, `view` and `metrics`.

use std::net::SocketAddr;
use std::path::PathBuf;

use clap::{Args, ValueHint};

use super::flags::{BusArgs, FormatArgs, count, host_name, listen_address, within};
use crate::display::watch::Glyphs;

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
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true, value_parser = within(0.01..=3600.0))]
    pub(crate) progress: Option<f64>,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct EchoArgs {
    /// Frames to print; until Ctrl-C without it.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = count())]
    pub(crate) count: Option<u64>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct HzArgs {
    /// Lines to print, one a second; until Ctrl-C without it.
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = count())]
    pub(crate) seconds: Option<u64>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct LatencyArgs {
    /// How long to measure; Ctrl-C ends it early, with the report.
    #[arg(long, value_name = "SECONDS", default_value_t = 10.0, allow_negative_numbers = true, value_parser = within(0.01..=1e6))]
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

/// Where a page listens, and by which names it may be called.
#[derive(Clone, Debug, Args)]
pub(crate) struct SiteArgs {
    /// A name by which browsers may call this machine, beside its addresses and its host name; may be repeated.
    #[arg(long = "allow-host", value_name = "NAME", value_parser = host_name)]
    pub(crate) allowed_hosts: Vec<String>,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct ViewArgs {
    /// Where the page is served; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:8223", value_parser = listen_address)]
    pub(crate) listen: SocketAddr,
    #[command(flatten)]
    pub(crate) site: SiteArgs,
    /// Take no commands: the page has no controls.
    #[arg(long)]
    pub(crate) read_only: bool,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct WatchArgs {
    /// Take no commands: keys change only what is shown.
    #[arg(long)]
    pub(crate) read_only: bool,
    /// What the plan is drawn with; by default what TERM and the locale allow.
    #[arg(long, value_enum, value_name = "GLYPHS")]
    pub(crate) glyphs: Option<Glyphs>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct MetricsArgs {
    /// Where the metrics are served; port 0 takes a free one.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:9223", value_parser = listen_address)]
    pub(crate) listen: SocketAddr,
    #[command(flatten)]
    pub(crate) site: SiteArgs,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

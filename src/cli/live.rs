//! The commands that show what goes on: `view`, `watch`, `metrics`.

use std::net::SocketAddr;

use clap::{Args, ValueEnum};

use super::value::{listen_address, site};
use super::{BusArgs, FormatArgs};

/// Where a page listens, and by which names it may be called.
#[derive(Clone, Debug, Args)]
pub(crate) struct SiteArgs {
    /// A name by which browsers may call this machine, beside its addresses and its host name; may be repeated.
    #[arg(long = "allow-host", value_name = "NAME", value_parser = site)]
    pub(crate) allowed_hosts: Vec<String>,
}

/// Arguments of `view`.
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

/// Arguments of `watch`.
#[derive(Clone, Debug, Args)]
pub(crate) struct WatchArgs {
    /// Take no commands: keys change only what is shown.
    #[arg(long)]
    pub(crate) read_only: bool,
    /// What the plan is drawn with; by default what TERM and the locale allow.
    #[arg(long, value_enum, value_name = "GLYPHS")]
    pub(crate) glyphs: Option<GlyphSet>,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
}

/// Characters that a terminal may have.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum GlyphSet {
    /// Braille patterns.
    Braille,
    /// Half blocks, as a console has them.
    Blocks,
    /// ASCII alone.
    Ascii,
}

/// Arguments of `metrics`.
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

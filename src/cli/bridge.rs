//! The arguments of `bridge`.

use std::net::{Ipv4Addr, SocketAddrV4};

use bench_dragon::bridge::psn::{self, SystemName, SystemNameError};
use clap::{Args, Subcommand};

use super::value::within;
use super::{BusArgs, FormatArgs};

/// Arguments of `bridge`.
#[derive(Clone, Debug, Args)]
pub(crate) struct BridgeArgs {
    /// To whom.
    #[command(subcommand)]
    pub(crate) bridge: Bridge,
    #[command(flatten)]
    pub(crate) bus: BusArgs,
    #[command(flatten)]
    pub(crate) format: FormatArgs,
}

/// The bridges.
#[derive(Clone, Debug, Subcommand)]
pub(crate) enum Bridge {
    /// PosiStageNet 2.03: each bench as a tracker, for lighting desks and media servers.
    #[command(after_help = "Examples:
  bench-dragon bridge psn --interface 10.0.0.5
  bench-dragon bridge psn --to 10.0.0.20:56565 --rate 30

A tracker is a bench's centre, its id the bench's number, the head's 0. Its x is our x, its y (up) our z, its z (depth) our y.
Its status is 1, and 0 once the server has been silent for 1.5 seconds.")]
    Psn(PsnArgs),
}

/// Arguments of `bridge psn`.
#[derive(Clone, Debug, Args)]
pub(crate) struct PsnArgs {
    /// The receiver: a multicast group, or one machine.
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = psn::DEFAULT_TARGET, value_parser = target)]
    pub(crate) to: SocketAddrV4,
    #[command(flatten)]
    pub(crate) network: NetworkArgs,
    /// DATA frames a second, 1 to 250.
    #[arg(long, value_name = "HZ", default_value_t = 60, allow_negative_numbers = true, value_parser = bridge_rate)]
    pub(crate) rate: u32,
    /// The name under which desks list this sender [default: bench-dragon and the instance].
    #[arg(long, value_name = "NAME", value_parser = system_name)]
    pub(crate) name: Option<SystemName>,
}

/// How datagrams leave this machine.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct NetworkArgs {
    /// The address of the interface to send by [default: as the routing table says].
    #[arg(long, value_name = "ADDRESS", value_parser = interface)]
    pub(crate) interface: Option<Ipv4Addr>,
    /// Networks that a multicast datagram may pass through, 1 to 255.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = ttl)]
    pub(crate) ttl: u32,
}

fn target(text: &str) -> Result<SocketAddrV4, String> {
    let target = text.parse().ok().filter(|target: &SocketAddrV4| target.port() > 0 && !target.ip().is_unspecified());
    target.ok_or_else(|| "must be an IPv4 address and a port, as 10.0.0.20:56565".to_owned())
}

fn interface(text: &str) -> Result<Ipv4Addr, String> {
    let address = text.parse().ok().filter(|address: &Ipv4Addr| !address.is_multicast() && !address.is_broadcast());
    address.ok_or_else(|| "must be an IPv4 address of this machine, as 10.0.0.5".to_owned())
}

fn bridge_rate(text: &str) -> Result<u32, String> {
    within(text, &(1..=250))
}

fn ttl(text: &str) -> Result<u32, String> {
    within(text, &(1..=255))
}

fn system_name(text: &str) -> Result<SystemName, SystemNameError> {
    text.parse()
}

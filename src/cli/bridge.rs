//! The arguments of `bridge`.

use std::net::{Ipv4Addr, SocketAddrV4};

use clap::{Args, Subcommand};

use super::flags::{BusArgs, FormatArgs, within};
use crate::bridge::osc::{AddressPattern, AngleUnit, ShowAddress};
use crate::bridge::psn::{self, SystemName};
#[cfg(feature = "zenoh")]
use crate::bridge::zenoh::{KeyPrefix, SessionMode, check_endpoint, wire::MAX_EVERY};
#[cfg(feature = "zenoh")]
use crate::config::RATE_HZ;

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

A tracker is a bench's centre, its id the bench's number, the head's 0. Its x is our x, its y (up) our z, its z (depth) our y. \
Its status is 1, and 0 once the server has been silent for 1.5 seconds, or for three periods of one that is slower.")]
    Psn(PsnArgs),
    /// Open Sound Control: a message a bench, for whatever speaks OSC.
    #[command(after_help = "Examples:
  bench-dragon bridge osc --to 10.0.0.30:7000
  bench-dragon bridge osc --to 10.0.0.30:7000 --tcp --bundle
  bench-dragon bridge osc --address /stage/{index}/pose --angle radians

A frame is one message /dragon/show (show time in s, state, time scale, tick, fresh: 1, or 0 once the server has been silent \
for 1.5 seconds, or three periods of a slower one) and one a bench (x, y, z in metres, heading counter-clockwise from +x, \
speed in m/s of wall time).")]
    Osc(OscArgs),
    /// zenoh: the same bus on another machine, where every client works unchanged.
    #[cfg(feature = "zenoh")]
    #[command(after_help = "Examples:
  bench-dragon bridge zenoh --listen tcp/10.0.0.5:7447             on the server's machine
  bench-dragon bridge zenoh --receive --connect tcp/10.0.0.5:7447  on the other one
  bench-dragon bridge zenoh --config tls.json5 --rate 60 --allow-commands

Nothing is listened on and nobody is looked for but as the flags and the configuration say. Without any endpoint a sending \
bridge listens on tcp/127.0.0.1:7447, and a receiving one looks for it there.")]
    Zenoh(ZenohArgs),
    /// zenoh: another machine's bus. This program was built without it.
    #[cfg(not(feature = "zenoh"))]
    #[command(after_help = "Example, once it was built with cargo build --release --features zenoh:
  bench-dragon bridge zenoh --listen tcp/10.0.0.5:7447")]
    Zenoh(AnyArgs),
}

/// Arguments of what is not built in.
#[cfg(not(feature = "zenoh"))]
#[derive(Clone, Debug, Args)]
pub(crate) struct AnyArgs {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _any: Vec<String>,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct PsnArgs {
    /// The receiver: a multicast group, or one machine.
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = psn::DEFAULT_TARGET, value_parser = target)]
    pub(crate) to: SocketAddrV4,
    #[command(flatten)]
    pub(crate) network: NetworkArgs,
    /// DATA frames a second, 1 to 250.
    #[arg(long, value_name = "HZ", default_value_t = 60, allow_negative_numbers = true, value_parser = within(1..=250_u32))]
    pub(crate) rate: u32,
    /// The name under which desks list this sender [default: bench-dragon and the instance].
    #[arg(long, value_name = "NAME")]
    pub(crate) name: Option<SystemName>,
}

#[derive(Clone, Debug, Args)]
pub(crate) struct OscArgs {
    /// The receiver.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:9000", value_parser = target)]
    pub(crate) to: SocketAddrV4,
    /// Connect to the receiver by TCP, and frame packets by SLIP.
    #[arg(long, conflicts_with_all = ["interface", "ttl"])]
    pub(crate) tcp: bool,
    #[command(flatten)]
    pub(crate) network: NetworkArgs,
    /// Frames a second, 1 to 250.
    #[arg(long, value_name = "HZ", default_value_t = 30, allow_negative_numbers = true, value_parser = within(1..=250_u32))]
    pub(crate) rate: u32,
    /// The address of a bench's message; {index} is the bench's number.
    #[arg(long, value_name = "PATTERN", default_value = "/dragon/bench/{index}")]
    pub(crate) address: AddressPattern,
    /// The address of the show's message.
    #[arg(long, value_name = "ADDRESS", default_value = "/dragon/show")]
    pub(crate) show_address: ShowAddress,
    /// How headings are told.
    #[arg(long, value_enum, value_name = "UNIT", default_value_t)]
    pub(crate) angle: AngleUnit,
    /// Put the messages of a frame into bundles, each as large as a datagram holds.
    #[arg(long)]
    pub(crate) bundle: bool,
}

/// How datagrams leave this machine.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct NetworkArgs {
    /// The address of the interface to send by [default: as the routing table says].
    #[arg(long, value_name = "ADDRESS", value_parser = interface)]
    pub(crate) interface: Option<Ipv4Addr>,
    /// Networks that a multicast datagram may pass through, 1 to 255.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = within(1..=255_u32))]
    pub(crate) ttl: u32,
}

#[cfg(feature = "zenoh")]
#[derive(Clone, Debug, Args)]
pub(crate) struct ZenohArgs {
    /// Put what comes from another host onto this instance's bus, instead of sending what is there.
    #[arg(long)]
    pub(crate) receive: bool,
    /// zenoh's own configuration, JSON5: TLS, passwords, timeouts. What it does not name stays off.
    #[arg(long, value_name = "FILE", value_hint = clap::ValueHint::FilePath)]
    pub(crate) config: Option<std::path::PathBuf>,
    /// Connect to this endpoint; again for more.
    #[arg(long, value_name = "ENDPOINT", value_parser = check_endpoint)]
    pub(crate) connect: Vec<String>,
    /// Listen on this endpoint; again for more. Loopback is heard on this machine alone.
    #[arg(long, value_name = "ENDPOINT", value_parser = check_endpoint)]
    pub(crate) listen: Vec<String>,
    /// What to be among zenoh's: a peer unless the configuration says otherwise.
    #[arg(long, value_enum)]
    pub(crate) mode: Option<SessionMode>,
    /// What all keys begin with [default: bench-dragon/ and the instance].
    #[arg(long, value_name = "PREFIX")]
    pub(crate) key: Option<KeyPrefix>,
    /// Send one frame of so many.
    #[arg(long, value_name = "N", conflicts_with_all = ["rate", "receive"], allow_negative_numbers = true, value_parser = within(1..=MAX_EVERY))]
    pub(crate) every: Option<u64>,
    /// Send at most so many frames a second.
    #[arg(long, value_name = "HZ", conflicts_with = "receive", allow_negative_numbers = true, value_parser = within(RATE_HZ))]
    pub(crate) rate: Option<u32>,
    /// Let whoever reaches this bridge command the server: pause, seek, stop and all else.
    #[arg(long, conflicts_with = "receive")]
    pub(crate) allow_commands: bool,
}

fn target(text: &str) -> Result<SocketAddrV4, String> {
    let target = text.parse().ok().filter(|target: &SocketAddrV4| target.port() > 0 && !target.ip().is_unspecified());
    target.ok_or_else(|| "must be an IPv4 address and a port, as 10.0.0.20:56565".to_owned())
}

fn interface(text: &str) -> Result<Ipv4Addr, String> {
    let address = text.parse().ok().filter(|address: &Ipv4Addr| !address.is_multicast() && !address.is_broadcast());
    address.ok_or_else(|| "must be an IPv4 address of this machine, as 10.0.0.5".to_owned())
}

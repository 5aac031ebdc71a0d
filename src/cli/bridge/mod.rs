//! `bridge`: passes the poses on in the protocols of show control.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::process::ExitCode;

use anyhow::Context as _;
use clap::{Args, Subcommand};

use crate::bridge::stage_transform::{StageOffset, StageRotation};
use crate::bridge::{AxisOrder, BenchSelection, Outlet, StageTransform, StaleAfter, UdpSender, UdpTarget};
use crate::cli::endpoint::{Endpoint, Transport};
#[cfg(not(feature = "zenoh"))]
use crate::cli::flags::BadInput;
use crate::cli::flags::{BusArgs, FormatArgs, within};

mod feed;
mod foxglove;
mod ltc;
mod osc;
mod psn;
mod session;
mod steering;
mod timecode;
#[cfg(feature = "zenoh")]
mod zenoh;

/// Pass the poses on to lighting desks, media servers and other machines.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon bridge psn --interface 10.0.0.5
  bench-dragon bridge osc --to 10.0.0.30:7000 --bundle
  bench-dragon bridge osc --listen 0.0.0.0:7400 --allow 10.0.0.7
  bench-dragon bridge timecode --art-net 10.0.0.255
  bench-dragon bridge timecode --ltc - | aplay
  bench-dragon bridge foxglove

The server never waits for a bridge. A bench's position is the centre of its board.")]
#[command(subcommand_value_name = "PROTOCOL", subcommand_help_heading = "Protocols")]
pub(crate) struct BridgeArgs {
    /// The protocol.
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
    Psn(psn::PsnArgs),
    Osc(osc::OscArgs),
    Timecode(timecode::TimecodeArgs),
    Foxglove(foxglove::FoxgloveArgs),
    #[cfg(feature = "zenoh")]
    Zenoh(zenoh::ZenohArgs),
    #[cfg(not(feature = "zenoh"))]
    Zenoh(AnyArgs),
}

impl Bridge {
    /// Name of the bridge among the commands beside a show, or the reason why it cannot be one.
    pub(crate) fn name_beside_show(&self) -> Result<&'static str, &'static str> {
        match self {
            Self::Psn(_) => Ok("bridge psn"),
            Self::Osc(_) => Ok("bridge osc"),
            Self::Timecode(_) => Ok("bridge timecode"),
            Self::Foxglove(_) => Ok("bridge foxglove"),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(zenoh) if zenoh.receive => Err("must be without --receive, because a show has its own source"),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(_) => Ok("bridge zenoh"),
            #[cfg(not(feature = "zenoh"))]
            Self::Zenoh(_) => Err(WITHOUT_ZENOH),
        }
    }

    /// Where the bridge listens and sends to. zenoh finds its peers itself.
    pub(crate) fn endpoints(&self) -> Vec<Endpoint> {
        let udp =
            |to: SocketAddrV4, network: NetworkArgs| Endpoint::Sends(Transport::Udp, to.into(), network.interface);
        match self {
            Self::Psn(psn) => vec![udp(psn.to, psn.network)],
            Self::Osc(osc) => {
                let transport = if osc.tcp { Transport::Tcp } else { Transport::Udp };
                let to = osc.to.map(|to| Endpoint::Sends(transport, to.into(), osc.network.interface));
                let listen = osc.steering.listen.map(|listen| Endpoint::Listens(Transport::Udp, listen));
                to.into_iter().chain(listen).collect()
            }
            Self::Timecode(timecode) => {
                timecode.output.art_net.map(|to| udp(to, timecode.network)).into_iter().collect()
            }
            Self::Foxglove(foxglove) => vec![Endpoint::Listens(Transport::Tcp, foxglove.listen)],
            Self::Zenoh(_) => Vec::new(),
        }
    }
}

/// Pass the bus on to another machine by zenoh. This program was built without this bridge.
#[cfg(not(feature = "zenoh"))]
#[derive(Clone, Debug, Args)]
#[command(after_help = "Example, for a program that was built with cargo build --release --features zenoh:
  bench-dragon bridge zenoh --listen tcp/10.0.0.5:7447")]
pub(crate) struct AnyArgs {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _any: Vec<String>,
}

/// Flags for outgoing datagrams.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct NetworkArgs {
    /// IPv4 address of the network interface to send from [default: by the routing table].
    #[arg(long, value_name = "ADDRESS", value_parser = interface)]
    pub(crate) interface: Option<Ipv4Addr>,
    /// Most networks that a multicast datagram passes through (TTL), 1 to 255.
    #[arg(long, value_name = "N", default_value_t = 1, allow_negative_numbers = true, value_parser = within(1..=255_u32))]
    pub(crate) ttl: u32,
}

/// The flag for a silent server.
#[derive(Clone, Copy, Debug, Args)]
pub(crate) struct SilenceArgs {
    /// Send the last frame as stale, with all speeds 0, once the server has been silent for these seconds, 0.05 to 60, and for
    /// three periods of its rate.
    #[arg(long, value_name = "SECONDS", default_value_t, allow_negative_numbers = true)]
    pub(crate) stale_after: StaleAfter,
}

/// Flags that choose benches and place them in the coordinate system of a desk.
#[derive(Clone, Debug, Args)]
pub(crate) struct StageArgs {
    /// Benches to send: numbers and ranges, such as 0,10..20. A range includes both ends; 10.. extends to the tail. Of several
    /// dragons, gold:0.. is all of one, and gold:0..5 some of it.
    #[arg(long, value_name = "LIST", default_value_t, allow_hyphen_values = true)]
    pub(crate) benches: BenchSelection,
    /// Rotate the dragon about the vertical axis through the origin by these degrees, counter-clockwise seen from above, from -360
    /// to 360.
    #[arg(long, value_name = "DEGREES", default_value_t, allow_hyphen_values = true)]
    pub(crate) rotate: StageRotation,
    /// After the rotation, move the dragon by X metres to the right, Y away and Z up, each from -10000 to 10000.
    #[arg(long, value_name = "X,Y,Z", default_value_t, allow_hyphen_values = true)]
    pub(crate) offset: StageOffset,
}

impl StageArgs {
    /// The transform to a desk with these axes.
    fn transform(&self, axes: AxisOrder) -> StageTransform {
        StageTransform::new(self.offset, self.rotate, axes)
    }
}

fn target(text: &str) -> Result<SocketAddrV4, String> {
    let target = text.parse().ok().filter(|target: &SocketAddrV4| target.port() > 0 && !target.ip().is_unspecified());
    target.ok_or_else(|| "must be an IPv4 address and a port, such as 10.0.0.20:56565".to_owned())
}

fn interface(text: &str) -> Result<Ipv4Addr, String> {
    let address = text.parse().ok().filter(|address: &Ipv4Addr| !address.is_multicast() && !address.is_broadcast());
    address.ok_or_else(|| "must be an IPv4 address of this machine, such as 10.0.0.5".to_owned())
}

/// The error of a program that was built without zenoh.
#[cfg(not(feature = "zenoh"))]
pub(in crate::cli) const WITHOUT_ZENOH: &str =
    "this program was built without the zenoh bridge: build it with cargo build --release --features zenoh";

pub(crate) fn run(args: &BridgeArgs) -> anyhow::Result<ExitCode> {
    match &args.bridge {
        Bridge::Psn(psn) => psn::run(args, psn),
        Bridge::Osc(osc) => osc::run(args, osc),
        Bridge::Timecode(timecode) => timecode::run(args, timecode),
        Bridge::Foxglove(foxglove) => foxglove::run(args, foxglove),
        #[cfg(feature = "zenoh")]
        Bridge::Zenoh(zenoh) => zenoh::run(args, zenoh),
        #[cfg(not(feature = "zenoh"))]
        Bridge::Zenoh(_) => Err(BadInput(WITHOUT_ZENOH.to_owned()).into()),
    }
}

/// Opens a sender of datagrams. Its error names a missing interface.
fn open_udp(to: SocketAddrV4, network: NetworkArgs) -> anyhow::Result<Box<dyn Outlet>> {
    let target = UdpTarget { to, interface: network.interface, multicast_ttl: network.ttl };
    let sender = UdpSender::open(target).with_context(|| match network.interface {
        Some(interface) => format!("no interface can send from {interface}, `ip address` lists all interfaces"),
        None => format!("cannot send to {to}"),
    })?;
    Ok(Box::new(sender))
}

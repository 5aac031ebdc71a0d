//! `bridge`: passes the poses on in the protocols of show control.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::process::ExitCode;

use anyhow::Context as _;
use bench_dragon_ipc::Instance;
use clap::{Args, Subcommand};

use crate::bridge::osc::{AddressPattern, AngleUnit, OscEncoder, OscSettings, ShowAddress, SlipSender};
use crate::bridge::psn::{self, PsnEncoder, SystemName};
use crate::bridge::{Outlet, Packets, UdpSender, UdpTarget};
use crate::command::flags::{BadInput, BusArgs, FormatArgs, within};
use crate::source::server::schedule::Schedule;
use crate::system::clock::{monotonic_ns, unix_minus_monotonic_ns};
use crate::system::stop::StopFlag;

mod feed;
mod session;
#[cfg(feature = "zenoh")]
mod zenoh;

use feed::Feed;
use session::PacketSession;

/// Pass the poses on to lighting desks, media servers and other machines.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon bridge psn --interface 10.0.0.5
  bench-dragon bridge osc --to 10.0.0.30:7000 --bundle

A bridge polls the frames; the server never waits for it.")]
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
    Psn(PsnArgs),
    Osc(OscArgs),
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
            #[cfg(feature = "zenoh")]
            Self::Zenoh(zenoh) if zenoh.receive => Err("must be without --receive, because a show has its own source"),
            #[cfg(feature = "zenoh")]
            Self::Zenoh(_) => Ok("bridge zenoh"),
            #[cfg(not(feature = "zenoh"))]
            Self::Zenoh(_) => Err(WITHOUT_ZENOH),
        }
    }
}

/// Send PosiStageNet 2.03 to lighting desks and media servers, each bench as a tracker.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon bridge psn --interface 10.0.0.5
  bench-dragon bridge psn --to 10.0.0.20:56565 --rate 30

A tracker is the centre of a bench. Its id is the bench's number; the head is 0. Its x is our x, its y (up) our z, its z \
(depth) our y. Its status is 1, and 0 once the server has been silent for 1.5 seconds, or for three periods of a slower \
server.")]
pub(crate) struct PsnArgs {
    /// IPv4 address and port of the receiver, a multicast group or one machine.
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = psn::DEFAULT_TARGET, value_parser = target)]
    pub(crate) to: SocketAddrV4,
    #[command(flatten)]
    pub(crate) network: NetworkArgs,
    /// DATA frames per second, 1 to 250.
    #[arg(long, value_name = "HZ", default_value_t = 60, allow_negative_numbers = true, value_parser = within(1..=250_u32))]
    pub(crate) rate: u32,
    /// Name under which lighting desks list this sender [default: bench-dragon and the instance].
    #[arg(long, value_name = "NAME")]
    pub(crate) name: Option<SystemName>,
}

/// Send Open Sound Control (OSC) messages, one per bench and frame.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon bridge osc --to 10.0.0.30:7000
  bench-dragon bridge osc --to 10.0.0.30:7000 --tcp --bundle
  bench-dragon bridge osc --address /stage/{index}/pose --angle radians

A frame is one message /dragon/show and one message per bench. /dragon/show has show time in s, state, time scale, tick, and \
fresh: 1, or 0 once the server has been silent for 1.5 seconds, or for three periods of a slower server. A bench's message has \
x, y, z in metres, heading counter-clockwise from +x, and speed in m/s of wall time.")]
pub(crate) struct OscArgs {
    /// IPv4 address and port of the receiver.
    #[arg(long, value_name = "ADDRESS:PORT", default_value = "127.0.0.1:9000", value_parser = target)]
    pub(crate) to: SocketAddrV4,
    /// Send by TCP, with SLIP framing, instead of UDP.
    #[arg(long, conflicts_with_all = ["interface", "ttl"])]
    pub(crate) tcp: bool,
    #[command(flatten)]
    pub(crate) network: NetworkArgs,
    /// Frames per second, 1 to 250.
    #[arg(long, value_name = "HZ", default_value_t = 30, allow_negative_numbers = true, value_parser = within(1..=250_u32))]
    pub(crate) rate: u32,
    /// OSC address of a bench's message; {index} is the bench's number.
    #[arg(long, value_name = "PATTERN", default_value = "/dragon/bench/{index}")]
    pub(crate) address: AddressPattern,
    /// OSC address of the show's message.
    #[arg(long, value_name = "ADDRESS", default_value = "/dragon/show")]
    pub(crate) show_address: ShowAddress,
    /// Unit of headings.
    #[arg(long, value_enum, value_name = "UNIT", default_value_t)]
    pub(crate) angle: AngleUnit,
    /// Send the messages of a frame in bundles, each up to the size of a datagram.
    #[arg(long)]
    pub(crate) bundle: bool,
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
pub(in crate::command) const WITHOUT_ZENOH: &str =
    "this program was built without the zenoh bridge: build it with cargo build --release --features zenoh";

pub(crate) fn run(args: &BridgeArgs) -> anyhow::Result<ExitCode> {
    match &args.bridge {
        Bridge::Psn(psn) => send_psn(args, psn),
        Bridge::Osc(osc) => send_osc(args, osc),
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

const INFO_RATE_HZ: u32 = 1;

fn send_psn(args: &BridgeArgs, psn: &PsnArgs) -> anyhow::Result<ExitCode> {
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let name = psn.name.clone().unwrap_or_else(|| default_name(&args.bus.instance));
    let mut session = PacketSession::new(args.format.format, psn.to, open_udp(psn.to, psn.network)?);
    let Some(mut feed) = Feed::open(&domain, "bridge-psn", psn.rate, &stop)? else { return session.finish(0) };
    session.announce(feed.epoch_ns, psn.rate)?;
    hand_on(&mut feed, name, &mut session)?;
    session.finish(feed.missed())
}

/// Sends frame after frame until a signal.
fn hand_on(feed: &mut Feed<'_>, name: SystemName, session: &mut PacketSession) -> anyhow::Result<()> {
    let mut encoder = PsnEncoder::new(name, feed.epoch_ns);
    let mut packets = Packets::default();
    let mut info = Schedule::new(monotonic_ns(), INFO_RATE_HZ);
    while let Some(release) = feed.next()? {
        if info.due_ns() <= release.now_ns {
            encoder.info(release.latest.benches.len(), release.now_ns, &mut packets)?;
            session.send(&packets, release.now_ns)?;
            info.advance(release.now_ns);
        }
        encoder.data(release.latest, release.now_ns, &mut packets)?;
        session.send_frame(&packets, &release)?;
    }
    Ok(())
}

fn default_name(instance: &Instance) -> SystemName {
    format!("bench-dragon {instance}").parse().expect("an instance's name is short, and ASCII")
}

fn send_osc(args: &BridgeArgs, osc: &OscArgs) -> anyhow::Result<ExitCode> {
    check(osc)?;
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let outlet: Box<dyn Outlet> =
        if osc.tcp { Box::new(SlipSender::new(osc.to)) } else { open_udp(osc.to, osc.network)? };
    let mut session = PacketSession::new(args.format.format, osc.to, outlet);
    let Some(mut feed) = Feed::open(&domain, "bridge-osc", osc.rate, &stop)? else { return session.finish(0) };
    session.announce(feed.epoch_ns, osc.rate)?;
    let mut encoder = OscEncoder::new(settings(osc));
    let mut packets = Packets::default();
    while let Some(release) = feed.next()? {
        encoder.frame(release.latest, unix_minus_monotonic_ns(), &mut packets);
        session.send_frame(&packets, &release)?;
    }
    session.finish(feed.missed())
}

fn check(OscArgs { to, tcp, address, show_address, .. }: &OscArgs) -> Result<(), BadInput> {
    if *tcp && (to.ip().is_multicast() || to.ip().is_broadcast()) {
        return Err(BadInput(format!("--to is {to}, must be the address of one machine with --tcp")));
    }
    if address.is_bench(show_address) {
        return Err(BadInput(format!(
            "--show-address is {show_address}, must differ from each bench's by --address {address}"
        )));
    }
    Ok(())
}

fn settings(osc: &OscArgs) -> OscSettings {
    OscSettings {
        bench_address: osc.address.clone(),
        show_address: osc.show_address.clone(),
        angle: osc.angle,
        bundle: osc.bundle,
    }
}

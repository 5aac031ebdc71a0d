//! `bridge`: the poses in the words of show control.

use std::net::SocketAddrV4;
use std::process::ExitCode;

use anyhow::Context as _;
use bench_dragon_ipc::{Domain, Instance};

use crate::bridge::osc::{OscEncoder, OscSettings, SlipSender};
use crate::bridge::psn::{PsnEncoder, SystemName};
use crate::bridge::{Outlet, Packets, UdpSender, UdpTarget};
use crate::cli::{BadInput, Bridge, BridgeArgs, NetworkArgs, OscArgs, PsnArgs};
use crate::source::server::schedule::Schedule;
use crate::system::clock::{monotonic_ns, unix_minus_monotonic_ns};
use crate::system::stop::StopFlag;

mod feed;
mod session;
#[cfg(feature = "zenoh")]
mod zenoh;

use feed::Feed;
use session::PacketSession;

/// What a program that was built without zenoh says.
#[cfg(not(feature = "zenoh"))]
pub(in crate::command) const WITHOUT_ZENOH: &str =
    "this program was built without the bridge to other machines: cargo build --release --features zenoh builds it in";

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

/// Makes a sender of datagrams. An error says which interface there is none of.
fn open_udp(to: SocketAddrV4, network: NetworkArgs) -> anyhow::Result<Box<dyn Outlet>> {
    let target = UdpTarget { to, interface: network.interface, multicast_ttl: network.ttl };
    let sender = UdpSender::open(target).with_context(|| match network.interface {
        Some(interface) => format!("no interface can send from {interface}, `ip address` lists those that there are"),
        None => format!("cannot send to {to}"),
    })?;
    Ok(Box::new(sender))
}

const INFO_RATE_HZ: u32 = 1;

fn send_psn(args: &BridgeArgs, psn: &PsnArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let name = psn.name.clone().unwrap_or_else(|| default_name(&args.bus.instance));
    let mut session = PacketSession::new(args.format.format, psn.to, open_udp(psn.to, psn.network)?);
    let Some(mut feed) = Feed::open(&domain, "bridge-psn", psn.rate, &stop)? else { return session.finish(0) };
    session.announce(feed.epoch_ns(), psn.rate)?;
    hand_on(&mut feed, name, &mut session)?;
    session.finish(feed.missed())
}

/// Sends frame after frame, until a signal comes.
fn hand_on(feed: &mut Feed<'_>, name: SystemName, session: &mut PacketSession) -> anyhow::Result<()> {
    let mut encoder = PsnEncoder::new(name, feed.epoch_ns());
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
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let outlet: Box<dyn Outlet> =
        if osc.tcp { Box::new(SlipSender::new(osc.to)) } else { open_udp(osc.to, osc.network)? };
    let mut session = PacketSession::new(args.format.format, osc.to, outlet);
    let Some(mut feed) = Feed::open(&domain, "bridge-osc", osc.rate, &stop)? else { return session.finish(0) };
    session.announce(feed.epoch_ns(), osc.rate)?;
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
        return Err(BadInput(format!("--to is {to}, must be one machine's with --tcp")));
    }
    if address.is_bench(show_address) {
        return Err(BadInput(format!("--show-address is {show_address}, must be no bench's by --address {address}")));
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

//! `bridge osc`: a message a bench.

use std::process::ExitCode;

use bench_dragon_ipc::Domain;

use super::feed::Feed;
use super::open_udp;
use super::session::Session;
use crate::bridge::osc::{AngleUnit, OscEncoder, OscSettings, SlipSender};
use crate::bridge::{Outlet, Packets};
use crate::cli::{Angle, BridgeArgs, OscArgs};
use crate::command::BadInput;
use crate::system::clock::unix_minus_monotonic_ns;
use crate::system::stop::StopFlag;

pub(super) fn run(args: &BridgeArgs, osc: &OscArgs) -> anyhow::Result<ExitCode> {
    check(osc)?;
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let outlet: Box<dyn Outlet> =
        if osc.tcp { Box::new(SlipSender::new(osc.to)) } else { open_udp(osc.to, osc.network)? };
    let mut session = Session::new(args.format.format, osc.to, outlet);
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

/// Refuses what cannot be sent, or not be told apart.
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
        angle: match osc.angle {
            Angle::Degrees => AngleUnit::Degrees,
            Angle::Radians => AngleUnit::Radians,
        },
        bundle: osc.bundle,
    }
}

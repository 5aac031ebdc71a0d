//! `bridge psn`: each bench as a PosiStageNet tracker.

use std::process::ExitCode;

use bench_dragon_ipc::{Domain, Instance};

use super::feed::Feed;
use super::open_udp;
use super::session::Session;
use crate::bridge::Packets;
use crate::bridge::psn::{PsnEncoder, SystemName};
use crate::cli::{BridgeArgs, PsnArgs};
use crate::source::server::schedule::Schedule;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// INFO frames a second.
const INFO_RATE_HZ: u32 = 1;

pub(super) fn run(args: &BridgeArgs, psn: &PsnArgs) -> anyhow::Result<ExitCode> {
    let domain = Domain::new(args.bus.instance.clone())?;
    let stop = StopFlag::on_signals()?;
    let name = psn.name.clone().unwrap_or_else(|| default_name(&args.bus.instance));
    let mut session = Session::new(args.format.format, psn.to, open_udp(psn.to, psn.network)?);
    let Some(mut feed) = Feed::open(&domain, "bridge-psn", psn.rate, &stop)? else { return session.finish(0) };
    session.announce(feed.epoch_ns(), psn.rate)?;
    hand_on(&mut feed, name, &mut session)?;
    session.finish(feed.missed())
}

/// Sends frame after frame, until a signal comes.
fn hand_on(feed: &mut Feed<'_>, name: SystemName, session: &mut Session) -> anyhow::Result<()> {
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

//! `bridge psn`: sends the poses as PosiStageNet.

use std::net::SocketAddrV4;
use std::process::ExitCode;

use bench_dragon_ipc::Instance;
use clap::Args;

use super::feed::{Feed, FeedSettings};
use super::session::PacketSession;
use super::{BridgeArgs, NetworkArgs, SilenceArgs, StageArgs, open_udp, target};
use crate::bridge::psn::{DEFAULT_TARGET, PsnEncoder, PsnSettings, SystemName, TrackerName};
use crate::bridge::{AxisOrder, Packets, desk_settings};
use crate::cli::flags::{SpinArgs, within};
use crate::source::server::schedule::Schedule;
use crate::system::clock::monotonic_ns;
use crate::system::stop::StopFlag;

/// Send PosiStageNet 2.03 to lighting desks and media servers, each bench as a tracker.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon bridge psn --interface 10.0.0.5
  bench-dragon bridge psn --to 10.0.0.20:56565 --rate 30
  bench-dragon bridge psn --rotate 90 --offset 12,-3.5,0 --axes x,y,z
  bench-dragon bridge psn --benches 0,20..40 --first-id 1 --tracker-name 'Dragon {index}'
  bench-dragon bridge psn --benches gold:0..,silver:0..9 --tracker-name '{dragon}/{index}'

A tracker is at the centre of the board of a bench; the head's is the centre of bench 0's board, not its front hinge. The id of \
bench i is that of --first-id plus i, whichever benches are chosen; several dragons are numbered on from one to the next. With the default axes the desk's x is our x (right), its y \
our z (up), its z (depth) our y (away). The dragon is rotated, then moved, then expressed along the desk's axes. A tracker's \
status is 1. It is 0, and its speed is 0, once the server has been silent for --stale-after. A tracker's time is the instant \
for which its pose holds.

At the first frame the bridge prints what to enter at the desk: address, system, trackers, axes.")]
pub(crate) struct PsnArgs {
    /// IPv4 address and port of the receiver, a multicast group or one machine.
    #[arg(long, value_name = "ADDRESS:PORT", default_value_t = DEFAULT_TARGET, value_parser = target)]
    pub(crate) to: SocketAddrV4,
    #[command(flatten)]
    pub(crate) network: NetworkArgs,
    /// DATA frames per second, 1 to 250.
    #[arg(long, value_name = "HZ", default_value_t = 60, allow_negative_numbers = true, value_parser = within(1..=250_u32))]
    pub(crate) rate: u32,
    /// Name under which lighting desks list this sender [default: bench-dragon and the instance].
    #[arg(long, value_name = "NAME")]
    pub(crate) name: Option<SystemName>,
    #[command(flatten)]
    pub(crate) clock: SpinArgs,
    #[command(flatten)]
    pub(crate) silence: SilenceArgs,
    #[command(flatten)]
    pub(crate) stage: StageArgs,
    /// Axes of the desk, in its order, as our x (right), y (away) and z (up); - reverses an axis.
    #[arg(long, value_name = "AXES", default_value_t = AxisOrder::RIGHT_UP_AWAY, allow_hyphen_values = true)]
    pub(crate) axes: AxisOrder,
    /// Id of the head's tracker, 0 to 65535; bench i has this id plus i.
    #[arg(long, value_name = "N", default_value_t = 0, allow_negative_numbers = true, value_parser = within(0..=u16::MAX))]
    pub(crate) first_id: u16,
    /// Name of each tracker; {index} is the bench's number, {id} the tracker's id. Of several dragons, {dragon} is the name, which
    /// otherwise stands before, and {index} the number within the dragon.
    #[arg(long, value_name = "PATTERN", default_value_t)]
    pub(crate) tracker_name: TrackerName,
}

const INFO_RATE_HZ: u32 = 1;

pub(super) fn run(args: &BridgeArgs, psn: &PsnArgs) -> anyhow::Result<ExitCode> {
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let outlet = open_udp(psn.to, psn.network)?;
    let mut session = PacketSession::new(args.format.format, psn.to, psn.rate, outlet);
    let feed = FeedSettings { rate_hz: psn.rate, stale_after: psn.silence.stale_after, spin: psn.clock.spin() };
    let Some(mut feed) = Feed::open(&domain, "bridge-psn", feed, &stop)? else {
        return session.finish(0);
    };
    hand_on(&mut feed, &settings(psn, &args.bus.instance), psn.to, &mut session)?;
    session.finish(feed.missed())
}

/// Sends frame after frame until a signal.
fn hand_on(
    feed: &mut Feed<'_>,
    settings: &PsnSettings,
    to: SocketAddrV4,
    session: &mut PacketSession,
) -> anyhow::Result<()> {
    let mut of_dragons = settings.clone();
    let mut encoder = PsnEncoder::new(settings.clone(), session.epoch_ns());
    let mut packets = Packets::default();
    let mut info = Schedule::new(monotonic_ns(), INFO_RATE_HZ);
    while let Some(due) = feed.next()? {
        let benches = due.latest.benches.len();
        if session.are_other(benches, due.dragons) {
            of_dragons = settings.of(due.dragons);
            encoder.set(of_dragons.clone());
        }
        let line = || Ok(desk_settings::psn(&of_dragons, to, benches)?);
        session.note_dragons(benches, due.dragons, &settings.benches, line)?;
        if info.due_ns() <= due.now_ns {
            encoder.info(benches, due.now_ns, &mut packets)?;
            session.send(&packets, due.now_ns)?;
            info.advance(due.now_ns);
        }
        encoder.data(due.latest, due.now_ns, &mut packets)?;
        session.send_frame(&packets, &due)?;
    }
    Ok(())
}

fn settings(psn: &PsnArgs, instance: &Instance) -> PsnSettings {
    PsnSettings {
        system_name: psn.name.clone().unwrap_or_else(|| default_name(instance)),
        benches: psn.stage.benches.clone(),
        first_id: psn.first_id,
        tracker_name: psn.tracker_name.clone(),
        transform: psn.stage.transform(psn.axes),
    }
}

fn default_name(instance: &Instance) -> SystemName {
    format!("bench-dragon {instance}").parse().expect("an instance's name is short, and ASCII")
}

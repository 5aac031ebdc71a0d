//! `bridge osc`: sends the poses as Open Sound Control.

use std::net::SocketAddrV4;
use std::process::ExitCode;

use clap::Args;

use super::feed::Feed;
use super::session::PacketSession;
use super::{BridgeArgs, NetworkArgs, SilenceArgs, StageArgs, open_udp, target};
use crate::bridge::desk_settings::{self, OscTransport};
use crate::bridge::osc::{AddressPattern, AngleUnit, OscEncoder, OscSettings, ShowAddress, SlipSender};
use crate::bridge::{AxisOrder, Outlet, Packets};
use crate::cli::flags::{BadInput, within};
use crate::system::clock::offset_bounds;
use crate::system::stop::StopFlag;
use crate::system::unix_offset::UnixOffset;

/// Send Open Sound Control (OSC) messages, one per bench and frame.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon bridge osc --to 10.0.0.30:7000
  bench-dragon bridge osc --to 10.0.0.30:7000 --tcp --bundle
  bench-dragon bridge osc --address /stage/{index}/pose --angle radians
  bench-dragon bridge osc --benches gold:0..,silver:0..9 --address /stage/{dragon}/{index}
  bench-dragon bridge osc --benches 0,20..40 --rotate 90 --offset 12,-3.5,0 --axes x,z,-y

A frame is one message /dragon/show and one message per chosen bench. /dragon/show has show time in s, state, time scale, tick, \
and fresh: 1, or 0 with all speeds 0 once the server has been silent for --stale-after. A bundle's time is the instant for \
which its poses hold. A bench's message \
has x, y, z of the centre of its board in metres, heading, and speed in m/s of wall time. The head's is the centre of bench 0's \
board, not its front hinge. The dragon is rotated, then moved, then expressed along the receiver's axes. A heading is the angle \
from the receiver's first horizontal axis towards its second one; by default it is counter-clockwise from +x.

At the first frame the bridge prints what to enter at the receiver: address, messages, axes.")]
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
    /// OSC address of a bench's message; {index} is the bench's number. Of several dragons, {dragon} is the name, which otherwise is
    /// the second part, and {index} the number within the dragon: /dragon/gold/bench/0.
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
    #[command(flatten)]
    pub(crate) silence: SilenceArgs,
    #[command(flatten)]
    pub(crate) stage: StageArgs,
    /// Axes of the receiver, in its order, as our x (right), y (away) and z (up); - reverses an axis.
    #[arg(long, value_name = "AXES", default_value_t = AxisOrder::RIGHT_AWAY_UP, allow_hyphen_values = true)]
    pub(crate) axes: AxisOrder,
}

pub(super) fn run(args: &BridgeArgs, osc: &OscArgs) -> anyhow::Result<ExitCode> {
    check(osc)?;
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let outlet: Box<dyn Outlet> =
        if osc.tcp { Box::new(SlipSender::new(osc.to)) } else { open_udp(osc.to, osc.network)? };
    let mut session = PacketSession::new(args.format.format, osc.to, osc.rate, outlet);
    let Some(mut feed) = Feed::open(&domain, "bridge-osc", osc.rate, osc.silence.stale_after, &stop)? else {
        return session.finish(0);
    };
    hand_on(&mut feed, osc, &mut session)?;
    session.finish(feed.missed())
}

/// Sends frame after frame until a signal.
fn hand_on(feed: &mut Feed<'_>, osc: &OscArgs, session: &mut PacketSession) -> anyhow::Result<()> {
    let settings = settings(osc);
    let mut of_dragons = settings.clone();
    let transport = if osc.tcp { OscTransport::Tcp } else { OscTransport::Udp };
    let mut encoder = OscEncoder::new(settings.clone());
    let mut packets = Packets::default();
    let mut unix_offset = UnixOffset::measured();
    while let Some(due) = feed.next()? {
        let benches = due.latest.benches.len();
        if session.are_other(benches, due.dragons) {
            of_dragons = settings.of(due.dragons);
            encoder = OscEncoder::new(of_dragons.clone());
        }
        let line = || Ok(desk_settings::osc(&of_dragons, osc.to, transport, benches));
        session.note_dragons(benches, due.dragons, &settings.benches, line)?;
        unix_offset.correct(offset_bounds());
        encoder.frame(due.latest, unix_offset.ns(), &mut packets);
        session.send_frame(&packets, &due)?;
    }
    Ok(())
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
        is_bundled: osc.bundle,
        benches: osc.stage.benches.clone(),
        transform: osc.stage.transform(osc.axes),
    }
}

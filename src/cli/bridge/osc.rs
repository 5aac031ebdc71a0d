//! `bridge osc`: sends the poses as Open Sound Control, and accepts commands.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::process::ExitCode;

use clap::Args;

use super::feed::{DueFrame, Feed, FeedSettings};
use super::session::PacketSession;
use super::steering::SteeringArgs;
use super::{BridgeArgs, NetworkArgs, SilenceArgs, StageArgs, open_udp, target};
use crate::bridge::desk_settings::{self, OscTransport};
use crate::bridge::osc::{AddressPattern, AngleUnit, OscEncoder, OscSettings, ShowAddress, SlipSender};
use crate::bridge::osc_steering::encode_cue;
use crate::bridge::{AxisOrder, Outlet, Packets};
use crate::cli::flags::{BadInput, Format, SpinArgs, within};
use crate::config::PlannedCue;
use crate::system::clock::offset_bounds;
use crate::system::stop::StopFlag;
use crate::system::unix_offset::UnixOffset;

/// Send Open Sound Control (OSC) messages, one per bench and frame. Accept commands from desks.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon bridge osc --to 10.0.0.30:7000
  bench-dragon bridge osc --to 10.0.0.30:7000 --tcp --bundle
  bench-dragon bridge osc --address /stage/{index}/pose --angle radians
  bench-dragon bridge osc --benches gold:0..,silver:0..9 --address /stage/{dragon}/{index}
  bench-dragon bridge osc --listen 0.0.0.0:7400 --allow 10.0.0.0/24 --full
  bench-dragon bridge osc --benches 0,20..40 --rotate 90 --offset 12,-3.5,0 --axes x,z,-y

A frame is one message /dragon/show and one message per chosen bench. /dragon/show has show time in s, state, time scale, tick, \
and fresh: 1, or 0 with all speeds 0 once the server has been silent for --stale-after. A bundle's time is the instant for \
which its poses hold. A bench's message \
has x, y, z of the centre of its board in metres, heading, and speed in m/s of wall time. The head's is the centre of bench 0's \
board, not its front hinge. The dragon is rotated, then moved, then expressed along the receiver's axes. A heading is the angle \
from the receiver's first horizontal axis towards its second one; by default it is counter-clockwise from +x.

At the first frame the bridge prints what to enter at the receiver: address, messages, axes.

With --listen, desks steer the show by /dragon/hold, /dragon/pause, /dragon/resume, /dragon/go, /dragon/speed MPS, /dragon/pace FACTOR, \
and with --full by /dragon/release, /dragon/seek SECONDS, /dragon/cue NAME and /dragon/stop. The sender gets /dragon/reply (command, accepted, tick, \
reason), and /dragon/state (state, show time, speed, tick) at each change and once a second. Poses are then sent only with --to. \
docs/reference/steering.md has the settings of desks.")]
pub(crate) struct OscArgs {
    /// IPv4 address and port of the receiver [default: 127.0.0.1:9000, or with --listen: no receiver].
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = target)]
    pub(crate) to: Option<SocketAddrV4>,
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
    pub(crate) clock: SpinArgs,
    #[command(flatten)]
    pub(crate) silence: SilenceArgs,
    #[command(flatten)]
    pub(crate) stage: StageArgs,
    /// Axes of the receiver, in its order, as our x (right), y (away) and z (up); - reverses an axis.
    #[arg(long, value_name = "AXES", default_value_t = AxisOrder::RIGHT_AWAY_UP, allow_hyphen_values = true)]
    pub(crate) axes: AxisOrder,
    #[command(flatten)]
    pub(crate) steering: SteeringArgs,
}

impl OscArgs {
    /// The receiver of poses.
    fn receiver(&self) -> Option<SocketAddrV4> {
        let is_sender = self.steering.listen.is_none();
        self.to.or(is_sender.then_some(SocketAddrV4::new(Ipv4Addr::LOCALHOST, 9000)))
    }
}

pub(super) fn run(args: &BridgeArgs, osc: &OscArgs) -> anyhow::Result<ExitCode> {
    check(osc)?;
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let format = args.format.format;
    let mut poses = osc.receiver().map(|to| PoseSender::open(osc, to, format)).transpose()?;
    let steering = osc.steering.start(domain.clone().for_operators(), format)?;
    let mut missed = 0;
    let feed = FeedSettings { rate_hz: osc.rate, stale_after: osc.silence.stale_after, spin: osc.clock.spin() };
    if let Some(mut feed) = Feed::open(&domain, "bridge-osc", feed, &stop)? {
        let mut last = None;
        while let Some(due) = feed.next()? {
            let reached = due.cues.reached(last.replace(due.latest.header).as_ref(), &due.latest.header);
            if let Some(steering) = &steering {
                steering.note(due.latest, due.cues, reached);
            }
            if let Some(poses) = &mut poses {
                poses.send(&due, reached)?;
            }
        }
        missed = feed.missed();
    }
    if let Some(steering) = steering {
        steering.finish()?;
    }
    poses.map_or(Ok(ExitCode::SUCCESS), |poses| poses.session.finish(missed))
}

/// Sends poses to a receiver.
struct PoseSender {
    session: PacketSession,
    to: SocketAddrV4,
    transport: OscTransport,
    settings: OscSettings,
    /// The settings for the dragons of the last frame.
    of_dragons: OscSettings,
    encoder: OscEncoder,
    packets: Packets,
    unix_offset: UnixOffset,
}

impl PoseSender {
    fn open(osc: &OscArgs, to: SocketAddrV4, format: Format) -> anyhow::Result<Self> {
        let outlet: Box<dyn Outlet> = if osc.tcp { Box::new(SlipSender::new(to)) } else { open_udp(to, osc.network)? };
        let settings = settings(osc);
        Ok(Self {
            session: PacketSession::new(format, to, osc.rate, outlet),
            to,
            transport: if osc.tcp { OscTransport::Tcp } else { OscTransport::Udp },
            of_dragons: settings.clone(),
            encoder: OscEncoder::new(settings.clone()),
            settings,
            packets: Packets::default(),
            unix_offset: UnixOffset::measured(),
        })
    }

    fn send(&mut self, due: &DueFrame<'_>, reached: &[PlannedCue]) -> anyhow::Result<()> {
        let Self { session, to, transport, settings, of_dragons, encoder, packets, unix_offset } = self;
        let benches = due.latest.benches.len();
        if session.are_other(benches, due.dragons) {
            *of_dragons = settings.of(due.dragons);
            *encoder = OscEncoder::new(of_dragons.clone());
        }
        let line = || Ok(desk_settings::osc(of_dragons, *to, *transport, benches));
        session.note_dragons(benches, due.dragons, &settings.benches, line)?;
        unix_offset.correct(offset_bounds());
        encoder.frame(due.latest, unix_offset.ns(), packets);
        for cue in reached {
            packets.push(|packet| packet.extend(encode_cue(cue)));
        }
        session.send_frame(packets, due)
    }
}

fn check(osc: &OscArgs) -> Result<(), BadInput> {
    let OscArgs { tcp, address, show_address, .. } = osc;
    let many = |to: &SocketAddrV4| to.ip().is_multicast() || to.ip().is_broadcast();
    if let Some(to) = osc.receiver().filter(|to| *tcp && many(to)) {
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

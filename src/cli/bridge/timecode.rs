//! `bridge timecode`: sends show time as timecode.

use std::net::{Ipv4Addr, SocketAddrV4};
use std::process::ExitCode;

use clap::Args;

use super::feed::{Feed, FeedSettings};
use super::ltc::{self, LtcOutput};
use super::session::PacketSession;
use super::{BridgeArgs, NetworkArgs, SilenceArgs, open_udp, target};
use crate::bridge::Packets;
use crate::bridge::timecode::{PacerStep, TimecodePacer};
use crate::cli::flags::{BadInput, within};
use crate::source::timecode::{Clock, FrameRate, art_net};
use crate::system::clock::{monotonic_ns, sleep_precisely};
use crate::system::stop::StopFlag;

/// Longest time between two looks at the bus: a show that stops is noticed within it.
const LOOK_NS: u64 = 5_000_000;
/// Looks per second until a frame is there.
const LOOK_HZ: u32 = 200;

/// Send show time as timecode, so that sound and light follow the dragon.
#[derive(Clone, Debug, Args)]
#[command(after_help = "Examples:
  bench-dragon bridge timecode --art-net 10.0.0.255
  bench-dragon bridge timecode --art-net 10.0.0.20:6454 --rate 30 --offset 3600
  bench-dragon bridge timecode --ltc - --rate 29.97ndf | aplay

The timecode is show time plus --offset. It runs while the show runs, and stands while the show stands: the same frame is then sent \
again, as often as --rate says. Before 00:00:00:00 it is that of the day before; --offset 3600 lets the show begin at 01:00:00:00. \
docs/reference/timecode.md has the details.")]
pub(crate) struct TimecodeArgs {
    #[command(flatten)]
    pub(crate) output: OutputArgs,
    /// Frames per second: 24, 25, 29.97 (drop-frame), 30, or for --ltc 29.97ndf.
    #[arg(long, value_name = "FPS", default_value_t)]
    pub(crate) rate: FrameRate,
    /// Timecode minus show time, in seconds from -1000000 to 1000000.
    #[arg(long, value_name = "SECONDS", default_value_t = 0.0, allow_negative_numbers = true, value_parser = within(-1e6..=1e6))]
    pub(crate) offset: f64,
    /// Samples per second of --ltc, 8000 to 192000.
    #[arg(long, value_name = "HZ", default_value_t = 48_000, conflicts_with = "art_net", allow_negative_numbers = true,
        value_parser = within(8_000..=192_000_u32))]
    pub(crate) sample_rate: u32,
    /// Write the samples of --ltc without a WAV header: 16 bits, one channel, little-endian.
    #[arg(long, conflicts_with = "art_net")]
    pub(crate) raw: bool,
    #[command(flatten)]
    pub(crate) network: NetworkArgs,
    #[command(flatten)]
    pub(crate) silence: SilenceArgs,
}

/// The output: one of these.
#[derive(Clone, Debug, Args)]
#[group(required = true, multiple = false)]
pub(crate) struct OutputArgs {
    /// Send Art-Net timecode (`ArtTimeCode`) to this IPv4 address and port; without a port, to 6454.
    #[arg(long, value_name = "ADDRESS[:PORT]", value_parser = art_net_target)]
    pub(crate) art_net: Option<SocketAddrV4>,
    /// Write linear timecode (LTC) as sound: - to stdout, else into a new file.
    #[arg(long, value_name = "-|FILE.wav", allow_hyphen_values = true, conflicts_with_all = ["interface", "ttl"])]
    pub(crate) ltc: Option<LtcOutput>,
}

fn art_net_target(text: &str) -> Result<SocketAddrV4, String> {
    let whole =
        text.parse().map_or_else(|_| text.to_owned(), |address: Ipv4Addr| format!("{address}:{}", art_net::PORT));
    target(&whole)
        .map_err(|_| "must be an IPv4 address, and perhaps a port, such as 10.0.0.255 or 10.0.0.20:6455".to_owned())
}

/// The feed of timecode.
pub(super) fn feed_of(silence: SilenceArgs) -> FeedSettings {
    FeedSettings { rate_hz: LOOK_HZ, stale_after: silence.stale_after, spin: None }
}

pub(super) fn run(args: &BridgeArgs, timecode: &TimecodeArgs) -> anyhow::Result<ExitCode> {
    match timecode.output {
        OutputArgs { ltc: Some(ref to), .. } => ltc::run(args, timecode, to),
        OutputArgs { art_net, .. } => send_art_net(args, timecode, art_net.expect("one output is required")),
    }
}

fn send_art_net(args: &BridgeArgs, timecode: &TimecodeArgs, to: SocketAddrV4) -> anyhow::Result<ExitCode> {
    let &TimecodeArgs { rate, offset, network, silence, .. } = timecode;
    if art_net::packet(Clock::default(), rate).is_none() {
        let message = format!("--rate is {rate}, must be 24, 25, 29.97 or 30: Art-Net has no other types of timecode");
        return Err(BadInput(message).into());
    }
    let domain = args.bus.domain()?;
    let stop = StopFlag::on_signals()?;
    let mut session =
        PacketSession::new(args.format.format, to, rate, open_udp(to, network)?).when_silent("the timecode stands");
    let Some(mut feed) = Feed::open(&domain, "bridge-timecode", feed_of(silence), &stop)? else {
        return session.finish(0);
    };
    sleep_precisely();
    let mut pacer = TimecodePacer::new(rate, (offset * 1e9).round() as i64);
    let (mut packets, mut deadline_ns) = (Packets::default(), monotonic_ns());
    while let Some((now_ns, latest)) = feed.newest_at(deadline_ns)? {
        deadline_ns = now_ns + LOOK_NS;
        let Some(latest) = latest else { continue };
        session.announce_once(|| settings(to, rate, offset))?;
        match pacer.step(latest, now_ns) {
            PacerStep::Wait(then_ns) => deadline_ns = deadline_ns.min(then_ns),
            PacerStep::Send(frame) => {
                let packet = art_net::packet(Clock::of_frame(frame, rate), rate).expect("the rate has a type");
                packets.clear();
                packets.push(|bytes| bytes.extend_from_slice(&packet));
                session.send_at(&packets, now_ns, Some(latest.freshness))?;
                deadline_ns = now_ns;
            }
        }
    }
    session.finish(pacer.left_out())
}

/// All that an operator checks at the receiver.
fn settings(to: SocketAddrV4, rate: FrameRate, offset_s: f64) -> String {
    let drop_frame = if rate == FrameRate::DropFrame { ", drop-frame" } else { "" };
    format!(
        "Art-Net timecode: {} port {}, {rate} frames a second{drop_frame}, show time {offset_s:+} s",
        to.ip(),
        to.port()
    )
}

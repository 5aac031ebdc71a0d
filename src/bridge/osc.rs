//! Open Sound Control: one message for each bench, and one for the show.
//!
//! | address | arguments |
//! |---|---|
//! | `/dragon/show` | show time in seconds (f), state (s), time scale (f), tick (i), fresh (i: 1, or 0 if the frame is stale) |
//! | `/dragon/bench/7` | x, y, z of the centre of the board in metres, heading, speed in metres per wall-clock second (five f) |
//! | `/dragon/gold/bench/7` | the same of one of several dragons, by its name |
//!
//! The show's message precedes the bench messages of the same frame. By default the axes are those of the bus: x right, y away,
//! z up. Headings are then counter-clockwise from +x. A [`StageTransform`] changes positions and headings; a speed is a scalar,
//! and is the same under each transform. Headings are in degrees from −180 to 180, or in radians on request. The tick is reduced
//! to its lowest 31 bits.
//!
//! By default each message is one packet, which every receiver accepts. Optionally messages are sent in bundles. A bundle
//! contains as many messages as a datagram holds, and the instant for which the poses hold. Over TCP each packet is
//! framed by SLIP with a double END, as OSC 1.1 specifies.
//!
//! Source: Open Sound Control 1.0 (2002) and 1.1 (2009), opensoundcontrol.org; SLIP: RFC 1055.

use bench_dragon_ipc::{BenchState, ShowState};
use rosc::{OscMessage, OscPacket, OscTime, OscType, encoder};

use super::bench_selection::BenchSelection;
use super::latest_frame::LatestFrame;
use super::outlet::{MAX_PACKET_LEN, Packets};
use super::stage_transform::StageTransform;
use crate::config::NamedLayout;

pub use super::osc_address::{AddressError, AddressPattern, ShowAddress};
pub use super::slip_sender::SlipSender;

/// The unit of headings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub enum AngleUnit {
    /// From -180 to 180.
    #[default]
    Degrees,
    /// From -pi to pi.
    Radians,
}

/// Settings of an encoder.
#[derive(Clone, Debug, PartialEq)]
pub struct OscSettings {
    /// The address of a bench's message.
    pub bench_address: AddressPattern,
    /// The address of the show's message.
    pub show_address: ShowAddress,
    /// The unit of headings.
    pub angle: AngleUnit,
    /// Whether messages are sent in bundles.
    pub is_bundled: bool,
    /// The chosen benches.
    pub benches: BenchSelection,
    /// The transform to the coordinate system of the receivers.
    pub transform: StageTransform,
}

impl OscSettings {
    /// The same settings for these dragons.
    #[must_use]
    pub fn of(&self, dragons: &NamedLayout) -> Self {
        Self { bench_address: self.bench_address.of(dragons), benches: self.benches.of(dragons), ..self.clone() }
    }
}

/// Encodes frames as packets.
#[derive(Debug)]
pub struct OscEncoder {
    settings: OscSettings,
    /// Addresses of the bench messages. Each is formatted once.
    addresses: Vec<String>,
    messages: Packets,
}

impl OscEncoder {
    /// Returns an encoder with these settings.
    pub fn new(settings: OscSettings) -> Self {
        Self { settings, addresses: Vec::new(), messages: Packets::default() }
    }

    /// Replaces the contents of `packets` with the packets of a frame. `unix_minus_monotonic_ns` is the offset from
    /// `CLOCK_MONOTONIC` to Unix time.
    pub fn frame(&mut self, latest: &LatestFrame, unix_minus_monotonic_ns: i64, packets: &mut Packets) {
        packets.clear();
        if !self.settings.is_bundled {
            self.write_messages(latest, packets);
            return;
        }
        let mut messages = std::mem::take(&mut self.messages);
        messages.clear();
        self.write_messages(latest, &mut messages);
        let unix_ns = latest.header.scheduled_ns.saturating_add_signed(unix_minus_monotonic_ns);
        pack(&messages, osc_time(unix_ns), packets);
        self.messages = messages;
    }

    fn write_messages(&mut self, latest: &LatestFrame, messages: &mut Packets) {
        let OscSettings { bench_address, show_address, benches, .. } = &self.settings;
        let (known, count) = (self.addresses.len(), latest.benches.len());
        self.addresses.extend((known..count).map(|index| bench_address.of_bench(index)));
        write(show_address.to_string(), show(latest), messages);
        for index in benches.indices(count) {
            write(self.addresses[index].clone(), self.bench(&latest.benches[index], latest.speed_factor()), messages);
        }
    }

    fn bench(&self, bench: &BenchState, speed_factor: f64) -> Vec<OscType> {
        let OscSettings { transform, angle, .. } = &self.settings;
        let [x, y, z] = transform.position_m(bench.centre_m);
        let heading_rad = transform.heading_rad(bench.heading_rad);
        let heading = match angle {
            AngleUnit::Degrees => heading_rad.to_degrees(),
            AngleUnit::Radians => heading_rad,
        };
        [x, y, z, heading, bench.speed_mps() * speed_factor].map(|value| OscType::Float(value as f32)).to_vec()
    }
}

fn show(latest: &LatestFrame) -> Vec<OscType> {
    let header = &latest.header;
    vec![
        OscType::Float(header.show_time_s() as f32),
        OscType::String(header.show_state().map_or("unknown", ShowState::name).to_owned()),
        OscType::Float(header.time_scale as f32),
        OscType::Int((header.tick & 0x7fff_ffff) as i32),
        OscType::Int(i32::from(latest.freshness.is_fresh())),
    ]
}

fn write(addr: String, args: Vec<OscType>, messages: &mut Packets) {
    let message = OscPacket::Message(OscMessage { addr, args });
    messages.push(|bytes| {
        encoder::encode_into(&message, bytes).expect("writing to a vector cannot fail");
    });
}

const HEADER: &[u8] = b"#bundle\0";
const HEADER_LEN: usize = HEADER.len() + 8;
/// Bytes of the length before each message in a bundle.
const PREFIX_LEN: usize = 4;
/// Seconds from 1900, the epoch of OSC time, to 1970.
const UNIX_EPOCH_S: u64 = 2_208_988_800;

/// Adds bundles of these messages to `packets`, with as many messages in each as a datagram holds. All have the same time.
fn pack(messages: &Packets, time: OscTime, packets: &mut Packets) {
    let mut rest = messages.iter().peekable();
    while rest.peek().is_some() {
        packets.push(|bytes| {
            let start = bytes.len();
            bytes.extend_from_slice(HEADER);
            bytes.extend_from_slice(&time.seconds.to_be_bytes());
            bytes.extend_from_slice(&time.fractional.to_be_bytes());
            let is_first = |len: usize| len == HEADER_LEN;
            while let Some(message) = rest.next_if(|message| {
                let len = bytes.len() - start;
                is_first(len) || len + PREFIX_LEN + message.len() <= MAX_PACKET_LEN
            }) {
                bytes.extend_from_slice(&(message.len() as u32).to_be_bytes());
                bytes.extend_from_slice(message);
            }
        });
    }
}

/// Converts a Unix time in nanoseconds to OSC time: whole seconds since 1900, which wrap in 2036, and units of 2⁻³² s.
fn osc_time(unix_ns: u64) -> OscTime {
    let (seconds, nanos) = (unix_ns / 1_000_000_000 + UNIX_EPOCH_S, unix_ns % 1_000_000_000);
    OscTime { seconds: seconds as u32, fractional: ((nanos << 32) / 1_000_000_000) as u32 }
}

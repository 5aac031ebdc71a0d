//! Snapshots as messages.

use bench_dragon_ipc::{BenchState, ShowState};
use rosc::{OscMessage, OscPacket, OscType, encoder};

use super::address::{AddressPattern, ShowAddress};
use super::bundle::{osc_time, pack};
use crate::bridge::packets::Packets;
use crate::bridge::snapshot::Snapshot;

/// How headings are told.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AngleUnit {
    /// −180 to 180.
    #[default]
    Degrees,
    /// −π to π.
    Radians,
}

/// What is told, and how.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OscSettings {
    /// The address of a bench's message.
    pub bench_address: AddressPattern,
    /// The address of the show's message.
    pub show_address: ShowAddress,
    /// How headings are told.
    pub angle: AngleUnit,
    /// Whether messages go in bundles.
    pub bundle: bool,
}

/// Turns snapshots into packets.
#[derive(Debug)]
pub struct OscEncoder {
    settings: OscSettings,
    /// The benches' addresses, made once.
    addresses: Vec<String>,
    messages: Packets,
}

impl OscEncoder {
    /// An encoder of these settings.
    pub fn new(settings: OscSettings) -> Self {
        Self { settings, addresses: Vec::new(), messages: Packets::default() }
    }

    /// Replaces `packets` by those of a snapshot. `unix_minus_monotonic_ns` tells what its clock is on the calendar.
    pub fn frame(&mut self, snapshot: &Snapshot, unix_minus_monotonic_ns: i64, packets: &mut Packets) {
        packets.clear();
        if !self.settings.bundle {
            self.write_messages(snapshot, packets);
            return;
        }
        let mut messages = std::mem::take(&mut self.messages);
        messages.clear();
        self.write_messages(snapshot, &mut messages);
        let unix_ns = snapshot.header.published_ns.saturating_add_signed(unix_minus_monotonic_ns);
        pack(&messages, osc_time(unix_ns), packets);
        self.messages = messages;
    }

    fn write_messages(&mut self, snapshot: &Snapshot, messages: &mut Packets) {
        let known = self.addresses.len();
        let pattern = &self.settings.bench_address;
        self.addresses.extend((known..snapshot.benches.len()).map(|index| pattern.of_bench(index)));
        write(self.settings.show_address.to_string(), show(snapshot), messages);
        let speed_factor = snapshot.speed_factor();
        for (address, state) in self.addresses.iter().zip(&snapshot.benches) {
            write(address.clone(), bench(state, self.settings.angle, speed_factor), messages);
        }
    }
}

fn show(snapshot: &Snapshot) -> Vec<OscType> {
    let header = &snapshot.header;
    vec![
        OscType::Float(header.sim_time_s() as f32),
        OscType::String(header.show_state().map_or("unknown", ShowState::name).to_owned()),
        OscType::Float(header.time_scale as f32),
        OscType::Int((header.tick & 0x7fff_ffff) as i32),
        OscType::Int(i32::from(snapshot.freshness.is_fresh())),
    ]
}

fn bench(bench: &BenchState, angle: AngleUnit, speed_factor: f64) -> Vec<OscType> {
    let [x, y, z] = bench.centre_m;
    let heading = match angle {
        AngleUnit::Degrees => bench.heading_rad.to_degrees(),
        AngleUnit::Radians => bench.heading_rad,
    };
    [x, y, z, heading, bench.speed_mps() * speed_factor].map(|value| OscType::Float(value as f32)).to_vec()
}

fn write(addr: String, args: Vec<OscType>, messages: &mut Packets) {
    let message = OscPacket::Message(OscMessage { addr, args });
    messages.push(|bytes| {
        encoder::encode_into(&message, bytes).expect("a vector takes every byte");
    });
}

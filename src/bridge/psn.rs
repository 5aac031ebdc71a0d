//! PosiStageNet 2.03, the protocol by which lighting desks and media servers follow what moves on a stage.
//!
//! Words: a *tracker* is something followed, here a bench; a *packet* is a datagram; a *frame* is the packets of
//! all trackers at once, under one number and each with their count. DATA packets say where trackers are, INFO packets what
//! they are called. A packet is a tree of *chunks*.
//!
//! *Axes.* Its x is right, its y up, its z depth, away from the audience: our (x, y, z) is its (x, z, y). Two axes are exchanged,
//! so what is right-handed here is left-handed there, and a turn changes its sign. An orientation is the rotation that takes a
//! board which points along +x to where it points: a vector along the axis of rotation, as long as the angle in radians. So a
//! heading h is (0, −h, 0).
//!
//! An example: a bench at (3, 4, 0) that points and walks in +y at 1 m/s has heading π/2. As a tracker it is at (3, 0, 4),
//! its speed is (0, 0, 1), and its orientation (0, −π/2, 0) turns (1, 0, 0) into (0, 0, 1).
//!
//! Source: PosiStageNet protocol, version 2.03 of 2019-09-09 (VYV Corporation, MA Lighting), posistage.net.

use std::fmt;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::str::FromStr;

use super::latest_frame::LatestFrame;
use super::outlet::{MAX_PACKET_LEN, Packets};

/// Where PosiStageNet is sent where nothing else was agreed on.
pub const DEFAULT_TARGET: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(236, 10, 10, 10), 56_565);

const VERSION: [u8; 2] = [2, 3];

const DATA_PACKET: u16 = 0x6755;
const INFO_PACKET: u16 = 0x6756;
/// Of both kinds of packet.
const PACKET_HEADER: u16 = 0;
const DATA_TRACKER_LIST: u16 = 1;
const INFO_SYSTEM_NAME: u16 = 1;
const INFO_TRACKER_LIST: u16 = 2;
const TRACKER_NAME: u16 = 0;
const TRACKER_POSITION: u16 = 0;
const TRACKER_SPEED: u16 = 1;
const TRACKER_ORIENTATION: u16 = 2;
const TRACKER_STATUS: u16 = 3;
const TRACKER_TIMESTAMP: u16 = 6;

const VECTOR_LEN: usize = HEADER_LEN + 12;
const STATUS_LEN: usize = HEADER_LEN + 4;
const TIMESTAMP_LEN: usize = HEADER_LEN + 8;
const TRACKER_LEN: usize = HEADER_LEN + 3 * VECTOR_LEN + STATUS_LEN + TIMESTAMP_LEN;
const PACKET_HEADER_LEN: usize = HEADER_LEN + 12;
const DATA_FRAME_LEN: usize = HEADER_LEN + PACKET_HEADER_LEN + HEADER_LEN;
const INFO_FRAME_LEN: usize = DATA_FRAME_LEN + HEADER_LEN + SystemName::MAX_LEN;
/// The longest of "Bench 0", "Bench 1" and so on.
const NAME_LEN: usize = "Bench 65535".len();

const TRACKERS_IN_A_PACKET: usize = (MAX_PACKET_LEN - DATA_FRAME_LEN) / TRACKER_LEN;
const NAMES_IN_A_PACKET: usize = (MAX_PACKET_LEN - INFO_FRAME_LEN) / (2 * HEADER_LEN + NAME_LEN);

/// Most benches of a dragon whose frames can be sent: the count of a frame's packets is a byte.
pub const MAX_BENCHES: usize = u8::MAX as usize * TRACKERS_IN_A_PACKET;

const _: () = assert!(NAMES_IN_A_PACKET >= TRACKERS_IN_A_PACKET && MAX_BENCHES <= u16::MAX as usize);

/// There are more benches than packets can be counted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the dragon has {benches} benches: PosiStageNet has room for at most {MAX_BENCHES}")]
pub struct TooManyBenches {
    /// The dragon's benches.
    pub benches: usize,
}

/// Turns frames into packets of at most [`MAX_PACKET_LEN`] bytes, none of which splits a tracker.
#[derive(Debug)]
pub struct PsnEncoder {
    system_name: SystemName,
    epoch_ns: u64,
    data_frame_id: u8,
    info_frame_id: u8,
}

/// What every packet of a frame says first.
#[derive(Clone, Copy, Debug)]
struct PacketHeader {
    timestamp_us: u64,
    frame_id: u8,
    packet_count: u8,
}

impl PsnEncoder {
    /// An encoder whose timestamps count from `epoch_ns` of `CLOCK_MONOTONIC`, and whose frames count from 0.
    pub fn new(system_name: SystemName, epoch_ns: u64) -> Self {
        Self { system_name, epoch_ns, data_frame_id: 0, info_frame_id: 0 }
    }

    /// Replaces `packets` by the next frame of DATA packets: where the benches are.
    ///
    /// # Errors
    /// [`TooManyBenches`].
    pub fn data(&mut self, latest: &LatestFrame, now_ns: u64, packets: &mut Packets) -> Result<(), TooManyBenches> {
        let benches = &latest.benches;
        let header = PacketHeader {
            timestamp_us: self.since_epoch_us(now_ns),
            frame_id: self.data_frame_id,
            packet_count: packet_count(benches.len(), TRACKERS_IN_A_PACKET)?,
        };
        self.data_frame_id = self.data_frame_id.wrapping_add(1);
        let (speed_factor, validity) = (latest.speed_factor(), f32::from(u8::from(latest.freshness.is_fresh())));
        let timestamp_us = self.since_epoch_us(latest.header.published_ns);
        let mut trackers = (0..).zip(benches);
        write_packets(DATA_PACKET, header, packets, |packet| {
            packet.branch(DATA_TRACKER_LIST, |list| {
                for (id, bench) in trackers.by_ref().take(TRACKERS_IN_A_PACKET) {
                    list.branch(id, |chunks| {
                        chunks.vector(TRACKER_POSITION, to_psn(bench.centre_m));
                        chunks.vector(TRACKER_SPEED, to_psn(bench.velocity_mps.map(|value| value * speed_factor)));
                        chunks.vector(TRACKER_ORIENTATION, [0.0, -bench.heading_rad as f32, 0.0]);
                        chunks.leaf(TRACKER_STATUS, &validity.to_le_bytes());
                        chunks.leaf(TRACKER_TIMESTAMP, &timestamp_us.to_le_bytes());
                    });
                }
            });
        });
        Ok(())
    }

    /// Replaces `packets` by the next frame of INFO packets: what this sender and the benches are called.
    ///
    /// # Errors
    /// [`TooManyBenches`].
    pub fn info(&mut self, benches: usize, now_ns: u64, packets: &mut Packets) -> Result<(), TooManyBenches> {
        let header = PacketHeader {
            timestamp_us: self.since_epoch_us(now_ns),
            frame_id: self.info_frame_id,
            packet_count: packet_count(benches, NAMES_IN_A_PACKET)?,
        };
        self.info_frame_id = self.info_frame_id.wrapping_add(1);
        let mut ids = 0..benches as u16;
        write_packets(INFO_PACKET, header, packets, |packet| {
            packet.leaf(INFO_SYSTEM_NAME, self.system_name.0.as_bytes());
            packet.branch(INFO_TRACKER_LIST, |list| {
                for id in ids.by_ref().take(NAMES_IN_A_PACKET) {
                    list.branch(id, |chunks| chunks.leaf(TRACKER_NAME, format!("Bench {id}").as_bytes()));
                }
            });
        });
        Ok(())
    }

    fn since_epoch_us(&self, instant_ns: u64) -> u64 {
        instant_ns.saturating_sub(self.epoch_ns) / 1_000
    }
}

fn to_psn([x, y, z]: [f64; 3]) -> [f32; 3] {
    [x as f32, z as f32, y as f32]
}

fn packet_count(benches: usize, in_a_packet: usize) -> Result<u8, TooManyBenches> {
    if benches > MAX_BENCHES {
        return Err(TooManyBenches { benches });
    }
    Ok(u8::try_from(benches.div_ceil(in_a_packet)).expect("as many packets as a byte counts hold the most benches"))
}

/// Replaces `packets` by those of one frame: in each its header, and what `write` appends.
fn write_packets(kind: u16, header: PacketHeader, packets: &mut Packets, mut write: impl FnMut(&mut ChunkWriter<'_>)) {
    let mut data = [0; PACKET_HEADER_LEN - HEADER_LEN];
    data[..8].copy_from_slice(&header.timestamp_us.to_le_bytes());
    data[8..10].copy_from_slice(&VERSION);
    data[10..].copy_from_slice(&[header.frame_id, header.packet_count]);
    packets.clear();
    for _ in 0..header.packet_count {
        packets.push(|bytes| {
            ChunkWriter(bytes).branch(kind, |packet| {
                packet.leaf(PACKET_HEADER, &data);
                write(packet);
            });
        });
    }
}

/// 1 to 64 printable ASCII characters, blanks among them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SystemName(String);

/// Why a text is no system name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be 1 to {} printable ASCII characters", SystemName::MAX_LEN)]
pub struct SystemNameError;

impl SystemName {
    /// Most bytes of a name.
    pub const MAX_LEN: usize = 64;
}

impl FromStr for SystemName {
    type Err = SystemNameError;

    fn from_str(name: &str) -> Result<Self, SystemNameError> {
        let is_allowed =
            (1..=Self::MAX_LEN).contains(&name.len()) && name.bytes().all(|byte| (b' '..=b'~').contains(&byte));
        if is_allowed { Ok(Self(name.to_owned())) } else { Err(SystemNameError) }
    }
}

impl fmt::Display for SystemName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.pad(&self.0)
    }
}

const HEADER_LEN: usize = 4;

const MAX_CHUNK_LEN: usize = (1 << 15) - 1;
const HAS_CHUNKS: u32 = 1 << 31;

/// Appends chunks to a packet.
#[derive(Debug)]
struct ChunkWriter<'a>(&'a mut Vec<u8>);

impl ChunkWriter<'_> {
    fn leaf(&mut self, id: u16, data: &[u8]) {
        self.0.extend_from_slice(&header(id, data.len(), 0));
        self.0.extend_from_slice(data);
    }

    /// A chunk of three numbers.
    fn vector(&mut self, id: u16, values: [f32; 3]) {
        self.leaf(id, values.map(f32::to_le_bytes).as_flattened());
    }

    /// A chunk of the chunks that `write` appends.
    fn branch(&mut self, id: u16, write: impl FnOnce(&mut ChunkWriter<'_>)) {
        let start = self.0.len();
        self.0.extend_from_slice(&[0; HEADER_LEN]);
        write(&mut ChunkWriter(self.0));
        let data_len = self.0.len() - start - HEADER_LEN;
        self.0[start..start + HEADER_LEN].copy_from_slice(&header(id, data_len, HAS_CHUNKS));
    }
}

fn header(id: u16, len: usize, has_chunks: u32) -> [u8; HEADER_LEN] {
    assert!(len <= MAX_CHUNK_LEN, "a packet is shorter than a chunk may be");
    (u32::from(id) | (len as u32) << 16 | has_chunks).to_le_bytes()
}

//! PosiStageNet 2.03: the protocol by which lighting desks and media servers follow moving objects on a stage.
//!
//! Words: a *tracker* is a tracked object, here a bench. A *packet* is a datagram. A *frame* is the set of packets that covers
//! all trackers once; each of its packets has the frame's number and the number of packets. DATA packets contain the poses
//! of trackers, INFO packets their names. A packet is a tree of *chunks*.
//!
//! *Axes.* PosiStageNet's x points right, y up, and z (depth) away from the audience: our (x, y, z) is its (x, z, y). The
//! exchange of two axes turns our right-handed axes into left-handed ones, so rotations change sign. An orientation is the
//! rotation from +x to the direction of the board. It is a vector along the axis of rotation; its length is the angle in
//! radians. So a heading h is (0, −h, 0).
//!
//! Example: a bench at (3, 4, 0) that points and moves in +y at 1 m/s has heading π/2. As a tracker it has position (3, 0, 4)
//! and speed (0, 0, 1). Its orientation (0, −π/2, 0) turns (1, 0, 0) into (0, 0, 1).
//!
//! Source: PosiStageNet protocol, version 2.03 of 2019-09-09 (VYV Corporation, MA Lighting), posistage.net.

use std::fmt;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::str::FromStr;

use super::latest_frame::LatestFrame;
use super::outlet::{MAX_PACKET_LEN, Packets};

/// The protocol's default multicast group and port.
pub const DEFAULT_TARGET: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(236, 10, 10, 10), 56_565);

const VERSION: [u8; 2] = [2, 3];

const DATA_PACKET: u16 = 0x6755;
const INFO_PACKET: u16 = 0x6756;
/// Chunk in DATA and INFO packets.
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

/// Most benches that fit into one frame: the number of packets in a frame is one byte.
pub const MAX_BENCHES: usize = u8::MAX as usize * TRACKERS_IN_A_PACKET;

const _: () = assert!(NAMES_IN_A_PACKET >= TRACKERS_IN_A_PACKET && MAX_BENCHES <= u16::MAX as usize);

/// The dragon has more benches than fit into one frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the dragon has {benches} benches, must be at most {MAX_BENCHES} for PosiStageNet")]
pub struct TooManyBenches {
    /// The dragon's benches.
    pub benches: usize,
}

/// Encodes frames as packets of at most [`MAX_PACKET_LEN`] bytes. A tracker is never split between packets.
#[derive(Debug)]
pub struct PsnEncoder {
    system_name: SystemName,
    epoch_ns: u64,
    data_frame_id: u8,
    info_frame_id: u8,
}

/// Contents of the header chunk of every packet.
#[derive(Clone, Copy, Debug)]
struct PacketHeader {
    timestamp_us: u64,
    frame_id: u8,
    packet_count: u8,
}

impl PsnEncoder {
    /// Returns an encoder. Its timestamps count from `epoch_ns` of `CLOCK_MONOTONIC`, its frames from 0.
    pub fn new(system_name: SystemName, epoch_ns: u64) -> Self {
        Self { system_name, epoch_ns, data_frame_id: 0, info_frame_id: 0 }
    }

    /// Replaces the contents of `packets` with the next frame of DATA packets: the poses of the benches.
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

    /// Replaces the contents of `packets` with the next frame of INFO packets: the names of this sender and of the benches.
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
    Ok(u8::try_from(benches.div_ceil(in_a_packet)).expect("MAX_BENCHES fit into 255 packets"))
}

/// Replaces the contents of `packets` with the packets of one frame. Each packet contains the header and the
/// chunks that `write` appends.
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

/// The name of a sender: 1 to 64 printable ASCII characters, including spaces.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SystemName(String);

/// Error for a text that is not a system name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("must be 1 to {} printable ASCII characters", SystemName::MAX_LEN)]
pub struct SystemNameError;

impl SystemName {
    /// Longest name in bytes.
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

    /// Appends a chunk that contains three numbers.
    fn vector(&mut self, id: u16, values: [f32; 3]) {
        self.leaf(id, values.map(f32::to_le_bytes).as_flattened());
    }

    /// Appends a chunk that contains the chunks that `write` appends.
    fn branch(&mut self, id: u16, write: impl FnOnce(&mut ChunkWriter<'_>)) {
        let start = self.0.len();
        self.0.extend_from_slice(&[0; HEADER_LEN]);
        write(&mut ChunkWriter(self.0));
        let data_len = self.0.len() - start - HEADER_LEN;
        self.0[start..start + HEADER_LEN].copy_from_slice(&header(id, data_len, HAS_CHUNKS));
    }
}

fn header(id: u16, len: usize, has_chunks: u32) -> [u8; HEADER_LEN] {
    assert!(len <= MAX_CHUNK_LEN, "a packet is shorter than the longest chunk");
    (u32::from(id) | (len as u32) << 16 | has_chunks).to_le_bytes()
}

//! PosiStageNet 2.03: the protocol by which lighting desks and media servers follow moving objects on a stage.
//!
//! Words: a *tracker* is a tracked object, here a bench. A *packet* is a datagram. A *frame* is the set of packets that covers
//! all trackers once; each of its packets has the frame's number and the number of packets. DATA packets contain the poses
//! of trackers, INFO packets their names. A packet is a tree of *chunks*.
//!
//! *Position.* A tracker is at the centre of the board, so tracker 0 is at the centre of the head's board.
//!
//! *Axes.* PosiStageNet's x points right, y up, and z (depth) away from the audience: our (x, y, z) is its (x, z, y). The
//! exchange of two axes turns our right-handed axes into left-handed ones, so rotations change sign. An orientation is the
//! rotation from +x to the direction of the board. It is a vector along the axis of rotation; its length is the angle in
//! radians. So a heading h is (0, −h, 0). A [`StageTransform`] with other axes, a rotation or an offset suits other desks.
//!
//! Example: a board with its centre at (3, 4, 0) that points and moves in +y at 1 m/s has heading π/2. As a tracker it has
//! position (3, 0, 4) and speed (0, 0, 1). Its orientation (0, −π/2, 0) turns (1, 0, 0) into (0, 0, 1).
//!
//! *Ids.* A tracker's id is the id of the head plus the bench's number. The choice of benches does not change it. The benches of
//! several dragons are numbered on from dragon to dragon.
//!
//! *Times.* The time of a tracker is the instant for which its pose holds. It is the same in each repetition of the pose. The time
//! of a packet is that of sending, as the protocol specifies.
//!
//! Source: PosiStageNet protocol, version 2.03 of 2019-09-09 (VYV Corporation, MA Lighting), posistage.net.

use std::net::{Ipv4Addr, SocketAddrV4};

use bench_dragon_ipc::BenchState;

use super::bench_selection::BenchSelection;
use super::latest_frame::LatestFrame;
use super::outlet::{MAX_PACKET_LEN, Packets};
use super::stage_transform::StageTransform;
use crate::config::NamedLayout;

pub use super::psn_names::{SystemName, SystemNameError, TrackerName, TrackerNameError};

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

const TRACKERS_IN_A_PACKET: usize = (MAX_PACKET_LEN - DATA_FRAME_LEN) / TRACKER_LEN;

/// Most benches that fit into one frame: the number of packets in a frame is one byte.
pub const MAX_BENCHES: usize = u8::MAX as usize * TRACKERS_IN_A_PACKET;

// A frame of the longest names has no more packets than a frame of poses.
const _: () = assert!(names_in_a_packet(TrackerName::MAX_LEN) >= TRACKERS_IN_A_PACKET);

/// Names that fit into one packet, if none of them is longer than `longest_len`.
const fn names_in_a_packet(longest_len: usize) -> usize {
    (MAX_PACKET_LEN - INFO_FRAME_LEN) / (2 * HEADER_LEN + longest_len)
}

/// The chosen benches of a dragon cannot be trackers.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TrackersError {
    /// More benches are chosen than fit into one frame.
    #[error(
        "{benches} benches are chosen, must be at most {MAX_BENCHES} for PosiStageNet: choose fewer with --benches"
    )]
    TooMany {
        /// The chosen benches.
        benches: usize,
    },
    /// The last tracker's id does not fit into a packet.
    #[error(
        "bench {index} would be tracker {id}, must be at most {}: choose a lower --first-id or other --benches",
        u16::MAX
    )]
    IdTooHigh {
        /// The bench's number.
        index: usize,
        /// The id that its tracker would have.
        id: usize,
    },
}

/// Settings of an encoder.
#[derive(Clone, Debug, PartialEq)]
pub struct PsnSettings {
    /// The name of this sender.
    pub system_name: SystemName,
    /// The chosen benches.
    pub benches: BenchSelection,
    /// The id of the head's tracker. The tracker of bench i has this id plus i.
    pub first_id: u16,
    /// The names of the trackers.
    pub tracker_name: TrackerName,
    /// The transform to the coordinate system of the receivers.
    pub transform: StageTransform,
}

impl PsnSettings {
    /// The same settings for these dragons.
    #[must_use]
    pub fn of(&self, dragons: &NamedLayout) -> Self {
        Self { tracker_name: self.tracker_name.of(dragons), benches: self.benches.of(dragons), ..self.clone() }
    }

    /// Returns the number of trackers of a dragon with `benches` benches.
    ///
    /// # Errors
    /// The chosen benches do not fit into one frame, or an id is too high.
    pub fn tracker_count(&self, benches: usize) -> Result<usize, TrackersError> {
        let count = self.benches.count(benches);
        if count > MAX_BENCHES {
            return Err(TrackersError::TooMany { benches: count });
        }
        let last = self.benches.indices(benches).next_back().map(|index| (index, usize::from(self.first_id) + index));
        match last {
            Some((index, id)) if id > u16::MAX.into() => Err(TrackersError::IdTooHigh { index, id }),
            _ => Ok(count),
        }
    }

    /// The id of a bench's tracker. `tracker_count` has found that the ids of all chosen benches fit.
    pub(super) fn id_of_bench(&self, index: usize) -> u16 {
        u16::try_from(usize::from(self.first_id) + index).expect("the ids of chosen benches were checked")
    }

    /// The chosen benches of a dragon with `benches` benches, each with its tracker's id, ascending.
    fn trackers(&self, benches: usize) -> impl Iterator<Item = (usize, u16)> + '_ {
        self.benches.indices(benches).map(|index| (index, self.id_of_bench(index)))
    }
}

/// Encodes frames as packets of at most [`MAX_PACKET_LEN`] bytes. A tracker is never split between packets.
#[derive(Debug)]
pub struct PsnEncoder {
    settings: PsnSettings,
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
    /// Returns an encoder with these settings. Its timestamps count from `epoch_ns` of `CLOCK_MONOTONIC`, its frames from 0.
    pub fn new(settings: PsnSettings, epoch_ns: u64) -> Self {
        Self { settings, epoch_ns, data_frame_id: 0, info_frame_id: 0 }
    }

    /// Goes on with other settings.
    pub fn set(&mut self, settings: PsnSettings) {
        self.settings = settings;
    }

    /// Replaces the contents of `packets` with the next frame of DATA packets: the poses of the chosen benches. Without a chosen
    /// bench there is no packet.
    ///
    /// # Errors
    /// The chosen benches do not fit into one frame, or an id is too high.
    pub fn data(&mut self, latest: &LatestFrame, now_ns: u64, packets: &mut Packets) -> Result<(), TrackersError> {
        let settings = &self.settings;
        let trackers = settings.tracker_count(latest.benches.len())?;
        let header = PacketHeader {
            timestamp_us: self.since_epoch_us(now_ns),
            frame_id: self.data_frame_id,
            packet_count: packet_count(trackers, TRACKERS_IN_A_PACKET),
        };
        self.data_frame_id = self.data_frame_id.wrapping_add(1);
        let due_us = self.since_epoch_us(latest.header.scheduled_ns);
        let mut trackers = settings.trackers(latest.benches.len());
        write_packets(DATA_PACKET, header, packets, |packet| {
            packet.branch(DATA_TRACKER_LIST, |list| {
                for (index, id) in trackers.by_ref().take(TRACKERS_IN_A_PACKET) {
                    let tracker = Tracker::of(&latest.benches[index], latest, &settings.transform);
                    list.branch(id, |chunks| tracker.write(due_us, chunks));
                }
            });
        });
        Ok(())
    }

    /// Replaces the contents of `packets` with the next frame of INFO packets: the names of this sender and of the chosen benches
    /// of a dragon with `benches` benches. Without a chosen bench there is no packet.
    ///
    /// # Errors
    /// The chosen benches do not fit into one frame, or an id is too high.
    pub fn info(&mut self, benches: usize, now_ns: u64, packets: &mut Packets) -> Result<(), TrackersError> {
        let settings = &self.settings;
        let in_a_packet = names_in_a_packet(settings.tracker_name.longest_len());
        let header = PacketHeader {
            timestamp_us: self.since_epoch_us(now_ns),
            frame_id: self.info_frame_id,
            packet_count: packet_count(settings.tracker_count(benches)?, in_a_packet),
        };
        self.info_frame_id = self.info_frame_id.wrapping_add(1);
        let mut trackers = settings.trackers(benches);
        write_packets(INFO_PACKET, header, packets, |packet| {
            packet.leaf(INFO_SYSTEM_NAME, settings.system_name.as_bytes());
            packet.branch(INFO_TRACKER_LIST, |list| {
                for (index, id) in trackers.by_ref().take(in_a_packet) {
                    let name = settings.tracker_name.of_tracker(index, id);
                    list.branch(id, |chunks| chunks.leaf(TRACKER_NAME, name.as_bytes()));
                }
            });
        });
        Ok(())
    }

    fn since_epoch_us(&self, instant_ns: u64) -> u64 {
        instant_ns.saturating_sub(self.epoch_ns) / 1_000
    }
}

/// The pose of a tracker, in the coordinate system of the receivers.
#[derive(Clone, Copy, Debug)]
struct Tracker {
    position_m: [f32; 3],
    speed_mps: [f32; 3],
    orientation_rad: [f32; 3],
    /// 1 if the frame is fresh, else 0.
    validity: f32,
}

impl Tracker {
    fn of(bench: &BenchState, latest: &LatestFrame, transform: &StageTransform) -> Self {
        let single = |vector: [f64; 3]| vector.map(|value| value as f32);
        let velocity_mps = bench.velocity_mps.map(|value| value * latest.speed_factor());
        Self {
            position_m: single(transform.position_m(bench.centre_m)),
            speed_mps: single(transform.velocity_mps(velocity_mps)),
            orientation_rad: single(transform.orientation_rad(bench.heading_rad, bench.pitch_rad)),
            validity: f32::from(u8::from(latest.freshness.is_fresh())),
        }
    }

    fn write(&self, timestamp_us: u64, chunks: &mut ChunkWriter<'_>) {
        chunks.vector(TRACKER_POSITION, self.position_m);
        chunks.vector(TRACKER_SPEED, self.speed_mps);
        chunks.vector(TRACKER_ORIENTATION, self.orientation_rad);
        chunks.leaf(TRACKER_STATUS, &self.validity.to_le_bytes());
        chunks.leaf(TRACKER_TIMESTAMP, &timestamp_us.to_le_bytes());
    }
}

fn packet_count(trackers: usize, in_a_packet: usize) -> u8 {
    u8::try_from(trackers.div_ceil(in_a_packet)).expect("MAX_BENCHES fit into 255 packets")
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

//! Frames of DATA and INFO packets.

use super::chunk::{ChunkWriter, HEADER_LEN};
use super::system_name::SystemName;
use super::tracker::Tracker;
use crate::bridge::packets::{MAX_PACKET_LEN, Packets};
use crate::bridge::snapshot::Snapshot;

/// Version 2.03.
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

/// Most benches of a dragon whose frames can be told: the count of a frame's packets is a byte.
pub const MAX_BENCHES: usize = u8::MAX as usize * TRACKERS_IN_A_PACKET;

const _: () = assert!(NAMES_IN_A_PACKET >= TRACKERS_IN_A_PACKET && MAX_BENCHES <= u16::MAX as usize);

/// There are more benches than packets can be counted for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the dragon has {benches} benches: PosiStageNet has room for at most {MAX_BENCHES}")]
pub struct TooManyBenches {
    /// The dragon's benches.
    pub benches: usize,
}

/// Turns snapshots into packets of at most [`MAX_PACKET_LEN`] bytes, none of which splits a tracker.
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
    pub fn data(&mut self, snapshot: &Snapshot, now_ns: u64, packets: &mut Packets) -> Result<(), TooManyBenches> {
        let benches = &snapshot.benches;
        let header = PacketHeader {
            timestamp_us: self.since_epoch_us(now_ns),
            frame_id: self.data_frame_id,
            packet_count: packet_count(benches.len(), TRACKERS_IN_A_PACKET)?,
        };
        self.data_frame_id = self.data_frame_id.wrapping_add(1);
        let (speed_factor, validity) = (snapshot.speed_factor(), f32::from(u8::from(snapshot.freshness.is_fresh())));
        let timestamp_us = self.since_epoch_us(snapshot.header.published_ns);
        let mut trackers =
            (0..).zip(benches).map(|(id, bench)| Tracker::of_bench(id, bench, speed_factor, validity, timestamp_us));
        packets.clear();
        for _ in 0..header.packet_count {
            packets.push(|bytes| {
                ChunkWriter::new(bytes).branch(DATA_PACKET, |packet| {
                    write_header(packet, header);
                    packet.branch(DATA_TRACKER_LIST, |list| {
                        trackers.by_ref().take(TRACKERS_IN_A_PACKET).for_each(|tracker| write_tracker(list, &tracker));
                    });
                });
            });
        }
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
        packets.clear();
        for _ in 0..header.packet_count {
            packets.push(|bytes| {
                ChunkWriter::new(bytes).branch(INFO_PACKET, |packet| {
                    write_header(packet, header);
                    packet.leaf(INFO_SYSTEM_NAME, self.system_name.as_str().as_bytes());
                    packet.branch(INFO_TRACKER_LIST, |list| {
                        ids.by_ref().take(NAMES_IN_A_PACKET).for_each(|id| write_name(list, id));
                    });
                });
            });
        }
        Ok(())
    }

    fn since_epoch_us(&self, instant_ns: u64) -> u64 {
        instant_ns.saturating_sub(self.epoch_ns) / 1_000
    }
}

fn packet_count(benches: usize, in_a_packet: usize) -> Result<u8, TooManyBenches> {
    if benches > MAX_BENCHES {
        return Err(TooManyBenches { benches });
    }
    Ok(u8::try_from(benches.div_ceil(in_a_packet)).expect("as many packets as a byte counts hold the most benches"))
}

fn write_header(packet: &mut ChunkWriter<'_>, header: PacketHeader) {
    let mut data = [0; PACKET_HEADER_LEN - HEADER_LEN];
    data[..8].copy_from_slice(&header.timestamp_us.to_le_bytes());
    data[8..10].copy_from_slice(&VERSION);
    data[10..].copy_from_slice(&[header.frame_id, header.packet_count]);
    packet.leaf(PACKET_HEADER, &data);
}

fn write_tracker(list: &mut ChunkWriter<'_>, tracker: &Tracker) {
    list.branch(tracker.id, |chunks| {
        chunks.vector(TRACKER_POSITION, tracker.position_m);
        chunks.vector(TRACKER_SPEED, tracker.speed_mps);
        chunks.vector(TRACKER_ORIENTATION, tracker.orientation_rad);
        chunks.leaf(TRACKER_STATUS, &tracker.validity.to_le_bytes());
        chunks.leaf(TRACKER_TIMESTAMP, &tracker.timestamp_us.to_le_bytes());
    });
}

fn write_name(list: &mut ChunkWriter<'_>, id: u16) {
    list.branch(id, |chunks| chunks.leaf(TRACKER_NAME, format!("Bench {id}").as_bytes()));
}

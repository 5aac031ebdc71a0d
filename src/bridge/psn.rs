//! PosiStageNet 2.03, the protocol by which lighting desks and media servers follow what moves on a stage.
//!
//! Words: a *tracker* is something followed, here a bench; a *packet* is a datagram; a *frame* is the packets that tell of
//! all trackers at once, under one number and each with their count. DATA packets tell where trackers are, INFO packets what
//! they are called. A packet is a tree of *chunks*.
//!
//! Source: PosiStageNet protocol, version 2.03 of 2019-09-09 (VYV Corporation, MA Lighting), posistage.net.

use std::fmt;
use std::net::{Ipv4Addr, SocketAddrV4};
use std::str::FromStr;

use super::latest_frame::LatestFrame;
use super::outlet::{MAX_PACKET_LEN, Packets};
use super::tracker::Tracker;

/// Where PosiStageNet is sent where nothing else was agreed on.
pub const DEFAULT_TARGET: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(236, 10, 10, 10), 56_565);

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

    /// The name.
    pub fn as_str(&self) -> &str {
        &self.0
    }
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

/// Bytes of a chunk's header.
pub(super) const HEADER_LEN: usize = 4;

const MAX_CHUNK_LEN: usize = (1 << 15) - 1;
const HAS_CHUNKS: u32 = 1 << 31;

/// Appends chunks to a packet.
#[derive(Debug)]
pub(super) struct ChunkWriter<'a>(&'a mut Vec<u8>);

impl<'a> ChunkWriter<'a> {
    pub(super) fn new(packet: &'a mut Vec<u8>) -> Self {
        Self(packet)
    }

    /// A chunk of bytes.
    pub(super) fn leaf(&mut self, id: u16, data: &[u8]) {
        self.0.extend_from_slice(&header(id, data.len(), 0));
        self.0.extend_from_slice(data);
    }

    /// A chunk of three numbers.
    pub(super) fn vector(&mut self, id: u16, [x, y, z]: [f32; 3]) {
        self.0.extend_from_slice(&header(id, 12, 0));
        for value in [x, y, z] {
            self.0.extend_from_slice(&value.to_le_bytes());
        }
    }

    /// A chunk of the chunks that `write` appends.
    pub(super) fn branch(&mut self, id: u16, write: impl FnOnce(&mut ChunkWriter<'_>)) {
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

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::{BenchState, FrameHeader};
    use proptest::prelude::*;

    use super::*;
    use crate::bridge::latest_frame::Freshness;

    const EPOCH_NS: u64 = 1_000_000_000;

    fn latest(benches: usize) -> LatestFrame {
        let header = FrameHeader { published_ns: EPOCH_NS + 5_000, time_scale: 2.0, ..FrameHeader::default() };
        let bench = BenchState { centre_m: [1.0, 2.0, 0.5], velocity_mps: [0.25, 0.5, 0.0], ..BenchState::default() };
        LatestFrame { header, benches: vec![bench; benches], freshness: Freshness::Fresh }
    }

    fn encoder() -> PsnEncoder {
        PsnEncoder::new("Dragon".parse().expect("a name"), EPOCH_NS)
    }

    /// A chunk: id, whether it has chunks, and its data.
    type Chunk<'a> = (u16, bool, &'a [u8]);

    /// Chunks one behind the other.
    fn chunks(mut bytes: &[u8]) -> Vec<Chunk<'_>> {
        let mut found = Vec::new();
        while let Some((header, rest)) = bytes.split_first_chunk() {
            let header = u32::from_le_bytes(*header);
            let (data, after) = rest.split_at((header >> 16 & 0x7fff) as usize);
            found.push((header as u16, header >> 31 == 1, data));
            bytes = after;
        }
        assert!(bytes.is_empty(), "{} bytes behind the last chunk", bytes.len());
        found
    }

    /// The chunks of the trackers of a packet, and the packet's count of packets and frame id.
    fn trackers(packet: &[u8], id: u16) -> (Vec<Chunk<'_>>, u8, u8) {
        let [(packet_id, true, content)] = chunks(packet)[..] else { panic!("a packet is one chunk") };
        assert_eq!(packet_id, id);
        let content = chunks(content);
        let (header, list) = (content[0].2, content[content.len() - 1].2);
        (chunks(list), header[11], header[10])
    }

    #[test]
    fn a_data_packet_is_what_the_protocol_says_byte_by_byte() {
        let mut packets = Packets::default();
        encoder().data(&latest(1), EPOCH_NS + 7_000, &mut packets).expect("one bench fits");
        let float = f32::to_le_bytes;
        #[rustfmt::skip]
        let expected = [
            &[0x55, 0x67, 92, 0x80][..],                            // DATA packet, 92 bytes, of chunks
            &[0, 0, 12, 0, 7, 0, 0, 0, 0, 0, 0, 0, 2, 3, 0, 1],     // header: 7 µs, version 2.03, frame 0, 1 packet
            &[1, 0, 72, 0x80],                                      // tracker list
            &[0, 0, 68, 0x80],                                      // tracker 0
            &[0, 0, 12, 0], &float(1.0), &float(0.5), &float(2.0),  // position: x, z, y
            &[1, 0, 12, 0], &float(0.5), &float(0.0), &float(1.0),  // speed, at twice the pace
            &[2, 0, 12, 0], &float(0.0), &float(-0.0), &float(0.0), // orientation: heading 0
            &[3, 0, 4, 0], &float(1.0),                             // status
            &[6, 0, 8, 0, 5, 0, 0, 0, 0, 0, 0, 0],                  // timestamp: 5 µs
        ];
        assert_eq!(packets.iter().collect::<Vec<_>>(), [expected.concat()]);
    }

    #[test]
    fn an_info_packet_is_what_the_protocol_says_byte_by_byte() {
        let mut packets = Packets::default();
        encoder().info(1, EPOCH_NS, &mut packets).expect("one bench fits");
        #[rustfmt::skip]
        let expected = [
            &[0x56, 0x67, 45, 0x80][..],                        // INFO packet, 45 bytes, of chunks
            &[0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 3, 0, 1], // header: 0 µs, version 2.03, frame 0, 1 packet
            &[1, 0, 6, 0], b"Dragon",                           // system name
            &[2, 0, 15, 0x80],                                  // tracker list
            &[0, 0, 11, 0x80],                                  // tracker 0
            &[0, 0, 7, 0], b"Bench 0",                          // its name
        ];
        assert_eq!(packets.iter().collect::<Vec<_>>(), [expected.concat()]);
    }

    #[test]
    fn a_stale_frame_is_invalid_and_stands() {
        let stale = LatestFrame { freshness: Freshness::Stale { age_ns: 1 }, ..latest(1) };
        let mut packets = Packets::default();
        encoder().data(&stale, EPOCH_NS, &mut packets).expect("one bench fits");
        let packet = packets.iter().next().expect("a packet");
        let (trackers, ..) = trackers(packet, DATA_PACKET);
        let fields = chunks(trackers[0].2);
        assert_eq!((fields[1].2, fields[3].2), (&[0; 12][..], &[0; 4][..]));
    }

    #[test]
    fn frame_ids_wrap_round() {
        let (mut encoder, mut packets) = (encoder(), Packets::default());
        for frame in 0..600 {
            encoder.data(&latest(1), EPOCH_NS, &mut packets).expect("one bench fits");
            let (_, _, frame_id) = trackers(packets.iter().next().expect("a packet"), DATA_PACKET);
            assert_eq!(u32::from(frame_id), frame % 256);
        }
    }

    #[test]
    fn one_bench_too_many_is_refused() {
        let (mut encoder, mut packets) = (encoder(), Packets::default());
        assert_eq!(MAX_BENCHES, 5_100);
        assert_eq!(encoder.data(&latest(5_100), EPOCH_NS, &mut packets), Ok(()));
        assert_eq!(packets.len(), 255);
        let refused = Err(TooManyBenches { benches: 5_101 });
        assert_eq!(encoder.data(&latest(5_101), EPOCH_NS, &mut packets), refused);
        assert_eq!(encoder.info(5_101, EPOCH_NS, &mut packets), refused);
    }

    proptest! {
        #[test]
        fn no_packet_is_too_long_and_no_tracker_is_split(benches in 1..=MAX_BENCHES, name in "[ -~]{1,64}") {
            let (mut encoder, mut packets) = (PsnEncoder::new(name.parse().expect("a name"), EPOCH_NS), Packets::default());
            for id in [DATA_PACKET, INFO_PACKET] {
                if id == DATA_PACKET {
                    encoder.data(&latest(benches), EPOCH_NS, &mut packets).expect("they fit");
                } else {
                    encoder.info(benches, EPOCH_NS, &mut packets).expect("they fit");
                }
                let mut ids = Vec::new();
                for packet in packets.iter() {
                    prop_assert!(packet.len() <= MAX_PACKET_LEN);
                    let (trackers, packet_count, frame_id) = trackers(packet, id);
                    prop_assert_eq!((usize::from(packet_count), frame_id), (packets.len(), 0));
                    ids.extend(trackers.iter().map(|(id, has_chunks, _)| (usize::from(*id), *has_chunks)));
                }
                prop_assert!(ids.into_iter().eq((0..benches).map(|id| (id, true))));
            }
        }
    }
}

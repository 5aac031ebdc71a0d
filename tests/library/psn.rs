//! PosiStageNet packets, byte by byte.

use std::f64::consts::{FRAC_PI_2, PI};

use bench_dragon::bridge::psn::{MAX_BENCHES, PsnEncoder, TooManyBenches};
use bench_dragon::bridge::{Freshness, LatestFrame, MAX_PACKET_LEN, Packets};
use bench_dragon_ipc::{BenchState, FrameHeader, HandleState};
use glam::{Quat, Vec3};
use proptest::prelude::*;

/// The protocol's ids of the two kinds of packets.
const DATA_PACKET: u16 = 0x6755;
const INFO_PACKET: u16 = 0x6756;

const EPOCH_NS: u64 = 1_000_000_000;

fn latest(benches: usize) -> LatestFrame {
    let header = FrameHeader { published_ns: EPOCH_NS + 5_000, time_scale: 2.0, ..FrameHeader::default() };
    let bench = BenchState { centre_m: [1.0, 2.0, 0.5], velocity_mps: [0.25, 0.5, 0.0], ..BenchState::default() };
    LatestFrame { header, benches: vec![bench; benches], freshness: Freshness::Fresh }
}

fn encoder() -> PsnEncoder {
    PsnEncoder::new("Dragon".parse().expect("a name"), EPOCH_NS)
}

/// Returns a chunk: its id, whether it has chunks, and its data.
type Chunk<'a> = (u16, bool, &'a [u8]);

/// Returns successive chunks as bytes.
fn chunks(mut bytes: &[u8]) -> Vec<Chunk<'_>> {
    let mut found = Vec::new();
    while let Some((header, rest)) = bytes.split_first_chunk() {
        let header = u32::from_le_bytes(*header);
        let (data, after) = rest.split_at((header >> 16 & 0x7fff) as usize);
        found.push((header as u16, header >> 31 == 1, data));
        bytes = after;
    }
    assert!(bytes.is_empty(), "{} bytes follow the last chunk", bytes.len());
    found
}

/// Returns the chunks of a packet's trackers, with the packet's number of packets and frame id.
fn trackers(packet: &[u8], id: u16) -> (Vec<Chunk<'_>>, u8, u8) {
    let [(packet_id, true, content)] = chunks(packet)[..] else { panic!("a packet is one chunk") };
    assert_eq!(packet_id, id);
    let content = chunks(content);
    let (header, list) = (content[0].2, content[content.len() - 1].2);
    (chunks(list), header[11], header[10])
}

#[test]
fn a_data_packet_has_the_bytes_of_the_protocol() {
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
        &[1, 0, 12, 0], &float(0.5), &float(0.0), &float(1.0),  // speed, at twice the speed
        &[2, 0, 12, 0], &float(0.0), &float(-0.0), &float(0.0), // orientation: heading 0
        &[3, 0, 4, 0], &float(1.0),                             // status
        &[6, 0, 8, 0, 5, 0, 0, 0, 0, 0, 0, 0],                  // timestamp: 5 µs
    ];
    assert_eq!(packets.iter().collect::<Vec<_>>(), [expected.concat()]);
}

#[test]
fn an_info_packet_has_the_bytes_of_the_protocol() {
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
fn a_stale_frame_is_invalid_and_has_no_speed() {
    let stale = LatestFrame { freshness: Freshness::Stale { age_ns: 1 }, ..latest(1) };
    let mut packets = Packets::default();
    encoder().data(&stale, EPOCH_NS, &mut packets).expect("one bench fits");
    let packet = packets.iter().next().expect("a packet");
    let (trackers, ..) = trackers(packet, DATA_PACKET);
    let fields = chunks(trackers[0].2);
    assert_eq!((fields[1].2, fields[3].2), (&[0; 12][..], &[0; 4][..]));
}

#[test]
fn frame_ids_wrap_around() {
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

fn bench(front: [f64; 3], rear: [f64; 3], velocity_mps: [f64; 3]) -> BenchState {
    let handle = |position_m| HandleState { position_m, velocity_mps };
    BenchState::between(&handle(front), &handle(rear))
}

/// Returns a bench as sent: its position, its speed and its orientation.
fn tracker(bench: &BenchState, time_scale: f64) -> [[f32; 3]; 3] {
    let header = FrameHeader { time_scale, ..FrameHeader::default() };
    let latest = LatestFrame { header, benches: vec![*bench], freshness: Freshness::Fresh };
    let mut packets = Packets::default();
    encoder().data(&latest, EPOCH_NS, &mut packets).expect("one bench fits");
    let (trackers, ..) = trackers(packets.iter().next().expect("a packet"), DATA_PACKET);
    let fields = chunks(trackers[0].2);
    [0, 1, 2].map(|field| {
        let (numbers, rest) = fields[field].2.as_chunks();
        assert!(rest.is_empty());
        [0, 1, 2].map(|axis| f32::from_le_bytes(numbers[axis]))
    })
}

#[test]
fn a_bench_that_walks_upstage_is_the_documented_tracker() {
    let walking = bench([3.0, 5.0, 0.0], [3.0, 3.0, 0.0], [0.0, 1.0, 0.0]);
    assert_eq!(walking.heading_rad, FRAC_PI_2);
    let orientation_rad = [0.0, -std::f32::consts::FRAC_PI_2, 0.0];
    assert_eq!(tracker(&walking, 1.0), [[3.0, 0.0, 4.0], [0.0, 0.0, 1.0], orientation_rad]);
}

#[test]
fn the_height_is_the_trackers_y() {
    let raised = bench([2.0, 1.0, 0.5], [0.0, 1.0, 0.5], [0.0, 0.0, 0.25]);
    assert_eq!(tracker(&raised, 1.0)[..2], [[1.0, 0.5, 1.0], [0.0, 0.25, 0.0]]);
}

#[test]
fn the_orientation_rotates_plus_x_into_the_direction_of_the_board() {
    for step in -8..=8 {
        let heading = f64::from(step) * PI / 8.0;
        let [x, y] = [heading.cos(), heading.sin()];
        let [_, _, orientation_rad] = tracker(&bench([x, y, 0.0], [0.0; 3], [0.0; 3]), 1.0);
        let turned = Quat::from_scaled_axis(Vec3::from(orientation_rad)) * Vec3::X;
        let apart = turned.distance(Vec3::new(x as f32, 0.0, y as f32));
        assert!(apart < 1e-6, "{heading}: {turned} instead of {x} right and {y} away");
    }
}

#[test]
fn speeds_are_per_second_of_wall_time() {
    let walking = bench([1.0, 0.0, 0.0], [0.0; 3], [0.5, 0.0, 0.0]);
    let speed = |time_scale| tracker(&walking, time_scale)[1];
    assert_eq!((speed(20.0), speed(0.0)), ([10.0, 0.0, 0.0], [0.0; 3]));
}

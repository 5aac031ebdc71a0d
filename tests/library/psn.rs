//! PosiStageNet packets, byte by byte.

use std::f64::consts::{FRAC_PI_2, PI};

use bench_dragon::bridge::psn::{
    DEFAULT_TARGET, MAX_BENCHES, PsnEncoder, PsnSettings, TrackerName, TrackerNameError, TrackersError,
};
use bench_dragon::bridge::stage_transform::StageTransform;
use bench_dragon::bridge::{AxisOrder, BenchSelection, Freshness, LatestFrame, MAX_PACKET_LEN, Packets, desk_settings};
use bench_dragon_ipc::{BenchState, FrameHeader, HandleState};
use glam::{Quat, Vec3};
use proptest::prelude::*;
use test_support::property::random_cases;

/// The protocol's ids of the two kinds of packets.
const DATA_PACKET: u16 = 0x6755;
const INFO_PACKET: u16 = 0x6756;

const EPOCH_NS: u64 = 1_000_000_000;

fn latest(benches: usize) -> LatestFrame {
    let header = FrameHeader { scheduled_ns: EPOCH_NS + 5_000, time_scale: 2.0, ..FrameHeader::default() };
    let bench = BenchState { centre_m: [1.0, 2.0, 0.5], velocity_mps: [0.25, 0.5, 0.0], ..BenchState::default() };
    LatestFrame { header, benches: vec![bench; benches], freshness: Freshness::Fresh }
}

fn settings() -> PsnSettings {
    PsnSettings {
        system_name: "Dragon".parse().expect("a name"),
        benches: BenchSelection::default(),
        first_id: 0,
        tracker_name: TrackerName::default(),
        transform: StageTransform::of_axes(AxisOrder::RIGHT_UP_AWAY),
    }
}

fn chosen(benches: &str) -> PsnSettings {
    PsnSettings { benches: benches.parse().expect("a choice of benches"), ..settings() }
}

fn encoder() -> PsnEncoder {
    PsnEncoder::new(settings(), EPOCH_NS)
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
    let refused = Err(TrackersError::TooMany { benches: 5_101 });
    assert_eq!(encoder.data(&latest(5_101), EPOCH_NS, &mut packets), refused);
    assert_eq!(encoder.info(5_101, EPOCH_NS, &mut packets), refused);
}

#[test]
fn only_chosen_benches_count_towards_the_limit() {
    let mut packets = Packets::default();
    let mut encoder = PsnEncoder::new(chosen("1..5100"), EPOCH_NS);
    assert_eq!(encoder.data(&latest(6_000), EPOCH_NS, &mut packets), Ok(()));
    assert_eq!(packets.len(), 255);
    assert_eq!(encoder.info(6_000, EPOCH_NS, &mut packets), Ok(()));
}

#[test]
fn an_id_above_65535_is_refused() {
    let settings = PsnSettings { first_id: 65_500, ..chosen("0,35..36") };
    assert_eq!(settings.tracker_count(36), Ok(2));
    let refused = Err(TrackersError::IdTooHigh { index: 36, id: 65_536 });
    assert_eq!(settings.tracker_count(37), refused);
    let (mut encoder, mut packets) = (PsnEncoder::new(settings, EPOCH_NS), Packets::default());
    assert_eq!(encoder.data(&latest(37), EPOCH_NS, &mut packets), refused.map(drop));
    assert_eq!(chosen("70000").tracker_count(100_000), Err(TrackersError::IdTooHigh { index: 70_000, id: 70_000 }));
}

#[test]
fn the_tracker_of_a_bench_has_the_first_id_plus_the_benchs_number_whichever_benches_are_chosen() {
    let settings = PsnSettings {
        first_id: 100,
        tracker_name: "B{index}/{id}".parse().expect("a pattern"),
        ..chosen("2,5..6,8..")
    };
    let (mut encoder, mut packets) = (PsnEncoder::new(settings, EPOCH_NS), Packets::default());
    let mut frame = latest(10);
    for (index, bench) in (0_u8..).zip(&mut frame.benches) {
        bench.centre_m[0] = index.into();
    }
    encoder.data(&frame, EPOCH_NS, &mut packets).expect("five benches fit");
    let (sent, ..) = trackers(packets.iter().next().expect("a packet"), DATA_PACKET);
    let x = |data| f32::from_le_bytes(chunks(data)[0].2[..4].try_into().expect("four bytes"));
    let placed: Vec<_> = sent.iter().map(|(id, _, data)| (*id, x(data))).collect();
    assert_eq!(placed, [(102, 2.0), (105, 5.0), (106, 6.0), (108, 8.0), (109, 9.0)]);
    encoder.info(10, EPOCH_NS, &mut packets).expect("five benches fit");
    let (sent, ..) = trackers(packets.iter().next().expect("a packet"), INFO_PACKET);
    let named: Vec<_> = sent.iter().map(|(id, _, data)| (*id, chunks(data)[0].2)).collect();
    let expected: [(u16, &[u8]); 5] =
        [(102, b"B2/102"), (105, b"B5/105"), (106, b"B6/106"), (108, b"B8/108"), (109, b"B9/109")];
    assert_eq!(named, expected);
}

#[test]
fn without_a_chosen_bench_there_is_no_packet() {
    let (mut encoder, mut packets) = (PsnEncoder::new(chosen("9"), EPOCH_NS), Packets::default());
    assert_eq!(encoder.data(&latest(9), EPOCH_NS, &mut packets), Ok(()));
    assert!(packets.is_empty());
    assert_eq!(encoder.info(9, EPOCH_NS, &mut packets), Ok(()));
    assert!(packets.is_empty());
}

#[test]
fn only_printable_names_of_at_most_sixty_characters_are_accepted() {
    for pattern in ["Head", "{index}", "a {id}-{index}", &"x".repeat(60), &("x".repeat(55) + "{id}")] {
        assert_eq!(pattern.parse::<TrackerName>().map(|name| name.to_string()), Ok(pattern.to_owned()));
    }
    for pattern in ["", "B\u{e4}nk {id}", "{", "{name}", "{{id}}", "a\n", &"x".repeat(61), &("x".repeat(56) + "{id}")] {
        assert_eq!(pattern.parse::<TrackerName>(), Err(TrackerNameError), "{pattern}");
    }
}

#[test]
fn the_line_for_a_desk_has_all_that_an_operator_enters() {
    let line = |settings: &PsnSettings, benches| desk_settings::psn(settings, DEFAULT_TARGET, benches);
    let expected = "PosiStageNet: multicast 236.10.10.10 port 56565, system \"Dragon\", trackers 0 to 222 \"Bench 0\" to \
                    \"Bench 222\", axes x right, y up, z away, metres and radians, at the centre of each board";
    assert_eq!(line(&settings(), 223).as_deref(), Ok(expected));
    let mut settings = PsnSettings { first_id: 1, ..chosen("0,10..20") };
    settings.transform = StageTransform::of_axes("-x,-y,z".parse().expect("axes"));
    let line_of = |benches| line(&settings, benches).expect("they fit");
    assert!(
        line_of(100)
            .contains("trackers 1, 11 to 21 \"Bench 0\" to \"Bench 20\", axes x left, y towards the audience, z up")
    );
    assert!(line_of(5).contains(", tracker 1 \"Bench 0\", "), "{}", line_of(5));
    assert!(line(&chosen("300.."), 223).expect("none fits").contains(", no trackers, "));
    assert_eq!(line(&chosen("0.."), 5_101), Err(TrackersError::TooMany { benches: 5_101 }));
    let unicast = desk_settings::psn(&settings, "10.0.0.20:6000".parse().expect("an address"), 1).expect("it fits");
    assert!(unicast.starts_with("PosiStageNet: unicast 10.0.0.20 port 6000, "), "{unicast}");
}

proptest! {
    #![proptest_config(random_cases(256))]

    #[test]
    fn no_packet_is_too_long_and_no_tracker_is_split(
        benches in 1..=MAX_BENCHES,
        name in "[ -~]{1,64}",
        pattern in "[ -z]{0,10}([ -z]{45}[{]index[}]|[{]id[}][{]index[}][ -z]{0,40})",
        first_id in 0..60_000_u16,
    ) {
        let (system_name, tracker_name) = (name.parse().expect("a name"), pattern.parse().expect("a pattern"));
        let settings = PsnSettings { system_name, tracker_name, first_id, ..settings() };
        let (mut encoder, mut packets) = (PsnEncoder::new(settings, EPOCH_NS), Packets::default());
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
            prop_assert!(ids.into_iter().eq((0..benches).map(|index| (usize::from(first_id) + index, true))));
        }
    }

    #[test]
    fn by_default_no_bit_differs_from_the_documented_axes(
        centre_m in any::<[f64; 3]>(), velocity_mps in any::<[f64; 3]>(), heading_rad in -PI..=PI,
    ) {
        let bench = BenchState { centre_m, velocity_mps, heading_rad, ..BenchState::default() };
        let swapped = |[x, y, z]: [f64; 3]| [x, z, y].map(|value| (value as f32).to_bits());
        let expected = [swapped(centre_m), swapped(velocity_mps), [0, (-heading_rad as f32).to_bits(), 0]];
        prop_assert_eq!(tracker(&bench, 1.0).map(|vector| vector.map(f32::to_bits)), expected);
    }
}

#[test]
fn by_default_negative_zeros_stay_negative() {
    let zeros = BenchState { centre_m: [-0.0; 3], velocity_mps: [-0.0; 3], ..BenchState::default() };
    let bits = |bench| tracker(&bench, 1.0).map(|vector| vector.map(f32::to_bits));
    let negative = (-0.0_f32).to_bits();
    assert_eq!(bits(zeros), [[negative; 3], [negative; 3], [0, negative, 0]]);
    assert_eq!(bits(BenchState { heading_rad: -0.0, ..zeros })[2], [0; 3]);
}

fn bench(front: [f64; 3], rear: [f64; 3], velocity_mps: [f64; 3]) -> BenchState {
    let handle = |position_m| HandleState { position_m, velocity_mps };
    BenchState::between(&handle(front), &handle(rear))
}

/// Returns a bench as sent: its position, its speed and its orientation.
fn tracker(bench: &BenchState, time_scale: f64) -> [[f32; 3]; 3] {
    tracker_of(settings(), bench, time_scale)
}

fn tracker_of(settings: PsnSettings, bench: &BenchState, time_scale: f64) -> [[f32; 3]; 3] {
    let header = FrameHeader { time_scale, ..FrameHeader::default() };
    let latest = LatestFrame { header, benches: vec![*bench], freshness: Freshness::Fresh };
    let mut packets = Packets::default();
    PsnEncoder::new(settings, EPOCH_NS).data(&latest, EPOCH_NS, &mut packets).expect("one bench fits");
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

#[test]
fn a_transform_places_a_tracker_as_documented() {
    let walking = bench([3.0, 5.0, 0.0], [3.0, 3.0, 0.0], [0.0, 1.0, 0.0]);
    let [offset, rotation, axes] = ["12,-3.5,0", "90", "x,y,z"];
    let transform = StageTransform::new(
        offset.parse().expect("an offset"),
        rotation.parse().expect("a rotation"),
        axes.parse().expect("axes"),
    );
    let orientation_rad = [0.0, 0.0, std::f32::consts::PI];
    let expected = [[8.0, -0.5, 0.0], [-1.0, 0.0, 0.0], orientation_rad];
    assert_eq!(tracker_of(PsnSettings { transform, ..settings() }, &walking, 1.0), expected);
}

#[test]
fn late_frames_have_times_that_are_exactly_a_period_apart() {
    let mut encoder = PsnEncoder::new(chosen("0"), EPOCH_NS);
    let mut packets = Packets::default();
    let times_us = [0, 3_000_000, 248_000_000, 14_000_000].iter().zip(1..).map(|(late_ns, tick)| {
        let scheduled_ns = EPOCH_NS + tick * 20_000_000;
        let published_ns = scheduled_ns + late_ns;
        let header = FrameHeader { scheduled_ns, published_ns, ..latest(1).header };
        encoder.data(&LatestFrame { header, ..latest(1) }, published_ns, &mut packets).expect("one bench fits");
        let packet = packets.iter().next().expect("a packet").to_vec();
        let [time, sent] = [packet.len() - 8, 8].map(|at| packet[at..at + 8].try_into().expect("eight bytes"));
        assert_eq!(u64::from_le_bytes(sent), (published_ns - EPOCH_NS) / 1_000, "the packet has the time of sending");
        u64::from_le_bytes(time)
    });
    assert_eq!(times_us.collect::<Vec<_>>(), [20_000, 40_000, 60_000, 80_000]);
}

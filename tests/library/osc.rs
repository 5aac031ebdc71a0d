//! OSC messages, bundles and addresses.

use std::f64::consts::FRAC_PI_2;

use bench_dragon::bridge::osc::{AddressError, AddressPattern, AngleUnit, OscEncoder, OscSettings, ShowAddress};
use bench_dragon::bridge::{Freshness, LatestFrame, MAX_PACKET_LEN, Packets};
use bench_dragon_ipc::{BenchState, FrameHeader, ShowState};
use rosc::{OscMessage, OscPacket, OscTime, OscType, decoder};

fn latest(benches: usize, freshness: Freshness) -> LatestFrame {
    let header = FrameHeader {
        tick: (1 << 31) + 7,
        sim_time_ns: 12_500_000_000,
        published_ns: 1_000_000_000,
        time_scale: 2.0,
        state: ShowState::Held.to_wire(),
        ..FrameHeader::default()
    };
    let bench = BenchState {
        centre_m: [1.0, 2.0, 0.5],
        heading_rad: -FRAC_PI_2,
        velocity_mps: [3.0, 4.0, 0.0],
        ..BenchState::default()
    };
    LatestFrame { header, benches: vec![bench; benches], freshness }
}

fn encoder(angle: AngleUnit, bundle: bool) -> OscEncoder {
    OscEncoder::new(OscSettings {
        bench_address: "/b/{index}".parse().expect("an address"),
        show_address: "/s".parse().expect("an address"),
        angle,
        bundle,
    })
}

fn packets(benches: usize, angle: AngleUnit, bundle: bool, freshness: Freshness) -> Vec<OscPacket> {
    let mut encoder = encoder(angle, bundle);
    let mut packets = Packets::default();
    encoder.frame(&latest(benches, freshness), 500_000_000, &mut packets);
    assert!(packets.iter().all(|packet| packet.len() <= MAX_PACKET_LEN));
    packets.iter().map(|packet| decoder::decode_udp(packet).expect("rosc wrote it").1).collect()
}

fn message(addr: &str, args: Vec<OscType>) -> OscPacket {
    OscPacket::Message(OscMessage { addr: addr.to_owned(), args })
}

#[test]
fn a_frame_is_the_show_and_then_its_benches() {
    let sent = packets(2, AngleUnit::Degrees, false, Freshness::Fresh);
    let state = OscType::String("held".to_owned());
    let show = vec![OscType::Float(12.5), state, OscType::Float(2.0), OscType::Int(7), OscType::Int(1)];
    let bench = [1.0, 2.0, 0.5, -90.0, 10.0].map(OscType::Float).to_vec();
    assert_eq!(sent, [message("/s", show), message("/b/0", bench.clone()), message("/b/1", bench)]);
}

#[test]
fn a_stale_frame_is_marked_and_has_no_speed() {
    let sent = packets(1, AngleUnit::Radians, false, Freshness::Stale { age_ns: 1 });
    let [OscPacket::Message(show), OscPacket::Message(bench)] = sent.as_slice() else { panic!("{sent:?}") };
    assert_eq!(show.args[4], OscType::Int(0));
    assert_eq!(bench.args[3..], [OscType::Float(-FRAC_PI_2 as f32), OscType::Float(0.0)]);
}

#[test]
fn bundles_hold_the_same_messages_under_the_time_of_the_frame() {
    let alone = packets(223, AngleUnit::Degrees, false, Freshness::Fresh);
    let bundles = packets(223, AngleUnit::Degrees, true, Freshness::Fresh);
    let mut bundled = Vec::new();
    for bundle in bundles {
        let OscPacket::Bundle(bundle) = bundle else { panic!("{bundle:?}") };
        assert_eq!(bundle.timetag, OscTime { seconds: 2_208_988_801, fractional: 1 << 31 });
        assert!(bundle.content.len() > 1);
        bundled.extend(bundle.content);
    }
    assert_eq!(bundled, alone);
}

#[test]
fn a_time_counts_seconds_since_1900_and_their_fractions() {
    let bundle_time = |unix_ns| {
        let mut encoder = encoder(AngleUnit::Degrees, true);
        let mut packets = Packets::default();
        encoder.frame(&LatestFrame::default(), unix_ns, &mut packets);
        let sent = packets.iter().map(|packet| decoder::decode_udp(packet).expect("rosc wrote it").1).next();
        let Some(OscPacket::Bundle(bundle)) = sent else { panic!("{sent:?}") };
        bundle.timetag
    };
    assert_eq!(bundle_time(0), OscTime { seconds: 2_208_988_800, fractional: 0 });
    assert_eq!(bundle_time(1_500_000_000), OscTime { seconds: 2_208_988_801, fractional: 1 << 31 });
    assert_eq!(bundle_time(999_999_999).fractional, u32::MAX - 4);
}

#[test]
fn only_valid_osc_addresses_are_accepted() {
    let long = format!("/{{index}}/{}", "a".repeat(200));
    let bad =
        ["{index}", "/a b/{index}", "/{index}/", "//{index}", "/a#/{index}", "/*/{index}", "/\u{e9}/{index}", &long];
    for text in bad {
        assert_eq!(text.parse::<AddressPattern>(), Err(AddressError::Address), "{text}");
    }
    assert_eq!("/dragon/bench".parse::<AddressPattern>(), Err(AddressError::NoIndex));
    assert!("/dragon/show".parse::<ShowAddress>().is_ok());
    let benches: AddressPattern = "/{index}/dragon2/bench{index}".parse().expect("an address");
    for (show, is_bench) in [("/7/dragon2/bench7", true), ("/7/dragon2/bench8", false), ("/dragon/show", false)] {
        assert_eq!(benches.is_bench(&show.parse().expect("an address")), is_bench, "{show}");
    }
    assert_eq!("/dragon/{index}".parse::<ShowAddress>(), Err(AddressError::Address));
    assert_eq!("/{index}/{index}".parse::<AddressPattern>().map(|pattern| pattern.of_bench(2)), Ok("/2/2".to_owned()));
}

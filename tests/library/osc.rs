//! OSC messages, bundles and addresses.

use std::f64::consts::FRAC_PI_2;

use bench_dragon::bridge::desk_settings::{self, OscTransport};
use bench_dragon::bridge::osc::{AddressError, AddressPattern, AngleUnit, OscEncoder, OscSettings, ShowAddress};
use bench_dragon::bridge::stage_transform::StageTransform;
use bench_dragon::bridge::{AxisOrder, BenchSelection, Freshness, LatestFrame, MAX_PACKET_LEN, Packets};
use bench_dragon_ipc::{BenchState, FrameHeader, ShowState};
use rosc::{OscMessage, OscPacket, OscTime, OscType, decoder};

fn latest(benches: usize, freshness: Freshness) -> LatestFrame {
    let header = FrameHeader {
        tick: (1 << 31) + 7,
        show_time_ns: 12_500_000_000,
        scheduled_ns: 1_000_000_000,
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

fn settings(angle: AngleUnit, is_bundled: bool) -> OscSettings {
    OscSettings {
        bench_address: "/b/{index}".parse().expect("an address"),
        show_address: "/s".parse().expect("an address"),
        angle,
        is_bundled,
        benches: BenchSelection::default(),
        transform: StageTransform::of_axes(AxisOrder::RIGHT_AWAY_UP),
    }
}

fn encoder(angle: AngleUnit, is_bundled: bool) -> OscEncoder {
    OscEncoder::new(settings(angle, is_bundled))
}

fn packets(benches: usize, angle: AngleUnit, is_bundled: bool, freshness: Freshness) -> Vec<OscPacket> {
    let mut encoder = encoder(angle, is_bundled);
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

/// Returns the messages of the benches, as sent with these settings.
fn bench_messages(settings: OscSettings, latest: &LatestFrame) -> Vec<OscMessage> {
    let mut packets = Packets::default();
    OscEncoder::new(settings).frame(latest, 0, &mut packets);
    let messages = packets.iter().skip(1).map(|packet| match decoder::decode_udp(packet).expect("rosc wrote it").1 {
        OscPacket::Message(message) => message,
        OscPacket::Bundle(bundle) => panic!("{bundle:?}"),
    });
    messages.collect()
}

#[test]
fn chosen_benches_keep_their_numbers() {
    let benches: BenchSelection = "1,3..4,7..".parse().expect("a choice");
    let settings = OscSettings { benches, ..settings(AngleUnit::Degrees, false) };
    let messages = bench_messages(settings.clone(), &latest(9, Freshness::Fresh));
    let addresses: Vec<&str> = messages.iter().map(|message| message.addr.as_str()).collect();
    assert_eq!(addresses, ["/b/1", "/b/3", "/b/4", "/b/7", "/b/8"]);
    assert!(bench_messages(settings, &latest(1, Freshness::Fresh)).is_empty());
}

#[test]
fn a_transform_changes_position_and_heading_and_keeps_the_speed() {
    // The bench at (1, 2, 0.5) points to -90 degrees. Turned by 90 degrees it is at (-2, 1, 0.5) and points to +x.
    let [offset, rotation] = ["10,20,30", "90"];
    for (axes, expected) in [
        ("x,y,z", [8.0, 21.0, 30.5, 0.0, 10.0]),
        ("x,z,y", [8.0, 30.5, 21.0, 0.0, 10.0]),
        ("y,x,z", [21.0, 8.0, 30.5, 90.0, 10.0]),
        ("-x,y,z", [-8.0, 21.0, 30.5, 180.0, 10.0]),
        ("-z,y,-x", [-30.5, 21.0, -8.0, -90.0, 10.0]),
    ] {
        let transform = StageTransform::new(
            offset.parse().expect("an offset"),
            rotation.parse().expect("a rotation"),
            axes.parse().expect("axes"),
        );
        let settings = OscSettings { transform, ..settings(AngleUnit::Degrees, false) };
        let messages = bench_messages(settings, &latest(1, Freshness::Fresh));
        assert_eq!(messages[0].args, expected.map(OscType::Float), "{axes}");
    }
}

#[test]
fn by_default_negative_zeros_stay_negative() {
    let mut frame = latest(1, Freshness::Fresh);
    frame.benches[0] = BenchState { centre_m: [-0.0; 3], heading_rad: -0.0, ..BenchState::default() };
    let messages = bench_messages(settings(AngleUnit::Degrees, false), &frame);
    let bits = |value: &OscType| value.clone().float().expect("a float").to_bits();
    let expected = [-0.0_f32, -0.0, -0.0, -0.0, 0.0].map(f32::to_bits);
    assert_eq!(messages[0].args.iter().map(bits).collect::<Vec<_>>(), expected);
}

#[test]
fn the_line_for_a_receiver_has_all_that_an_operator_enters() {
    let to = "10.0.0.30:10000".parse().expect("an address");
    let mut settings = settings(AngleUnit::Degrees, false);
    let expected = "Open Sound Control: UDP unicast 10.0.0.30 port 10000, /s (time, state, time scale, tick, fresh), /b/0 to \
                    /b/222 (x, y, z, heading, speed), axes x right, y away, z up, metres, at the centre of each board, \
                    heading in degrees from x to y";
    assert_eq!(desk_settings::osc(&settings, to, OscTransport::Udp, 223), expected);
    settings.benches = "0,10..20".parse().expect("a choice");
    settings.transform = StageTransform::of_axes("x,z,-y".parse().expect("axes"));
    (settings.is_bundled, settings.angle) = (true, AngleUnit::Radians);
    let expected = "Open Sound Control: TCP 10.0.0.30 port 10000, SLIP, in bundles, /s (time, state, time scale, tick, fresh), \
                    /b/0, /b/10 to /b/14 (x, y, z, heading, speed), axes x right, y up, z towards the audience, metres, at \
                    the centre of each board, heading in radians from x to z";
    assert_eq!(desk_settings::osc(&settings, to, OscTransport::Tcp, 15), expected);
    settings.benches = "7".parse().expect("a choice");
    assert!(desk_settings::osc(&settings, to, OscTransport::Tcp, 7).contains(", no benches, axes"));
}

#[test]
fn bundles_of_late_frames_have_times_that_are_exactly_a_period_apart() {
    let mut encoder = encoder(AngleUnit::Degrees, true);
    let mut packets = Packets::default();
    let seconds = [0, 3_000_000, 248_000_000, 14_000_000].iter().zip(1..).map(|(late_ns, tick)| {
        let scheduled_ns = tick * 250_000_000;
        let header =
            FrameHeader { scheduled_ns, published_ns: scheduled_ns + late_ns, ..latest(1, Freshness::Fresh).header };
        encoder.frame(&LatestFrame { header, ..latest(1, Freshness::Fresh) }, 0, &mut packets);
        let (_, decoded) = decoder::decode_udp(packets.iter().next().expect("a packet")).expect("rosc wrote it");
        let OscPacket::Bundle(bundle) = decoded else { panic!("a bundle, not {decoded:?}") };
        f64::from(bundle.timetag.seconds - 2_208_988_800) + f64::from(bundle.timetag.fractional) / 2.0_f64.powi(32)
    });
    assert_eq!(seconds.collect::<Vec<_>>(), [0.25, 0.5, 0.75, 1.0]);
}

//! Timecode as OSC messages.

use bench_dragon::source::timecode::osc::position;
use bench_dragon::source::timecode::{FrameRate, Malformed};
use proptest::prelude::*;
use rosc::{OscBundle, OscMessage, OscPacket, OscTime, OscType};
use test_support::property::random_cases;

fn message(args: Vec<OscType>) -> OscPacket {
    OscPacket::Message(OscMessage { addr: "/timecode".to_owned(), args })
}

fn position_s(args: Vec<OscType>) -> Result<Option<f64>, Malformed> {
    position_of_packet(&message(args))
}

fn position_of_packet(packet: &OscPacket) -> Result<Option<f64>, Malformed> {
    let packet = rosc::encoder::encode(packet).expect("the file can be written");
    Ok(position(&packet, "/timecode", FrameRate::Ebu)?.map(|position| position.since_midnight_s))
}

fn text(text: &str) -> OscType {
    OscType::String(text.to_owned())
}

#[test]
fn a_position_is_read_from_text_from_four_numbers_or_from_seconds() {
    use OscType::{Double, Float, Int, Long};
    for (args, expected_s) in [
        (vec![text("01:02:03:05")], 3723.2),
        (vec![text("01:02:03:05"), Int(24)], 3723.0 + 5.0 / 24.0),
        (vec![text("00:01:00;02")], 1800.0 * 1001.0 / 30_000.0),
        (vec![text("00:01:00:02"), Float(29.97)], 1800.0 * 1001.0 / 30_000.0),
        (vec![text("00:01:00:00"), text("29.97ndf")], 1800.0 * 1001.0 / 30_000.0),
        (vec![text("01:02:03.25")], 3723.25),
        (vec![text("62.5")], 62.5),
        (vec![Int(1), Int(2), Int(3), Int(5)], 3723.2),
        (vec![Float(1.0), Int(2), Long(3), Int(5), Int(30)], 3723.0 + 5.0 / 30.0),
        (vec![Float(62.5)], 62.5),
        (vec![Double(3723.16)], 3723.16),
        (vec![Int(60)], 60.0),
    ] {
        let position_s = position_s(args.clone()).expect("the settings are sound").expect("the message is a timecode");
        assert!((position_s - expected_s).abs() < 1e-9, "{args:?} is {position_s}");
    }
}

#[test]
fn messages_without_a_position_are_malformed() {
    use OscType::{Bool, Double, Float, Int};
    let texts = ["", "1:2", "01:02:03:25", "99:00:00:00", "00:01:00;00", "+1:02:03:04", "001:02:03:04", "01:02:60.0"];
    let texts = texts.into_iter().chain(["inf", "-1.5", "1e3"]).map(|malformed| vec![text(malformed)]);
    let others = [
        vec![],
        vec![text("01:02:03:04"), Int(60)],
        vec![text("01:02:03:04"), text("fast")],
        vec![Int(1), Int(2)],
        vec![Int(-1), Int(2), Int(3), Int(4)],
        vec![Float(0.5), Int(2), Int(3), Int(4)],
    ];
    let numbers = [Float(f32::NAN), Double(f64::INFINITY), Double(-0.1), Double(86_400.0), Bool(true)];
    for args in texts.chain(others).chain(numbers.map(|number| vec![number])) {
        assert_eq!(position_s(args.clone()), Err(Malformed), "{args:?}");
    }
}

#[test]
fn messages_of_other_addresses_are_ignored() {
    let other = OscPacket::Message(OscMessage { addr: "/fader".to_owned(), args: vec![OscType::Bool(true)] });
    assert_eq!(position_of_packet(&other), Ok(None));
    let bundle = |content| OscPacket::Bundle(OscBundle { timetag: OscTime::from((0, 1)), content });
    let several = vec![message(vec![OscType::Int(1)]), message(vec![OscType::Int(2)]), other];
    assert_eq!(position_of_packet(&bundle(several)), Ok(Some(2.0)));
    let deep = (0..5).fold(message(vec![OscType::Int(1)]), |packet, _| bundle(vec![packet]));
    assert_eq!(position_of_packet(&deep), Err(Malformed));
}

proptest! {
    #![proptest_config(random_cases(256))]

    #[test]
    fn any_bytes_are_decoded_or_rejected(bytes in prop::collection::vec(any::<u8>(), 0..200), flips in prop::collection::vec((0..40_usize, any::<u8>()), 0..4)) {
        let _ = position(&bytes, "/timecode", FrameRate::Ebu);
        let mut packet = rosc::encoder::encode(&message(vec![text("01:02:03:05"), OscType::Int(25)])).expect("the file can be written");
        for (index, byte) in flips {
            let index = index % packet.len();
            packet[index] = byte;
        }
        if let Ok(Some(position)) = position(&packet, "/timecode", FrameRate::Ebu) {
            prop_assert!((0.0..position.day_s).contains(&position.since_midnight_s));
        }
    }
}

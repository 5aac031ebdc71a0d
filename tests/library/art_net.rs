//! Art-Net timecode. The crate `artnet_protocol` is an independent implementation.

use artnet_protocol::{ArtCommand, FrameType, Timecode};
use bench_dragon::source::timecode::art_net::{packet, position};
use bench_dragon::source::timecode::{Clock, FrameRate, Malformed};

const PACKET: [u8; 19] = *b"Art-Net\0\x00\x97\x00\x0e\x00\x00\x05\x02\x01\x00\x01";

fn position_s(packet: &[u8]) -> Result<Option<f64>, Malformed> {
    position(packet).map(|position| position.map(|position| position.since_midnight_s))
}

fn with(index: usize, byte: u8) -> [u8; 19] {
    let mut packet = PACKET;
    packet[index] = byte;
    packet
}

#[test]
fn each_of_the_four_rates_has_its_position() {
    let positions = [0, 1, 2, 3].map(|kind| position_s(&with(18, kind)));
    let expected = [62.0 + 5.0 / 24.0, 62.2, (62.0 * 30.0 + 5.0 - 2.0) * 1001.0 / 30_000.0, 62.0 + 5.0 / 30.0];
    for (position, expected) in positions.into_iter().zip(expected) {
        let position_s = position.expect("the settings are sound").expect("the message is a timecode");
        assert!((position_s - expected).abs() < 1e-12, "{position_s} {expected}");
    }
}

#[test]
fn a_packet_cut_short_is_malformed_and_a_longer_one_is_not() {
    // The first packet ends before its opcode, the others before their rate.
    assert!((0..19).all(|length| position_s(&PACKET[..length]) == Err(Malformed)));
    assert_eq!(position_s(&[&PACKET[..], b"more"].concat()), Ok(Some(62.2)));
}

#[test]
fn other_packets_and_other_streams_are_ignored() {
    assert_eq!(position_s(b"Art-Net\0\x00\x50\x00\x0e"), Ok(None), "ArtDmx");
    assert_eq!(position_s(&with(13, 1)), Ok(None));
}

#[test]
fn positions_that_no_clock_shows_are_malformed() {
    for (index, byte) in [(0, b'a'), (7, 1), (11, 13), (14, 25), (15, 60), (16, 60), (17, 24), (17, 99), (18, 4)] {
        assert_eq!(position_s(&with(index, byte)), Err(Malformed), "byte {index} is {byte}");
    }
}

const TYPES: [FrameRate; 4] = [FrameRate::Film, FrameRate::Ebu, FrameRate::DropFrame, FrameRate::Smpte];

#[test]
fn each_packet_has_the_bytes_of_another_implementation() {
    for (rate, frame_type) in TYPES.into_iter().zip([FrameType::Film, FrameType::EBU, FrameType::DF, FrameType::SMPTE])
    {
        // A prime step visits all numbers of frames, seconds, minutes and hours.
        for frame in (0..rate.frames_per_day()).step_by(9_973) {
            let clock = Clock::of_frame(frame.into(), rate);
            let [frames, seconds, minutes, hours] =
                [clock.frames, clock.seconds, clock.minutes, clock.hours].map(|number| number as u8);
            let (version, stream_id) = ([0, 14], 0);
            let timecode = Timecode { version, filler1: 0, stream_id, frames, seconds, minutes, hours, frame_type };
            let expected = ArtCommand::OpTimeCode(timecode).write_to_buffer().expect("a packet");
            assert_eq!(packet(clock, rate).expect("a type of the protocol").as_slice(), expected, "{rate} {clock:?}");
        }
    }
    assert_eq!(packet(Clock::default(), FrameRate::NonDrop), None);
}

/// 24 hours out and in: the position of each frame is exactly the time at which it begins.
#[test]
fn no_frame_of_a_day_drifts() {
    for rate in TYPES {
        for frame in 0..rate.frames_per_day() {
            let packet = packet(Clock::of_frame(frame.into(), rate), rate).expect("a type of the protocol");
            let position = position(&packet).expect("a valid packet").expect("a timecode");
            assert_eq!(position.since_midnight_s, f64::from(frame) / rate.frames_per_second(), "{rate} frame {frame}");
            assert_eq!(position.day_s, rate.day_s());
        }
    }
}

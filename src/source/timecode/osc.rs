//! Timecode as OSC messages. Pure.
//!
//! | arguments | as |
//! |---|---|
//! | `"01:02:03:04"`, `"01:02:03;04"` (drop-frame) | hours, minutes, seconds, frames |
//! | `"01:02:03.040"`, `"62.5"` | hours, minutes, seconds with decimals |
//! | `1 2 3 4` | four whole numbers: hours, minutes, seconds, frames |
//! | `3723.16` | one number: seconds |
//!
//! Behind those with frames may stand their number a second: 24, 25, 29.97 (drop-frame) or 30.

use rosc::{OscMessage, OscPacket, OscType};

use super::{Clock, FrameRate, Malformed, Position};

/// Bundles in bundles are looked into so deep.
const DEEPEST: usize = 4;

/// The position in the last message of a packet that has this address; `None` where none has. Frames whose number a second
/// is not given are of `rate`.
///
/// # Errors
/// [`Malformed`] for what is not OSC, and for a message of this address that is no timecode.
pub fn position(packet: &[u8], address: &str, rate: FrameRate) -> Result<Option<Position>, Malformed> {
    let (rest, packet) = rosc::decoder::decode_udp(packet).map_err(|_| Malformed)?;
    if rest.is_empty() { position_in(&packet, address, rate, DEEPEST) } else { Err(Malformed) }
}

fn position_in(
    packet: &OscPacket,
    address: &str,
    rate: FrameRate,
    deepest: usize,
) -> Result<Option<Position>, Malformed> {
    match packet {
        OscPacket::Message(message) if message.addr == address => position_of(message, rate).map(Some),
        OscPacket::Message(_) => Ok(None),
        OscPacket::Bundle(_) if deepest == 0 => Err(Malformed),
        OscPacket::Bundle(bundle) => bundle.content.iter().try_fold(None, |last, packet| {
            let found = position_in(packet, address, rate, deepest - 1)?;
            Ok(found.or(last))
        }),
    }
}

fn position_of(OscMessage { args, .. }: &OscMessage, rate: FrameRate) -> Result<Position, Malformed> {
    match args.as_slice() {
        [OscType::String(text)] => position_of_text(text, rate),
        [OscType::String(text), given] => position_of_text(text, given_rate(given)?),
        [hours, minutes, seconds, frames] => Position::of_clock(clock([hours, minutes, seconds, frames])?, rate),
        [hours, minutes, seconds, frames, given] => {
            Position::of_clock(clock([hours, minutes, seconds, frames])?, given_rate(given)?)
        }
        [seconds] => Position::of_seconds(number(seconds)?),
        _ => Err(Malformed),
    }
}

fn position_of_text(text: &str, rate: FrameRate) -> Result<Position, Malformed> {
    let parts: Vec<&str> = text.trim().split([':', ';']).collect();
    let whole = |text: &str| {
        let is_short = (1..=2).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit());
        if is_short { text.parse().map_err(|_| Malformed) } else { Err(Malformed) }
    };
    match parts[..] {
        [hours, minutes, seconds, frames] => {
            let rate = if text.contains(';') { FrameRate::DropFrame } else { rate };
            let [hours, minutes, seconds, frames] = [whole(hours)?, whole(minutes)?, whole(seconds)?, whole(frames)?];
            Position::of_clock(Clock { hours, minutes, seconds, frames }, rate)
        }
        [hours, minutes, seconds] => {
            let clock = Clock { hours: whole(hours)?, minutes: whole(minutes)?, ..Clock::default() };
            let seconds_s = decimal(seconds).filter(|seconds_s| *seconds_s < 60.0).ok_or(Malformed)?;
            Position::of_seconds(clock.position_s(FrameRate::Ebu)? + seconds_s)
        }
        [seconds] => Position::of_seconds(decimal(seconds).ok_or(Malformed)?),
        _ => Err(Malformed),
    }
}

/// Digits and a decimal point: no sign, no exponent, no infinity.
fn decimal(text: &str) -> Option<f64> {
    text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.').then(|| text.parse().ok())?
}

fn clock(parts: [&OscType; 4]) -> Result<Clock, Malformed> {
    let mut whole = [0; 4];
    for (whole, part) in whole.iter_mut().zip(parts) {
        let number = number(part)?;
        let is_whole = number.fract() == 0.0 && (0.0..100.0).contains(&number);
        *whole = if is_whole { number as u32 } else { return Err(Malformed) };
    }
    let [hours, minutes, seconds, frames] = whole;
    Ok(Clock { hours, minutes, seconds, frames })
}

fn given_rate(given: &OscType) -> Result<FrameRate, Malformed> {
    FrameRate::of(number(given)?).ok_or(Malformed)
}

fn number(value: &OscType) -> Result<f64, Malformed> {
    match *value {
        OscType::Int(value) => Ok(f64::from(value)),
        OscType::Long(value) => Ok(value as f64),
        OscType::Float(value) => Ok(f64::from(value)),
        OscType::Double(value) => Ok(value),
        _ => Err(Malformed),
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use rosc::{OscBundle, OscTime};

    use super::*;

    fn message(args: Vec<OscType>) -> OscPacket {
        OscPacket::Message(OscMessage { addr: "/timecode".to_owned(), args })
    }

    fn position_s(args: Vec<OscType>) -> Result<Option<f64>, Malformed> {
        position_of_packet(&message(args))
    }

    fn position_of_packet(packet: &OscPacket) -> Result<Option<f64>, Malformed> {
        let packet = rosc::encoder::encode(packet).expect("it can be written");
        Ok(position(&packet, "/timecode", FrameRate::Ebu)?.map(|position| position.since_midnight_s))
    }

    fn text(text: &str) -> OscType {
        OscType::String(text.to_owned())
    }

    #[test]
    fn a_position_comes_as_text_as_four_numbers_or_as_seconds() {
        use OscType::{Double, Float, Int, Long};
        for (args, expected_s) in [
            (vec![text("01:02:03:05")], 3723.2),
            (vec![text("01:02:03:05"), Int(24)], 3723.0 + 5.0 / 24.0),
            (vec![text("00:01:00;02")], 1800.0 * 1001.0 / 30_000.0),
            (vec![text("00:01:00:02"), Float(29.97)], 1800.0 * 1001.0 / 30_000.0),
            (vec![text("01:02:03.25")], 3723.25),
            (vec![text("62.5")], 62.5),
            (vec![Int(1), Int(2), Int(3), Int(5)], 3723.2),
            (vec![Float(1.0), Int(2), Long(3), Int(5), Int(30)], 3723.0 + 5.0 / 30.0),
            (vec![Float(62.5)], 62.5),
            (vec![Double(3723.16)], 3723.16),
            (vec![Int(60)], 60.0),
        ] {
            let position_s = position_s(args.clone()).expect("it is sound").expect("it is a timecode");
            assert!((position_s - expected_s).abs() < 1e-9, "{args:?} is {position_s}");
        }
    }

    #[test]
    fn what_is_no_position_is_malformed() {
        use OscType::{Bool, Double, Float, Int};
        for args in [
            vec![],
            vec![text("")],
            vec![text("1:2")],
            vec![text("01:02:03:25")],
            vec![text("99:00:00:00")],
            vec![text("00:01:00;00")],
            vec![text("+1:02:03:04")],
            vec![text("001:02:03:04")],
            vec![text("01:02:60.0")],
            vec![text("inf")],
            vec![text("-1.5")],
            vec![text("1e3")],
            vec![text("01:02:03:04"), Int(60)],
            vec![Int(1), Int(2)],
            vec![Int(-1), Int(2), Int(3), Int(4)],
            vec![Float(0.5), Int(2), Int(3), Int(4)],
            vec![Float(f32::NAN)],
            vec![Double(f64::INFINITY)],
            vec![Double(-0.1)],
            vec![Double(86_400.0)],
            vec![Bool(true)],
        ] {
            assert_eq!(position_s(args.clone()), Err(Malformed), "{args:?}");
        }
    }

    #[test]
    fn messages_of_other_addresses_are_none_of_ours() {
        let other = OscPacket::Message(OscMessage { addr: "/fader".to_owned(), args: vec![OscType::Bool(true)] });
        assert_eq!(position_of_packet(&other), Ok(None));
        let bundle = |content| OscPacket::Bundle(OscBundle { timetag: OscTime::from((0, 1)), content });
        let several = vec![message(vec![OscType::Int(1)]), message(vec![OscType::Int(2)]), other];
        assert_eq!(position_of_packet(&bundle(several)), Ok(Some(2.0)));
        let deep = (0..5).fold(message(vec![OscType::Int(1)]), |packet, _| bundle(vec![packet]));
        assert_eq!(position_of_packet(&deep), Err(Malformed));
    }

    proptest! {
        #[test]
        fn no_bytes_do_any_harm(bytes in prop::collection::vec(any::<u8>(), 0..200), flips in prop::collection::vec((0..40_usize, any::<u8>()), 0..4)) {
            let _ = position(&bytes, "/timecode", FrameRate::Ebu);
            let mut packet = rosc::encoder::encode(&message(vec![text("01:02:03:05"), OscType::Int(25)])).expect("it can be written");
            for (index, byte) in flips {
                let index = index % packet.len();
                packet[index] = byte;
            }
            if let Ok(Some(position)) = position(&packet, "/timecode", FrameRate::Ebu) {
                prop_assert!((0.0..position.day_s).contains(&position.since_midnight_s));
            }
        }
    }
}

//! Timecode as OSC messages. Pure.
//!
//! | arguments | meaning |
//! |---|---|
//! | `"01:02:03:04"`, `"01:02:03;04"` (drop-frame) | hours, minutes, seconds, frames |
//! | `"01:02:03.040"`, `"62.5"` | hours, minutes, seconds with decimals |
//! | `1 2 3 4` | four whole numbers: hours, minutes, seconds, frames |
//! | `3723.16` | one number: seconds |
//!
//! A form with frames may end with the frame rate as a further argument: 24, 25, 29.97 (drop-frame), the text "29.97ndf", or 30.

use rosc::{OscMessage, OscPacket, OscType};

use super::{Clock, FrameRate, Malformed, Position};

/// Greatest depth of nested bundles.
const DEEPEST: usize = 4;

/// Returns the position in the packet's last message with this address; `None` where no message has it. `rate` applies
/// to frames without a rate.
///
/// # Errors
/// [`Malformed`] for a packet that is not OSC, and for a message with this address that contains no timecode.
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

/// Parses digits and a decimal point, without sign, exponent or infinity.
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
    match given {
        OscType::String(text) => text.parse().map_err(|_| Malformed),
        number_of_frames => FrameRate::of(number(number_of_frames)?).ok_or(Malformed),
    }
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

//! Timecode as Art-Net sends it: the packet `ArtTimeCode` of the Art-Net 4 protocol. Pure.
//!
//! | bytes | what |
//! |---|---|
//! | 0–7 | `Art-Net`, ended by a zero |
//! | 8–9 | opcode 0x9700, the low byte first |
//! | 10–11 | protocol version, the high byte first: 14 |
//! | 12 | nothing |
//! | 13 | stream; 0 is the master |
//! | 14–17 | frames, seconds, minutes, hours |
//! | 18 | 0 film, 24 frames a second; 1 EBU, 25; 2 drop-frame, 29.97; 3 SMPTE, 30 |

use super::{Clock, FrameRate, Malformed, Position};

/// The UDP port of Art-Net.
pub const PORT: u16 = 6454;

const ID: &[u8; 8] = b"Art-Net\0";
const TIME_CODE: u16 = 0x9700;
const LEAST_VERSION: u16 = 14;
const MASTER_STREAM: u8 = 0;

/// The position in a packet; `None` where it is another Art-Net packet, or of another stream than the master.
///
/// # Errors
/// [`Malformed`] for what is no Art-Net packet, or a timecode that is cut short or never shows.
///
/// ```
/// use bench_dragon::source::timecode::art_net::position;
///
/// let packet = b"Art-Net\0\x00\x97\x00\x0e\x00\x00\x05\x02\x01\x00\x01";
/// let position = position(packet).expect("it is sound").expect("it is a timecode");
/// assert_eq!((position.since_midnight_s, position.day_s), (62.2, 86_400.0));
/// ```
pub fn position(packet: &[u8]) -> Result<Option<Position>, Malformed> {
    let rest = packet.strip_prefix(ID).ok_or(Malformed)?;
    let (opcode, rest) = rest.split_first_chunk().ok_or(Malformed)?;
    if u16::from_le_bytes(*opcode) != TIME_CODE {
        return Ok(None);
    }
    let (version, rest) = rest.split_first_chunk().ok_or(Malformed)?;
    if u16::from_be_bytes(*version) < LEAST_VERSION {
        return Err(Malformed);
    }
    let &[_, stream, frames, seconds, minutes, hours, kind, ..] = rest else { return Err(Malformed) };
    if stream != MASTER_STREAM {
        return Ok(None);
    }
    let rate = match kind {
        0 => FrameRate::Film,
        1 => FrameRate::Ebu,
        2 => FrameRate::DropFrame,
        3 => FrameRate::Smpte,
        _ => return Err(Malformed),
    };
    let [hours, minutes, seconds, frames] = [hours, minutes, seconds, frames].map(u32::from);
    Position::of_clock(Clock { hours, minutes, seconds, frames }, rate).map(Some)
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn the_four_rates_tell_their_positions() {
        let positions = [0, 1, 2, 3].map(|kind| position_s(&with(18, kind)));
        let expected = [62.0 + 5.0 / 24.0, 62.2, (62.0 * 30.0 + 5.0 - 2.0) * 1001.0 / 30_000.0, 62.0 + 5.0 / 30.0];
        for (position, expected) in positions.into_iter().zip(expected) {
            let position_s = position.expect("it is sound").expect("it is a timecode");
            assert!((position_s - expected).abs() < 1e-12, "{position_s} {expected}");
        }
    }

    #[test]
    fn a_packet_cut_short_is_malformed_and_a_longer_one_is_not() {
        // One that ends before its opcode tells what it is, and all others before the rate.
        assert!((0..19).all(|length| position_s(&PACKET[..length]) == Err(Malformed)));
        assert_eq!(position_s(&[&PACKET[..], b"more"].concat()), Ok(Some(62.2)));
    }

    #[test]
    fn other_packets_and_other_streams_are_none_of_ours() {
        assert_eq!(position_s(b"Art-Net\0\x00\x50\x00\x0e"), Ok(None), "ArtDmx");
        assert_eq!(position_s(&with(13, 1)), Ok(None));
    }

    #[test]
    fn what_never_shows_is_malformed() {
        for (index, byte) in [(0, b'a'), (7, 1), (11, 13), (14, 25), (15, 60), (16, 60), (17, 24), (17, 99), (18, 4)] {
            assert_eq!(position_s(&with(index, byte)), Err(Malformed), "byte {index} is {byte}");
        }
    }
}

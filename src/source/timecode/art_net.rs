//! Timecode in the Art-Net 4 protocol: the packet `ArtTimeCode`. Pure.
//!
//! | bytes | content |
//! |---|---|
//! | 0–7 | `Art-Net`, terminated by a zero byte |
//! | 8–9 | opcode 0x9700, low byte first |
//! | 10–11 | protocol version, high byte first: 14 |
//! | 12 | unused |
//! | 13 | stream; 0 is the master |
//! | 14–17 | frames, seconds, minutes, hours |
//! | 18 | 0 film, 24 frames a second; 1 EBU, 25; 2 drop-frame, 29.97; 3 SMPTE, 30 |

use super::{Clock, FrameRate, Malformed, Position};

/// UDP port of Art-Net.
pub const PORT: u16 = 6454;

/// Bytes of a timecode packet.
pub const PACKET_BYTES: usize = 19;

const ID: &[u8; 8] = b"Art-Net\0";
const TIME_CODE: u16 = 0x9700;
const LEAST_VERSION: u16 = 14;
const MASTER_STREAM: u8 = 0;

/// Returns the packet of a clock; `None` for a rate that the protocol has no type for.
///
/// ```
/// use bench_dragon::source::timecode::{Clock, FrameRate, art_net};
///
/// let clock = Clock { hours: 0, minutes: 1, seconds: 2, frames: 5 };
/// let packet = art_net::packet(clock, FrameRate::Ebu).expect("a type of the protocol");
/// assert_eq!(&packet, b"Art-Net\0\x00\x97\x00\x0e\x00\x00\x05\x02\x01\x00\x01");
/// ```
pub fn packet(clock: Clock, rate: FrameRate) -> Option<[u8; PACKET_BYTES]> {
    let kind = match rate {
        FrameRate::Film => 0,
        FrameRate::Ebu => 1,
        FrameRate::DropFrame => 2,
        FrameRate::Smpte => 3,
        FrameRate::NonDrop => return None,
    };
    let Clock { hours, minutes, seconds, frames } = clock;
    let mut packet = [0; PACKET_BYTES];
    packet[..8].copy_from_slice(ID);
    packet[8..10].copy_from_slice(&TIME_CODE.to_le_bytes());
    packet[10..12].copy_from_slice(&LEAST_VERSION.to_be_bytes());
    packet[13] = MASTER_STREAM;
    // Each number of a clock is below 60.
    packet[14..18].copy_from_slice(&[frames, seconds, minutes, hours].map(|number| number as u8));
    packet[18] = kind;
    Some(packet)
}

/// Returns the position in a packet; `None` for another kind of Art-Net packet, or another stream than the master.
///
/// # Errors
/// [`Malformed`] for a packet that is not Art-Net, and for a timecode that is cut short or invalid.
///
/// ```
/// use bench_dragon::source::timecode::art_net::position;
///
/// let packet = b"Art-Net\0\x00\x97\x00\x0e\x00\x00\x05\x02\x01\x00\x01";
/// let position = position(packet).expect("a valid packet").expect("a timecode");
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

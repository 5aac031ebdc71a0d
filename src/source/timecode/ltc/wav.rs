//! WAV: the header of a stream of samples, and samples of the first channel.
//!
//! A stream that is still being written has no length: its header has 0, or a number that is far too high. So samples are read up
//! to the end of the stream.

use std::io::{self, Read};

/// Longest part of a header before the samples, in bytes.
const MAX_CHUNK_BYTES: u32 = 1 << 20;
/// Most parts of a header.
const MAX_CHUNKS: usize = 64;
/// Allowed samples per second.
const RATES: std::ops::RangeInclusive<u32> = 8_000..=192_000;
const MAX_CHANNELS: u16 = 64;
/// The format whose number stands in its identifier.
const EXTENSIBLE: u16 = 0xfffe;

/// Error of a stream that is no sound in WAV.
#[derive(Debug, thiserror::Error)]
pub enum WavError {
    /// The stream ends early, or has another form.
    #[error("must be sound in WAV, as `arecord -f S16_LE -r 48000` writes it")]
    Form,
    /// Another kind of samples.
    #[error("has samples of the kind {format} with {bits} bits, must have 8, 16, 24 or 32 bits, or 32-bit floats")]
    Samples {
        /// The number of the format.
        format: u16,
        /// Bits of a sample.
        bits: u16,
    },
    /// Too few or too many samples, or channels.
    #[error("has {rate} samples a second in {channels} channels, must have {} to {} in at most {MAX_CHANNELS}", RATES.start(), RATES.end())]
    Rate {
        /// Samples per second.
        rate: u32,
        /// Channels.
        channels: u16,
    },
    /// The stream cannot be read.
    #[error(transparent)]
    Io(#[from] io::Error),
}

/// How the samples of a stream are read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct WavReader {
    /// Samples per second, of one channel.
    pub samples_per_second: u32,
    /// Bytes of one sample of all channels.
    pub frame_bytes: usize,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    U8,
    I16,
    I24,
    I32,
    F32,
}

impl WavReader {
    /// Reads a header, up to the first sample.
    ///
    /// # Errors
    /// The stream is no WAV, or has samples of another kind.
    pub fn read_header(stream: &mut impl Read) -> Result<Self, WavError> {
        let header = read::<12>(stream)?;
        if &header[..4] != b"RIFF" || &header[8..] != b"WAVE" {
            return Err(WavError::Form);
        }
        let mut reader = None;
        for _ in 0..MAX_CHUNKS {
            let header = read::<8>(stream)?;
            let (name, length) = (&header[..4], u32_at(&header, 4));
            if name == b"data" {
                return reader.ok_or(WavError::Form);
            }
            if length > MAX_CHUNK_BYTES {
                return Err(WavError::Form);
            }
            // Parts begin at even places.
            let mut part = vec![0; length.next_multiple_of(2) as usize];
            stream.read_exact(&mut part).map_err(of_end)?;
            if name == b"fmt " {
                reader = Some(Self::of_format(&part)?);
            }
        }
        Err(WavError::Form)
    }

    fn of_format(part: &[u8]) -> Result<Self, WavError> {
        if part.len() < 16 {
            return Err(WavError::Form);
        }
        let (format, channels, rate, bits) = (u16_at(part, 0), u16_at(part, 2), u32_at(part, 4), u16_at(part, 14));
        let format = if format == EXTENSIBLE && part.len() >= 26 { u16_at(part, 24) } else { format };
        let kind = match (format, bits) {
            (1, 8) => Kind::U8,
            (1, 16) => Kind::I16,
            (1, 24) => Kind::I24,
            (1, 32) => Kind::I32,
            (3, 32) => Kind::F32,
            _ => return Err(WavError::Samples { format, bits }),
        };
        if !RATES.contains(&rate) || !(1..=MAX_CHANNELS).contains(&channels) {
            return Err(WavError::Rate { rate, channels });
        }
        let frame_bytes = usize::from(channels) * usize::from(bits / 8);
        Ok(Self { samples_per_second: rate, frame_bytes, kind })
    }

    /// The samples of the first channel in whole frames of bytes, from −1 to 1.
    pub fn samples(self, bytes: &[u8]) -> impl Iterator<Item = f32> {
        bytes.chunks_exact(self.frame_bytes).map(move |frame| match self.kind {
            Kind::U8 => (f32::from(frame[0]) - 128.0) / 128.0,
            Kind::I16 => f32::from(i16::from_le_bytes([frame[0], frame[1]])) / 32_768.0,
            Kind::I24 => i32::from_le_bytes([0, frame[0], frame[1], frame[2]]) as f32 / 2_147_483_648.0,
            Kind::I32 => i32::from_le_bytes([frame[0], frame[1], frame[2], frame[3]]) as f32 / 2_147_483_648.0,
            Kind::F32 => f32::from_le_bytes([frame[0], frame[1], frame[2], frame[3]]),
        })
    }
}

/// The header of samples of 16 bits in one channel. `data_bytes`: the length of all samples; `None` for a stream without an end.
pub fn wav_header(samples_per_second: u32, data_bytes: Option<u32>) -> [u8; 44] {
    let data_bytes = data_bytes.unwrap_or(u32::MAX - 36);
    let mut header = [0; 44];
    header[..4].copy_from_slice(b"RIFF");
    header[4..8].copy_from_slice(&data_bytes.saturating_add(36).to_le_bytes());
    header[8..16].copy_from_slice(b"WAVEfmt ");
    header[16..20].copy_from_slice(&16_u32.to_le_bytes());
    for (at, number) in [(20, 1_u16), (22, 1), (32, 2), (34, 16)] {
        header[at..at + 2].copy_from_slice(&number.to_le_bytes());
    }
    header[24..28].copy_from_slice(&samples_per_second.to_le_bytes());
    header[28..32].copy_from_slice(&(2 * samples_per_second).to_le_bytes());
    header[36..40].copy_from_slice(b"data");
    header[40..].copy_from_slice(&data_bytes.to_le_bytes());
    header
}

fn read<const N: usize>(stream: &mut impl Read) -> Result<[u8; N], WavError> {
    let mut bytes = [0; N];
    stream.read_exact(&mut bytes).map_err(of_end)?;
    Ok(bytes)
}

/// The error of a header that cannot be read.
fn of_end(error: io::Error) -> WavError {
    if error.kind() == io::ErrorKind::UnexpectedEof { WavError::Form } else { WavError::Io(error) }
}

fn u16_at(bytes: &[u8], at: usize) -> u16 {
    u16::from_le_bytes([bytes[at], bytes[at + 1]])
}

fn u32_at(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A header with a part that nobody knows, and these values.
    fn header(format: u16, channels: u16, rate: u32, bits: u16) -> Vec<u8> {
        let mut header = wav_header(rate, Some(0)).to_vec();
        header[20..22].copy_from_slice(&format.to_le_bytes());
        header[22..24].copy_from_slice(&channels.to_le_bytes());
        header[34..36].copy_from_slice(&bits.to_le_bytes());
        let odd = [&b"LIST"[..], &3_u32.to_le_bytes(), b"abc\0"].concat();
        header.splice(12..12, odd);
        header
    }

    #[test]
    fn samples_of_each_kind_are_those_of_the_first_channel() {
        for (format, bits, bytes) in [
            (1, 8, vec![0x40]),
            (1, 16, vec![0x00, 0xc0]),
            (1, 24, vec![0x00, 0x00, 0xc0]),
            (1, 32, vec![0x00, 0x00, 0x00, 0xc0]),
            (3, 32, (-0.5_f32).to_le_bytes().to_vec()),
        ] {
            let header = header(format, 2, 44_100, bits);
            let reader = WavReader::read_header(&mut &header[..]).expect("a header");
            let both = [bytes, vec![0x11; usize::from(bits / 8)]].concat();
            assert_eq!((reader.samples_per_second, reader.frame_bytes), (44_100, both.len()));
            assert_eq!(reader.samples(&both.repeat(3)).collect::<Vec<_>>(), [-0.5; 3], "{format} {bits}");
        }
    }

    #[test]
    fn a_stream_that_is_no_such_sound_is_refused() {
        let whole = header(1, 1, 48_000, 16);
        for length in 0..whole.len() - 1 {
            assert!(matches!(WavReader::read_header(&mut &whole[..length]), Err(WavError::Form)), "{length} bytes");
        }
        assert!(matches!(WavReader::read_header(&mut &[7; 5_000][..]), Err(WavError::Form)));
        for (bad, text) in [
            (header(7, 1, 48_000, 8), "has samples of the kind 7 with 8 bits"),
            (header(1, 1, 48_000, 64), "has samples of the kind 1 with 64 bits"),
            (header(1, 0, 48_000, 16), "has 48000 samples a second in 0 channels"),
            (header(1, 1, 100, 16), "has 100 samples a second in 1 channels"),
        ] {
            let error = WavReader::read_header(&mut &bad[..]).expect_err(text);
            assert!(error.to_string().starts_with(text), "{error}");
        }
    }
}

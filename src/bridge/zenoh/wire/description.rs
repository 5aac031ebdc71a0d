//! The description, and what run it is of.

use bench_dragon_ipc::service::MAX_DESCRIPTION_LEN;

use super::WireError;
use super::fields::{Fields, concatenated, run_id};
use crate::source::replay::FASTEST_HZ;

/// Encoding of the description. What run it is of stands in its attachment, see [`Described`].
pub const DESCRIPTION_ENCODING: &str = "text/toml";
/// Bytes of what is attached to a description.
pub const DESCRIBED_BYTES: usize = 24;
/// The most that may be left out between two frames that are sent: all but one a second of the fastest run.
pub const MAX_EVERY: u64 = FASTEST_HZ as u64;

/// What a description is of: attached to it, as three little-endian `u64`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Described {
    /// The run.
    pub run_id: u64,
    /// Of the run's frames, those are sent whose tick is a multiple of this, and those that change the state.
    pub every: u64,
    /// Frames of the run a second before that choice; 0 where it is not known. A recording that is played faster than it was
    /// made has more than its configuration says.
    pub rate_hz: u64,
}

/// What is attached to a description, as bytes.
pub fn encode_described(described: Described) -> [u8; DESCRIBED_BYTES] {
    concatenated([described.run_id, described.every, described.rate_hz])
}

/// Reads a description and what it is of.
///
/// # Errors
/// Whatever is not as a source publishes it. The text is not read as a configuration: that is its readers' affair.
pub fn decode_description(bytes: &[u8], attached: &[u8]) -> Result<(Described, String), WireError> {
    let mut fields = Fields::of(attached, DESCRIBED_BYTES)?;
    let described = Described { run_id: fields.word(), every: fields.word(), rate_hz: fields.word() };
    run_id(described.run_id)?;
    if bytes.len() > MAX_DESCRIPTION_LEN {
        return Err(WireError::Length { got: bytes.len(), expected: MAX_DESCRIPTION_LEN });
    }
    let is_pace = (1..=MAX_EVERY).contains(&described.every) && described.rate_hz <= u64::from(FASTEST_HZ);
    let text = core::str::from_utf8(bytes).ok().filter(|_| is_pace).ok_or(WireError::Description)?;
    Ok((described, text.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_description_is_text_of_a_run_and_says_how_many_frames_there_are_and_are_sent() {
        let described = Described { run_id: 5, every: 10, rate_hz: 10_000 };
        let read = |text: &[u8], described| decode_description(text, &encode_described(described));
        assert_eq!(read(b"[dragon]", described), Ok((described, "[dragon]".to_owned())));
        assert_eq!(read(b"\xff", described), Err(WireError::Description));
        assert_eq!(read(b"", Described { every: 0, ..described }), Err(WireError::Description));
        assert_eq!(read(b"", Described { every: u64::MAX, ..described }), Err(WireError::Description));
        assert_eq!(read(b"", Described { rate_hz: u64::MAX, ..described }), Err(WireError::Description));
        assert!(read(b"", Described { rate_hz: 0, ..described }).is_ok(), "a description of another version");
        assert!(read(&vec![b' '; MAX_DESCRIPTION_LEN + 1], described).is_err());
    }
}

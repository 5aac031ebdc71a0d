//! The words of which every payload is made, and what holds of them all.

use super::WireError;

/// Numbers of runs are smaller, so that every double holds them.
pub(super) const RUN_ID_END: u64 = 1 << 53;

pub(super) fn run_id(run_id: u64) -> Result<(), WireError> {
    if run_id < RUN_ID_END { Ok(()) } else { Err(WireError::RunId(run_id)) }
}

pub(super) fn finite(values: &[f64]) -> Result<(), WireError> {
    if values.iter().all(|value| value.is_finite()) { Ok(()) } else { Err(WireError::NotFinite) }
}

/// Two halves of a word, the one that comes first being the lower.
pub(super) fn pair_of(first: u32, second: u32) -> u64 {
    u64::from(second) << 32 | u64::from(first)
}

pub(super) fn concatenated<const WORDS: usize, const BYTES: usize>(words: [u64; WORDS]) -> [u8; BYTES] {
    const { assert!(WORDS * 8 == BYTES) };
    let mut bytes = [0; BYTES];
    for (place, word) in bytes.chunks_exact_mut(8).zip(words) {
        place.copy_from_slice(&word.to_le_bytes());
    }
    bytes
}

/// The fields of a payload whose length has been checked, one after the other.
pub(super) struct Fields<'a>(pub(super) &'a [u8]);

impl<'a> Fields<'a> {
    pub(super) fn of(bytes: &'a [u8], expected: usize) -> Result<Self, WireError> {
        if bytes.len() == expected { Ok(Self(bytes)) } else { Err(WireError::Length { got: bytes.len(), expected }) }
    }

    fn take<const BYTES: usize>(&mut self) -> [u8; BYTES] {
        let (first, rest) = self.0.split_first_chunk().expect("the length has been compared with the layout");
        self.0 = rest;
        *first
    }

    pub(super) fn word(&mut self) -> u64 {
        u64::from_le_bytes(self.take())
    }

    pub(super) fn half(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    pub(super) fn double(&mut self) -> f64 {
        f64::from_le_bytes(self.take())
    }

    pub(super) fn doubles<const COUNT: usize>(&mut self) -> [f64; COUNT] {
        core::array::from_fn(|_| self.double())
    }
}

//! Files that users name: read as a whole up to a limit, and quoted in messages.

use std::fs::{self, File};
use std::io::{self, Read as _};
use std::path::Path;

/// Greatest length of a file, in bytes.
const MAX_LEN: u64 = 64 << 20;

/// Reason why a file has no content that can be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum InputFileError {
    #[error("cannot be read: {0}")]
    Unreadable(#[from] io::Error),
    #[error("is longer than {} MiB, the most that is allowed", MAX_LEN >> 20)]
    TooLong,
    #[error("is not UTF-8 text")]
    NotText,
}

/// The bytes of a file, at most 64 MiB.
pub(crate) fn read(file: &Path) -> Result<Vec<u8>, InputFileError> {
    // Opening a pipe would wait for its writer.
    if !fs::metadata(file)?.is_file() {
        return Err(io::Error::other("is not a file").into());
    }
    let mut bytes = vec![];
    File::open(file)?.take(MAX_LEN + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_LEN { Err(InputFileError::TooLong) } else { Ok(bytes) }
}

/// The text of a file.
pub(crate) fn utf8(bytes: &[u8]) -> Result<&str, InputFileError> {
    std::str::from_utf8(bytes).map_err(|_| InputFileError::NotText)
}

/// A text from a file for a message: short and printable.
pub(crate) fn quoted(text: &str) -> String {
    const LONGEST: usize = 40;
    let printable = text.chars().map(|char| match char {
        '\t' => ' ',
        char if char.is_control() => '?',
        char => char,
    });
    format!("\"{}\"", printable.take(LONGEST).collect::<String>())
}

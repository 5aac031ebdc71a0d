//! Files that users name: read as a whole up to a limit, and quoted in messages.

use std::fs::{File, Metadata, OpenOptions};
use std::io::{self, ErrorKind, Read as _};
use std::os::unix::fs::{MetadataExt as _, OpenOptionsExt as _};
use std::path::Path;
use std::time::{Duration, Instant};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

/// Longest wait for the end of a pipe.
const MAX_WAIT: Duration = Duration::from_secs(10);
/// Greatest length of a file, in bytes.
const MAX_LEN: u64 = 64 << 20;

/// Reason why a file has no content that can be used.
#[derive(Debug, thiserror::Error)]
pub(crate) enum InputFileError {
    // The words have the cause, so it is no source: a chain of errors would print it again.
    #[error("cannot be read: {0}")]
    Unreadable(io::Error),
    #[error("is longer than {} MiB, the most that is allowed", MAX_LEN >> 20)]
    TooLong,
    #[error("is not UTF-8 text")]
    NotText,
}

impl From<io::Error> for InputFileError {
    fn from(error: io::Error) -> Self {
        Self::Unreadable(error)
    }
}

/// The bytes of a file, at most 64 MiB.
///
/// # Errors
/// It cannot be read, is too long, has no end, or changes meanwhile.
pub(crate) fn read(file: &Path) -> Result<Vec<u8>, InputFileError> {
    let source = open(file)?;
    // The open file is asked: its name may belong to another one by now.
    let before = source.metadata()?;
    if !before.is_file() {
        return Err(io::Error::other("is not a file").into());
    }
    let mut bytes = vec![];
    (&source).take(MAX_LEN + 1).read_to_end(&mut bytes).map_err(unending)?;
    if bytes.len() as u64 > MAX_LEN {
        return Err(InputFileError::TooLong);
    }
    let state = |file: &Metadata| (file.len(), file.mtime(), file.mtime_nsec());
    if state(&source.metadata()?) != state(&before) {
        return Err(io::Error::other("changed while it was read").into());
    }
    Ok(bytes)
}

/// Opens a file to read it, and never waits: neither here for a pipe's writer, nor later for bytes.
fn open(file: &Path) -> io::Result<File> {
    let nonblocking = rustix::fs::OFlags::NONBLOCK.bits() as i32;
    OpenOptions::new().read(true).custom_flags(nonblocking).open(file)
}

/// The error of a read. A file that has no bytes yet is one of the kernel, such as a log.
fn unending(error: io::Error) -> io::Error {
    if error.kind() == ErrorKind::WouldBlock { io::Error::other("is a file without an end") } else { error }
}

/// The first bytes of a file, a pipe or a terminal, at most `most`.
///
/// # Errors
/// It cannot be read, or is a pipe that does not end within 10 s.
pub(crate) fn read_any(file: &Path, most: u64) -> io::Result<Vec<u8>> {
    let mut source = open(file)?;
    let until = Instant::now() + MAX_WAIT;
    let mut bytes = vec![];
    let mut chunk = [0; 1 << 14];
    let mut has_ended = false;
    while (bytes.len() as u64) < most {
        match source.read(&mut chunk) {
            // A pipe without a writer has no bytes: before the first one the writer is still to come.
            Ok(0) if has_ended || !bytes.is_empty() || !is_pipe(&source)? => break,
            Ok(0) => {}
            Ok(count) => {
                bytes.extend_from_slice(&chunk[..count]);
                continue;
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) if error.kind() == ErrorKind::WouldBlock => {}
            Err(error) => return Err(error),
        }
        has_ended = wait_for_bytes(&source, until)?;
    }
    bytes.truncate(usize::try_from(most).unwrap_or(usize::MAX));
    Ok(bytes)
}

fn is_pipe(file: &File) -> io::Result<bool> {
    use std::os::unix::fs::FileTypeExt as _;
    Ok(file.metadata()?.file_type().is_fifo())
}

/// Waits until there is something to read. Returns whether all writers have gone.
fn wait_for_bytes(file: &File, until: Instant) -> io::Result<bool> {
    let left = until.saturating_duration_since(Instant::now());
    let timeout = Timespec { tv_sec: left.as_secs().cast_signed(), tv_nsec: i64::from(left.subsec_nanos()) };
    let mut files = [PollFd::new(file, PollFlags::IN)];
    match poll(&mut files, Some(&timeout)) {
        Ok(0) => Err(io::Error::other(format!("is a pipe that did not end within {} s", MAX_WAIT.as_secs()))),
        Ok(_) => Ok(files[0].revents().contains(PollFlags::HUP)),
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
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

#[cfg(test)]
mod tests {
    use std::fs;

    use rustix::fs::{CWD, FileType, Mode, mknodat};

    use super::*;

    #[test]
    fn only_a_file_is_read_and_nothing_waits_for_a_writer() {
        let folder = tempfile::tempdir().expect("a folder");
        let [file, pipe] = ["a.csv", "pipe"].map(|name| folder.path().join(name));
        fs::write(&file, "0,0\n").expect("a file");
        mknodat(CWD, &pipe, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe");
        assert_eq!(read(&file).expect("a file"), b"0,0\n");
        for other in [pipe.as_path(), folder.path(), Path::new("/dev/null")] {
            assert_eq!(read(other).expect_err("no file").to_string(), "cannot be read: is not a file", "{other:?}");
        }
    }
}

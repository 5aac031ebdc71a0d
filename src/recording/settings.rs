//! What a recorder is told: where to record, how large files may grow, how hard to compress.

use std::{ops::RangeInclusive, path::PathBuf};

use super::RecordError;

/// The smallest size at which files can be told to rotate: dozens of frames.
const MIN_ROTATE_BYTES: u64 = 1_000_000;
/// Parts into which a bounded recording is cut where no file size is given.
const FILES_IN_TOTAL: u64 = 4;
/// Uncompressed size at which a chunk is closed; a smaller file has smaller chunks.
const CHUNK_BYTES: u64 = 1 << 20;
/// A rotating file holds this many chunks at least, so it ends close to its limit.
const CHUNKS_IN_FILE: u64 = 16;
const COMPRESSION_LEVELS: RangeInclusive<u32> = 1..=19;

/// Where and how to record.
#[derive(Clone, Debug)]
pub struct RecorderSettings {
    /// The file to make; with rotation the first of several. It must not exist.
    pub file: PathBuf,
    /// Size at which a file is finished and the next one begun, 1 MB or more; `None`: one file, or a quarter of
    /// `max_total_bytes`.
    pub rotate_bytes: Option<u64>,
    /// Size that all files together stay under, the oldest being removed; at least `rotate_bytes`. `None`: no bound.
    pub max_total_bytes: Option<u64>,
    /// Unix time minus `CLOCK_MONOTONIC`, in nanoseconds, taken once at the start.
    pub unix_minus_monotonic_ns: i64,
    /// Zstandard level, 1 to 19.
    pub compression_level: u32,
}

impl RecorderSettings {
    /// The level that keeps up with 10 kHz on one core; higher ones save little on poses.
    pub const DEFAULT_COMPRESSION_LEVEL: u32 = 1;

    /// Records into one file, however large it grows.
    pub fn new(file: impl Into<PathBuf>, unix_minus_monotonic_ns: i64) -> Self {
        Self {
            file: file.into(),
            rotate_bytes: None,
            max_total_bytes: None,
            unix_minus_monotonic_ns,
            compression_level: Self::DEFAULT_COMPRESSION_LEVEL,
        }
    }

    /// Checks every value against its range.
    pub(super) fn limits(&self) -> Result<Limits, RecordError> {
        let file = self.rotate_bytes.or(self.max_total_bytes.map(|total| total / FILES_IN_TOTAL));
        let smallest_total = self.rotate_bytes.unwrap_or(FILES_IN_TOTAL * MIN_ROTATE_BYTES);
        check("rotate_bytes", self.rotate_bytes, MIN_ROTATE_BYTES..=u64::MAX)?;
        check("max_total_bytes", self.max_total_bytes, smallest_total..=u64::MAX)?;
        let levels = u64::from(*COMPRESSION_LEVELS.start())..=u64::from(*COMPRESSION_LEVELS.end());
        check("compression_level", Some(self.compression_level.into()), levels)?;
        let chunk = file.map_or(CHUNK_BYTES, |bytes| CHUNK_BYTES.min(bytes / CHUNKS_IN_FILE));
        Ok(Limits { file, total: self.max_total_bytes, chunk })
    }
}

fn check(name: &'static str, value: Option<u64>, allowed: RangeInclusive<u64>) -> Result<(), RecordError> {
    match value {
        Some(value) if !allowed.contains(&value) => Err(RecordError::OutOfRange { name, value, allowed }),
        _ => Ok(()),
    }
}

/// Sizes in bytes that agree with each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Size that a file stays under.
    pub(super) file: Option<u64>,
    /// Size that all files together stay under.
    pub(super) total: Option<u64>,
    /// Uncompressed size at which a chunk is closed.
    pub(super) chunk: u64,
}

#[cfg(test)]
mod tests {
    use super::*;

    fn error_of(rotate_bytes: Option<u64>, max_total_bytes: Option<u64>) -> String {
        let settings = RecorderSettings { rotate_bytes, max_total_bytes, ..RecorderSettings::new("a.mcap", 0) };
        settings.limits().expect_err("settings out of range").to_string()
    }

    #[test]
    fn an_error_names_the_setting_its_value_and_what_is_allowed() {
        assert_eq!(error_of(Some(5), None), "rotate_bytes is 5, allowed is 1000000 or more");
        assert_eq!(
            error_of(Some(8_000_000), Some(7_000_000)),
            "max_total_bytes is 7000000, allowed is 8000000 or more"
        );
        assert_eq!(error_of(None, Some(3_999_999)), "max_total_bytes is 3999999, allowed is 4000000 or more");
        let settings = RecorderSettings { compression_level: 0, ..RecorderSettings::new("a.mcap", 0) };
        let error = settings.limits().expect_err("settings out of range").to_string();
        assert_eq!(error, "compression_level is 0, allowed is 1 to 19");
    }

    #[test]
    fn a_bounded_recording_rotates_by_itself() {
        let settings = RecorderSettings { max_total_bytes: Some(8_000_000), ..RecorderSettings::new("a.mcap", 0) };
        assert_eq!(settings.limits().expect("valid settings").file, Some(2_000_000));
    }
}

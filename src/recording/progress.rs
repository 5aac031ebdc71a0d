//! Progress of a recording, and a forecast of when its disk will be full.
//!
//! At 1 kHz the paper's dragon produces about 43 GB per hour before compression. The forecast uses the growth rate of the file,
//! and warns while there is still time to act.

use std::{fmt, fs::File, io, path::PathBuf, time::Duration};

use crossbeam::atomic::AtomicCell;

use super::{
    rotation::FileNames,
    topics::{MessageCounts, Topic},
};

/// Time to a full disk below which the recorder warns.
const WARN_BEFORE_FULL_S: f64 = 600.0;
/// Free part of the disk below which the recorder warns.
const WARN_BELOW_FREE_PART: f64 = 0.05;
/// Averaging span: the rate is the mean over the last one to two spans.
const RATE_SPAN: Duration = Duration::from_secs(10);
/// Least recording time for a rate: the start-up phase is not typical.
const FIRST_RATE_AFTER: Duration = Duration::from_secs(1);

/// Progress of a recording. Counts only data handed to the operating system, which survives the end of the process.
#[derive(Clone, Debug, PartialEq)]
pub struct RecorderProgress {
    /// Frames in the files.
    pub frames: u64,
    /// Alerts in the files.
    pub alerts: u64,
    /// Bytes written, including removed files.
    pub bytes_written: u64,
    /// Files begun, including removed files.
    pub files: u64,
    /// The file that is being written.
    pub file: PathBuf,
    /// Seconds until the disk is full at the present rate. `None` if there is no forecast, or the disk will not be full.
    pub seconds_until_full: Option<f64>,
    /// Warning to make room on the disk.
    pub warning: Option<SpaceWarning>,
}

/// Totals of an ended recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingSummary {
    /// Frames recorded, including removed files.
    pub frames: u64,
    /// Alerts recorded, including removed files.
    pub alerts: u64,
    /// Command events recorded, including removed files.
    pub commands: u64,
    /// Bytes written, including removed files.
    pub bytes: u64,
    /// Existing files, the oldest first.
    pub files: Vec<PathBuf>,
}

/// Progress that the writing thread stores and other threads load.
#[derive(Debug)]
pub(super) struct SharedProgress {
    names: FileNames,
    pub(super) totals: AtomicCell<Totals>,
    pub(super) forecast: AtomicCell<Option<SpaceForecast>>,
}

/// Totals of several files.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Totals {
    pub(super) files: u64,
    pub(super) bytes: u64,
    pub(super) counts: MessageCounts,
}

impl SharedProgress {
    pub(super) fn new(names: FileNames) -> Self {
        let totals = Totals { files: 1, ..Totals::default() };
        Self { names, totals: AtomicCell::new(totals), forecast: AtomicCell::new(None) }
    }

    pub(super) fn load(&self) -> RecorderProgress {
        let Totals { files, bytes: bytes_written, counts } = self.totals.load();
        let forecast = self.forecast.load();
        RecorderProgress {
            frames: counts.of(Topic::Frames),
            alerts: counts.of(Topic::Alerts),
            bytes_written,
            files,
            file: self.names.path(files),
            seconds_until_full: forecast.and_then(|forecast| forecast.seconds_until_full),
            warning: forecast.and_then(|forecast| forecast.warning()),
        }
    }
}

/// Free and total bytes of a file system for an unprivileged process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DiskSpace {
    /// Free bytes.
    pub free_bytes: u64,
    /// Size of the file system.
    pub total_bytes: u64,
}

impl DiskSpace {
    /// Space of the file system that contains an open file.
    ///
    /// # Errors
    /// The error of `fstatvfs`.
    pub fn around(file: &File) -> io::Result<Self> {
        let system = rustix::fs::fstatvfs(file)?;
        Ok(Self { free_bytes: system.f_bavail * system.f_frsize, total_bytes: system.f_blocks * system.f_frsize })
    }
}

/// Forecast of when the disk will be full.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SpaceForecast {
    /// Space at the time of the forecast.
    pub(super) space: DiskSpace,
    /// Seconds until the disk is full at the present rate. `None` if the recording does not grow, or has no rate yet.
    pub(super) seconds_until_full: Option<f64>,
}

impl SpaceForecast {
    /// Warning for the operator, if one is due.
    pub(super) fn warning(&self) -> Option<SpaceWarning> {
        let DiskSpace { free_bytes, total_bytes } = self.space;
        match self.seconds_until_full {
            Some(seconds) if seconds < WARN_BEFORE_FULL_S => Some(SpaceWarning::FullSoon { seconds, free_bytes }),
            _ if (free_bytes as f64) < WARN_BELOW_FREE_PART * total_bytes as f64 => {
                Some(SpaceWarning::NearlyFull { free_bytes, total_bytes })
            }
            _ => None,
        }
    }
}

/// Warning to make room on the disk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpaceWarning {
    /// At the present rate the disk will be full in less than ten minutes.
    FullSoon {
        /// Seconds until the disk is full.
        seconds: f64,
        /// Free bytes.
        free_bytes: u64,
    },
    /// Less than a twentieth of the disk is free.
    NearlyFull {
        /// Free bytes.
        free_bytes: u64,
        /// Size of the file system.
        total_bytes: u64,
    },
}

impl fmt::Display for SpaceWarning {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::FullSoon { seconds, free_bytes } => {
                write!(formatter, "the disk will be full in {seconds:.0} s: {} are free", Size(free_bytes))
            }
            Self::NearlyFull { free_bytes, total_bytes } => {
                write!(formatter, "the disk is nearly full: {} of {} are free", Size(free_bytes), Size(total_bytes))
            }
        }
    }
}

/// A number of bytes that prints with a unit: `12.3 MB`, `4.5 GB`.
#[derive(Clone, Copy, Debug)]
pub struct Size(pub u64);

impl fmt::Display for Size {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            bytes @ 1_000_000_000.. => write!(formatter, "{:.1} GB", bytes as f64 * 1e-9),
            bytes => write!(formatter, "{:.1} MB", bytes as f64 * 1e-6),
        }
    }
}

/// Measures the growth rate of the recording, and forecasts when the disk will be full.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Growth {
    older: Measurement,
    newer: Measurement,
}

#[derive(Clone, Copy, Debug, Default)]
struct Measurement {
    at: Duration,
    written_bytes: u64,
}

impl Growth {
    /// Takes the bytes written until `elapsed` after the start, and returns a forecast.
    ///
    /// `growth_left_bytes` is the growth left until the recording removes its own oldest files. If the disk has room for it,
    /// the recording never fills the disk, and the result is `None`.
    pub(super) fn observe(
        &mut self,
        elapsed: Duration,
        written_bytes: u64,
        space: DiskSpace,
        growth_left_bytes: Option<u64>,
    ) -> Option<SpaceForecast> {
        if growth_left_bytes.is_some_and(|growth| growth < space.free_bytes) {
            return None;
        }
        let now = Measurement { at: elapsed, written_bytes };
        let seconds_until_full = self.bytes_per_s(now).map(|rate| space.free_bytes as f64 / rate);
        if now.at.saturating_sub(self.newer.at) >= RATE_SPAN {
            self.older = std::mem::replace(&mut self.newer, now);
        }
        Some(SpaceForecast { space, seconds_until_full })
    }

    fn bytes_per_s(&self, now: Measurement) -> Option<f64> {
        let span = now.at.saturating_sub(self.older.at);
        let grown_bytes = now.written_bytes - self.older.written_bytes;
        (span >= FIRST_RATE_AFTER && grown_bytes > 0).then(|| grown_bytes as f64 / span.as_secs_f64())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ROOMY: DiskSpace = DiskSpace { free_bytes: 500_000_000_000, total_bytes: 1_000_000_000_000 };

    fn after(seconds: u64) -> Duration {
        Duration::from_secs(seconds)
    }

    #[test]
    fn forecast_is_the_free_space_divided_by_the_rate() {
        let mut growth = Growth::default();
        let forecast = growth.observe(after(5), 50_000_000, ROOMY, None).expect("an unbounded recording");
        assert_eq!(forecast.seconds_until_full, Some(50_000.0));
        assert_eq!(forecast.warning(), None);
    }

    #[test]
    fn first_second_gives_no_rate() {
        let forecast = Growth::default().observe(Duration::from_millis(900), 9_000_000, ROOMY, None);
        assert_eq!(forecast.and_then(|forecast| forecast.seconds_until_full), None);
    }

    #[test]
    fn forecast_follows_a_slower_rate_within_two_spans() {
        let mut growth = Growth::default();
        let mut written_bytes = 0;
        let mut last = None;
        for second in 1..=60 {
            written_bytes += if second <= 30 { 10_000_000 } else { 1_000_000 };
            last = growth.observe(after(second), written_bytes, ROOMY, None);
        }
        assert_eq!(last.and_then(|forecast| forecast.seconds_until_full), Some(500_000.0));
    }

    #[test]
    fn disk_full_within_ten_minutes_gives_a_warning() {
        let mut growth = Growth::default();
        let forecast = growth.observe(after(2), 2_000_000_000, ROOMY, None).expect("an unbounded recording");
        assert_eq!(forecast.warning(), Some(SpaceWarning::FullSoon { seconds: 500.0, free_bytes: 500_000_000_000 }));
    }

    #[test]
    fn disk_with_little_room_gives_a_warning_at_any_rate() {
        let space = DiskSpace { free_bytes: 4_900_000_000, total_bytes: 100_000_000_000 };
        let forecast = Growth::default().observe(after(0), 0, space, None).expect("an unbounded recording");
        assert_eq!(
            forecast.warning().expect("a warning").to_string(),
            "the disk is nearly full: 4.9 GB of 100.0 GB are free"
        );
    }

    #[test]
    fn recording_that_removes_its_oldest_files_in_time_has_no_forecast() {
        let forecast = Growth::default().observe(after(2), 2_000_000_000, ROOMY, Some(1_000_000_000));
        assert_eq!(forecast, None);
    }
}

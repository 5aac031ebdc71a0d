//! How far a recording is, and how long its disk will last.
//!
//! At 1 kHz the paper's dragon makes about 39 GB an hour before compression, so the end of the disk is forecast from
//! the rate at which the file grows, and warned of while there is still time to act.

use std::{fmt, fs::File, io, path::PathBuf, time::Duration};

use crossbeam::atomic::AtomicCell;

use super::{
    rotation::FileNames,
    topics::{MessageCounts, Topic},
};

/// A disk that will be full sooner than this is warned of.
const WARN_BEFORE_FULL_S: f64 = 600.0;
/// A disk with less than this part of it free is warned of.
const WARN_BELOW_FREE_PART: f64 = 0.05;
/// The rate is the mean over the last one to two spans of this length.
const RATE_SPAN: Duration = Duration::from_secs(10);
/// A rate is given from here on; before, start-up would be taken for the rule.
const FIRST_RATE_AFTER: Duration = Duration::from_secs(1);

/// How far a recording is: what the operating system has, so what would survive the process.
#[derive(Clone, Debug, PartialEq)]
pub struct RecorderProgress {
    /// Frames that are in the files.
    pub frames: u64,
    /// Alerts that are in the files.
    pub alerts: u64,
    /// Bytes that have been written, those of removed files included.
    pub bytes_written: u64,
    /// Files that have been begun, removed ones included.
    pub files: u64,
    /// The file that is being written.
    pub file: PathBuf,
    /// Seconds until the disk is full at the present rate; `None` where that is not known, or will not happen.
    pub seconds_until_full: Option<f64>,
    /// A reason to make room on the disk.
    pub warning: Option<SpaceWarning>,
}

/// What a whole recording came to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RecordingSummary {
    /// Frames recorded, those in removed files included.
    pub frames: u64,
    /// Alerts recorded, those in removed files included.
    pub alerts: u64,
    /// Events of commands recorded, those in removed files included.
    pub commands: u64,
    /// Bytes written, those of removed files included.
    pub bytes: u64,
    /// The files that are there, the oldest first.
    pub files: Vec<PathBuf>,
}

/// What the writing thread stores of its progress, and any other thread loads.
#[derive(Debug)]
pub(super) struct SharedProgress {
    names: FileNames,
    pub(super) totals: AtomicCell<Totals>,
    pub(super) forecast: AtomicCell<Option<SpaceForecast>>,
}

/// What several files came to.
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

/// Free and total bytes of a file system, as an unprivileged process may use them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DiskSpace {
    /// Bytes that can still be written.
    pub free_bytes: u64,
    /// Size of the file system.
    pub total_bytes: u64,
}

impl DiskSpace {
    /// The space of the file system on which an open file lies.
    ///
    /// # Errors
    /// What `fstatvfs` reports.
    pub fn around(file: &File) -> io::Result<Self> {
        let system = rustix::fs::fstatvfs(file)?;
        Ok(Self { free_bytes: system.f_bavail * system.f_frsize, total_bytes: system.f_blocks * system.f_frsize })
    }
}

/// How long the disk will last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SpaceForecast {
    /// The space it was made from.
    pub(super) space: DiskSpace,
    /// Seconds until the disk is full at the present rate; `None` where nothing grows or the rate is not known yet.
    pub(super) seconds_until_full: Option<f64>,
}

impl SpaceForecast {
    /// What the operator should be told, if anything.
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

/// A reason to make room on the disk.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpaceWarning {
    /// At the present rate the disk is full in less than ten minutes.
    FullSoon {
        /// Seconds until then.
        seconds: f64,
        /// Bytes that can still be written.
        free_bytes: u64,
    },
    /// Less than a twentieth of the disk is free.
    NearlyFull {
        /// Bytes that can still be written.
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

/// A number of bytes as people read it: `12.3 MB`, `4.5 GB`.
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

/// The rate at which the recording grows, and by it when the disk will be full.
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
    /// Takes in how far the recording is, `elapsed` after its start.
    ///
    /// `growth_left_bytes` is by how much the recording can still grow before it removes its own oldest files; a
    /// recording that finds room for all of that never fills the disk.
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
    fn the_forecast_is_the_free_space_over_the_rate() {
        let mut growth = Growth::default();
        let forecast = growth.observe(after(5), 50_000_000, ROOMY, None).expect("an unbounded recording");
        assert_eq!(forecast.seconds_until_full, Some(50_000.0));
        assert_eq!(forecast.warning(), None);
    }

    #[test]
    fn the_first_second_gives_no_rate() {
        let forecast = Growth::default().observe(Duration::from_millis(900), 9_000_000, ROOMY, None);
        assert_eq!(forecast.and_then(|forecast| forecast.seconds_until_full), None);
    }

    #[test]
    fn a_slower_rate_is_noticed_within_two_spans() {
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
    fn a_disk_that_will_be_full_within_ten_minutes_is_warned_of() {
        let mut growth = Growth::default();
        let forecast = growth.observe(after(2), 2_000_000_000, ROOMY, None).expect("an unbounded recording");
        assert_eq!(forecast.warning(), Some(SpaceWarning::FullSoon { seconds: 500.0, free_bytes: 500_000_000_000 }));
    }

    #[test]
    fn a_disk_with_little_room_is_warned_of_at_any_rate() {
        let space = DiskSpace { free_bytes: 4_900_000_000, total_bytes: 100_000_000_000 };
        let forecast = Growth::default().observe(after(0), 0, space, None).expect("an unbounded recording");
        assert_eq!(
            forecast.warning().expect("a warning").to_string(),
            "the disk is nearly full: 4.9 GB of 100.0 GB are free"
        );
    }

    #[test]
    fn a_recording_that_removes_its_oldest_files_in_time_never_fills_the_disk() {
        let forecast = Growth::default().observe(after(2), 2_000_000_000, ROOMY, Some(1_000_000_000));
        assert_eq!(forecast, None);
    }
}

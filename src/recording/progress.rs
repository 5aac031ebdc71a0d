//! Progress of a recording, and a forecast of when its disk will be full.
//!
//! The forecast uses the growth rate of the file ([`Growth`](super::growth::Growth)), and warns while there is still time to act.

use std::{fmt, fs::File, io, path::PathBuf};

use crossbeam::atomic::AtomicCell;

use super::{
    rotation::FileNames,
    topics::{MessageCounts, Topic},
};

/// Time to a full disk below which the recorder warns.
const WARN_BEFORE_FULL_S: f64 = 600.0;
/// Free part of the disk below which the recorder warns.
const WARN_BELOW_FREE_PART: f64 = 0.05;

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
    /// Growth of the recording of a walking dragon, in bytes per second; 0 if it is unknown.
    pub(super) walking_bytes_per_s: AtomicCell<f64>,
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
        let (totals, forecast) = (AtomicCell::new(totals), AtomicCell::new(None));
        Self { names, totals, forecast, walking_bytes_per_s: AtomicCell::new(0.0) }
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

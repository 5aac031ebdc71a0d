//! How far a recording is, told by the writing thread and read by any other without waiting.

use std::{
    path::PathBuf,
    sync::atomic::{AtomicU64, Ordering::Relaxed},
};

use super::{
    open_file::Counts,
    rotation::FileNames,
    space::{DiskSpace, Outlook, SpaceWarning},
};

/// How far a recording is: what the operating system has, so what would survive the process.
#[derive(Clone, Debug, PartialEq)]
pub struct Progress {
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
pub struct Summary {
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

/// Numbers that the writing thread stores one by one; a reader may see a few of them a chunk apart.
#[derive(Debug)]
pub(super) struct SharedProgress {
    names: FileNames,
    frames: AtomicU64,
    alerts: AtomicU64,
    bytes_written: AtomicU64,
    files: AtomicU64,
    free_bytes: AtomicU64,
    total_bytes: AtomicU64,
    seconds_until_full: AtomicU64,
}

impl SharedProgress {
    pub(super) fn new(names: FileNames) -> Self {
        Self {
            names,
            frames: AtomicU64::new(0),
            alerts: AtomicU64::new(0),
            bytes_written: AtomicU64::new(0),
            files: AtomicU64::new(1),
            free_bytes: AtomicU64::new(0),
            total_bytes: AtomicU64::new(0),
            seconds_until_full: AtomicU64::new(f64::NAN.to_bits()),
        }
    }

    pub(super) fn store(&self, counts: Counts, bytes_written: u64, files: u64) {
        self.frames.store(counts.frames, Relaxed);
        self.alerts.store(counts.alerts, Relaxed);
        self.bytes_written.store(bytes_written, Relaxed);
        self.files.store(files, Relaxed);
    }

    pub(super) fn store_outlook(&self, outlook: Option<Outlook>) {
        let space = outlook.map_or(DiskSpace { free_bytes: 0, total_bytes: 0 }, |outlook| outlook.space);
        let seconds = outlook.and_then(|outlook| outlook.seconds_until_full).unwrap_or(f64::NAN);
        self.free_bytes.store(space.free_bytes, Relaxed);
        self.total_bytes.store(space.total_bytes, Relaxed);
        self.seconds_until_full.store(seconds.to_bits(), Relaxed);
    }

    pub(super) fn load(&self) -> Progress {
        let files = self.files.load(Relaxed);
        let seconds = f64::from_bits(self.seconds_until_full.load(Relaxed));
        let space =
            DiskSpace { free_bytes: self.free_bytes.load(Relaxed), total_bytes: self.total_bytes.load(Relaxed) };
        let outlook = Outlook { space, seconds_until_full: (!seconds.is_nan()).then_some(seconds) };
        Progress {
            frames: self.frames.load(Relaxed),
            alerts: self.alerts.load(Relaxed),
            bytes_written: self.bytes_written.load(Relaxed),
            files,
            file: self.names.path(files),
            seconds_until_full: outlook.seconds_until_full,
            warning: outlook.warning(),
        }
    }
}

//! Finishes, in place, a recording whose recorder was killed.
//!
//! [`repair()`] surveys the file by the heads of its records and cuts off an incomplete record at its end. Then it appends the
//! ending of a finished file: the end of the data, the summary with the indexes, the footer. It reads the contents of the first
//! and the last chunk only, and needs about 130 bytes of disk per chunk. [`repair_checked`](super::repair_checked) reads
//! everything.
//!
//! **A repair that is killed or fails** can be repeated, and loses nothing:
//! 1. Repair never overwrites bytes of the data. It cuts or writes only after the last whole chunk or configuration.
//! 2. The cut bytes contain nothing that a reader could use: an incomplete record, message indexes of a chunk that stays, or
//!    the summary of an earlier repair. Repair makes all of them again from the data, except the incomplete record.
//! 3. Repair writes the magic bytes that end a finished file last, after all other bytes are on the disk. Until then the next
//!    survey finds the same data and the beginning of a summary, and cuts that off.
//! 4. Repair reserves the disk space before it cuts anything. So a full disk leaves the file unchanged.
//!
//! A power cut may reorder earlier writes. By (3), no file has the final bytes without its data and its summary. The recorder ends
//! its own files in the same order ([`FileSync`](super::disk_sync::FileSync)).

use std::{
    io::{self, BufReader},
    path::{Path, PathBuf},
    sync::Arc,
};

use mcap::{
    MAGIC,
    records::{Header, Record},
};

use super::{
    disk::{FileReader, RecordingDisk, RecordingFile, SystemDisk},
    error::is_disk_full,
    progress::{DiskSpace, Size},
    records::Records,
    summary::Contents,
    survey::{Survey, SurveyError, survey},
    topics::LIBRARY_FAMILY,
};

/// Result of a repair.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repair {
    /// The recording.
    pub path: PathBuf,
    /// Number of frames in the recording after the repair. Without a check, the indexes give this number.
    pub frames: u64,
    /// Whether repair has written the file. It does not change a finished recording without damage.
    pub was_unfinished: bool,
    /// Bytes of the damaged chunks that a check skipped.
    pub skipped_bytes: u64,
    /// Path of the old file, if a check found damage in it.
    pub kept: Option<PathBuf>,
}

/// Reason why a recording cannot be repaired. The recording is unchanged, unless the variant states otherwise.
#[derive(Debug, thiserror::Error)]
pub enum RepairError {
    /// The file or folder cannot be read.
    #[error("cannot read {}", .0.display())]
    Read(PathBuf, #[source] io::Error),
    /// The file is not a recording of a bench dragon.
    #[error("{} is not a recording of a bench dragon", .0.display())]
    Foreign(PathBuf),
    /// A recorder or another repair has locked the file.
    #[error("{} is being recorded or repaired by another process", .0.display())]
    InUse(PathBuf),
    /// The file is damaged. More data may follow the damage, so nothing may be cut off.
    #[error(
        "{} is damaged at byte {at_byte}: `record --repair --check` copies all readable parts, and needs free disk space of \
         the size of the file",
        path.display()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Byte at which the damaged record begins.
        at_byte: u64,
    },
    /// The disk has no room for the index.
    #[error("the disk is full ({} free): the index of {} needs {needed_bytes} bytes", Size(*free_bytes), path.display())]
    DiskFull {
        /// The file.
        path: PathBuf,
        /// Bytes that the index needs.
        needed_bytes: u64,
        /// Bytes that an unprivileged process could still write.
        free_bytes: u64,
    },
    /// The file, or the copy that replaces it, cannot be written. After a failed repair in place the whole records are still
    /// there, and the next repair finishes the file.
    #[error("cannot write {}", .0.display())]
    Write(PathBuf, #[source] io::Error),
}

/// Finishes a recording in place: adds an index of all whole chunks, so that any reader opens the file.
///
/// The time grows with the number of chunks. A second repair finds a finished file and does nothing. Repair does not find
/// damage inside a chunk; readers skip such a chunk. [`repair_checked`](super::repair_checked) finds it.
///
/// # Errors
/// See [`RepairError`].
pub fn repair(path: &Path) -> Result<Repair, RepairError> {
    repair_on(&SystemDisk, path)
}

/// As [`repair()`], on this disk.
///
/// # Errors
/// See [`RepairError`].
pub fn repair_on(disk: &dyn RecordingDisk, path: &Path) -> Result<Repair, RepairError> {
    let finished =
        |frames, was_unfinished| Repair { path: path.into(), frames, was_unfinished, skipped_bytes: 0, kept: None };
    let file = open_ours(disk, path)?;
    if let Some(frames) = frames_of_finished(&*file, path)? {
        return Ok(finished(frames, false));
    }
    drop(file);
    let file = disk.open(path, true);
    let file = Locked::take(file.map_err(|source| RepairError::Write(path.into(), source))?, path)?;
    // Another repair may have finished the file before this lock.
    if let Some(frames) = frames_of_finished(&*file.0, path)? {
        return Ok(finished(frames, false));
    }
    let survey = survey(&*file.0).map_err(|error| match error {
        SurveyError::Io(source) => RepairError::Read(path.into(), source),
        SurveyError::Damaged(at_byte) => RepairError::Damaged { path: path.into(), at_byte },
    })?;
    let frames = survey.contents.frames().unwrap_or(0);
    finish_in_place(&*file.0, path, survey)?;
    Ok(finished(frames, true))
}

pub(super) fn open_ours(disk: &dyn RecordingDisk, path: &Path) -> Result<Arc<dyn RecordingFile>, RepairError> {
    let failed = |source| RepairError::Read(path.into(), source);
    let foreign = || RepairError::Foreign(path.into());
    // Opening a named pipe would wait for a writer.
    if !disk.is_file(path).map_err(failed)? {
        return Err(foreign());
    }
    let file = disk.open(path, false).map_err(failed)?;
    let begin = Records::new(BufReader::new(FileReader::new(&*file, 0))).next();
    match begin.map_err(failed)? {
        Some(Record::Header(Header { library, .. })) if library.starts_with(LIBRARY_FAMILY) => Ok(file),
        _ => Err(foreign()),
    }
}

/// Number of frames of a finished recording; `None` if it is unfinished.
fn frames_of_finished(file: &dyn RecordingFile, path: &Path) -> Result<Option<u64>, RepairError> {
    let contents = Contents::of_finished(file).map_err(|source| RepairError::Read(path.into(), source))?;
    Ok(contents.and_then(|contents| contents.frames()))
}

/// A file that a recorder or a repair has locked against the others. It is unlocked when this value is dropped.
#[derive(Debug)]
pub(super) struct Locked(pub(super) Arc<dyn RecordingFile>);

impl Locked {
    pub(super) fn take(file: Arc<dyn RecordingFile>, path: &Path) -> Result<Self, RepairError> {
        match file.lock() {
            Ok(true) => Ok(Self(file)),
            Ok(false) => Err(RepairError::InUse(path.into())),
            Err(source) => Err(RepairError::Read(path.into(), source)),
        }
    }
}

impl Drop for Locked {
    fn drop(&mut self) {
        // A child process that is just starting may share the file. Closing alone would then leave the file locked.
        self.0.unlock();
    }
}

fn finish_in_place(
    file: &dyn RecordingFile,
    path: &Path,
    Survey { end, last_indexes, contents }: Survey,
) -> Result<(), RepairError> {
    let ending = contents.into_ending(end, &last_indexes);
    let failed = |source: io::Error| match file.space() {
        Ok(DiskSpace { free_bytes, .. }) if is_disk_full(&source) => {
            RepairError::DiskFull { path: path.into(), needed_bytes: ending.len() as u64, free_bytes }
        }
        _ => RepairError::Write(path.into(), source),
    };
    let there = bytes_there(file, end, &ending).map_err(failed)?;
    match file.reserve(end, ending.len() as u64) {
        Err(full) if is_disk_full(&full) => {
            let error = failed(full);
            // Releases the reserved part. The file is unchanged, even if this fails.
            let _ = file.length().and_then(|bytes| file.set_length(bytes));
            return Err(error);
        }
        // The file system has no reservation: a full disk shows in `append`.
        _ => {}
    }
    append(file, end + there, &ending[there as usize..]).map_err(|error| {
        // Keeps the whole records. If this fails, the next repair cuts off the part of the ending.
        let _ = file.set_length(end + there);
        failed(error)
    })
}

/// Number of bytes of the ending that the file already contains: message indexes, or bytes from an earlier repair.
fn bytes_there(file: &dyn RecordingFile, end: u64, ending: &[u8]) -> io::Result<u64> {
    let mut there = 0;
    let mut block = [0; 1 << 14];
    loop {
        let read = file.read_at(&mut block, end + there as u64)?;
        let same = block[..read].iter().zip(&ending[there..]).take_while(|(old, new)| old == new).count();
        there += same;
        if same == 0 || same < read {
            // `append` always writes the magic bytes, so that only `append` finishes a file.
            return Ok(there.min(ending.len() - MAGIC.len()) as u64);
        }
    }
}

/// Writes the last bytes of a file at `begin`, and cuts off the old bytes there. Writes the magic bytes after all others are on
/// the disk.
fn append(file: &dyn RecordingFile, begin: u64, bytes: &[u8]) -> io::Result<()> {
    let (but_magic, magic) = bytes.split_at(bytes.len() - MAGIC.len());
    let magic_begin = begin + but_magic.len() as u64;
    if file.length()? > begin {
        file.set_length(begin)?;
    }
    file.write_all_at(but_magic, begin)?;
    file.sync()?;
    file.write_all_at(magic, magic_begin)?;
    // Releases the space that the recorder had reserved.
    file.set_length(magic_begin + magic.len() as u64)?;
    file.sync()
}

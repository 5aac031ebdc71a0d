//! Finishing a recording whose recorder was killed, in place.
//!
//! [`repair()`] surveys the file by the heads of its records, cuts off an incomplete record at its end, and appends what a
//! finished file has: the end of the data, the summary with the indexes, the footer. It reads no chunk's contents but those
//! of the first and the last one, and needs about 130 bytes of disk a chunk. [`repair_checked`](super::repair_checked) reads
//! everything.
//!
//! **A repair that is killed or fails** can be repeated, and loses nothing:
//! 1. Bytes of the data are never written again. Only what is behind the last whole chunk or description is cut or written.
//! 2. What is cut holds nothing that a reader could use: a record whose end is missing, message indexes of a chunk that
//!    stays, or the summary of an earlier repair. All of it but the record is made again from the data.
//! 3. The magic bytes that end a finished file are written last, when everything before them is on the disk. Until then the
//!    next survey finds the same data and the beginning of a summary, and cuts that off.
//! 4. The room on the disk is taken before anything is cut, so a full disk leaves the file as it was.
//!
//! A power cut may reorder what was written before it reached the disk; by (3) no file has the final bytes without its data
//! and its summary.

use std::{
    fs::{self, File},
    io,
    os::unix::fs::FileExt as _,
    path::{Path, PathBuf},
};

use mcap::{
    MAGIC,
    records::{Header, Record},
};
use rustix::fs::{FallocateFlags, fallocate};

use super::{
    error::is_disk_full,
    progress::{DiskSpace, Size},
    records::Records,
    summary::Contents,
    survey::{Survey, SurveyError, survey},
    topics::LIBRARY_FAMILY,
};

/// What repair found and did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repair {
    /// The recording.
    pub path: PathBuf,
    /// Frames that are in it now; without a check, as its indexes count them.
    pub frames: u64,
    /// Whether the file was written; a finished recording without damage is not touched.
    pub was_unfinished: bool,
    /// Bytes of the damaged chunks that a check passed over.
    pub skipped_bytes: u64,
    /// Where the old file is kept, if a check found damage in it.
    pub kept: Option<PathBuf>,
}

/// Why a recording could not be repaired; but where stated, it is as it was.
#[derive(Debug, thiserror::Error)]
pub enum RepairError {
    /// The file or folder could not be read.
    #[error("cannot read {}", .0.display())]
    Read(PathBuf, #[source] io::Error),
    /// The file is not a recording of a bench dragon.
    #[error("{} is not a recording of a bench dragon", .0.display())]
    Foreign(PathBuf),
    /// A recorder or another repair is at work on the file.
    #[error("{} is being recorded or repaired by another process", .0.display())]
    InUse(PathBuf),
    /// There is damage, and perhaps more data behind it, so that nothing may be cut off.
    #[error(
        "{} is damaged at byte {at_byte}: `record --repair --check` saves what can be read, and needs as much free disk as \
         the file is large",
        path.display()
    )]
    Damaged {
        /// The file.
        path: PathBuf,
        /// Where the damaged record begins.
        at_byte: u64,
    },
    /// The disk has no room for the index.
    #[error("the disk is full ({} free): {} needs {needed_bytes} bytes more to be finished", Size(*free_bytes), path.display())]
    DiskFull {
        /// The file.
        path: PathBuf,
        /// Bytes that its index takes.
        needed_bytes: u64,
        /// Bytes that an unprivileged process could still write.
        free_bytes: u64,
    },
    /// The file could not be written, or the copy that was to take its place. In place, its whole records are still there,
    /// and the next repair finishes it.
    #[error("cannot write {}", .0.display())]
    Write(PathBuf, #[source] io::Error),
}

/// Finishes a recording in place: an index for all whole chunks, so that any reader opens it.
///
/// The time grows with the number of chunks. A second repair finds a finished file and does nothing. Damage inside a chunk
/// is not found, and costs readers that chunk; [`repair_checked`](super::repair_checked) finds it.
///
/// # Errors
/// See [`RepairError`].
pub fn repair(path: &Path) -> Result<Repair, RepairError> {
    let finished =
        |frames, was_unfinished| Repair { path: path.into(), frames, was_unfinished, skipped_bytes: 0, kept: None };
    let file = open_ours(path)?;
    if let Some(frames) = frames_of_finished(&file, path)? {
        return Ok(finished(frames, false));
    }
    drop(file);
    let file = File::options().read(true).write(true).open(path);
    let file = Locked::take(file.map_err(|source| RepairError::Write(path.into(), source))?, path)?;
    // Another repair may have been at work until now.
    if let Some(frames) = frames_of_finished(&file.0, path)? {
        return Ok(finished(frames, false));
    }
    let survey = survey(&file.0).map_err(|error| match error {
        SurveyError::Io(source) => RepairError::Read(path.into(), source),
        SurveyError::Damaged(at_byte) => RepairError::Damaged { path: path.into(), at_byte },
    })?;
    let frames = survey.contents.frames().unwrap_or(0);
    finish_in_place(&file.0, path, survey)?;
    Ok(finished(frames, true))
}

pub(super) fn open_ours(path: &Path) -> Result<File, RepairError> {
    let failed = |source| RepairError::Read(path.into(), source);
    let foreign = || RepairError::Foreign(path.into());
    // Opening a pipe would wait for somebody who writes into it.
    if !fs::metadata(path).map_err(failed)?.is_file() {
        return Err(foreign());
    }
    let file = File::open(path).map_err(failed)?;
    match Records::new(&file).next().map_err(failed)? {
        Some(Record::Header(Header { library, .. })) if library.starts_with(LIBRARY_FAMILY) => Ok(file),
        _ => Err(foreign()),
    }
}

/// The frames of a finished recording; `None` where it is unfinished.
fn frames_of_finished(file: &File, path: &Path) -> Result<Option<u64>, RepairError> {
    let contents = Contents::of_finished(file).map_err(|source| RepairError::Read(path.into(), source))?;
    Ok(contents.and_then(|contents| contents.frames()))
}

/// A file that no other repair and no recorder is at work on.
pub(super) struct Locked(pub(super) File);

impl Locked {
    pub(super) fn take(file: File, path: &Path) -> Result<Self, RepairError> {
        match file.try_lock() {
            Ok(()) => Ok(Self(file)),
            Err(fs::TryLockError::WouldBlock) => Err(RepairError::InUse(path.into())),
            Err(fs::TryLockError::Error(source)) => Err(RepairError::Read(path.into(), source)),
        }
    }
}

impl Drop for Locked {
    fn drop(&mut self) {
        // Closing alone would leave it locked where a child that is just being started has the file too.
        let _ = self.0.unlock();
    }
}

fn finish_in_place(
    file: &File,
    path: &Path,
    Survey { end, last_indexes, contents }: Survey,
) -> Result<(), RepairError> {
    let ending = contents.into_ending(end, &last_indexes);
    let failed = |source: io::Error| match DiskSpace::around(file) {
        Ok(DiskSpace { free_bytes, .. }) if is_disk_full(&source) => {
            RepairError::DiskFull { path: path.into(), needed_bytes: ending.len() as u64, free_bytes }
        }
        _ => RepairError::Write(path.into(), source),
    };
    let there = bytes_there(file, end, &ending).map_err(failed)?;
    match fallocate(file, FallocateFlags::KEEP_SIZE, end, ending.len() as u64) {
        Err(full) if is_disk_full(&full.into()) => {
            let error = failed(full.into());
            // Gives back what was found of room. The file is as it was, whether this succeeds or not.
            let _ = file.metadata().and_then(|metadata| file.set_len(metadata.len()));
            return Err(error);
        }
        // A file system that reserves nothing: its full disk shows below.
        _ => {}
    }
    append(file, end + there, &ending[there as usize..]).map_err(|error| {
        // What is whole stays; a part of the ending would be cut off by the next repair just as well.
        let _ = file.set_len(end + there);
        failed(error)
    })
}

/// How many bytes of the ending are in the file already: message indexes, or what an earlier repair has written.
fn bytes_there(file: &File, end: u64, ending: &[u8]) -> io::Result<u64> {
    let mut there = 0;
    let mut block = [0; 1 << 14];
    loop {
        let read = file.read_at(&mut block, end + there as u64)?;
        let same = block[..read].iter().zip(&ending[there..]).take_while(|(old, new)| old == new).count();
        there += same;
        if same == 0 || same < read {
            // The last byte is written in any case, so that a file is finished by `append` alone.
            return Ok(there.min(ending.len() - MAGIC.len()) as u64);
        }
    }
}

/// Puts the last bytes of a file at `begin`, and cuts off whatever else is there. Only when all but the magic bytes are on
/// the disk, those are written.
fn append(file: &File, begin: u64, bytes: &[u8]) -> io::Result<()> {
    let (but_magic, magic) = bytes.split_at(bytes.len() - MAGIC.len());
    let magic_begin = begin + but_magic.len() as u64;
    if file.metadata()?.len() > begin {
        file.set_len(begin)?;
    }
    file.write_all_at(but_magic, begin)?;
    file.sync_data()?;
    file.write_all_at(magic, magic_begin)?;
    // Gives back the room that the recorder had reserved for more.
    file.set_len(magic_begin + magic.len() as u64)?;
    file.sync_data()
}

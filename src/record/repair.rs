//! Finishing a recording whose recorder was killed.
//!
//! Everything that is whole is copied into a new file beside it, with an index and a summary; when that file is on the
//! disk, it takes the place of the old one in one step. Whatever fails before, the old file stays as it was; and one with
//! damage inside, so that there may be more to save than this does, is kept beside it.

use std::{
    collections::HashSet,
    fs::{self, File},
    io::{self, BufReader, BufWriter, Seek},
    path::{Path, PathBuf},
};

use mcap::{
    McapError, McapResult, Writer,
    records::{Header, Record},
    write::NoSeek,
};
use rustix::fs::{FlockOperation, flock};

use super::{
    recording::write_options,
    records::{Ending, Records},
    schema,
    settings::RecorderSettings,
    summary::frames_of_finished,
};
use crate::nameless_file::folder_of;

/// What the name of the copy adds to that of the recording; a copy left by a killed repair is overwritten by the next.
const COPY_SUFFIX: &str = ".repairing";
/// What the name of an old file adds that is kept.
const DAMAGED_SUFFIX: &str = ".damaged";
const CHUNK_BYTES: u64 = 1 << 20;
const BUFFER_BYTES: usize = 1 << 20;

/// What repair found and did.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Repair {
    /// The recording.
    pub path: PathBuf,
    /// Frames that are in it now.
    pub frames: u64,
    /// Whether it was unfinished; a finished recording is not touched.
    pub was_unfinished: bool,
    /// Bytes of the damaged chunks that were passed over.
    pub skipped_bytes: u64,
    /// Where the old file is kept, if there was damage inside it.
    pub kept: Option<PathBuf>,
}

/// Why a recording could not be repaired; it is as it was.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RepairError {
    /// The file or folder could not be read.
    #[error("cannot read {}", path.display())]
    Read {
        /// The file or folder.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The file is not a recording of a bench dragon.
    #[error("{} is not a recording of a bench dragon", path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
    },
    /// A recorder or another repair is at work on the file.
    #[error("{} is being recorded or repaired by another process", path.display())]
    InUse {
        /// The file.
        path: PathBuf,
    },
    /// The repaired file could not be written beside the old one.
    #[error("cannot write {}", path.display())]
    Write {
        /// The new file, which is removed again.
        path: PathBuf,
        /// Why not.
        source: McapError,
    },
}

/// Finishes a recording: all whole chunks, with an index, so that any reader opens it.
///
/// A second repair finds a finished file and does nothing. Reads and writes as it goes; needs as much free disk as the
/// recording is large.
///
/// # Errors
/// See [`RepairError`]; the recording is then as it was.
pub fn repair(path: &Path) -> Result<Repair, RepairError> {
    repair_with_progress(path, |_| ())
}

/// As [`repair()`]; `progress` hears how many bytes of the old file are done, after each of its chunks.
///
/// # Errors
/// As [`repair()`].
pub fn repair_with_progress(path: &Path, progress: impl FnMut(u64)) -> Result<Repair, RepairError> {
    let read_error = |source| RepairError::Read { path: path.into(), source };
    let mut file = File::open(path).map_err(read_error)?;
    if !is_ours(&file).map_err(read_error)? {
        return Err(RepairError::Foreign { path: path.into() });
    }
    match flock(&file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => {}
        Err(rustix::io::Errno::WOULDBLOCK) => return Err(RepairError::InUse { path: path.into() }),
        Err(error) => return Err(read_error(error.into())),
    }
    if let Some(frames) = frames_of_finished(&mut file).map_err(read_error)? {
        return Ok(Repair { path: path.into(), frames, was_unfinished: false, skipped_bytes: 0, kept: None });
    }
    file.rewind().map_err(read_error)?;
    // A link stays one: the file that it leads to is replaced.
    let target = path.canonicalize().map_err(read_error)?;
    let (Copied { frames, skipped_bytes, .. }, kept) = replace_by_finished_copy(file, &target, progress)?;
    Ok(Repair { path: path.into(), frames, was_unfinished: true, skipped_bytes, kept })
}

/// Repairs all unfinished recordings of ours in a folder, and tells of each; finished ones, those that another process has
/// open, being recorded or copied, and all other files are passed over.
///
/// # Errors
/// [`RepairError::Read`] where the folder cannot be listed. A recording that cannot be repaired is one entry of the list
/// and keeps none of the others from being repaired.
pub fn repair_folder(folder: &Path) -> Result<Vec<Result<Repair, RepairError>>, RepairError> {
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<io::Result<Vec<_>>>);
    let entries = entries.map_err(|source| RepairError::Read { path: folder.into(), source })?;
    let is_candidate = |path: &PathBuf| {
        path.is_file() && ![COPY_SUFFIX, DAMAGED_SUFFIX].iter().any(|suffix| path.to_string_lossy().ends_with(suffix))
    };
    let mut candidates: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).filter(is_candidate).collect();
    candidates.sort();
    let open_files = open_files();
    candidates.retain(|path| path.canonicalize().is_ok_and(|path| !open_files.contains(&path)));
    Ok(candidates.iter().map(|path| repair(path)).filter(is_news).collect())
}

/// The files that other processes have open, as far as this user may know: one that is being copied here is unfinished
/// too, and not for us to finish.
fn open_files() -> HashSet<PathBuf> {
    let processes = fs::read_dir("/proc").into_iter().flatten().flatten();
    let others = processes.filter(|process| process.file_name() != *std::process::id().to_string());
    let files = others.flat_map(|process| fs::read_dir(process.path().join("fd")).into_iter().flatten().flatten());
    files.filter_map(|file| fs::read_link(file.path()).ok()).collect()
}

fn is_news(repair: &Result<Repair, RepairError>) -> bool {
    match repair {
        Ok(repair) => repair.was_unfinished,
        // Most files in a folder are not for us to read.
        Err(RepairError::Foreign { .. } | RepairError::InUse { .. } | RepairError::Read { .. }) => false,
        Err(RepairError::Write { .. }) => true,
    }
}

fn is_ours(file: &File) -> io::Result<bool> {
    let header = Records::new(file).next()?;
    Ok(matches!(header, Some(Record::Header(Header { library, .. })) if library.starts_with(schema::LIBRARY_FAMILY)))
}

fn frames_in(summary: &mcap::Summary) -> u64 {
    let count = |id: &u16| summary.stats.as_ref().and_then(|stats| stats.channel_message_counts.get(id)).copied();
    summary.channels.iter().filter(|(_, channel)| channel.topic == schema::FRAMES).filter_map(|(id, _)| count(id)).sum()
}

/// What was copied of a recording.
struct Copied {
    frames: u64,
    skipped_bytes: u64,
    is_damaged: bool,
}

/// Returns what was copied, and where the old file is kept.
fn replace_by_finished_copy(
    file: File,
    path: &Path,
    progress: impl FnMut(u64),
) -> Result<(Copied, Option<PathBuf>), RepairError> {
    let [copy, damaged] = [COPY_SUFFIX, DAMAGED_SUFFIX].map(|suffix| {
        let mut name = path.as_os_str().to_owned();
        name.push(suffix);
        PathBuf::from(name)
    });
    let replaced = write_finished_copy(file, &copy, progress).and_then(|copied| {
        let kept = copied.is_damaged.then_some(damaged);
        kept.as_ref().map_or(Ok(()), |damaged| fs::hard_link(path, damaged))?;
        fs::rename(&copy, path)?;
        File::open(folder_of(path))?.sync_all()?;
        Ok((copied, kept))
    });
    replaced.map_err(|source| {
        // The error that is on its way tells more than this one would; the next repair overwrites the copy.
        let _ = fs::remove_file(&copy);
        RepairError::Write { path: copy, source }
    })
}

fn write_finished_copy(damaged: File, copy: &Path, mut progress: impl FnMut(u64)) -> McapResult<Copied> {
    let file = File::create(copy)?;
    file.set_permissions(damaged.metadata()?.permissions())?;
    let sink = NoSeek::new(BufWriter::with_capacity(BUFFER_BYTES, file.try_clone()?));
    let options = write_options(RecorderSettings::DEFAULT_COMPRESSION_LEVEL).chunk_size(Some(CHUNK_BYTES));
    let mut writer = options.create(sink)?;
    let mut records = Records::new(BufReader::with_capacity(BUFFER_BYTES, damaged));
    let mut done_to = 0;
    while let Some(record) = records.next()? {
        copy_record(&mut writer, record)?;
        if records.position() > done_to {
            done_to = records.position();
            progress(done_to);
        }
    }
    let summary = writer.finish()?;
    file.sync_all()?;
    let skipped_bytes = records.skipped_bytes();
    let is_damaged = skipped_bytes > 0 || records.ending() == Some(Ending::Damaged);
    Ok(Copied { frames: frames_in(&summary), skipped_bytes, is_damaged })
}

fn copy_record<W: io::Write + Seek>(writer: &mut Writer<W>, record: Record<'_>) -> McapResult<()> {
    match record {
        Record::Schema { header, data } => {
            writer.add_schema_with_id(header.id, &header.name, &header.encoding, &data).map(drop)
        }
        Record::Channel(channel) => writer
            .add_channel_with_id(
                channel.id,
                channel.schema_id,
                &channel.topic,
                &channel.message_encoding,
                &channel.metadata,
            )
            .map(drop),
        Record::Message { header, data } => writer.write_to_known_channel(&header, &data),
        Record::Metadata(metadata) => writer.write_metadata(&metadata),
        // The writer makes its own header and indexes.
        _ => Ok(()),
    }
}

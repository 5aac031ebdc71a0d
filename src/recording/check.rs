//! Reads a whole recording to find damage, and saves the readable parts of a damaged one.
//!
//! The check copies all whole chunks into a new file beside the old one, with an index and a summary. When the new file is on
//! the disk, it replaces the old file in one step. The old file is kept under another name, because more of it may be
//! recoverable. If the check fails before that, the old file is unchanged.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io::{self, BufReader, BufWriter, Seek},
    path::{Path, PathBuf},
};

use mcap::{
    McapError, McapResult, Writer,
    records::{Channel, Header, Record},
    write::NoSeek,
};

use super::{
    disk::{FileReader, RecordingFile, SystemDisk},
    mcap_file::write_options,
    reader::Configuration,
    recorder::RecorderSettings,
    records::{Ending, Records},
    repair::{Locked, Repair, RepairError, open_ours, repair},
    summary::Contents,
    topics::{Channels, LIBRARY, Topic, channel_names},
};
use crate::system::whole_file::folder_of;

/// Extension of the copy, added to the name of the recording. A repair overwrites the copy of a killed repair.
pub(super) const COPY_EXTENSION: &str = "repairing";
/// Extension of a damaged file that is kept, added to its name.
pub(super) const DAMAGED_EXTENSION: &str = "damaged";
const CHUNK_BYTES: u64 = 1 << 20;
const BUFFER_BYTES: usize = 1 << 20;

/// Reads a whole recording, finished or not. If every chunk is undamaged, finishes it as [`repair()`] does. A damaged recording
/// is replaced by a finished copy of its undamaged chunks, and the old file is kept as `FILE.damaged`.
///
/// `progress` receives the number of bytes read, after each chunk. For a copy it starts again at the beginning of the file. A
/// copy needs as much free disk space as the size of the recording.
///
/// # Errors
/// See [`RepairError`]. Never returns [`RepairError::Damaged`].
pub fn repair_checked(path: &Path, mut progress: impl FnMut(u64)) -> Result<Repair, RepairError> {
    let file = Locked::take(open_ours(&SystemDisk, path)?, path)?;
    let sound = sound_frames(&*file.0, &mut progress);
    let sound = sound.map_err(|error| RepairError::Read(path.into(), io_error(error)))?;
    drop(file);
    if let Some(frames) = sound {
        match repair(path) {
            Ok(repaired) if repaired.frames != frames => {}
            Err(RepairError::Damaged { .. }) => {}
            done => return done,
        }
    }
    let file = Locked::take(open_ours(&SystemDisk, path)?, path)?;
    // Keeps a symbolic link: the copy replaces the target of the link.
    let target = path.canonicalize().map_err(|source| RepairError::Read(path.into(), source))?;
    let copied = replace_by_finished_copy(&*file.0, &target, progress)?;
    Ok(Repair { path: path.into(), ..copied })
}

/// Number of frames of an undamaged recording; `None` if it is damaged.
fn sound_frames(file: &dyn RecordingFile, progress: impl FnMut(u64)) -> McapResult<Option<u64>> {
    let mut frame_channels = BTreeSet::new();
    let mut frames = 0;
    let damage = visit(file, progress, |record| {
        match record {
            Record::Channel(channel) if channel.topic == Topic::Frames.name() => {
                frame_channels.insert(channel.id);
            }
            Record::Message { header, .. } => frames += u64::from(frame_channels.contains(&header.channel_id)),
            _ => {}
        }
        Ok(())
    })?;
    Ok((damage == (0, false)).then_some(frames))
}

/// Reads all records of a file's data. Returns the number of bytes skipped, and whether unreadable bytes end the records.
fn visit(
    file: &dyn RecordingFile,
    mut progress: impl FnMut(u64),
    mut take: impl FnMut(Record<'_>) -> McapResult<()>,
) -> McapResult<(u64, bool)> {
    let mut records = Records::new(BufReader::with_capacity(BUFFER_BYTES, FileReader::new(file, 0)));
    let mut done_to = 0;
    while let Some(record) = records.next()? {
        take(record)?;
        if records.position.start > done_to {
            done_to = records.position.start;
            progress(done_to);
        }
    }
    Ok((records.skipped_bytes, records.ending == Some(Ending::Damaged)))
}

fn replace_by_finished_copy(
    file: &dyn RecordingFile,
    path: &Path,
    progress: impl FnMut(u64),
) -> Result<Repair, RepairError> {
    let copy = path.with_added_extension(COPY_EXTENSION);
    let kept = free_name_for_damaged(path);
    let replaced = write_finished_copy(file, path, &copy, progress).and_then(|(frames, skipped_bytes)| {
        fs::hard_link(path, &kept)?;
        fs::rename(&copy, path)?;
        File::open(folder_of(path))?.sync_all()?;
        Ok(Repair { path: path.into(), frames, was_unfinished: true, skipped_bytes, kept: Some(kept) })
    });
    replaced.map_err(|error| {
        // The first error explains more than an error of the removal. The next check overwrites the copy.
        let _ = fs::remove_file(&copy);
        RepairError::Write(copy, io_error(error))
    })
}

fn io_error(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}

/// A free name: `FILE.damaged`, else `FILE.2.damaged` and so on.
fn free_name_for_damaged(path: &Path) -> PathBuf {
    let name = |number: u32| match number {
        1 => path.with_added_extension(DAMAGED_EXTENSION),
        number => path.with_added_extension(format!("{number}.{DAMAGED_EXTENSION}")),
    };
    (1..=u32::MAX).map(name).find(|path| !path.exists()).expect("a folder has fewer than 2^32 files")
}

/// Writes the copy. Returns the number of frames copied, and the number of bytes skipped.
fn write_finished_copy(
    old: &dyn RecordingFile,
    path: &Path,
    copy: &Path,
    progress: impl FnMut(u64),
) -> McapResult<(u64, u64)> {
    let file = File::options().read(true).write(true).create(true).truncate(true).open(copy)?;
    file.set_permissions(fs::metadata(path)?.permissions())?;
    let sink = NoSeek::new(BufWriter::with_capacity(BUFFER_BYTES, file.try_clone()?));
    let options = write_options(RecorderSettings::DEFAULT_COMPRESSION_LEVEL).chunk_size(Some(CHUNK_BYTES));
    let mut copier =
        Copier { writer: options.create(sink)?, has_channels: false, is_of_this_version: false, dragons: Vec::new() };
    for declared in Contents::of_finished(old)?.unwrap_or_default().into_declarations() {
        copier.take(declared)?;
    }
    let (skipped_bytes, _) = visit(old, progress, |record| copier.take(record))?;
    copier.writer.finish()?;
    file.sync_all()?;
    let frames = Contents::of_finished(&file)?.and_then(|contents| contents.frames());
    Ok((frames.unwrap_or(0), skipped_bytes))
}

struct Copier<W: io::Write + Seek> {
    writer: Writer<W>,
    has_channels: bool,
    is_of_this_version: bool,
    /// Names of the dragons of the first configuration, which precedes the messages.
    dragons: Vec<String>,
}

impl<W: io::Write + Seek> Copier<W> {
    fn take(&mut self, record: Record<'_>) -> McapResult<()> {
        match record {
            Record::Header(Header { library, .. }) => self.is_of_this_version = library == LIBRARY,
            Record::Schema { header, data } => {
                self.writer.add_schema_with_id(header.id, &header.name, &header.encoding, &data)?;
            }
            Record::Channel(Channel { id, schema_id, topic, message_encoding, metadata }) => {
                self.writer.add_channel_with_id(id, schema_id, &topic, &message_encoding, &metadata)?;
                self.has_channels = true;
            }
            Record::Message { header, data } => {
                if !self.has_channels && self.is_of_this_version {
                    // The chunk that declares the channels is damaged. This version numbers them alike in every file of these dragons.
                    Channels::declare(&mut self.writer, &self.dragons)?;
                    self.has_channels = true;
                }
                self.writer.write_to_known_channel(&header, &data)?;
            }
            Record::Metadata(metadata) => {
                self.writer.write_metadata(&metadata)?;
                if let Some(configuration) = Configuration::from_metadata(metadata).filter(|_| !self.has_channels) {
                    self.dragons = channel_names(&configuration.toml);
                }
            }
            // The writer writes its own header and indexes.
            _ => {}
        }
        Ok(())
    }
}

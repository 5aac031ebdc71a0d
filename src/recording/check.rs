//! Reading a whole recording to find damage, and saving what is readable of a damaged one.
//!
//! Everything that is whole is copied into a new file beside the old one, with an index and a summary. When that file is on
//! the disk, it takes the old one's place in one step, and the old one is kept under another name: there may be more to
//! save in it. Whatever fails before, the old file stays as it was.

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
    mcap_file::write_options,
    recorder::RecorderSettings,
    records::{Ending, Records},
    repair::{Locked, Repair, RepairError, open_ours, repair},
    summary::Contents,
    topics::{Channels, LIBRARY, Topic},
};
use crate::system::whole_file::folder_of;

/// What the name of the copy adds to that of the recording; a copy left by a killed repair is overwritten by the next.
pub(super) const COPY_EXTENSION: &str = "repairing";
/// What the name of an old file adds that is kept.
pub(super) const DAMAGED_EXTENSION: &str = "damaged";
const CHUNK_BYTES: u64 = 1 << 20;
const BUFFER_BYTES: usize = 1 << 20;

/// Reads a whole recording, finished or not, and finishes it as [`repair()`] does where every chunk is sound. Of one with
/// damage a finished copy of all that is sound takes its place, and the old file is kept as `FILE.damaged`.
///
/// `progress` hears how many bytes of the file have been read, chunk by chunk; for a copy from the beginning again. A copy
/// needs as much free disk as the recording is large.
///
/// # Errors
/// See [`RepairError`]; [`RepairError::Damaged`] is none of them.
pub fn repair_checked(path: &Path, mut progress: impl FnMut(u64)) -> Result<Repair, RepairError> {
    let file = Locked::take(open_ours(path)?, path)?;
    let sound = sound_frames(&file.0, &mut progress);
    let sound = sound.map_err(|error| RepairError::Read(path.into(), io_error(error)))?;
    drop(file);
    if let Some(frames) = sound {
        match repair(path) {
            Ok(repaired) if repaired.frames != frames => {}
            Err(RepairError::Damaged { .. }) => {}
            done => return done,
        }
    }
    let file = Locked::take(open_ours(path)?, path)?;
    // A link stays one: the file that it leads to is replaced.
    let target = path.canonicalize().map_err(|source| RepairError::Read(path.into(), source))?;
    let copied = replace_by_finished_copy(&file.0, &target, progress)?;
    Ok(Repair { path: path.into(), ..copied })
}

/// The frames of a recording all of whose chunks are sound; `None` where there is damage.
fn sound_frames(file: &File, progress: impl FnMut(u64)) -> McapResult<Option<u64>> {
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

/// Reads all records of a file's data. Returns how many bytes were passed over, and whether the records break off before the
/// end of the data.
fn visit(
    mut file: &File,
    mut progress: impl FnMut(u64),
    mut take: impl FnMut(Record<'_>) -> McapResult<()>,
) -> McapResult<(u64, bool)> {
    file.rewind()?;
    let mut records = Records::new(BufReader::with_capacity(BUFFER_BYTES, file));
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

fn replace_by_finished_copy(file: &File, path: &Path, progress: impl FnMut(u64)) -> Result<Repair, RepairError> {
    let copy = path.with_added_extension(COPY_EXTENSION);
    let kept = free_name_for_damaged(path);
    let replaced = write_finished_copy(file, &copy, progress).and_then(|(frames, skipped_bytes)| {
        fs::hard_link(path, &kept)?;
        fs::rename(&copy, path)?;
        File::open(folder_of(path))?.sync_all()?;
        Ok(Repair { path: path.into(), frames, was_unfinished: true, skipped_bytes, kept: Some(kept) })
    });
    replaced.map_err(|error| {
        // The error that is on its way explains more than this one would; the next check overwrites the copy.
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

/// `FILE.damaged`, or where an earlier one has that name, `FILE.2.damaged` and so on.
fn free_name_for_damaged(path: &Path) -> PathBuf {
    let name = |number: u32| match number {
        1 => path.with_added_extension(DAMAGED_EXTENSION),
        number => path.with_added_extension(format!("{number}.{DAMAGED_EXTENSION}")),
    };
    (1..=u32::MAX).map(name).find(|path| !path.exists()).expect("a folder holds fewer files than that")
}

/// Returns how many frames were copied, and how many bytes were passed over.
fn write_finished_copy(old: &File, copy: &Path, progress: impl FnMut(u64)) -> McapResult<(u64, u64)> {
    let file = File::options().read(true).write(true).create(true).truncate(true).open(copy)?;
    file.set_permissions(old.metadata()?.permissions())?;
    let sink = NoSeek::new(BufWriter::with_capacity(BUFFER_BYTES, file.try_clone()?));
    let options = write_options(RecorderSettings::DEFAULT_COMPRESSION_LEVEL).chunk_size(Some(CHUNK_BYTES));
    let mut copier = Copier { writer: options.create(sink)?, has_channels: false, is_of_this_version: false };
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
                    // The chunk that declares them is damaged; this version gives each the same number in every file.
                    Channels::declare(&mut self.writer)?;
                    self.has_channels = true;
                }
                self.writer.write_to_known_channel(&header, &data)?;
            }
            Record::Metadata(metadata) => self.writer.write_metadata(&metadata)?,
            // The writer makes its own header and indexes.
            _ => {}
        }
        Ok(())
    }
}

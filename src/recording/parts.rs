//! The parts of a recording: the files that a recorder and its successors wrote, in the order in which they were recorded.
//!
//! A recorder that rotates begins a new file at a size. After the death of a recorder, `show` starts another one, which writes
//! the next file of the show's folder. A reader of the folder joins them again ([`PartsReader`](super::PartsReader)).
//!
//! **Order.** Files are ordered by their first frames. Within a run, its ticks decide; between runs, the wall times. So the names
//! of the files do not matter.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use bench_dragon_ipc::FrameHeader;

use super::{outline::Outline, reader::FrameReader, reader::ReadError, topics::RecordedFrame};
use crate::system::whole_file::folder_of;

/// Extension of the recordings in a folder.
const EXTENSION: &str = "mcap";
/// A file that only the folder of a show has.
const SHOW_CONFIG: &str = "config.toml";
/// The summary of a show, in its folder.
const SHOW_SUMMARY: &str = "summary.json";

/// The parts of a recording, oldest first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Parts {
    /// The named file or folder, for messages.
    pub named: PathBuf,
    /// The files.
    pub files: Vec<PathBuf>,
    /// Files of the named folders that cannot be read as recordings, each with the reason.
    pub unreadable: Vec<(PathBuf, String)>,
    /// Frames that the show of the named folder has published, according to its `summary.json`.
    pub published: Option<u64>,
}

/// Reason why the parts of a recording cannot be found.
#[derive(Debug, thiserror::Error)]
pub enum PartsError {
    /// The folder cannot be listed.
    #[error("cannot read {}", .0.display())]
    Folder(PathBuf, #[source] io::Error),
    /// The folder has no recording.
    #[error("{} has no recording: no file *.{EXTENSION} that can be read", .0.display())]
    NoRecording(PathBuf),
    /// A file cannot be read as a recording.
    #[error(transparent)]
    Read(#[from] ReadError),
}

/// The place of a file among the parts of its recording.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PartOf {
    /// The file.
    pub file: PathBuf,
    /// Number of the part, from 1.
    pub number: usize,
    /// Number of parts.
    pub count: usize,
    /// Their folder.
    pub folder: PathBuf,
}

impl Parts {
    /// Files of one recording, in the given order.
    pub fn in_this_order(files: &[PathBuf]) -> Self {
        Self { named: files[0].clone(), files: files.to_vec(), unreadable: Vec::new(), published: None }
    }

    /// Finds the parts of the recording in a folder, or takes a single file as it is.
    ///
    /// # Errors
    /// [`PartsError`].
    pub fn find(named: &Path) -> Result<Self, PartsError> {
        Self::find_all(&[named.to_owned()])
    }

    /// As [`Parts::find`], of several files and folders together.
    ///
    /// # Errors
    /// [`PartsError`].
    pub fn find_all(named: &[PathBuf]) -> Result<Self, PartsError> {
        let mut parts =
            Self { named: named[0].clone(), files: Vec::new(), unreadable: Vec::new(), published: published(named) };
        let mut firsts = Vec::new();
        for path in named {
            if path.is_dir() {
                parts.take_folder(path, &mut firsts)?;
            } else {
                // A file that was named must be readable. Without a readable frame, the reader of the frames reports why.
                let mut reader = FrameReader::open(path)?;
                let header = reader.next_wanted_frame(|_| true).ok().flatten();
                firsts.push(FirstFrame { path: path.clone(), frame: header });
            }
        }
        parts.files = in_order(firsts).into_iter().map(|first| first.path).collect();
        Ok(parts)
    }

    fn take_folder(&mut self, folder: &Path, firsts: &mut Vec<FirstFrame>) -> Result<(), PartsError> {
        let before = firsts.len();
        for path in recordings_in(folder)? {
            let first = FrameReader::open(&path).and_then(|mut reader| reader.next_wanted_frame(|_| true));
            match first {
                Ok(frame) => firsts.push(FirstFrame { path, frame }),
                Err(error) => self.unreadable.push((path, format!("{:#}", anyhow::Error::from(error)))),
            }
        }
        if firsts.len() == before { Err(PartsError::NoRecording(folder.to_owned())) } else { Ok(()) }
    }

    /// Whether a folder was named, or several files.
    pub fn are_joined(&self) -> bool {
        self.files.len() != 1 || self.files[0] != self.named
    }

    /// Size of all parts in bytes.
    pub fn bytes(&self) -> u64 {
        self.files.iter().filter_map(|file| fs::metadata(file).ok()).map(|metadata| metadata.len()).sum()
    }
}

impl PartOf {
    /// Finds the place of a file among the recordings of its folder. `None` if it is not one of several parts: no other file
    /// has frames of its runs, and the folder is not that of a show. A copy, which begins with the same frame, is no other part.
    ///
    /// # Errors
    /// [`PartsError`].
    pub fn find(file: &Path) -> Result<Option<Self>, PartsError> {
        let folder = folder_of(file);
        let is_of_show = folder.join(SHOW_CONFIG).is_file();
        let runs = |path: &Path| -> BTreeSet<u64> {
            let outline = File::open(path).and_then(|file| Outline::of(&file));
            outline.unwrap_or_default().configurations.iter().map(|configuration| configuration.run_id).collect()
        };
        let own = runs(file);
        let is_part = |path: &Path| is_of_show || is_same(path, file) || !runs(path).is_disjoint(&own);
        let firsts = recordings_in(folder)?.into_iter().filter(|path| is_part(path)).filter_map(|path| {
            let frame = FrameReader::open(&path).and_then(|mut reader| reader.next_wanted_frame(|_| true)).ok()?;
            Some(FirstFrame { path, frame })
        });
        let mut parts = in_order(firsts.collect());
        let begin = |first: &FirstFrame| first.frame.as_ref().map(|frame| (frame.header.run_id, frame.header.tick));
        let Some(named) = parts.iter().find(|first| is_same(&first.path, file)).and_then(begin) else {
            return Ok(None);
        };
        parts.dedup_by_key(|first| begin(first));
        let number = parts.iter().position(|first| begin(first) == Some(named));
        let part = number.map(|number| Self {
            file: file.to_owned(),
            number: number + 1,
            count: parts.len(),
            folder: folder.to_owned(),
        });
        Ok(part.filter(|part| part.count > 1))
    }
}

fn is_same(path: &Path, other: &Path) -> bool {
    path.file_name() == other.file_name()
}

/// A file and its first frame, if it has one.
struct FirstFrame {
    path: PathBuf,
    frame: Option<RecordedFrame>,
}

/// The files in the order in which they were recorded. Files without frames come last.
fn in_order(mut firsts: Vec<FirstFrame>) -> Vec<FirstFrame> {
    let mut begins: BTreeMap<u64, u64> = BTreeMap::new();
    for RecordedFrame { log_time_ns, header, .. } in firsts.iter().filter_map(|first| first.frame.as_ref()) {
        let begin_ns = begins.entry(header.run_id).or_insert(*log_time_ns);
        *begin_ns = (*begin_ns).min(*log_time_ns);
    }
    firsts.sort_by_key(|FirstFrame { frame, .. }| match frame {
        Some(RecordedFrame { log_time_ns, header: FrameHeader { run_id, tick, .. }, .. }) => {
            (false, begins[run_id], *run_id, *tick, *log_time_ns)
        }
        None => (true, 0, 0, 0, 0),
    });
    firsts
}

/// Returns the files of a folder with the extension of recordings, by name; at least one.
///
/// # Errors
/// [`PartsError::Folder`], [`PartsError::NoRecording`].
pub fn recordings_in(folder: &Path) -> Result<Vec<PathBuf>, PartsError> {
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<io::Result<Vec<_>>>);
    let entries = entries.map_err(|source| PartsError::Folder(folder.to_owned(), source))?;
    let is_recording = |path: &PathBuf| path.is_file() && path.extension().is_some_and(|end| end == EXTENSION);
    let mut paths: Vec<PathBuf> = entries.into_iter().map(|entry| entry.path()).filter(is_recording).collect();
    paths.sort();
    if paths.is_empty() { Err(PartsError::NoRecording(folder.to_owned())) } else { Ok(paths) }
}

/// The number of published frames in the summary of a show's folder. A folder without a readable summary has none.
fn published(named: &[PathBuf]) -> Option<u64> {
    let [folder] = named else { return None };
    let text = fs::read_to_string(folder.join(SHOW_SUMMARY)).ok()?;
    serde_json::from_str::<serde_json::Value>(&text).ok()?["frames"]["published"].as_u64()
}

//! The files of a show: its folder, and unfinished recordings of killed recorders.

use std::collections::VecDeque;
use std::fs::{self, DirBuilder, File, Permissions, TryLockError};
use std::io::{self, ErrorKind, Write as _};
use std::os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::time::Duration;

use anyhow::Context as _;

use super::summary::ShowSummary;
use crate::cli::flags::BadInput;
use crate::config::Config;
use crate::output::{Counted, json};
use crate::recording::{BackgroundRepair, DiskSpace, Repair, RepairError};
use crate::system::whole_file;

/// Prefix of the default folder's name.
const FOLDER_PREFIX: &str = "show-";
/// The configuration, which the server reads.
const CONFIG: &str = "config.toml";
/// The summary, which a show writes last.
pub(crate) const SUMMARY: &str = "summary.json";
/// The report beside it.
const REPORT: &str = "report.html";
/// Mode of files with the output of configured commands. Only the user may read it, because it may contain a page's token.
const OUTPUT_MODE: u32 = 0o600;
/// Mode of a show's folder: the recording and the logs are its user's.
const FOLDER_MODE: u32 = 0o700;

pub(super) struct Folder {
    pub(super) path: PathBuf,
    /// Whether the folder was created for this show.
    is_new: bool,
    /// The configuration's file. Its lock shows other shows that this show is running.
    config_file: File,
}

/// Creates a folder that only its user can open, whatever the umask, unless it exists.
pub(crate) fn create_private(path: &Path) -> io::Result<()> {
    if path.is_dir() {
        return Ok(());
    }
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent)?;
    }
    DirBuilder::new().mode(FOLDER_MODE).create(path)?;
    // A strict umask may have removed even the user's own rights.
    fs::set_permissions(path, Permissions::from_mode(FOLDER_MODE))
}

impl Folder {
    /// Creates the folder if it is missing, and writes the configuration into it.
    ///
    /// # Errors
    /// The folder cannot be created, another show is using it, or it contains files of an earlier show.
    pub(super) fn claim(out: Option<&Path>, config: &Config) -> anyhow::Result<Self> {
        let path = out.map_or_else(
            || PathBuf::from(format!("{FOLDER_PREFIX}{}", jiff::Zoned::now().strftime("%Y%m%d-%H%M%S"))),
            Path::to_owned,
        );
        let is_new = !path.exists();
        create_private(&path).map_err(|error| {
            BadInput(format!("--out is {}, must be a folder that can be created: {error}", path.display()))
        })?;
        let config = write_config(&path, config).inspect_err(|_| {
            if is_new {
                // A failure to remove it is ignored, because the first error is reported.
                let _ = fs::remove_dir(&path);
            }
        })?;
        Ok(Self { path, is_new, config_file: config })
    }

    /// Free bytes on the folder's disk; `None` if the system does not report them.
    pub(super) fn free_bytes(&self) -> Option<u64> {
        DiskSpace::around(&self.config_file).ok().map(|space| space.free_bytes)
    }

    pub(super) fn config(&self) -> PathBuf {
        self.path.join(CONFIG)
    }

    /// An unused name for a recording: `recording.mcap`, `recording-2.mcap` and so on.
    pub(super) fn free_recording(&self) -> PathBuf {
        let name = |number: u32| match number {
            1 => self.path.join("recording.mcap"),
            number => self.path.join(format!("recording-{number}.mcap")),
        };
        (1..=u32::MAX).map(name).find(|path| !path.exists()).expect("a folder holds fewer files than that")
    }

    /// Opens the file for a configured command's output, to append to it.
    pub(super) fn open_output(&self, name: &str) -> anyhow::Result<File> {
        let path = self.path.join(format!("{}.log", name.replace(' ', "-")));
        let options = File::options().append(true).create(true).mode(OUTPUT_MODE).open(&path);
        options.with_context(|| format!("cannot write {}", path.display()))
    }

    /// This folder, and those of earlier shows in the current folder.
    pub(super) fn and_earlier(&self) -> Vec<PathBuf> {
        let is_of_show = |path: &PathBuf| {
            path.is_dir() && path.file_name().is_some_and(|name| name.to_string_lossy().starts_with(FOLDER_PREFIX))
        };
        let entries = fs::read_dir(".").into_iter().flatten().flatten().map(|entry| entry.path());
        let mut shows: Vec<_> = entries.filter(is_of_show).collect();
        shows.sort();
        std::iter::once(self.path.clone()).chain(shows).collect()
    }

    /// Writes the summary.
    pub(super) fn write_summary(&self, summary: &ShowSummary) -> anyhow::Result<()> {
        whole_file::write(&self.path.join(SUMMARY), &json::indented(summary)?)
    }

    pub(super) fn report(&self) -> PathBuf {
        self.path.join(REPORT)
    }

    /// Writes the report, an HTML file.
    pub(super) fn write_report(&self, html: &str) -> anyhow::Result<()> {
        whole_file::write(&self.report(), html.as_bytes())
    }

    /// Removes the files of a show that never began: its configuration, and the folder if it was created for this show.
    pub(super) fn remove_unused(&self) {
        // A failure to remove them is ignored, because the error of the show itself is reported.
        let _ = fs::remove_file(self.config());
        if self.is_new {
            let _ = fs::remove_dir(&self.path);
        }
    }
}

/// Writes the configuration, which the server reads at every start. Locks the file for the lifetime of the result.
fn write_config(folder: &Path, config: &Config) -> anyhow::Result<File> {
    let path = folder.join(CONFIG);
    let cannot_write = || format!("cannot write {}", path.display());
    match File::options().write(true).create_new(true).open(&path) {
        Ok(_) if folder.join(SUMMARY).exists() => {
            fs::remove_file(&path).with_context(cannot_write)?;
            Err(used_before(folder, SUMMARY).into())
        }
        Ok(mut file) => {
            let written = file.lock().and_then(|()| file.write_all(config.to_toml().as_bytes()));
            // A disk without room leaves an empty file, which would look like that of an earlier show.
            let written = written.inspect_err(|_| drop(fs::remove_file(&path)));
            written.with_context(cannot_write).map(|()| file)
        }
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(refusal(folder, &path).into()),
        Err(error) => Err(error).with_context(cannot_write),
    }
}

/// The reason for which a folder with a configuration is refused.
fn refusal(folder: &Path, config: &Path) -> BadInput {
    let is_locked = |file: File| matches!(file.try_lock(), Err(TryLockError::WouldBlock));
    if File::open(config).is_ok_and(is_locked) {
        return BadInput(format!("--out is {}, which another show is using", folder.display()));
    }
    used_before(folder, CONFIG)
}

/// The refusal of a folder with a file of an earlier show.
pub(crate) fn used_before(folder: &Path, file: &str) -> BadInput {
    let folder = folder.display();
    BadInput(format!(
        "--out is {folder}, which has {file} of an earlier show: name another folder, or move that file away"
    ))
}

/// Longest wait at the end of a show until its files are finished.
const REPAIR_TIMEOUT: Duration = Duration::from_secs(30);

/// Most files of the show that are remembered until they are finished. Further files are finished, but their frames are not
/// counted.
const MOST_OWN: usize = 1000;
/// Most folders of earlier shows that are searched.
const MOST_EARLIER: usize = 10_000;
/// Most results that wait to be taken.
const MOST_RESULTS: usize = 64;

/// The recordings to finish. A thread finishes them; it starts with the first recording.
pub(super) struct Repairs {
    /// One result per file. Dropped before the thread, so that the thread does not wait for room.
    results: Receiver<Result<Repair, RepairError>>,
    sender: SyncSender<Result<Repair, RepairError>>,
    background: Option<BackgroundRepair>,
    /// The show's own unfinished files, at most [`MOST_OWN`].
    own: Vec<PathBuf>,
    /// Folders of earlier shows that have not been passed to the thread yet, at most [`MOST_EARLIER`].
    earlier: VecDeque<PathBuf>,
}

/// The result for one file.
pub(super) struct Repaired {
    /// Frames in the file, if it belongs to this show.
    pub(super) frames: Option<u64>,
    /// The message for people.
    pub(super) line: String,
}

impl Repairs {
    /// Returns an empty list of recordings.
    pub(super) fn new() -> Self {
        let (sender, results) = mpsc::sync_channel(MOST_RESULTS);
        Self { background: None, sender, results, own: Vec::new(), earlier: VecDeque::new() }
    }

    /// Requests to finish a file of this show.
    pub(super) fn finish_own(&mut self, recording: PathBuf) {
        if self.own.len() < MOST_OWN {
            self.own.push(recording.clone());
        }
        self.ask(|background| background.repair(recording));
    }

    /// Requests to finish all unfinished recordings in the folders of earlier shows.
    pub(super) fn finish_earlier(&mut self, folders: impl IntoIterator<Item = PathBuf>) {
        self.earlier.extend(folders.into_iter().take(MOST_EARLIER));
    }

    /// Returns the results since the last call. Never waits.
    pub(super) fn poll(&mut self) -> Vec<Repaired> {
        while let Some(folder) = self.earlier.pop_front() {
            if !self.ask(|background| background.repair(folder.clone())) {
                self.earlier.push_front(folder);
                break;
            }
        }
        let results: Vec<_> = self.results.try_iter().collect();
        results.into_iter().map(|result| self.take(result)).collect()
    }

    /// Waits up to [`REPAIR_TIMEOUT`] until the show's own files are finished. Returns the results since the last call.
    pub(super) fn finish(&mut self) -> Vec<Repaired> {
        self.earlier.clear();
        let mut repaired = self.poll();
        // A second request: another process that was repairing a file may have ended by now.
        for recording in self.own.clone() {
            self.ask(|background| background.repair(recording));
        }
        let is_done = self.background.take().is_none_or(|background| background.finish(REPAIR_TIMEOUT));
        repaired.extend(self.poll());
        if !is_done {
            let line = format!(
                "warning: not all recordings are finished after {} s: the next `record` or `show` in their folder finishes \
                 them",
                REPAIR_TIMEOUT.as_secs()
            );
            repaired.push(Repaired { frames: None, line });
        }
        repaired
    }

    /// Sends a request to the thread, and starts the thread if it is missing. Returns false if its queue is full.
    fn ask(&mut self, request: impl FnOnce(&BackgroundRepair) -> bool) -> bool {
        if self.background.is_none() {
            let sender = self.sender.clone();
            // The send fails if the show has ended. Then no result is needed.
            let report = move |result| drop(sender.send(result));
            self.background = BackgroundRepair::start(report).inspect_err(|error| tracing::warn!("{error}")).ok();
        }
        self.background.as_ref().is_some_and(request)
    }

    fn take(&mut self, result: Result<Repair, RepairError>) -> Repaired {
        match result {
            Ok(Repair { path, frames, was_unfinished, .. }) => {
                let is_own = self.own.contains(&path);
                self.own.retain(|own| *own != path);
                let (path, frames_text) = (path.display(), Counted(frames, "frame"));
                // A recorder whose disk is full finishes its file, but prints no summary.
                let line = if was_unfinished {
                    format!("finished {path}, which a killed recorder left: {frames_text}")
                } else {
                    format!("{path} is finished: {frames_text}")
                };
                Repaired { frames: is_own.then_some(frames), line }
            }
            Err(error) => Repaired { frames: None, line: format!("warning: {:#}", anyhow::Error::from(error)) },
        }
    }
}

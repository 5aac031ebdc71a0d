//! The files of a show: its folder, and recordings that killed recorders left.

use std::collections::VecDeque;
use std::fs::{self, File, TryLockError};
use std::io::{ErrorKind, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, Receiver, SyncSender};
use std::time::Duration;

use anyhow::Context as _;

use super::summary::ShowSummary;
use crate::command::flags::BadInput;
use crate::config::Config;
use crate::output::Counted;
use crate::recording::{BackgroundRepair, DiskSpace, Repair, RepairError};

/// How the name of a show's folder begins that was not given one.
const FOLDER_PREFIX: &str = "show-";
/// The configuration, which the server reads.
const CONFIG: &str = "config.toml";
/// What a show leaves last.
const SUMMARY: &str = "summary.json";
/// Who may read what a configured command prints, such as a page's token: its user.
const OUTPUT_MODE: u32 = 0o600;

pub(super) struct Folder {
    pub(super) path: PathBuf,
    /// Whether it was made for this show.
    is_new: bool,
    /// Locked, so that a second show can tell that this one goes on.
    config_file: File,
}

impl Folder {
    /// Makes the folder where it is missing, and writes the configuration into it.
    ///
    /// # Errors
    /// A folder that cannot be made, that another show is using, or that has the files of an earlier one.
    pub(super) fn claim(out: Option<&Path>, config: &Config) -> anyhow::Result<Self> {
        let path = out.map_or_else(
            || PathBuf::from(format!("{FOLDER_PREFIX}{}", jiff::Zoned::now().strftime("%Y%m%d-%H%M%S"))),
            Path::to_owned,
        );
        let is_new = !path.exists();
        fs::create_dir_all(&path).map_err(|error| {
            BadInput(format!("--out is {}, must be a folder that can be created: {error}", path.display()))
        })?;
        let config = write_config(&path, config)?;
        Ok(Self { path, is_new, config_file: config })
    }

    /// Bytes that can still be written to its disk; `None` where the system does not tell.
    pub(super) fn free_bytes(&self) -> Option<u64> {
        DiskSpace::around(&self.config_file).ok().map(|space| space.free_bytes)
    }

    pub(super) fn config(&self) -> PathBuf {
        self.path.join(CONFIG)
    }

    /// A name for a recording that is not taken: `recording.mcap`, `recording-2.mcap` and so on.
    pub(super) fn free_recording(&self) -> PathBuf {
        let name = |number: u32| match number {
            1 => self.path.join("recording.mcap"),
            number => self.path.join(format!("recording-{number}.mcap")),
        };
        (1..=u32::MAX).map(name).find(|path| !path.exists()).expect("a folder holds fewer files than that")
    }

    /// The file that a configured command's output goes on in.
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
        let shows = fs::read_dir(".").into_iter().flatten().flatten().map(|entry| entry.path()).filter(is_of_show);
        std::iter::once(self.path.clone()).chain(shows).collect()
    }

    /// Writes the summary.
    pub(super) fn write_summary(&self, summary: &ShowSummary) -> anyhow::Result<()> {
        let path = self.path.join(SUMMARY);
        let text = serde_json::to_string_pretty(summary)? + "\n";
        fs::write(&path, text).with_context(|| format!("cannot write {}", path.display()))
    }

    /// Removes what a show that never began has left: its configuration, and a folder that was made for nothing else.
    pub(super) fn remove_unused(&self) {
        // What keeps it there is no fault of the show's, whose own is reported.
        let _ = fs::remove_file(self.config());
        if self.is_new {
            let _ = fs::remove_dir(&self.path);
        }
    }
}

/// Writes the configuration that the server reads, also after a restart, and locks it for as long as the result is held.
fn write_config(folder: &Path, config: &Config) -> anyhow::Result<File> {
    let path = folder.join(CONFIG);
    let cannot_write = || format!("cannot write {}", path.display());
    match File::options().write(true).create_new(true).open(&path) {
        Ok(_) if folder.join(SUMMARY).exists() => {
            fs::remove_file(&path).with_context(cannot_write)?;
            Err(used_before(folder, SUMMARY).into())
        }
        Ok(mut file) => {
            file.lock().and_then(|()| file.write_all(config.to_toml().as_bytes())).with_context(cannot_write)?;
            Ok(file)
        }
        Err(error) if error.kind() == ErrorKind::AlreadyExists => Err(refusal(folder, &path).into()),
        Err(error) => Err(error).with_context(cannot_write),
    }
}

/// Why a folder that has a configuration is refused.
fn refusal(folder: &Path, config: &Path) -> BadInput {
    let is_locked = |file: File| matches!(file.try_lock(), Err(TryLockError::WouldBlock));
    if File::open(config).is_ok_and(is_locked) {
        return BadInput(format!("--out is {}, which another show is using", folder.display()));
    }
    used_before(folder, CONFIG)
}

fn used_before(folder: &Path, file: &str) -> BadInput {
    let folder = folder.display();
    BadInput(format!(
        "--out is {folder}, which has {file} of an earlier show: name another folder, or move that file away"
    ))
}

/// How long the end of a show waits for its files to be finished.
const PATIENCE: Duration = Duration::from_secs(30);

/// Files of the show that are remembered until they are finished: later ones are finished too, but their frames are not counted.
const MOST_OWN: usize = 1000;
/// Folders of earlier shows that are looked through.
const MOST_EARLIER: usize = 10_000;
/// Results that wait to be taken.
const MOST_RESULTS: usize = 64;

/// The files that are being finished, by a thread that is started with the first of them.
pub(super) struct Repairs {
    /// One result a file. Dropped before the thread, which then waits for nobody.
    results: Receiver<Result<Repair, RepairError>>,
    sender: SyncSender<Result<Repair, RepairError>>,
    background: Option<BackgroundRepair>,
    /// The show's own files that are not finished yet, at most [`MOST_OWN`].
    own: Vec<PathBuf>,
    /// Folders of earlier shows that have not been asked for yet, at most [`MOST_EARLIER`].
    earlier: VecDeque<PathBuf>,
}

/// What has become of a file.
pub(super) struct Repaired {
    /// Frames in it, where it is the show's own.
    pub(super) frames: Option<u64>,
    /// What there is to say.
    pub(super) line: String,
}

impl Repairs {
    /// Nothing is to be done yet.
    pub(super) fn new() -> Self {
        let (sender, results) = mpsc::sync_channel(MOST_RESULTS);
        Self { background: None, sender, results, own: Vec::new(), earlier: VecDeque::new() }
    }

    /// Has a file of the show's finished.
    pub(super) fn finish_own(&mut self, recording: PathBuf) {
        if self.own.len() < MOST_OWN {
            self.own.push(recording.clone());
        }
        self.ask(|background| background.repair(recording));
    }

    /// Has all unfinished recordings in the folders of earlier shows finished.
    pub(super) fn finish_earlier(&mut self, folders: impl IntoIterator<Item = PathBuf>) {
        self.earlier.extend(folders.into_iter().take(MOST_EARLIER));
    }

    /// What has been done since the last call. Never waits.
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

    /// Waits, not without end, until the show's own files are finished. Returns what has been done since the last call.
    pub(super) fn finish(&mut self) -> Vec<Repaired> {
        self.earlier.clear();
        let mut repaired = self.poll();
        // Of another process that was at work on a file there may be an end by now.
        for recording in self.own.clone() {
            self.ask(|background| background.repair(recording));
        }
        let is_done = self.background.take().is_none_or(|background| background.finish(PATIENCE));
        repaired.extend(self.poll());
        if !is_done {
            let line = format!(
                "warning: not all recordings are finished after {} s: the next `record` or `show` in their folder does it",
                PATIENCE.as_secs()
            );
            repaired.push(Repaired { frames: None, line });
        }
        repaired
    }

    /// Asks the thread, which is started where it is missing. `false` where it can take no more now.
    fn ask(&mut self, request: impl FnOnce(&BackgroundRepair) -> bool) -> bool {
        if self.background.is_none() {
            let sender = self.sender.clone();
            // Where the show has ended meanwhile, nobody counts any more.
            let report = move |result| drop(sender.send(result));
            self.background = BackgroundRepair::start(report).inspect_err(|error| tracing::warn!("{error}")).ok();
        }
        self.background.as_ref().is_some_and(request)
    }

    fn take(&mut self, result: Result<Repair, RepairError>) -> Repaired {
        match result {
            Ok(Repair { path, frames, .. }) => {
                let is_own = self.own.contains(&path);
                self.own.retain(|own| *own != path);
                let line =
                    format!("finished {}, which a killed recorder left: {}", path.display(), Counted(frames, "frame"));
                Repaired { frames: is_own.then_some(frames), line }
            }
            Err(error) => Repaired { frames: None, line: format!("warning: {:#}", anyhow::Error::from(error)) },
        }
    }
}

//! Finishing what killed recorders left, beside the show: its own files, and those of earlier shows.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::mpsc::{self, Receiver, Sender};
use std::time::Duration;

use crate::output::number::Counted;
use crate::recording::{BackgroundRepair, Repair, RepairError};

/// How long the end of a show waits for its files to be finished.
const PATIENCE: Duration = Duration::from_secs(30);

/// The files that are being finished, by a thread that is started with the first of them.
#[derive(Debug)]
pub(super) struct Repairs {
    background: Option<BackgroundRepair>,
    sender: Sender<Result<Repair, RepairError>>,
    /// One result a file.
    results: Receiver<Result<Repair, RepairError>>,
    /// The show's own files that are not finished yet.
    own: Vec<PathBuf>,
    /// Folders of earlier shows that have not been asked for yet.
    earlier: VecDeque<PathBuf>,
}

/// What has become of a file.
#[derive(Debug)]
pub(super) struct Repaired {
    /// Frames in it, where it is the show's own.
    pub(super) frames: Option<u64>,
    /// What there is to say.
    pub(super) line: String,
}

impl Repairs {
    /// Nothing is to be done yet.
    pub(super) fn new() -> Self {
        let (sender, results) = mpsc::channel();
        Self { background: None, sender, results, own: Vec::new(), earlier: VecDeque::new() }
    }

    /// Has a file of the show's finished.
    pub(super) fn finish_own(&mut self, recording: PathBuf) {
        self.own.push(recording.clone());
        self.ask(|background| background.repair_file(recording));
    }

    /// Has all unfinished recordings in the folders of earlier shows finished.
    pub(super) fn finish_earlier(&mut self, folders: impl IntoIterator<Item = PathBuf>) {
        self.earlier.extend(folders);
    }

    /// What has been done since the last call. Never waits.
    pub(super) fn poll(&mut self) -> Vec<Repaired> {
        while let Some(folder) = self.earlier.pop_front() {
            if !self.ask(|background| background.repair_folder(folder.clone())) {
                self.earlier.push_front(folder);
                break;
            }
        }
        let results: Vec<_> = self.results.try_iter().collect();
        results.into_iter().map(|result| self.take(result)).collect()
    }

    /// Waits, not without end, until the show's own files are finished. Returns what has been done since the last call.
    pub(super) fn finish(mut self) -> Vec<Repaired> {
        self.earlier.clear();
        let mut repaired = self.poll();
        // Of another process that was at work on a file there may be an end by now.
        for recording in self.own.clone() {
            self.ask(|background| background.repair_file(recording));
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

//! Export: the frames, the alerts and the commands of a recording as rows and columns, for spreadsheets and for people's own programs.
//!
//! **Which frames.** Those whose show time lies in an interval, in the recorded order, and of these the ones with which
//! show time enters another step: a frame a second, say. Alerts and commands of the interval are all there.
//!
//! **As what.** Comma-separated values  are written as the file is read: a row for each handle of each frame, numbers whole,
//! in the shortest form that reads back the same. A workbook has several sheets, among them positions and speeds with
//! a column for each frame, as `solve poses` writes them; whether it fits is known before it is begun. Its numbers are
//! whole as well, and shown with six decimals.
//!
//! **A damaged file** is exported without what is damaged, one without its end as far as it goes; [`Flaws`](crate::recording::Flaws) tells.

mod rows;
mod selection;
mod workbook;

use std::{io, path::PathBuf};

use super::{NothingFound, ReadError, ShowInterval};
use crate::output::table::WorkbookError;

pub(crate) use rows::write_csv;
pub(crate) use selection::Selection;
pub(crate) use workbook::Workbook;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ExportSettings {
    pub(crate) file: PathBuf,
    pub(crate) interval: ShowInterval,
    /// Nanoseconds of show time from one exported frame to the next; 0 for every frame.
    pub(crate) every_ns: i64,
    pub(crate) subject: ExportSubject,
    /// Whether alerts and commands are exported beside the subject: a workbook has sheets for them.
    pub(crate) with_events: bool,
}

/// What rows are about.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ExportSubject {
    /// Every handle of each frame: position, velocity and speed.
    #[default]
    Handles,
    /// Every bench of each frame: centre, heading, velocity and speed, and how fast it turns.
    Benches,
    /// Each frame as a whole: its state and its head.
    Frames,
    Alerts,
    Commands,
}

impl ExportSubject {
    /// The plural of what a row stands for.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Handles => "handles",
            Self::Benches => "benches",
            Self::Frames => "frames",
            Self::Alerts => "alerts",
            Self::Commands => "command events",
        }
    }

    /// Whether frames are part of it.
    pub(crate) fn has_frames(self) -> bool {
        !matches!(self, Self::Alerts | Self::Commands)
    }
}

/// How much was exported.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ExportCounts {
    /// Recorded runs that frames were exported of.
    pub runs: u64,
    /// Frames.
    pub frames: u64,
    /// Alerts.
    pub alerts: u64,
    /// Events of the record of commands.
    pub commands: u64,
    /// Rows of comma-separated values, without the titles; null of a workbook.
    pub rows: Option<u64>,
}

#[derive(Debug, thiserror::Error)]
pub(crate) enum ExportError {
    /// The file cannot be opened as a recording.
    #[error(transparent)]
    Open(ReadError),
    #[error("the export ends early")]
    Read(#[source] ReadError),
    #[error(transparent)]
    Nothing(#[from] NothingFound),
    /// A workbook has no room for it.
    #[error("{what}, a workbook has room for {most}: choose a greater --every, a shorter --from and --to, or .csv")]
    TooMuch {
        /// What there is too much of, with its number.
        what: String,
        most: usize,
    },
    #[error("cannot write the rows")]
    Write(#[source] io::Error),
    #[error(transparent)]
    Table(#[from] WorkbookError),
}

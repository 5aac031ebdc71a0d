//! Export: frames, alerts and commands of a recording as rows and columns, for spreadsheets and other programs.
//!
//! **Selection.** Export selects the frames whose show time lies in an interval, in the recorded order. A step of show time can
//! thin them out, for example to one frame per second. All alerts and commands of the interval are selected, but the accepted
//! grants of a guard only on request.
//!
//! **Formats.** Comma-separated values are written while the file is read, for example one row for each handle of each frame.
//! Numbers have full precision, in the shortest form that reads back as the same value. A workbook has several sheets, among
//! them positions and speeds with one column per frame, as `solve poses` writes them. Its numbers also have full precision, and
//! are shown with six decimals. Its size is checked before it is written.
//!
//! **Damaged files.** Export skips damaged parts and stops where an incomplete file ends. [`Flaws`]
//! reports both.

mod rows;
mod selection;
mod workbook;

use std::{io, sync::Arc};

use super::{Coverage, FlawedFile, Flaws, NothingFound, Parts, ReadError, ShowInterval};
use crate::output::table::WorkbookError;

pub(crate) use rows::write_csv;
pub(crate) use selection::Selection;
pub(crate) use workbook::Workbook;

#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct ExportSettings {
    pub(crate) parts: Arc<Parts>,
    pub(crate) interval: ShowInterval,
    /// Step of show time between exported frames in nanoseconds; 0 for every frame.
    pub(crate) every_ns: i64,
    pub(crate) subject: ExportSubject,
    /// Whether alerts and commands are exported too: a workbook has sheets for them.
    pub(crate) has_events: bool,
    /// Whether the accepted grants of a guard are among the commands.
    pub(crate) has_grants: bool,
}

/// The parts of the recording that could not be read, and its gaps.
#[derive(Clone, Debug, Default)]
pub(crate) struct ExportFindings {
    pub(crate) flawed: Vec<FlawedFile>,
    pub(crate) coverage: Coverage,
}

impl ExportFindings {
    /// The unreadable parts of all files together.
    pub(crate) fn flaws(&self) -> Flaws {
        self.flawed.iter().fold(Flaws::default(), |all, file| all.and(file.flaws))
    }
}

/// Subject of the rows.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum ExportSubject {
    /// Every handle of each frame: position, velocity and speed.
    #[default]
    Handles,
    /// Every bench of each frame: centre, heading, velocity, speed and turn rate.
    Benches,
    /// Each frame: state of the show, and travel, speed and time scale of the head.
    Frames,
    Alerts,
    Commands,
}

impl ExportSubject {
    /// Plural name of the subject.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Handles => "handles",
            Self::Benches => "benches",
            Self::Frames => "frames",
            Self::Alerts => "alerts",
            Self::Commands => "command events",
        }
    }

    /// Whether the rows come from frames.
    pub(crate) fn has_frames(self) -> bool {
        !matches!(self, Self::Alerts | Self::Commands)
    }
}

/// Counts of an export.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct ExportCounts {
    /// Runs with exported frames.
    pub runs: u64,
    /// Frames.
    pub frames: u64,
    /// Alerts.
    pub alerts: u64,
    /// Events of the record of commands.
    pub commands: u64,
    /// Rows of comma-separated values, without the titles; null for a workbook.
    pub rows: Option<u64>,
}

#[derive(Debug, thiserror::Error)]
pub(crate) enum ExportError {
    #[error("the export ends early")]
    Read(#[source] ReadError),
    #[error(transparent)]
    Nothing(#[from] NothingFound),
    /// The export does not fit into a workbook.
    #[error("{what}; a workbook has room for {most}: choose a greater --every, a shorter --from and --to, or .csv")]
    TooMuch {
        /// Contents that exceed the limit, with their number.
        what: String,
        most: usize,
    },
    #[error("cannot write the rows")]
    Write(#[source] io::Error),
    #[error(transparent)]
    Table(#[from] WorkbookError),
}

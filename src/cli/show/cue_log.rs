//! The cues of a show, with the times at which it reached them.

use bench_dragon_ipc::CommandEvent;
use serde::Serialize;

use super::wall_time::WallTime;
use crate::config::Cue;

/// Most times that are kept of one cue. Seeks may reach it again; of more times, the oldest are dropped.
const MOST_TIMES: usize = 20;

/// The cues, in the order of plan time.
#[derive(Clone, Debug, Default)]
pub(super) struct CueLog {
    cues: Vec<CueReport>,
}

/// A cue, as `summary.json` has it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub(super) struct CueReport {
    pub(super) name: String,
    /// Plan time in seconds.
    pub(super) at_s: f64,
    /// Whether the show waits there until GO.
    pub(super) waits: bool,
    pub(super) note: Option<String>,
    /// When the show reached it, oldest first; empty for a cue that it never reached.
    pub(super) reached: Vec<CueTime>,
}

/// When the show reached a cue.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct CueTime {
    pub(super) at: WallTime,
    /// Show time in seconds.
    pub(super) time_s: f64,
}

impl CueLog {
    pub(super) fn of(cues: &[Cue]) -> Self {
        let report = |Cue { name, at_s, waits, note, .. }: &Cue| CueReport {
            name: name.clone(),
            at_s: *at_s,
            waits: *waits,
            note: note.clone(),
            reached: Vec::new(),
        };
        Self { cues: cues.iter().map(report).collect() }
    }

    /// Takes the event of a cue. Returns the cue; `None` for one that the configuration does not have.
    pub(super) fn take(&mut self, event: &CommandEvent) -> Option<&CueReport> {
        let cue = self.cues.get_mut(event.values[0] as usize)?;
        if cue.reached.len() == MOST_TIMES {
            cue.reached.remove(0);
        }
        cue.reached.push(CueTime { at: WallTime::of(event), time_s: event.show_time_ns as f64 / 1e9 });
        Some(cue)
    }

    pub(super) fn reports(&self) -> Vec<CueReport> {
        self.cues.clone()
    }
}

//! The cues of a show, with those that it has reached and the next one.

use bench_dragon_ipc::ShowState;
use serde::Serialize;

use super::head_motion::HeadMotion;
use super::snapshot::Snapshot;
use crate::config::Cue;

/// The cues of a show, in the order of plan time.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct CueList {
    /// All cues.
    pub cues: Vec<ListedCue>,
    /// Number of the next cue, from 0: the one at which the show waits, or else the first one ahead. Null after the last one.
    pub next: Option<usize>,
    /// Wall time until the next cue at the present pace, in seconds; for a show that stands, from the instant at which it walks on.
    /// Null at a cue that waits, and after the last one.
    pub next_in_s: Option<f64>,
    /// Show time at the next cue, in seconds; null likewise.
    pub next_time_s: Option<f64>,
}

/// A cue of the list.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ListedCue {
    /// Its name.
    pub name: String,
    /// Plan time in seconds.
    pub at_s: f64,
    /// Whether the show waits here until GO.
    pub waits: bool,
    /// Planned speed from here on, in metres per second; null for a cue that changes none.
    pub speed_mps: Option<f64>,
    /// Name of the dragon whose speed changes; null for all.
    pub dragon: Option<String>,
    /// Text for operators.
    pub note: Option<String>,
    /// How far the show is.
    pub state: CueState,
}

/// How far the show is with a cue.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum CueState {
    /// The show is at it or behind it.
    Reached,
    /// The show waits at it for GO.
    Waiting,
    /// The first one ahead.
    Next,
    /// A later one.
    Ahead,
}

impl CueState {
    /// The state in a word.
    pub fn name(self) -> &'static str {
        match self {
            Self::Reached => "reached",
            Self::Waiting => "waits for GO",
            Self::Next => "next",
            Self::Ahead => "",
        }
    }
}

impl CueList {
    /// The cues of a snapshot; `None` if there are none, or if the show is not known.
    pub fn of(snapshot: &Snapshot) -> Option<Self> {
        let (config, header) = (snapshot.config()?, snapshot.header()?);
        if config.cues().is_empty() {
            return None;
        }
        let place_m = |cue: &Cue| config.formation().course_m(cue.at_s);
        let waiting = snapshot.cue_here().filter(|_| header.show_state() == Some(ShowState::Waiting));
        let is_waiting = |cue: &Cue| waiting == Some(cue);
        let next = config.cues().iter().position(|cue| place_m(cue) > header.course_m || is_waiting(cue));
        let arrival = next.map(|next| &config.cues()[next]).filter(|cue| !is_waiting(cue)).and_then(|cue| {
            let accel_mps2 = config.accel_mps2_at(header.course_m);
            let motion = HeadMotion::new(header, snapshot.clock?, accel_mps2, snapshot.status.as_deref());
            Some(motion.passing(place_m(cue)))
        });
        let state = |number: usize, cue: &Cue| match next {
            _ if is_waiting(cue) => CueState::Waiting,
            Some(next) if number == next => CueState::Next,
            Some(next) if number > next => CueState::Ahead,
            _ => CueState::Reached,
        };
        let listed = |(number, cue): (usize, &Cue)| ListedCue {
            name: cue.name.clone(),
            at_s: cue.at_s,
            waits: cue.waits,
            speed_mps: cue.speed_mps,
            dragon: cue.dragon.and_then(|dragon| Some(config.named()?.dragons()[dragon].name.clone())),
            note: cue.note.clone(),
            state: state(number, cue),
        };
        Some(Self {
            cues: config.cues().iter().enumerate().map(listed).collect(),
            next,
            next_in_s: arrival.map(|arrival| arrival.wall_s),
            next_time_s: arrival.map(|arrival| arrival.time_s),
        })
    }

    /// The next cue.
    pub fn next_cue(&self) -> Option<&ListedCue> {
        Some(&self.cues[self.next?])
    }
}

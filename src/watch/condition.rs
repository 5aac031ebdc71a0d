//! What is to be known first of a scene: whether there is a source, and what the show is doing.

use bench_dragon_ipc::ShowState;

use super::glyphs::Glyphs;
use super::theme::Tone;
use crate::observe::{Link, Scene};

/// A word, and how urgent it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Condition {
    pub(super) word: &'static str,
    pub(super) tone: Tone,
    sign: usize,
}

impl Condition {
    /// The source's silence comes before what it said last.
    pub(super) fn of(scene: &Scene) -> Self {
        let new = |word, tone, sign| Self { word, tone, sign };
        let state = state(scene);
        match (&scene.link, state) {
            (Link::Waiting, _) => new("WAITING", Tone::Caution, 1),
            (Link::Failed { .. }, _) => new("FAILED", Tone::Danger, 2),
            (Link::Ended { .. }, _) | (Link::Live, Some(ShowState::Ended)) => new("ENDED", Tone::Calm, 3),
            (Link::Gone { .. }, _) => new("LOST", Tone::Danger, 2),
            (Link::Silent { .. }, _) => new("SILENT", Tone::Danger, 2),
            (Link::Live, Some(ShowState::Running)) => new("RUNNING", Tone::Good, 0),
            (Link::Live, Some(ShowState::Stopping)) => new("STOPPING", Tone::Caution, 1),
            (Link::Live, Some(ShowState::Paused)) => new("PAUSED", Tone::Caution, 1),
            (Link::Live, Some(ShowState::Held)) => new("HELD", Tone::Danger, 2),
            (Link::Live, Some(ShowState::Finished)) => new("FINISHED", Tone::Calm, 3),
            (Link::Live, None) => new("UNKNOWN", Tone::Caution, 1),
        }
    }

    /// A sign that says the same.
    pub(super) fn sign(&self, glyphs: Glyphs) -> &'static str {
        glyphs.signs()[self.sign]
    }
}

/// What the show is doing.
pub(super) fn state(scene: &Scene) -> Option<ShowState> {
    scene.state()
}

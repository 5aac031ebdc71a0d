//! What is to be known first of a scene: whether there is a source, and what the show is doing.

use bench_dragon_ipc::ShowState;

use super::glyphs::Glyphs;
use super::theme::Tone;
use crate::display::observe::{GuardSituation, Link, Scene};

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
            (Link::Live, Some(ShowState::Held)) => match by_guard(scene) {
                GuardSituation::Missing => new("NO GUARD", Tone::Danger, 2),
                GuardSituation::Waiting => new("GUARD WAITS", Tone::Caution, 1),
                GuardSituation::AtEnd { .. } => new("GUARD STOP", Tone::Caution, 2),
                GuardSituation::None | GuardSituation::Working => new("HELD", Tone::Danger, 2),
            },
            (Link::Live, Some(ShowState::Finished)) => new("FINISHED", Tone::Calm, 3),
            (Link::Live, None) => new("UNKNOWN", Tone::Caution, 1),
        }
    }

    /// A sign that says the same.
    pub(super) fn sign(&self, glyphs: Glyphs) -> &'static str {
        glyphs.signs()[self.sign]
    }
}

/// How it stands with the guard of a show that no operator holds.
fn by_guard(scene: &Scene) -> GuardSituation {
    let is_held = scene.status.as_ref().is_some_and(|status| status.stops().held);
    if is_held { GuardSituation::None } else { scene.guard }
}

/// What the show is doing.
pub(super) fn state(scene: &Scene) -> Option<ShowState> {
    scene.state()
}

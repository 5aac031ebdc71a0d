//! Whether a command is really to be sent.

use bench_dragon_ipc::{FrameHeader, Request};
use ratatui::crossterm::event::KeyCode;

use crate::display::observe::Scene;
use crate::output::report::request_words;

/// So long the question stands, in nanoseconds.
const STANDS_NS: u64 = 5_000_000_000;

/// The question: which command, since when it is asked, and of what show: its run and its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Question {
    request: Request,
    asked_ns: u64,
    about: Option<(u64, u32)>,
}

impl Question {
    /// Asks about a release or a seek.
    pub(super) fn ask(request: Request, scene: &Scene, now_ns: u64) -> Self {
        Self { request, asked_ns: now_ns, about: about(scene) }
    }

    /// What is asked.
    pub(super) fn text(&self) -> String {
        match self.request {
            Request::Release => "release the hold? r again".to_owned(),
            request => format!("{}? the dragon jumps there: enter again", request_words(request)),
        }
    }

    /// The keys that answer it, and what the first one does.
    pub(super) fn keys(&self) -> (&'static str, &'static str) {
        if self.request == Request::Release { ("r", "release") } else { ("enter", "seek") }
    }

    /// The command, where this key confirms it.
    pub(super) fn answered_by(&self, code: KeyCode) -> Option<Request> {
        let key = if self.request == Request::Release { KeyCode::Char('r') } else { KeyCode::Enter };
        (code == key).then_some(self.request)
    }

    /// Whether it still stands: of a show that has been held meanwhile, or has ended, it was not asked.
    pub(super) fn stands(&self, scene: &Scene, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.asked_ns) < STANDS_NS && self.about == about(scene)
    }
}

fn about(scene: &Scene) -> Option<(u64, u32)> {
    let FrameHeader { run_id, state, .. } = scene.frame.as_ref()?.header;
    Some((run_id, state))
}

//! What a key asks back: a number that is typed, or a confirmation.

use bench_dragon_ipc::{FrameHeader, Request};
use ratatui::crossterm::event::KeyCode;

use crate::display::observe::Snapshot;
use crate::output::report::request_words;

/// The longest one.
const LONGEST: usize = 16;

/// What the number is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberKind {
    Speed,
    Seek,
}

/// The number as far as it is typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct NumberEntry {
    kind: NumberKind,
    text: String,
}

impl NumberEntry {
    pub(super) fn new(kind: NumberKind) -> Self {
        Self { kind, text: String::new() }
    }

    /// Adds a character; one that no number has is left out.
    pub(super) fn push(&mut self, character: char) {
        // What is no number is seen as typed, and refused when it is entered.
        if self.text.len() < LONGEST && character.is_ascii_graphic() {
            self.text.push(character);
        }
    }

    /// Takes the last character back.
    pub(super) fn take_back(&mut self) {
        self.text.pop();
    }

    /// The line as it is shown; what is typed next comes at its end.
    pub(super) fn line(&self) -> String {
        let asked = match self.kind {
            NumberKind::Speed => "speed of the head in m/s",
            NumberKind::Seek => "show time to go to in s",
        };
        format!("{asked}: {}", self.text)
    }

    /// The command, or why it is none.
    pub(super) fn request(&self) -> Result<Request, String> {
        let value = self.text.parse().ok().filter(|value: &f64| value.is_finite());
        let value = value.ok_or_else(|| format!("{:?} is not a number: nothing was sent", self.text))?;
        Ok(match self.kind {
            NumberKind::Speed => Request::Speed { speed_mps: value },
            NumberKind::Seek => Request::Seek { sim_time_s: value },
        })
    }
}

/// So long the confirmation stands, in nanoseconds.
const STANDS_NS: u64 = 5_000_000_000;

/// The confirmation: which command, since when it is asked, and of what show: its run and its state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Confirmation {
    request: Request,
    asked_ns: u64,
    about: Option<(u64, u32)>,
}

impl Confirmation {
    /// Asks about a release or a seek.
    pub(super) fn ask(request: Request, snapshot: &Snapshot, now_ns: u64) -> Self {
        Self { request, asked_ns: now_ns, about: about(snapshot) }
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
    pub(super) fn stands(&self, snapshot: &Snapshot, now_ns: u64) -> bool {
        now_ns.saturating_sub(self.asked_ns) < STANDS_NS && self.about == about(snapshot)
    }
}

fn about(snapshot: &Snapshot) -> Option<(u64, u32)> {
    let FrameHeader { run_id, state, .. } = snapshot.frame.as_ref()?.header;
    Some((run_id, state))
}

//! The prompts after a key: the entry of a number, or a confirmation.

use bench_dragon_ipc::Request;
use ratatui::crossterm::event::KeyCode;

use super::footer::CommandOutcome;
use super::look::Tone;
use crate::display::observe::Snapshot;
use crate::output::command_words::request_words;

/// Greatest length of an entry.
const LONGEST: usize = 16;

/// The number being typed.
#[derive(Clone, Debug)]
pub(super) struct NumberEntry {
    asked: &'static str,
    request: fn(f64) -> Request,
    text: String,
}

impl NumberEntry {
    pub(super) fn speed() -> Self {
        let request = |speed_mps| Request::Speed { speed_mps };
        Self { asked: "speed of the head in m/s", request, text: String::new() }
    }

    /// Entry of a seek: of a replay, the position in its recording.
    pub(super) fn seek(snapshot: &Snapshot) -> Self {
        let request = |show_time_s| Request::Seek { show_time_s };
        let asked = match snapshot.replay {
            Some(_) => "seconds since the first frame of the recording to seek to",
            None => "show time to seek to in s",
        };
        Self { asked, request, text: String::new() }
    }

    /// Adds a character, if it is printable ASCII and the entry is not full.
    pub(super) fn push(&mut self, character: char) {
        // An entry that is no number is shown as typed, and rejected at the enter key.
        if self.text.len() < LONGEST && character.is_ascii_graphic() {
            self.text.push(character);
        }
    }

    pub(super) fn take_back(&mut self) {
        self.text.pop();
    }

    /// The line on the screen. The cursor is at its end.
    pub(super) fn line(&self) -> String {
        format!("{}: {}", self.asked, self.text)
    }

    /// The command, or the reason for which the entry is invalid.
    pub(super) fn request(&self) -> Result<Request, String> {
        let value = self.text.parse().ok().filter(|value: &f64| value.is_finite());
        let value = value.ok_or_else(|| format!("{:?} is not a number: nothing was sent", self.text))?;
        Ok((self.request)(value))
    }
}

/// Time in nanoseconds for which a confirmation is valid, and the reason that the screen shows afterwards.
const VALID_NS: u64 = 5_000_000_000;
const NOT_CONFIRMED: &str = "it was not confirmed within 5 s";

/// The confirmation of a command: its start, and the show that it is about, by run and state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Confirmation {
    request: Request,
    asked_ns: u64,
    about: Option<(u64, u32)>,
}

impl Confirmation {
    /// Asks for confirmation of a release or a seek.
    pub(super) fn ask(request: Request, snapshot: &Snapshot, now_ns: u64) -> Self {
        Self { request, asked_ns: now_ns, about: about(snapshot) }
    }

    pub(super) fn text(&self) -> String {
        match self.request {
            Request::Release => "release the hold? press r again".to_owned(),
            request => format!("{}? the dragon jumps there: press enter again", request_words(request)),
        }
    }

    /// The key that confirms, and its action.
    pub(super) fn keys(&self) -> (&'static str, &'static str) {
        if self.request == Request::Release { ("r", "release") } else { ("enter", "seek") }
    }

    /// Returns the command, if this key confirms it.
    pub(super) fn answered_by(&self, code: KeyCode) -> Option<Request> {
        let key = if self.request == Request::Release { KeyCode::Char('r') } else { KeyCode::Enter };
        (code == key).then_some(self.request)
    }

    /// The reason for which the confirmation is no longer valid. It is valid for five seconds, and only for the same run and
    /// state.
    pub(super) fn withdrawn_because(&self, snapshot: &Snapshot, now_ns: u64) -> Option<&'static str> {
        if self.about != about(snapshot) {
            Some("the show has changed")
        } else if now_ns.saturating_sub(self.asked_ns) >= VALID_NS {
            Some(NOT_CONFIRMED)
        } else {
            None
        }
    }

    /// The line on the screen after the confirmation was withdrawn for a reason.
    pub(super) fn withdrawal(&self, reason: &str) -> CommandOutcome {
        CommandOutcome::new(format!("{}: not sent: {reason}", request_words(self.request)), Tone::Caution)
    }
}

fn about(snapshot: &Snapshot) -> Option<(u64, u32)> {
    snapshot.header().map(|header| (header.run_id, header.state))
}

#[cfg(test)]
mod tests {
    use bench_dragon_ipc::ShowState;
    use ratatui::crossterm::event::{KeyEvent, KeyModifiers};

    use super::*;
    use crate::display::watch::KeyAction;
    use crate::display::watch::sample::{new_screen, type_keys, walking};

    #[test]
    fn typed_numbers_are_sent_unchanged() {
        let (mut screen, snapshot) = (new_screen(false), walking(ShowState::Running, 1.0));
        let actions = type_keys(&mut screen, "s-12.5\n\nv0.8\ns1e2\n\n", &snapshot);
        let expected = [
            Request::Seek { show_time_s: -12.5 },
            Request::Speed { speed_mps: 0.8 },
            Request::Seek { show_time_s: 100.0 },
        ];
        assert_eq!(actions, expected.map(KeyAction::Command));
    }

    #[test]
    fn an_entry_that_is_no_number_is_not_sent_but_shown() {
        let (mut screen, snapshot) = (new_screen(false), walking(ShowState::Running, 1.0));
        for typed in ["1-2", "abc1", "inf"] {
            assert_eq!(type_keys(&mut screen, &format!("s{typed}\n"), &snapshot), []);
            let reply = screen.reply.take().expect("a reply").text;
            assert_eq!(reply, format!("{typed:?} is not a number: nothing was sent"));
        }
    }

    #[test]
    fn only_the_second_press_releases_with_and_without_caps_lock() {
        let snapshot = walking(ShowState::Held, 0.0);
        for keys in ["rr", "RR", "rR"] {
            let mut screen = new_screen(false);
            assert_eq!(type_keys(&mut screen, &keys[..1], &snapshot), []);
            assert_eq!(type_keys(&mut screen, &keys[1..], &snapshot), [KeyAction::Command(Request::Release)]);
            assert_eq!(type_keys(&mut screen, "r", &snapshot), [], "the next one asks again");
        }
    }

    #[test]
    fn only_the_second_enter_sends_a_seek() {
        let (mut screen, snapshot) = (new_screen(false), walking(ShowState::Running, 1.0));
        assert_eq!(type_keys(&mut screen, "s30\n", &snapshot), []);
        let confirmation = screen.confirmation.expect("a confirmation").text();
        assert_eq!(confirmation, "seek 30 s? the dragon jumps there: press enter again");
        assert_eq!(type_keys(&mut screen, "f\n", &snapshot), [], "another key withdraws it");
        let seek = Request::Seek { show_time_s: 30.0 };
        assert_eq!(type_keys(&mut screen, "s30\n\n", &snapshot), [KeyAction::Command(seek)]);
    }

    #[test]
    fn any_other_key_withdraws_a_release_and_escape_has_no_other_action() {
        let snapshot = walking(ShowState::Held, 0.0);
        for other in [KeyCode::Esc, KeyCode::Char('f'), KeyCode::Left, KeyCode::Char('y')] {
            let mut screen = new_screen(false);
            type_keys(&mut screen, "r", &snapshot);
            assert_eq!(screen.press(KeyEvent::new(other, KeyModifiers::NONE), &snapshot, 0), KeyAction::None);
            assert_eq!(type_keys(&mut screen, "r", &snapshot), [], "{other:?}");
        }
    }

    #[test]
    fn a_confirmation_is_withdrawn_after_five_seconds_or_if_the_show_changes() {
        let (held, running) = (walking(ShowState::Held, 0.0), walking(ShowState::Running, 1.0));
        let key = KeyEvent::new(KeyCode::Char('r'), KeyModifiers::NONE);
        for (before, after, after_ns, withdrawal) in [
            (&held, &held, 4_999_999_999, None),
            (&held, &held, 5_000_000_000, Some("release: not sent: it was not confirmed within 5 s")),
            (&held, &running, 1, Some("release: not sent: the show has changed")),
        ] {
            let mut screen = new_screen(false);
            screen.press(key, before, 0);
            let mut shown = screen.clone();
            assert_eq!(shown.see(after, after_ns), withdrawal.is_some(), "the screen has changed");
            assert_eq!(shown.reply.map(|reply| reply.text).as_deref(), withdrawal);
            let is_sent = screen.press(key, after, after_ns) == KeyAction::Command(Request::Release);
            assert_eq!(is_sent, withdrawal.is_none());
        }
    }
}

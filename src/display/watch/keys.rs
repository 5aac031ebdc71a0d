//! The handling of keys.

use bench_dragon_ipc::{Request, ShowState, Stop};
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::footer::CommandOutcome;
use super::look::Tone;
use super::prompt::{Confirmation, NumberEntry};
use super::screen::{Overlay, Screen};
use crate::display::observe::{Controls, Snapshot};
use crate::output::command_words::request_words;

/// The action for a key, in addition to a redraw of the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeyAction {
    /// No action.
    None,
    /// Sends a command to the server. Its answer goes to [`Screen::answer`].
    Command(Request),
    /// Restores the terminal and suspends the process.
    Suspend,
    /// Ends the program.
    Quit,
}

impl Screen {
    /// Handles a key at an instant of a monotonic clock, while this snapshot is shown.
    pub fn press(&mut self, key: KeyEvent, snapshot: &Snapshot, now_ns: u64) -> KeyAction {
        self.withdraw_confirmation(snapshot, now_ns);
        // Any key other than the answer withdraws the confirmation.
        let confirmation = self.confirmation.take();
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return match key.code {
                KeyCode::Char('c') => KeyAction::Quit,
                KeyCode::Char('z') => KeyAction::Suspend,
                _ => KeyAction::None,
            };
        }
        let code = without_caps_lock(key.code);
        // A hold never waits, not even for an incomplete number.
        if code == KeyCode::Char('h') && !self.is_read_only {
            (self.entry, self.overlay) = (None, None);
            return self.send(Request::Hold);
        }
        if self.entry.is_some() {
            return self.type_number(code, snapshot, now_ns);
        }
        if let Some(request) = confirmation.and_then(|confirmation| confirmation.answered_by(code)) {
            return self.command(request, snapshot);
        }
        if self.overlay.take().is_some() {
            return KeyAction::None;
        }
        match code {
            KeyCode::Char('r') if !self.is_read_only => self.ask(Request::Release, snapshot, now_ns),
            KeyCode::Esc if confirmation.is_some() => KeyAction::None,
            KeyCode::Char('q') | KeyCode::Esc => KeyAction::Quit,
            KeyCode::Char('?') => self.lay_over(Overlay::Help),
            KeyCode::Char('l') => self.lay_over(Overlay::Lamps),
            KeyCode::Char('a') => {
                self.past_contact = None;
                KeyAction::None
            }
            KeyCode::Char('k') => {
                self.alert_filter = self.alert_filter.next();
                KeyAction::None
            }
            code if self.camera.press(code, snapshot) => KeyAction::None,
            KeyCode::Char(character) if !self.is_read_only => self.press_command(character, snapshot),
            _ => KeyAction::None,
        }
    }

    fn lay_over(&mut self, overlay: Overlay) -> KeyAction {
        self.overlay = Some(overlay);
        KeyAction::None
    }

    /// Asks for confirmation of a release or a seek. Only a second press sends it.
    fn ask(&mut self, request: Request, snapshot: &Snapshot, now_ns: u64) -> KeyAction {
        if self.would_be_refused(request, snapshot) {
            return KeyAction::None;
        }
        self.confirmation = Some(Confirmation::ask(request, snapshot, now_ns));
        KeyAction::None
    }

    /// Whether the source would refuse a request. If so, the reply shows the reason.
    fn would_be_refused(&mut self, request: Request, snapshot: &Snapshot) -> bool {
        let controls = Controls::of(snapshot);
        let reason = controls.refusal(request);
        if let Some(reason) = reason {
            let text = format!("{}: not sent: {reason}", request_words(request));
            self.reply = Some(CommandOutcome::new(text, Tone::Caution));
        }
        reason.is_some()
    }

    /// Handles a key of a command to the server.
    fn press_command(&mut self, character: char, snapshot: &Snapshot) -> KeyAction {
        match character {
            ' ' => self.command(space_request(snapshot), snapshot),
            'g' => self.command(Request::Go, snapshot),
            '+' | '=' => self.step_speed(snapshot, 1.0),
            '-' | '_' => self.step_speed(snapshot, -1.0),
            'v' => self.type_in(NumberEntry::speed(), "speed", Controls::of(snapshot).speed),
            's' => self.type_in(NumberEntry::seek(snapshot), "seek", Controls::of(snapshot).seek),
            _ => KeyAction::None,
        }
    }

    fn step_speed(&mut self, snapshot: &Snapshot, steps: f64) -> KeyAction {
        let speed_mps = self.speed_steps.stepped(snapshot, steps);
        self.command(Request::Speed { speed_mps }, snapshot)
    }

    /// Begins the entry of a number, unless its command would be refused.
    fn type_in(&mut self, entry: NumberEntry, name: &str, refusal: Option<String>) -> KeyAction {
        match refusal.map(|reason| CommandOutcome::new(format!("{name}: not sent: {reason}"), Tone::Caution)) {
            Some(reply) => self.reply = Some(reply),
            None => self.entry = Some(entry),
        }
        KeyAction::None
    }

    fn type_number(&mut self, code: KeyCode, snapshot: &Snapshot, now_ns: u64) -> KeyAction {
        let Some(entry) = &mut self.entry else { return KeyAction::None };
        match code {
            KeyCode::Char(character) => entry.push(character),
            KeyCode::Backspace => entry.take_back(),
            KeyCode::Esc => self.entry = None,
            KeyCode::Enter => {
                let request = entry.request();
                self.entry = None;
                match request {
                    Ok(request @ Request::Seek { .. }) => return self.ask(request, snapshot, now_ns),
                    Ok(request) => return self.command(request, snapshot),
                    Err(why) => self.reply = Some(CommandOutcome::new(why, Tone::Caution)),
                }
            }
            _ => {}
        }
        KeyAction::None
    }

    fn command(&mut self, request: Request, snapshot: &Snapshot) -> KeyAction {
        if self.would_be_refused(request, snapshot) { KeyAction::None } else { self.send(request) }
    }

    fn send(&mut self, request: Request) -> KeyAction {
        if let Request::Speed { speed_mps } = request {
            self.speed_steps.ask(speed_mps);
        }
        self.reply = Some(CommandOutcome::sent(request));
        KeyAction::Command(request)
    }
}

/// The request of the space bar: a pause if the head walks and the show is not paused yet, else a resume.
pub(super) fn space_request(snapshot: &Snapshot) -> Request {
    let is_paused = snapshot.status.as_ref().is_some_and(|status| status.stops().has(Stop::Paused));
    let pauses = snapshot.state().is_some_and(ShowState::walks) && !is_paused;
    if pauses { Request::Pause } else { Request::Resume }
}

/// Converts letters to lower case, since a terminal reports Caps Lock like Shift. No key here needs Shift.
fn without_caps_lock(code: KeyCode) -> KeyCode {
    match code {
        KeyCode::Char(character) => KeyCode::Char(character.to_ascii_lowercase()),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::display::watch::sample::{new_screen, type_keys, walking};

    #[test]
    fn space_pauses_a_walking_head_and_resumes_a_standing_one() {
        for (state, request) in [
            (ShowState::Running, Request::Pause),
            (ShowState::Stopping, Request::Pause),
            (ShowState::Paused, Request::Resume),
        ] {
            assert_eq!(type_keys(&mut new_screen(false), " ", &walking(state, 1.0)), [KeyAction::Command(request)]);
        }
    }

    #[test]
    fn a_refusal_is_shown_without_sending_and_a_hold_is_always_sent() {
        let held = walking(ShowState::Held, 0.0);
        let mut watching = new_screen(false);
        assert_eq!(type_keys(&mut watching, " ", &held), []);
        let reply = watching.reply.take().expect("a reply").text;
        assert_eq!(reply, "resume: not sent: the show is held: release it first");
        let no_server = Snapshot::default();
        for (key, name) in [(" ", "resume"), ("r", "release"), ("+", "speed 1.1 m/s"), ("v", "speed"), ("s", "seek")] {
            assert_eq!(type_keys(&mut watching, key, &no_server), []);
            let reply = watching.reply.take().expect("a reply").text;
            assert_eq!(reply, format!("{name}: not sent: no server runs"));
        }
        assert_eq!(type_keys(&mut watching, "h", &no_server), [KeyAction::Command(Request::Hold)]);
    }

    #[test]
    fn a_hold_does_not_wait_for_an_incomplete_number() {
        let (mut screen, snapshot) = (new_screen(false), walking(ShowState::Running, 1.0));
        assert_eq!(type_keys(&mut screen, "s12h", &snapshot), [KeyAction::Command(Request::Hold)]);
        assert!(screen.entry.is_none());
    }

    #[test]
    fn h_holds_on_every_screen_with_and_without_caps_lock() {
        let snapshot = walking(ShowState::Running, 1.0);
        for key in ["h", "H"] {
            for before in ["", "s12", "v", "?", "r"] {
                let mut screen = new_screen(false);
                type_keys(&mut screen, before, &snapshot);
                let actions = type_keys(&mut screen, key, &snapshot);
                assert_eq!(actions, [KeyAction::Command(Request::Hold)], "{before}{key}");
                assert!(screen.entry.is_none() && screen.confirmation.is_none() && screen.overlay.is_none());
            }
        }
    }

    #[test]
    fn letters_have_the_same_action_under_caps_lock() {
        let (mut screen, snapshot) = (new_screen(false), walking(ShowState::Running, 1.0));
        let actions = type_keys(&mut screen, "S12\n\nV2\nFZXQ", &snapshot);
        let expected = [Request::Seek { show_time_s: 12.0 }, Request::Speed { speed_mps: 2.0 }].map(KeyAction::Command);
        assert_eq!(actions, [&expected[..], &[KeyAction::Quit]].concat());
        assert!(screen.camera.follows);
    }

    #[test]
    fn a_read_only_screen_sends_no_command() {
        let (mut screen, snapshot) = (new_screen(true), walking(ShowState::Running, 1.0));
        assert_eq!(type_keys(&mut screen, " hHrrRR+-=_v1\ns2\nf0[]zx", &snapshot), []);
        assert_eq!(type_keys(&mut screen, "q", &snapshot), [KeyAction::Quit]);
    }

    #[test]
    fn control_c_quits_and_control_z_suspends_on_every_screen() {
        let snapshot = walking(ShowState::Running, 1.0);
        for before in ["", "s1", "?"] {
            let mut screen = new_screen(false);
            type_keys(&mut screen, before, &snapshot);
            for (key, action) in [('z', KeyAction::Suspend), ('c', KeyAction::Quit)] {
                let event = KeyEvent::new(KeyCode::Char(key), KeyModifiers::CONTROL);
                assert_eq!(screen.press(event, &snapshot, 0), action);
            }
        }
    }

    #[test]
    fn escape_closes_the_help_cancels_an_entry_and_else_quits() {
        let (mut screen, snapshot) = (new_screen(false), walking(ShowState::Running, 1.0));
        let escape = KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE);
        type_keys(&mut screen, "?", &snapshot);
        assert_eq!(screen.press(escape, &snapshot, 0), KeyAction::None);
        type_keys(&mut screen, "s1", &snapshot);
        assert_eq!(screen.press(escape, &snapshot, 0), KeyAction::None);
        assert_eq!(screen.press(escape, &snapshot, 0), KeyAction::Quit);
    }
}

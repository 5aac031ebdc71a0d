//! What the keys do.

use bench_dragon_ipc::{Request, ShowState};
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::footer::CommandOutcome;
use super::prompt::{Confirmation, NumberEntry, NumberKind};
use super::screen::{Overlay, Screen};
use crate::display::observe::{Controls, Snapshot};

/// What is to be done about a key, beside drawing the screen anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeyAction {
    /// Nothing.
    None,
    /// A command to the server; its answer goes to [`Screen::answer`].
    Command(Request),
    /// The terminal is given back until the process is continued.
    Suspend,
    /// The end.
    Quit,
}

impl Screen {
    /// A key was hit, while this snapshot was shown, at this instant of a clock that never goes back.
    pub fn press(&mut self, key: KeyEvent, snapshot: &Snapshot, now_ns: u64) -> KeyAction {
        // Whatever is hit withdraws the confirmation, if it is not the answer.
        let confirmation = self.confirmation.take().filter(|confirmation| confirmation.stands(snapshot, now_ns));
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return match key.code {
                KeyCode::Char('c') => KeyAction::Quit,
                KeyCode::Char('z') => KeyAction::Suspend,
                _ => KeyAction::None,
            };
        }
        let code = without_caps_lock(key.code);
        // A hold never waits, not even for a number that is half typed.
        if code == KeyCode::Char('h') && !self.is_read_only() {
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
            KeyCode::Char('r') if !self.is_read_only() => self.ask(Request::Release, snapshot, now_ns),
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
            KeyCode::Char(character) if !self.is_read_only() => self.order(character, snapshot),
            _ => KeyAction::None,
        }
    }

    fn lay_over(&mut self, overlay: Overlay) -> KeyAction {
        self.overlay = Some(overlay);
        KeyAction::None
    }

    /// A safety stop is lifted, and the dragon put elsewhere, by the second press alone.
    fn ask(&mut self, request: Request, snapshot: &Snapshot, now_ns: u64) -> KeyAction {
        if self.would_be_refused(request, snapshot) {
            return KeyAction::None;
        }
        self.confirmation = Some(Confirmation::ask(request, snapshot, now_ns));
        KeyAction::None
    }

    /// Whether the source would refuse a request; then the reply says why.
    fn would_be_refused(&mut self, request: Request, snapshot: &Snapshot) -> bool {
        let controls = Controls::of(snapshot);
        let reason = controls.refusal(request);
        if let Some(reason) = reason {
            self.reply = Some(CommandOutcome::not_sent(request, reason));
        }
        reason.is_some()
    }

    /// A key for the server.
    fn order(&mut self, character: char, snapshot: &Snapshot) -> KeyAction {
        match character {
            ' ' => self.command(space_request(snapshot), snapshot),
            '+' | '=' => self.step_speed(snapshot, 1.0),
            '-' | '_' => self.step_speed(snapshot, -1.0),
            'v' => self.ask_for(NumberKind::Speed, snapshot),
            's' => self.ask_for(NumberKind::Seek, snapshot),
            _ => KeyAction::None,
        }
    }

    fn step_speed(&mut self, snapshot: &Snapshot, steps: f64) -> KeyAction {
        let speed_mps = self.speed_steps.stepped(snapshot, steps);
        self.command(Request::Speed { speed_mps }, snapshot)
    }

    fn ask_for(&mut self, kind: NumberKind, snapshot: &Snapshot) -> KeyAction {
        let refusal = match kind {
            NumberKind::Speed => ("speed", Controls::of(snapshot).speed),
            NumberKind::Seek => ("seek", Controls::of(snapshot).seek),
        };
        match refusal {
            (name, Some(reason)) => self.reply = Some(CommandOutcome::mistaken(format!("{name}: not sent: {reason}"))),
            (_, None) => self.entry = Some(NumberEntry::new(kind)),
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
                    Err(why) => self.reply = Some(CommandOutcome::mistaken(why)),
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

/// What the space bar asks for: a head that walks, and has not been paused already, is paused.
pub(super) fn space_request(snapshot: &Snapshot) -> Request {
    let is_paused = snapshot.status.as_ref().is_some_and(|status| status.stops().paused);
    let pauses = snapshot.state().is_some_and(ShowState::walks) && !is_paused;
    if pauses { Request::Pause } else { Request::Resume }
}

/// The key that was hit: a terminal tells a letter under Caps Lock as one with Shift, and no key here is both.
fn without_caps_lock(code: KeyCode) -> KeyCode {
    match code {
        KeyCode::Char(character) => KeyCode::Char(character.to_ascii_lowercase()),
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bench_dragon_geometry::clearance::PairClearance;
    use bench_dragon_ipc::{Alert, AlertKind, CommandReply, FrameHeader};
    use glam::DVec2;

    use super::*;
    use crate::display::observe::{FrameCopy, SourcePresence};
    use crate::display::watch::Look;
    use crate::safety::monitor::run_alert;

    fn snapshot(state: ShowState, head_speed_mps: f64) -> Snapshot {
        let header = FrameHeader { run_id: 1, state: state.to_wire(), head_speed_mps, ..FrameHeader::default() };
        let frame = Some(Arc::new(FrameCopy { header, handles: Vec::new() }));
        Snapshot { presence: SourcePresence::Live, frame, ..Snapshot::default() }
    }

    fn type_keys(screen: &mut Screen, keys: &str, snapshot: &Snapshot) -> Vec<KeyAction> {
        let code = |key| if key == '\n' { KeyCode::Enter } else { KeyCode::Char(key) };
        let events = keys.chars().map(|key| KeyEvent::new(code(key), KeyModifiers::NONE));
        events.map(|event| screen.press(event, snapshot, 0)).filter(|action| *action != KeyAction::None).collect()
    }

    fn screen(read_only: bool) -> Screen {
        Screen::new("dragon", Look::default(), read_only)
    }

    #[test]
    fn space_pauses_what_walks_and_resumes_what_stands() {
        for (state, request) in [
            (ShowState::Running, Request::Pause),
            (ShowState::Stopping, Request::Pause),
            (ShowState::Paused, Request::Resume),
        ] {
            assert_eq!(type_keys(&mut screen(false), " ", &snapshot(state, 1.0)), [KeyAction::Command(request)]);
        }
    }

    #[test]
    fn a_key_that_would_be_refused_answers_with_the_reason_and_a_hold_is_always_sent() {
        let held = snapshot(ShowState::Held, 0.0);
        let mut watching = screen(false);
        assert_eq!(type_keys(&mut watching, " ", &held), []);
        let told = watching.reply.take().expect("a line about it").text;
        assert_eq!(told, "resume: not sent: the show is held: release it first");
        let nobody = Snapshot::default();
        for (key, name) in [(" ", "resume"), ("r", "release"), ("+", "speed 1.1 m/s"), ("v", "speed"), ("s", "seek")] {
            assert_eq!(type_keys(&mut watching, key, &nobody), []);
            let told = watching.reply.take().expect("a line about it").text;
            assert_eq!(told, format!("{name}: not sent: no server runs"));
        }
        assert_eq!(type_keys(&mut watching, "h", &nobody), [KeyAction::Command(Request::Hold)]);
    }

    #[test]
    fn a_past_contact_stays_until_it_is_acknowledged() {
        let mut touching = snapshot(ShowState::Running, 1.0);
        touching.nearest = Some(PairClearance { benches: [0, 8], clearance_m: -0.001, point: DVec2::ZERO });
        let parted = snapshot(ShowState::Running, 1.0);
        let mut watching = screen(true);
        watching.see(&touching, 0);
        watching.see(&parted, 0);
        assert_eq!(watching.past_contact.as_deref(), Some("CONTACT 0-8 at 0.000 s"));
        type_keys(&mut watching, "a", &parted);
        assert_eq!(watching.past_contact, None);
        let mut told = snapshot(ShowState::Running, 1.0);
        let header = told.frame.as_ref().expect("a frame").header;
        let alert = Alert { bench_a: 3, bench_b: 9, ..run_alert(&header, AlertKind::Contact) };
        Arc::make_mut(&mut told.alerts).push(alert);
        watching.see(&told, 0);
        watching.see(&told, 0);
        assert_eq!(watching.past_contact.as_deref(), Some("CONTACT 3-9 at 0.000 s"));
    }

    #[test]
    fn typed_numbers_are_sent_as_they_stand() {
        let (mut screen, snapshot) = (screen(false), snapshot(ShowState::Running, 1.0));
        let actions = type_keys(&mut screen, "s-12.5\n\nv0.8\ns1e2\n\n", &snapshot);
        let expected = [
            Request::Seek { sim_time_s: -12.5 },
            Request::Speed { speed_mps: 0.8 },
            Request::Seek { sim_time_s: 100.0 },
        ];
        assert_eq!(actions, expected.map(KeyAction::Command));
    }

    #[test]
    fn what_is_no_number_is_not_sent_but_told() {
        let (mut screen, snapshot) = (screen(false), snapshot(ShowState::Running, 1.0));
        for typed in ["1-2", "abc1", "inf"] {
            assert_eq!(type_keys(&mut screen, &format!("s{typed}\n"), &snapshot), []);
            let told = screen.reply.take().expect("a line about it").text;
            assert_eq!(told, format!("{typed:?} is not a number: nothing was sent"));
        }
    }

    #[test]
    fn a_hold_does_not_wait_for_a_number_that_is_half_typed() {
        let (mut screen, snapshot) = (screen(false), snapshot(ShowState::Running, 1.0));
        assert_eq!(type_keys(&mut screen, "s12h", &snapshot), [KeyAction::Command(Request::Hold)]);
        assert_eq!(screen.entry, None);
    }

    #[test]
    fn h_holds_whatever_stands_on_the_screen_and_whether_caps_lock_is_on() {
        let snapshot = snapshot(ShowState::Running, 1.0);
        for key in ["h", "H"] {
            for before in ["", "s12", "v", "?", "r"] {
                let mut screen = screen(false);
                type_keys(&mut screen, before, &snapshot);
                assert_eq!(
                    type_keys(&mut screen, key, &snapshot),
                    [KeyAction::Command(Request::Hold)],
                    "{before}{key}"
                );
                assert_eq!((screen.entry, screen.confirmation, screen.overlay), (None, None, None));
            }
        }
    }

    #[test]
    fn only_a_second_press_releases_whether_caps_lock_is_on_or_not() {
        let snapshot = snapshot(ShowState::Held, 0.0);
        for keys in ["rr", "RR", "rR"] {
            let mut screen = screen(false);
            assert_eq!(type_keys(&mut screen, &keys[..1], &snapshot), []);
            assert_eq!(type_keys(&mut screen, &keys[1..], &snapshot), [KeyAction::Command(Request::Release)]);
            assert_eq!(type_keys(&mut screen, "r", &snapshot), [], "the next one asks again");
        }
    }

    #[test]
    fn a_seek_is_sent_by_the_second_enter_alone() {
        let (mut screen, snapshot) = (screen(false), snapshot(ShowState::Running, 1.0));
        assert_eq!(type_keys(&mut screen, "s30\n", &snapshot), []);
        let confirmation = screen.confirmation.expect("a confirmation").text();
        assert_eq!(confirmation, "seek 30 s? the dragon jumps there: enter again");
        assert_eq!(type_keys(&mut screen, "f\n", &snapshot), [], "another key withdraws it");
        let seek = Request::Seek { sim_time_s: 30.0 };
        assert_eq!(type_keys(&mut screen, "s30\n\n", &snapshot), [KeyAction::Command(seek)]);
    }

    #[test]
    fn any_other_key_withdraws_a_release_and_escape_does_nothing_else() {
        let snapshot = snapshot(ShowState::Held, 0.0);
        for other in [KeyCode::Esc, KeyCode::Char('f'), KeyCode::Left, KeyCode::Char('y')] {
            let mut screen = screen(false);
            type_keys(&mut screen, "r", &snapshot);
            assert_eq!(screen.press(KeyEvent::new(other, KeyModifiers::NONE), &snapshot, 0), KeyAction::None);
            assert_eq!(type_keys(&mut screen, "r", &snapshot), [], "{other:?}");
        }
    }

    #[test]
    fn a_release_is_not_asked_for_ever_nor_of_a_show_that_has_been_held_since() {
        let (held, running) = (snapshot(ShowState::Held, 0.0), snapshot(ShowState::Running, 1.0));
        let key = KeyEvent::new(KeyCode::Char('r'), KeyModifiers::NONE);
        for (before, after, after_ns, stands) in
            [(&held, &held, 4_999_999_999, true), (&held, &held, 5_000_000_000, false), (&held, &running, 1, false)]
        {
            let mut screen = screen(false);
            screen.press(key, before, 0);
            let was_withdrawn = screen.clone().see(after, after_ns);
            assert_eq!(was_withdrawn, !stands, "the screen shows it no longer");
            assert_eq!(screen.press(key, after, after_ns) == KeyAction::Command(Request::Release), stands);
        }
    }

    #[test]
    fn letters_do_the_same_under_caps_lock() {
        let (mut screen, snapshot) = (screen(false), snapshot(ShowState::Running, 1.0));
        let actions = type_keys(&mut screen, "S12\n\nV2\nFZXQ", &snapshot);
        let expected = [Request::Seek { sim_time_s: 12.0 }, Request::Speed { speed_mps: 2.0 }].map(KeyAction::Command);
        assert_eq!(actions, [&expected[..], &[KeyAction::Quit]].concat());
        assert!(screen.camera.follows());
    }

    #[test]
    fn steps_of_speed_add_up_before_the_head_walks_at_the_first_one() {
        let (mut screen, snapshot) = (screen(false), snapshot(ShowState::Running, 1.0));
        screen.see(&snapshot, 0);
        let actions = type_keys(&mut screen, "++-+", &snapshot);
        let speeds = [1.1, 1.2, 1.1, 1.2].map(|speed_mps| KeyAction::Command(Request::Speed { speed_mps }));
        assert_eq!(actions, speeds);
    }

    #[test]
    fn steps_of_speed_stay_within_what_the_server_takes_and_start_from_the_heads_own() {
        let mut screen = screen(false);
        for (tick, (at_mps, key, to_mps)) in (1..).zip([(9.96, "+", 10.0), (0.04, "-", 0.0), (0.73, "+", 0.8)]) {
            let snapshot = walking(at_mps, tick);
            screen.speed_steps.answer(Err(()));
            screen.see(&snapshot, 0);
            let expected = KeyAction::Command(Request::Speed { speed_mps: to_mps });
            assert_eq!(type_keys(&mut screen, key, &snapshot), [expected]);
        }
        screen.speed_steps.answer(Err(()));
        let paused = snapshot(ShowState::Paused, 0.0);
        screen.see(&paused, 0);
        let expected = KeyAction::Command(Request::Speed { speed_mps: 0.8 });
        assert_eq!(type_keys(&mut screen, "+", &paused), [expected], "a paused head had walked at 0.73 m/s");
    }

    #[test]
    fn a_step_after_somebody_elses_speed_starts_from_that() {
        let (mut screen, paused) = (screen(false), snapshot(ShowState::Paused, 0.0));
        let accepted = CommandReply { tick: 10, ..CommandReply::default() };
        screen.see(&snapshot(ShowState::Running, 1.0), 0);
        let faster = Request::Speed { speed_mps: 1.1 };
        assert_eq!(type_keys(&mut screen, "+", &paused), [KeyAction::Command(faster)]);
        screen.answer(CommandOutcome::to(faster, Ok(accepted)));
        for (tick, speed_mps) in [(11, 0.5), (12, 0.5)] {
            screen.see(&walking(speed_mps, tick), 0);
        }
        let expected = KeyAction::Command(Request::Speed { speed_mps: 0.6 });
        assert_eq!(type_keys(&mut screen, "+", &snapshot(ShowState::Running, 0.5)), [expected]);
    }

    #[test]
    fn steps_of_speed_add_up_while_the_head_is_on_its_way_to_them() {
        let (mut screen, snapshot) = (screen(false), snapshot(ShowState::Running, 1.0));
        screen.see(&snapshot, 0);
        let speeds = [1.1, 1.2].map(|speed_mps| Request::Speed { speed_mps });
        assert_eq!(type_keys(&mut screen, "++", &snapshot), speeds.map(KeyAction::Command));
        let accepted = |tick| Ok(CommandReply { tick, ..CommandReply::default() });
        // At the first of them for a while, and the second is not answered yet.
        screen.answer(CommandOutcome::to(speeds[0], accepted(10)));
        for tick in 11..15 {
            screen.see(&walking(1.1, tick), 0);
        }
        screen.answer(CommandOutcome::to(speeds[1], accepted(20)));
        // The same frame again says nothing new, and a ramp is no speed that the head keeps.
        for (speed_mps, tick) in [(1.1, 20), (1.1, 20), (1.12, 21), (1.14, 22), (1.16, 23)] {
            screen.see(&walking(speed_mps, tick), 0);
        }
        let expected = KeyAction::Command(Request::Speed { speed_mps: 1.3 });
        assert_eq!(type_keys(&mut screen, "+", &snapshot), [expected]);
    }

    fn walking(speed_mps: f64, tick: u64) -> Snapshot {
        at_tick(snapshot(ShowState::Running, speed_mps), tick)
    }

    fn at_tick(mut snapshot: Snapshot, tick: u64) -> Snapshot {
        let frame_copy = Arc::make_mut(snapshot.frame.as_mut().expect("a frame"));
        frame_copy.header.tick = tick;
        snapshot
    }

    #[test]
    fn a_screen_that_only_reads_gives_no_command_whatever_is_typed() {
        let (mut screen, snapshot) = (screen(true), snapshot(ShowState::Running, 1.0));
        assert_eq!(type_keys(&mut screen, " hHrrRR+-=_v1\ns2\nf0[]zx", &snapshot), []);
        assert_eq!(type_keys(&mut screen, "q", &snapshot), [KeyAction::Quit]);
    }

    #[test]
    fn control_c_quits_and_control_z_suspends_from_wherever() {
        let snapshot = snapshot(ShowState::Running, 1.0);
        for before in ["", "s1", "?"] {
            let mut screen = screen(false);
            type_keys(&mut screen, before, &snapshot);
            for (key, action) in [('z', KeyAction::Suspend), ('c', KeyAction::Quit)] {
                let event = KeyEvent::new(KeyCode::Char(key), KeyModifiers::CONTROL);
                assert_eq!(screen.press(event, &snapshot, 0), action);
            }
        }
    }

    #[test]
    fn escape_leaves_what_is_typed_then_the_help_then_the_program() {
        let (mut screen, snapshot) = (screen(false), snapshot(ShowState::Running, 1.0));
        let escape = KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE);
        type_keys(&mut screen, "?", &snapshot);
        assert_eq!(screen.press(escape, &snapshot, 0), KeyAction::None);
        type_keys(&mut screen, "s1", &snapshot);
        assert_eq!(screen.press(escape, &snapshot, 0), KeyAction::None);
        assert_eq!(screen.press(escape, &snapshot, 0), KeyAction::Quit);
    }
}

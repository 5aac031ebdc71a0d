//! What the keys do.

use bench_dragon_ipc::{Request, ShowState};
use ratatui::crossterm::event::{KeyCode, KeyEvent, KeyModifiers};

use super::condition::state;
use super::entry::{Entry, Subject};
use super::reply::Reply;
use super::screen::Screen;
use crate::observe::Scene;

/// What is to be done about a key, beside drawing the screen anew.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Action {
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
    /// A key was hit, while this scene was shown.
    pub fn press(&mut self, key: KeyEvent, scene: &Scene) -> Action {
        if key.modifiers.contains(KeyModifiers::CONTROL) {
            return match key.code {
                KeyCode::Char('c') => Action::Quit,
                KeyCode::Char('z') => Action::Suspend,
                _ => Action::None,
            };
        }
        // A hold never waits, not even for a number that is half typed.
        if key.code == KeyCode::Char('h') && !self.is_read_only() {
            self.entry = None;
            return self.command(Request::Hold);
        }
        if self.entry.is_some() {
            return self.type_number(key.code);
        }
        if std::mem::take(&mut self.helps) {
            return Action::None;
        }
        match key.code {
            KeyCode::Char('q') | KeyCode::Esc => Action::Quit,
            KeyCode::Char('?') => {
                self.helps = true;
                Action::None
            }
            code if self.camera.press(code, scene) => Action::None,
            KeyCode::Char(character) if !self.is_read_only() => self.order(character, scene),
            _ => Action::None,
        }
    }

    /// A key for the server.
    fn order(&mut self, character: char, scene: &Scene) -> Action {
        match character {
            ' ' if state(scene) == Some(ShowState::Running) => self.command(Request::Pause),
            // Where the show is held or finished, the server says what has to be done.
            ' ' => self.command(Request::Resume),
            'R' => self.command(Request::Release),
            '+' | '=' => self.step_speed(scene, 1.0),
            '-' | '_' => self.step_speed(scene, -1.0),
            'v' => self.ask_for(Subject::Speed),
            's' => self.ask_for(Subject::Seek),
            _ => Action::None,
        }
    }

    fn step_speed(&mut self, scene: &Scene, steps: f64) -> Action {
        let speed_mps = self.pace.stepped(scene, steps);
        self.command(Request::Speed { speed_mps })
    }

    fn ask_for(&mut self, subject: Subject) -> Action {
        self.entry = Some(Entry::new(subject));
        Action::None
    }

    fn type_number(&mut self, code: KeyCode) -> Action {
        let Some(entry) = &mut self.entry else { return Action::None };
        match code {
            KeyCode::Char(character) => entry.push(character),
            KeyCode::Backspace => entry.take_back(),
            KeyCode::Esc => self.entry = None,
            KeyCode::Enter => {
                let request = entry.request();
                self.entry = None;
                match request {
                    Ok(request) => return self.command(request),
                    Err(why) => self.reply = Some(Reply::mistaken(why)),
                }
            }
            _ => {}
        }
        Action::None
    }

    fn command(&mut self, request: Request) -> Action {
        if let Request::Speed { speed_mps } = request {
            self.pace.ask(speed_mps);
        }
        self.reply = Some(Reply::sent(request));
        Action::Command(request)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use bench_dragon_ipc::FrameHeader;

    use super::*;
    use crate::observe::Still;
    use crate::watch::Look;

    fn scene(state: ShowState, head_speed_mps: f64) -> Scene {
        let header = FrameHeader { run_id: 1, state: state.to_wire(), head_speed_mps, ..FrameHeader::default() };
        Scene { frame: Some(Arc::new(Still { header, handles: Vec::new() })), ..Scene::default() }
    }

    fn type_keys(screen: &mut Screen, keys: &str, scene: &Scene) -> Vec<Action> {
        let code = |key| if key == '\n' { KeyCode::Enter } else { KeyCode::Char(key) };
        let events = keys.chars().map(|key| KeyEvent::new(code(key), KeyModifiers::NONE));
        events.map(|event| screen.press(event, scene)).filter(|action| *action != Action::None).collect()
    }

    fn screen(read_only: bool) -> Screen {
        Screen::new("dragon", Look::default(), read_only)
    }

    #[test]
    fn space_pauses_what_walks_and_resumes_what_stands() {
        for (state, request) in [
            (ShowState::Running, Request::Pause),
            (ShowState::Paused, Request::Resume),
            (ShowState::Held, Request::Resume),
        ] {
            assert_eq!(type_keys(&mut screen(false), " ", &scene(state, 1.0)), [Action::Command(request)]);
        }
    }

    #[test]
    fn typed_numbers_are_sent_as_they_stand() {
        let (mut screen, scene) = (screen(false), scene(ShowState::Running, 1.0));
        let actions = type_keys(&mut screen, "s-12.5\nv0.8x\n", &scene);
        let expected = [Request::Seek { sim_time_s: -12.5 }, Request::Speed { speed_mps: 0.8 }];
        assert_eq!(actions, expected.map(Action::Command));
    }

    #[test]
    fn what_is_no_number_is_not_sent_but_told() {
        let (mut screen, scene) = (screen(false), scene(ShowState::Running, 1.0));
        assert_eq!(type_keys(&mut screen, "s1-2\n", &scene), []);
        let told = screen.reply.expect("a line about it").text;
        assert_eq!(told, "\"1-2\" is not a number: nothing was sent");
    }

    #[test]
    fn a_hold_does_not_wait_for_a_number_that_is_half_typed() {
        let (mut screen, scene) = (screen(false), scene(ShowState::Running, 1.0));
        assert_eq!(type_keys(&mut screen, "s12h", &scene), [Action::Command(Request::Hold)]);
        assert_eq!(screen.entry, None);
    }

    #[test]
    fn steps_of_speed_add_up_before_the_head_walks_at_the_first_one() {
        let (mut screen, scene) = (screen(false), scene(ShowState::Running, 1.0));
        screen.see(&scene);
        let actions = type_keys(&mut screen, "++-+", &scene);
        let speeds = [1.1, 1.2, 1.1, 1.2].map(|speed_mps| Action::Command(Request::Speed { speed_mps }));
        assert_eq!(actions, speeds);
    }

    #[test]
    fn steps_of_speed_stay_within_what_the_server_takes_and_start_from_the_heads_own() {
        let mut screen = screen(false);
        for (at_mps, key, to_mps) in [(9.96, "+", 10.0), (0.04, "-", 0.0), (0.73, "+", 0.8)] {
            let scene = scene(ShowState::Running, at_mps);
            screen.pace.forget();
            screen.see(&scene);
            let expected = Action::Command(Request::Speed { speed_mps: to_mps });
            assert_eq!(type_keys(&mut screen, key, &scene), [expected]);
        }
        screen.pace.forget();
        let paused = scene(ShowState::Paused, 0.0);
        screen.see(&paused);
        let expected = Action::Command(Request::Speed { speed_mps: 0.8 });
        assert_eq!(type_keys(&mut screen, "+", &paused), [expected], "a paused head had walked at 0.73 m/s");
    }

    #[test]
    fn a_screen_that_only_reads_gives_no_command_whatever_is_typed() {
        let (mut screen, scene) = (screen(true), scene(ShowState::Running, 1.0));
        assert_eq!(type_keys(&mut screen, " hR+-=_v1\ns2\nf0[]zx", &scene), []);
        assert_eq!(type_keys(&mut screen, "q", &scene), [Action::Quit]);
    }

    #[test]
    fn control_c_quits_and_control_z_suspends_from_wherever() {
        let scene = scene(ShowState::Running, 1.0);
        for before in ["", "s1", "?"] {
            let mut screen = screen(false);
            type_keys(&mut screen, before, &scene);
            for (key, action) in [('z', Action::Suspend), ('c', Action::Quit)] {
                let event = KeyEvent::new(KeyCode::Char(key), KeyModifiers::CONTROL);
                assert_eq!(screen.press(event, &scene), action);
            }
        }
    }

    #[test]
    fn escape_leaves_what_is_typed_then_the_help_then_the_program() {
        let (mut screen, scene) = (screen(false), scene(ShowState::Running, 1.0));
        let escape = KeyEvent::new(KeyCode::Esc, KeyModifiers::NONE);
        type_keys(&mut screen, "?", &scene);
        assert_eq!(screen.press(escape, &scene), Action::None);
        type_keys(&mut screen, "s1", &scene);
        assert_eq!(screen.press(escape, &scene), Action::None);
        assert_eq!(screen.press(escape, &scene), Action::Quit);
    }
}

//! `watch` in a terminal: it shows the values of the bus, its keys send commands, and it restores the terminal.

use std::fs;
use std::time::Duration;

use bench_dragon::config::Config;
use bench_dragon_geometry::clearance::ClearanceSearch;
use bench_dragon_ipc::ShowState;
use glam::DVec3;
use rustix::process::{Pid, Signal, kill_process, test_kill_process};
use test_support::eventually::{eventually, within};
use test_support::skip::has_programs;

use crate::reader::{Reader, Shot};
use crate::stage::{Stage, program};
use crate::tmux::{Settings, Stalled, Tmux};

/// Settings of a terminal with a shell.
const OF_A_SHELL: Settings = Settings { other_screen: false, cursor: true };
const DRAWN_ON: Settings = Settings { other_screen: true, cursor: false };

/// Longest wait for a prompt, which the screen shows for 5 s: a test that looks later does not see it.
const PROMPT_WAIT: Duration = Duration::from_secs(10);
/// Greatest number of tries to see a prompt or to confirm a command. On a busy machine, a prompt may lapse before the test sees
/// it, or before the key arrives.
const MOST_TRIES: usize = 20;

/// Whether tmux is installed. Skips the test if it is not.
fn has_terminal() -> bool {
    has_programs(&["tmux"])
}

/// Fails unless the watch has ended with this status and has restored the shell's terminal.
fn assert_given_back(terminal: &Tmux<'_>, status: u8) {
    terminal.await_prompt();
    assert_eq!(terminal.settings(), OF_A_SHELL);
    let told = terminal.shell("status=$?; clear; echo status $status; stty -a", &format!("status {status}\n"));
    for mode in ["echo", "icanon", "isig", "opost"] {
        assert!(told.split([' ', ';', '\n']).any(|word| word == mode), "{mode} is missing in\n{told}");
    }
}

/// Returns clearance and pair of a frame of the paper's dragon, as the screen shows them.
fn nearest_of(shot: &Shot) -> [String; 2] {
    let config = Config::load(None, |_| ()).expect("the paper's");
    let mut boards = Vec::new();
    let seen = |handle: &bench_dragon_ipc::HandleState| DVec3::from(handle.position_m);
    config.lead().place_boards_at(&shot.handles, seen, &mut boards);
    let nearest = ClearanceSearch::default().nearest(&boards).expect("the dragon has at least three boards");
    let [one, another] = nearest.benches;
    [format!("clearance {:.3} mm", nearest.clearance_m * 1e3), format!("benches {one} and {another}")]
}

/// Asks for a command until the test sees its prompt.
fn ask_until_shown(terminal: &Tmux<'_>, prompt: &str, ask: impl Fn()) {
    let is_shown = || {
        ask();
        within(PROMPT_WAIT, || if terminal.text().contains(prompt) { Ok(()) } else { Err(()) }).is_ok()
    };
    assert!((0..MOST_TRIES).any(|_| is_shown()), "{prompt:?} was not seen in\n{}", terminal.text());
}

/// Asks for a command and confirms it by a key. Asks again if the prompt has lapsed before the key arrived.
fn confirm(terminal: &Tmux<'_>, command: &str, prompt: &str, key: &str, ask: impl Fn()) {
    let accepted = format!("{command}: accepted");
    let too_late = format!("{command}: not sent: it was not confirmed within 5 s");
    for _ in 0..MOST_TRIES {
        ask_until_shown(terminal, prompt, &ask);
        terminal.press(key);
        let text = terminal.until("an outcome", |text| text.contains(&accepted) || text.contains(&too_late));
        if text.contains(&accepted) {
            return;
        }
    }
    panic!("{MOST_TRIES} confirmations of {command:?} came too late");
}

fn first_line(text: &str) -> Option<&str> {
    text.lines().next()
}

fn dots(text: &str) -> usize {
    text.chars().filter(|symbol| ('\u{2801}'..='\u{28ff}').contains(symbol)).count()
}

#[test]
fn the_screen_shows_what_is_on_the_bus_and_its_keys_steer_the_show() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--start-at", "100"]);
    let mut reader = Reader::join(&stage);
    let terminal = Tmux::open(&stage, "tmux-256color");
    terminal.run("", "watch");
    let text = terminal.until("the dragon, live", |text| text.contains("RUNNING") && dots(text) > 280);
    assert!(text.contains("m/s") && text.contains("space pause"), "{text}");
    assert_eq!(terminal.settings(), DRAWN_ON);

    terminal.press("Space");
    terminal.until_shown("pause: accepted, from tick");
    let paused = reader
        .read_until("the show is paused", |header| header.show_state() == Some(ShowState::Paused))
        .pop()
        .expect("a frame");
    let text = terminal.until("the pause", |text| text.contains("PAUSED"));
    let time = format!("t {:.3} s", paused.header.show_time_s());
    for told in nearest_of(&paused).iter().chain([&time]) {
        assert!(text.contains(told), "{told} is missing in\n{text}");
    }

    terminal.type_text("H");
    terminal.until_shown("HELD");
    reader.read_until("the show is held", |header| header.show_state() == Some(ShowState::Held));
    // The reply may arrive after the frame.
    terminal.until_shown("hold: accepted, from tick");
    terminal.press("Space");
    terminal.until_shown("resume: not sent: the show is held: release it first");
    let release = "release the hold? press r again";
    ask_until_shown(&terminal, release, || terminal.type_text("r"));
    terminal.press("Escape");
    terminal.until_shown("space resume");
    confirm(&terminal, "release", release, "R", || terminal.type_text("R"));
    reader.read_until("the show is not held", |header| header.show_state() != Some(ShowState::Held));
    terminal.until_shown("PAUSED");

    confirm(&terminal, "seek 300 s", "seek 300 s? the dragon jumps there: press enter again", "Enter", || {
        terminal.type_text("s300");
        terminal.until_shown("show time to seek to in s: 300");
        terminal.press("Enter");
    });
    terminal.until("300 s", |text| {
        ["t 300.000 s", "clearance 120.694 mm", "benches 0 and 21", "at 412.474 s"]
            .iter()
            .all(|told| text.contains(told))
    });
    terminal.type_text("v0.5");
    terminal.press("Enter");
    terminal.until_shown("speed 0.5 m/s: accepted");
    terminal.type_text("+");
    terminal.until_shown("speed 0.6 m/s: accepted");
    terminal.type_text("v11");
    terminal.press("Enter");
    terminal.until_shown("speed 11 m/s: refused: the speed is 11 m/s, must be from 0 to 10 m/s");

    // The next key starts from the speed of another client, which is visible only when the head walks.
    stage.run(&["ctl", "speed", "0.3"]).expect_clean();
    terminal.press("Space");
    for _ in 0..3 {
        let before = terminal.text();
        terminal.until("a snapshot at this speed", |text| {
            text.contains("0.300 m/s") && first_line(text) != first_line(&before)
        });
    }
    terminal.type_text("+");
    terminal.until_shown("speed 0.4 m/s: accepted");
    reader.read_until("the head walks at 0.4 m/s", |header| header.head_speed_mps == 0.4);

    terminal.type_text("q");
    assert_given_back(&terminal, 0);
    drop(terminal);
    server.stop();
}

#[test]
fn a_read_only_watch_sends_no_command() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let terminal = Tmux::open(&stage, "xterm");
    terminal.run("", "watch --read-only");
    terminal.until_shown("RUNNING");
    terminal.type_text(" hv1");
    terminal.press("Enter");
    terminal.type_text("?");
    let text = terminal.until_shown("all of the route");
    assert!(!text.contains("pause") && !text.contains("hold"), "{text}");
    // Any key closes the help. The keys before it have been read by then.
    terminal.type_text("?f");
    let text = terminal.until_shown("following the head");
    assert!(text.contains("RUNNING") && text.contains("read-only"), "{text}");
    terminal.press("C-c");
    assert_given_back(&terminal, 0);
    drop(terminal);
    server.stop();
}

#[test]
fn a_lost_server_is_shown_clearly_and_the_next_one_is_live() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let terminal = Tmux::open(&stage, "screen");
    terminal.run("", "watch");
    let text = terminal.until_shown("NO SERVER");
    assert!(text.contains("There is no server."), "{text}");
    let server = stage.serve(&["--rate", "100"]);
    terminal.until_shown("RUNNING");
    server.process.signal(Signal::STOP);
    terminal.until_shown("SILENT");
    server.process.signal(Signal::CONT);
    terminal.until_shown("RUNNING");
    server.process.kill();
    let text = terminal.until_shown("The server is gone.");
    assert_eq!(text.matches("LOST").count(), 2, "LOST is in the first line and across the plan:\n{text}");
    assert!(!text.contains("RUNNING"), "{text}");
    terminal.type_text("h");
    // Until the hold has failed: a hold that is under way would reach the next server.
    terminal.until("the hold's outcome", |text| text.contains("hold: ") && !text.contains("hold: sent"));
    let server = stage.serve(&["--rate", "100"]);
    terminal.until("the next run", |text| text.contains("RUNNING") && !text.contains("LOST"));
    let watch = Pid::from_raw(terminal.running_pid() as i32).expect("a process id");
    kill_process(watch, Signal::TERM).expect("the process runs");
    assert_given_back(&terminal, 0);
    drop(terminal);
    server.stop();
}

#[test]
fn a_braking_head_and_an_orderly_end_are_shown() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    fs::write(stage.path("slow.toml"), "[head]\naccel_mps2 = 0.1\n").expect("a file");
    let server = stage.serve(&["--config", "slow.toml", "--rate", "100", "--start-at", "100"]);
    let mut reader = Reader::join(&stage);
    let terminal = Tmux::open(&stage, "tmux-256color");
    terminal.run("", "watch");
    terminal.until_shown("RUNNING");
    terminal.until_shown("monitor missing");
    // From this speed it brakes for eight seconds. The test must see the screen in this time.
    reader.read_until("the head is fast", |header| header.head_speed_mps > 0.8);
    stage.run(&["ctl", "hold"]).expect_clean();
    let text = terminal.until("the braking head", |text| text.contains("STOPPING") && text.contains("stop "));
    assert!(!text.contains("contact "), "no contact is shown for a braking head:\n{text}");
    terminal.until_shown("ctl: hold, accepted from tick");
    terminal.until_shown("HELD");
    stage.run(&["ctl", "stop"]).expect_clean();
    let text = terminal.until_shown("The server has ended in order.");
    assert!(text.contains("ENDED") && !text.contains("LOST"), "{text}");
    terminal.type_text(" ");
    terminal.until_shown("resume: not sent: the show has ended");
    terminal.type_text("q");
    assert_given_back(&terminal, 0);
    drop(terminal);
    server.summary();
}

#[test]
fn a_suspended_watch_leaves_the_terminal_to_the_shell_and_resumes() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let terminal = Tmux::open(&stage, "tmux-256color");
    terminal.run("", "watch");
    terminal.until_shown("RUNNING");
    terminal.press("C-z");
    terminal.await_prompt();
    assert_eq!(terminal.settings(), OF_A_SHELL);
    let told = terminal.shell("stty -a", "icanon");
    assert!(told.contains(" icanon") && told.contains(" echo "), "{told}");
    terminal.type_text("fg");
    terminal.press("Enter");
    terminal.until("the plan again", |text| text.contains("RUNNING") && dots(text) > 280);
    assert_eq!(terminal.settings(), DRAWN_ON);
    terminal.resize(44, 14);
    terminal.until("a small screen", |text| {
        text.contains("RUNNING") && text.contains("clearance") && !text.contains("lateness")
    });
    terminal.resize(80, 24);
    terminal.until_shown("lateness");
    terminal.type_text("q");
    assert_given_back(&terminal, 0);
    drop(terminal);
    server.stop();
}

#[test]
fn a_watch_whose_terminal_is_closed_ends_and_leaves_nothing() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let terminal = Tmux::open(&stage, "tmux-256color");
    terminal.run("", "watch");
    terminal.until_shown("RUNNING");
    let watch = Pid::from_raw(terminal.running_pid() as i32).expect("a process id");
    terminal.close();
    eventually("the watch is gone", || test_kill_process(watch).is_err().then_some(()));
    server.stop();
}

/// Starts a watch that draws much, and stalls its terminal, so that the drawing blocks.
fn stall(stage: &Stage, terminal: &Tmux<'_>) -> (Pid, Stalled) {
    let mut reader = Reader::join(stage);
    terminal.run("", "watch");
    terminal.until_shown("RUNNING");
    terminal.type_text("f");
    terminal.until_shown("following the head");
    let watch = Pid::from_raw(terminal.running_pid() as i32).expect("a process id");
    let stalled = terminal.stall();
    // By then there were more frames than a terminal's buffer has room for.
    let tick = reader.next().header.tick;
    reader.read_to_tick(tick + 600);
    (watch, stalled)
}

#[test]
fn a_signal_ends_a_watch_when_its_stalled_terminal_continues() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--time-scale", "5"]);
    let terminal = Tmux::open(&stage, "tmux-256color");
    let (watch, stalled) = stall(&stage, &terminal);
    kill_process(watch, Signal::TERM).expect("the process runs");
    drop(stalled);
    assert_given_back(&terminal, 0);
    drop(terminal);
    server.stop();
}

#[test]
fn one_signal_ends_a_watch_on_a_stalled_terminal() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--time-scale", "5"]);
    let terminal = Tmux::open(&stage, "tmux-256color");
    let (watch, stalled) = stall(&stage, &terminal);
    kill_process(watch, Signal::TERM).expect("the process runs");
    eventually("the watch has ended", || test_kill_process(watch).is_err().then_some(()));
    drop(stalled);
    // The last sequence of the watch may lack its end, and the echo of a letter would become its end.
    terminal.press("Enter");
    terminal.until_shown("ready>");
    let told = terminal.shell("clear; stty -a", "icanon");
    assert!(told.contains(" icanon") && told.contains(" echo "), "{told}");
    drop(terminal);
    server.stop();
}

#[test]
fn a_second_signal_ends_a_watch_on_a_stalled_terminal() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--time-scale", "5"]);
    let terminal = Tmux::open(&stage, "tmux-256color");
    let (watch, stalled) = stall(&stage, &terminal);
    eventually("the watch is gone", || kill_process(watch, Signal::TERM).is_err().then_some(()));
    drop(stalled);
    // The last sequence of the watch may lack its end, and the echo of a letter would become its end.
    terminal.press("Enter");
    terminal.until_shown("ready>");
    let told = terminal.shell("clear; stty -a", "icanon");
    assert!(told.contains(" icanon") && told.contains(" echo "), "{told}");
    drop(terminal);
    server.stop();
}

#[test]
fn a_watch_that_ends_waits_for_the_command_in_flight_and_drops_the_others() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let terminal = Tmux::open(&stage, "tmux-256color");
    terminal.run("", "watch");
    terminal.until_shown("RUNNING");
    server.process.signal(Signal::STOP);
    terminal.type_text("    q");
    terminal.until_shown("pause: sent, waiting for the server's answer");
    server.process.signal(Signal::CONT);
    let text = terminal.await_prompt();
    assert_eq!(text.matches("pause: not sent: this program is ending").count(), 3, "{text}");
    drop(terminal);
    server.stop();
}

#[test]
fn no_color_is_respected_and_the_log_on_the_terminal_waits_for_the_end() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let terminal = Tmux::open(&stage, "tmux-256color");
    terminal.run("NO_COLOR=1 RUST_LOG=trace", "watch");
    let text = terminal.until("the dragon", |text| text.contains("RUNNING") && dots(text) > 280);
    assert!(!text.contains("TRACE") && !text.contains("DEBUG"), "{text}");
    assert!(!has_colours(&terminal.styled_text()), "{}", terminal.styled_text());
    terminal.type_text("q");
    let text = terminal.await_prompt();
    assert!(text.contains("TRACE") || text.contains("DEBUG"), "the log is printed at the end:\n{text}");

    // A log that is redirected to a file does not wait.
    let log = stage.path("log");
    terminal.run("RUST_LOG=trace", &format!("watch 2> {}", log.display()));
    terminal.until("the dragon", |text| text.contains("RUNNING") && dots(text) > 280);
    eventually("the log has a line", || {
        fs::read_to_string(&log).ok().filter(|told| told.contains("TRACE") || told.contains("DEBUG"))
    });
    assert_eq!(terminal.settings(), DRAWN_ON);
    terminal.type_text("q");
    terminal.await_prompt();

    terminal.run("", "watch");
    terminal.until("the dragon", |text| text.contains("RUNNING") && dots(text) > 280);
    assert!(has_colours(&terminal.styled_text()));
    terminal.type_text("q");
    assert_given_back(&terminal, 0);
    drop(terminal);
    server.stop();
}

/// Whether the text has a sequence that sets a colour (ECMA-48, SGR).
fn has_colours(styled: &str) -> bool {
    let sequences = styled.split("\u{1b}[").skip(1).filter_map(|rest| rest.split_once('m'));
    sequences.flat_map(|(sequence, _)| sequence.split([';', ':'])).any(|parameter| {
        parameter.parse().is_ok_and(|number: u8| matches!(number, 30..=38 | 40..=48 | 90..=97 | 100..=107))
    })
}

#[test]
fn an_unsuitable_terminal_is_refused_in_one_line() {
    if !has_terminal() {
        return;
    }
    let stage = Stage::new();
    let terminal = Tmux::open(&stage, "tmux-256color");
    for (kind, told) in [("dumb", "TERM is dumb"), ("", "TERM is not set")] {
        terminal.run(&format!("TERM={kind}"), "watch");
        terminal.until(told, |text| text.replace('\n', "").contains(told) && text.contains("bench-dragon echo"));
        assert_given_back(&terminal, 2);
    }
}

#[test]
fn a_pipe_is_refused_with_the_commands_to_use_instead() {
    let ended = test_support::process::Process::start(program(&["watch"])).end();
    assert_eq!(ended.code(), Some(2));
    let told = "error: watch needs a terminal; in a pipe use `bench-dragon hz` or `bench-dragon echo`\n";
    assert_eq!((ended.stdout.as_str(), ended.stderr.as_str()), ("", told));
}

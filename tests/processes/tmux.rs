//! A terminal of 80 by 24 cells with a shell: tmux, with its own server for each terminal.

use std::fs;
use std::process::Command;

use rustix::process::{Pid, Signal, kill_process};
use test_support::eventually::eventually_from;
use test_support::process::Process;

use crate::stage::Stage;

/// The prompt of the shell.
const PROMPT: &str = "ready>";

/// A terminal. When it is dropped, all processes in it end.
#[derive(Debug)]
pub(crate) struct Tmux<'a> {
    stage: &'a Stage,
}

/// The terminal's settings that a program must restore.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Settings {
    pub(crate) other_screen: bool,
    pub(crate) cursor: bool,
}

/// A terminal that accepts no output until this is dropped.
#[derive(Debug)]
pub(crate) struct Stalled {
    tmux: Pid,
}

impl<'a> Tmux<'a> {
    /// Opens a terminal of the type `kind` (TERM), and waits for its shell.
    pub(crate) fn open(stage: &'a Stage, kind: &str) -> Self {
        let settings = stage.path("tmux.conf");
        fs::write(&settings, format!("set -g default-terminal {kind}\nset -s escape-time 0\n")).expect("a file");
        let terminal = Self { stage };
        terminal.tell(&[
            "-f",
            settings.to_str().expect("a path of ASCII"),
            "new-session",
            "-d",
            "-x",
            "80",
            "-y",
            "24",
            "env -u RUST_LOG -u NO_COLOR -u ENV LC_ALL=C.UTF-8 PS1='ready> ' sh -i",
        ]);
        terminal.await_prompt();
        terminal
    }

    /// Types the program's command line for this stage after the text `before`, and presses enter.
    pub(crate) fn run(&self, before: &str, args: &str) {
        let program = env!("CARGO_BIN_EXE_bench-dragon");
        let instance = self.stage.domain().instance();
        self.type_text(&format!("clear; {before} {program} {args} --instance {instance}"));
        self.press("Enter");
    }

    /// Types characters as they are.
    pub(crate) fn type_text(&self, text: &str) {
        self.tell(&["send-keys", "-l", text]);
    }

    /// Presses a key, by its name in tmux.
    pub(crate) fn press(&self, key: &str) {
        self.tell(&["send-keys", key]);
    }

    /// Returns the text of the screen.
    pub(crate) fn text(&self) -> String {
        self.tell(&["capture-pane", "-p"])
    }

    /// Returns the text of the screen with its colour sequences.
    pub(crate) fn styled_text(&self) -> String {
        self.tell(&["capture-pane", "-p", "-e"])
    }

    /// Waits until the screen is as wanted.
    #[track_caller]
    pub(crate) fn until(&self, wanted: &str, is_so: impl Fn(&str) -> bool) -> String {
        eventually_from(&format!("{wanted} is on the screen"), || {
            let text = self.text();
            if is_so(&text) { Ok(text) } else { Err(text) }
        })
    }

    /// Waits until the screen shows this text.
    #[track_caller]
    pub(crate) fn until_shown(&self, wanted: &str) -> String {
        self.until(wanted, |text| text.contains(wanted))
    }

    /// Waits until the shell shows its prompt.
    #[track_caller]
    pub(crate) fn await_prompt(&self) -> String {
        self.until(PROMPT, |text| text.trim_end().lines().last().is_some_and(|line| line.trim_end() == PROMPT))
    }

    /// Runs a shell command, and waits for this text in its output. Returns the screen.
    pub(crate) fn shell(&self, command: &str, wanted: &str) -> String {
        self.type_text(command);
        self.press("Enter");
        self.until_shown(wanted);
        self.await_prompt()
    }

    pub(crate) fn settings(&self) -> Settings {
        let told = self.tell(&["display-message", "-p", "#{alternate_on} #{cursor_flag}"]);
        let flags: Vec<bool> = told.split_whitespace().map(|flag| flag == "1").collect();
        let [other_screen, cursor] = flags[..] else { panic!("{told}") };
        Settings { other_screen, cursor }
    }

    /// Returns the process id of the shell's running child.
    pub(crate) fn running_pid(&self) -> u32 {
        let shell = self.tell(&["display-message", "-p", "#{pane_pid}"]);
        let children = format!("/proc/{0}/task/{0}/children", shell.trim());
        let children = fs::read_to_string(children).expect("the shell runs");
        children.split_whitespace().next_back().and_then(|pid| pid.parse().ok()).expect("the shell has a child")
    }

    /// Changes the size of the terminal.
    pub(crate) fn resize(&self, columns: u16, rows: u16) {
        self.tell(&["resize-window", "-x", &columns.to_string(), "-y", &rows.to_string()]);
    }

    /// Makes the terminal accept no output until the returned value is dropped.
    pub(crate) fn stall(&self) -> Stalled {
        let tmux = self.tell(&["display-message", "-p", "#{pid}"]);
        let tmux = tmux.trim().parse().ok().and_then(Pid::from_raw).expect("a process id");
        kill_process(tmux, Signal::STOP).expect("the process runs");
        Stalled { tmux }
    }

    /// Closes the terminal of a running process.
    pub(crate) fn close(&self) {
        self.tell(&["kill-server"]);
    }

    fn tell(&self, args: &[&str]) -> String {
        let told = Process::start(self.command(args)).end();
        assert!(told.status.success(), "{args:?}: {}", told.stderr);
        told.stdout
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new("tmux");
        command.args(["-u", "-L", "test"]).args(args).env("TMUX_TMPDIR", self.stage.path("")).env_remove("TMUX");
        command
    }
}

impl Drop for Stalled {
    fn drop(&mut self) {
        kill_process(self.tmux, Signal::CONT).expect("it is there");
    }
}

impl Drop for Tmux<'_> {
    fn drop(&mut self) {
        // This fails if the terminal was closed before.
        let _ = self.command(&["kill-server"]).output();
    }
}

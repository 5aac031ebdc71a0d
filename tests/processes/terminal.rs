//! A pseudo-terminal for a program, from util-linux's `script`.

use std::process::Command;

use test_support::process::Process;
use test_support::skip::has_programs;

/// Runs a shell line in a terminal, and returns its whole output; `None` if `script` is missing.
pub(crate) fn in_terminal(line: &str, environment: &[(&str, &str)]) -> Option<String> {
    if !has_programs(&["script"]) {
        return None;
    }
    let mut script = Command::new("script");
    script.args(["--quiet", "--return", "--command", line, "/dev/null"]);
    script.env_remove("NO_COLOR").env("TERM", "xterm-256color").envs(environment.iter().copied());
    Some(Process::start(script).end().stdout)
}

//! A terminal that a program is run in: a pseudo-terminal of util-linux's `script`.

use std::process::Command;

use test_support::process::Process;
use test_support::skip::has_programs;

/// Runs a line of a shell in a terminal, and returns all that came onto it; `None` where there is no `script`.
pub(crate) fn in_terminal(line: &str, environment: &[(&str, &str)]) -> Option<String> {
    if !has_programs(&["script"]) {
        return None;
    }
    let mut script = Command::new("script");
    script.args(["--quiet", "--return", "--command", line, "/dev/null"]);
    script.env_remove("NO_COLOR").env("TERM", "xterm-256color").envs(environment.iter().copied());
    Some(Process::start(script).end().stdout)
}

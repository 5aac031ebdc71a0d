//! A terminal that a program is run in: a pseudo-terminal of util-linux's `script`.

use std::process::{Command, Stdio};

use crate::skip::skip;

/// Runs a line of a shell in a terminal, and returns all that came onto it; `None` where there is no `script`.
pub(crate) fn in_terminal(line: &str, environment: &[(&str, &str)]) -> Option<String> {
    let mut script = Command::new("script");
    script.args(["--quiet", "--return", "--command", line, "/dev/null"]).stdin(Stdio::null());
    script.env_remove("NO_COLOR").env("TERM", "xterm-256color").envs(environment.iter().copied());
    let Ok(output) = script.output() else {
        skip("script of util-linux is not installed");
        return None;
    };
    Some(String::from_utf8_lossy(&output.stdout).into_owned())
}

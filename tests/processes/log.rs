//! The log on stderr: messages of iceoryx2 about its clean-up appear only with `RUST_LOG`.

use std::process::Command;

use test_support::process::{Ended, Process};

use crate::stage::Stage;

/// Kills a server, and runs the next one, which removes the remains of the first.
fn run_after_kill(log: Option<&str>) -> Ended {
    let stage = Stage::new();
    stage.serve(&[]).process.kill();
    let mut next: Command = stage.command(&["serve", "--until", "0.01", "--format", "json"]);
    next.envs(log.map(|log| ("RUST_LOG", log)));
    Process::start(next).end()
}

#[test]
fn iceoryx2s_clean_up_is_logged_only_with_rust_log() {
    // Only their target identifies these lines.
    let shown = run_after_kill(Some("iceoryx2=trace"));
    assert_eq!(shown.code(), Some(0), "{}", shown.stderr);
    assert!(shown.stderr.lines().any(|line| line.trim_start().starts_with("TRACE")), "{}", shown.stderr);
    assert_eq!(run_after_kill(Some("iceoryx2=off")).expect_clean().stderr, "");
    run_after_kill(None).expect_clean();
}

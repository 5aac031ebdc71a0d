//! The log on stderr: iceoryx2's housekeeping stays out of it, and `RUST_LOG` shows it.

use std::process::Command;

use test_support::process::{Ended, Process};

use crate::stage::Stage;

/// Kills a server, and runs the next one, which clears away what the first has left.
fn run_after_kill(log: Option<&str>) -> Ended {
    let stage = Stage::new();
    stage.serve(&[]).process.kill();
    let mut next: Command = stage.command(&["serve", "--until", "0.01", "--format", "json"]);
    next.envs(log.map(|log| ("RUST_LOG", log)));
    Process::start(next).end()
}

#[test]
fn iceoryx2s_clean_up_is_logged_only_with_rust_log() {
    // Its lines are known by their target alone.
    let shown = run_after_kill(Some("iceoryx2=trace"));
    assert_eq!(shown.code(), Some(0), "{}", shown.stderr);
    assert!(shown.stderr.lines().any(|line| line.trim_start().starts_with("TRACE")), "{}", shown.stderr);
    assert_eq!(run_after_kill(Some("iceoryx2=off")).expect_clean().stderr, "");
    run_after_kill(None).expect_clean();
}

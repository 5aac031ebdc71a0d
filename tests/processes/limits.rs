//! Small limits of threads, memory and stack, and names with control characters: one line each, and no panic.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt as _;
use std::process::Command;

use test_support::process::{Ended, Process};
use test_support::skip::is_possible;

use crate::stage::{Stage, program};

/// Returns the program under limits that a shell sets.
fn limited(limits: &str, args: &[&str]) -> Command {
    let inside = program(args);
    let mut limited = Command::new("bash");
    limited.args(["-c", &format!("{limits} && exec \"$@\""), "bash"]).arg(inside.get_program()).args(inside.get_args());
    limited
}

/// Fails unless the program answered or printed one line, without a panic or a signal.
fn assert_answered(ended: &Ended, what: &str) {
    let told = &ended.stderr;
    assert!(!told.contains("panicked"), "{what}: {told}");
    match ended.code() {
        Some(0) => {}
        Some(1) => assert_eq!(told.lines().count(), 1, "{what}: {told}"),
        status => panic!("{what}: {status:?} {told}"),
    }
}

#[test]
fn a_small_stack_is_raised_or_named_in_one_line() {
    let raised = Process::start(limited("ulimit -S -s 64", &["solve", "contact"])).end();
    assert_eq!(raised.code(), Some(0), "{}", raised.stderr);
    let refused = Process::start(limited("ulimit -s 64", &["solve", "contact"])).end();
    assert_eq!(refused.code(), Some(1), "{}", refused.stderr);
    let expected = "error: the stack limit is 64 KiB, must be at least 1024 KiB: raise the limit, `ulimit -s 8192`\n";
    assert_eq!(refused.stderr, expected);
}

#[test]
fn threads_that_cannot_be_started_are_reported_in_one_line_with_the_limit() {
    let uid = "47113";
    if !is_possible(&["setpriv", "--reuid", uid, "--clear-groups"]) {
        return;
    }
    let mut refusals = 0;
    for threads in [1, 2, 3, 5] {
        for args in [
            &["solve", "sensitivity", "--steps", "1"][..],
            &["serve"],
            &["monitor"],
            &["view", "--listen", "127.0.0.1:0"],
            &["bridge", "zenoh"],
        ] {
            let runtime = tempfile::tempdir().expect("a folder");
            std::os::unix::fs::chown(runtime.path(), Some(47113), Some(47113)).expect("root may change the owner");
            let as_other = format!("ulimit -u {threads}");
            let inside = program(args);
            let mut command = Command::new("timeout");
            command.args(["--signal=INT", "1", "setpriv", "--reuid", uid, "--clear-groups", "bash", "-c"]);
            command.arg(format!("{as_other} && exec \"$@\"")).arg("bash").arg(inside.get_program()).args(args);
            command.env("XDG_RUNTIME_DIR", runtime.path());
            let ended = Process::start(command).end();
            let (what, told) = (format!("{args:?} with {threads} threads"), &ended.stderr);
            assert!(!told.contains("panicked"), "{what}: {told}");
            assert!(matches!(ended.code(), Some(0 | 1 | 124)), "{what}: {:?} {told}", ended.code());
            if ended.code() == Some(1) {
                assert_eq!(told.lines().filter(|line| line.starts_with("error: ")).count(), 1, "{what}: {told}");
                assert!(!told.contains("os error 11") || told.contains("`ulimit -u`"), "{what}: {told}");
                refusals += 1;
            }
        }
    }
    assert!(refusals > 0, "some limit is too small");
}

#[test]
fn a_small_address_space_ends_in_an_answer_or_one_line() {
    for megabytes in [64, 128, 256, 512] {
        let limit = format!("ulimit -v {}", megabytes << 10);
        for args in [&["solve", "contact"][..], &["solve", "sensitivity", "--steps", "1"]] {
            assert_answered(&Process::start(limited(&limit, args)).end(), &format!("{args:?} in {megabytes} MB"));
        }
    }
}

#[test]
fn control_characters_in_names_are_escaped_in_every_message() {
    let stage = Stage::new();
    let name = OsStr::from_bytes(b"a\x1b[2J\nerror: b\x07.toml");
    let path = stage.path("").join(name);
    for content in [None, Some("[dragon]\nbenches = 0\n")] {
        if let Some(content) = content {
            fs::write(&path, content).expect("a file");
        }
        let mut command = program(&["solve", "contact", "--config"]);
        command.arg(&path);
        let ended = Process::start(command).end();
        assert_eq!((ended.code(), ended.stderr.lines().count()), (Some(2), 1), "{}", ended.stderr);
        assert!(ended.stderr.contains(r"a\u{1b}[2J\nerror: b\u{7}.toml"), "{}", ended.stderr);
        assert!(!ended.stderr.trim_end().contains(char::is_control), "{:?}", ended.stderr);
    }
    let drawn = stage.path("").join(OsStr::from_bytes(b"b\x1b[31m.svg"));
    let mut command = program(&["solve", "contact", "--figure"]);
    command.arg(&drawn);
    let ended = Process::start(command).end().expect_clean();
    assert!(ended.stdout.contains(r"b\u{1b}[31m.svg") && !ended.stdout.contains('\u{1b}'), "{:?}", ended.stdout);
    let ended = Process::start(program(&["solve", "\u{1b}[2J"])).end();
    assert_eq!(ended.code(), Some(2));
    assert!(!ended.stderr.contains('\u{1b}'), "{:?}", ended.stderr);
}

#[test]
fn a_figure_of_a_dragon_that_touches_at_the_start_is_refused_in_one_line() {
    let stage = Stage::new();
    let config = stage.path("touching.toml");
    fs::write(&config, "[dragon]\nhole_offset_m = 1.0\n").expect("a file");
    let figure = stage.path("x.svg");
    let mut command = program(&["solve", "contact", "--profile", "--config"]);
    command.arg(&config).arg("--figure").arg(&figure);
    let ended = Process::start(command).end();
    assert_eq!((ended.code(), figure.exists()), (Some(1), false), "{}", ended.stderr);
    assert_eq!(ended.stderr, "error: --figure has nothing to show: benches touch at the start already\n");
    let mut command = program(&["solve", "contact", "--config"]);
    command.arg(&config).arg("--figure").arg(&figure);
    Process::start(command).end().expect_clean();
    assert!(figure.exists(), "the boards at the contact");
}

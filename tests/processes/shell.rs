//! Output for shells, terminals and manuals: completions, pages, colours and progress bars.

use std::fs;
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;
use test_support::process::Process;
use test_support::skip::has_programs;

use crate::stage::{Stage, program};
use crate::terminal::in_terminal;
use crate::tmux::Tmux;

const BINARY: &str = env!("CARGO_BIN_EXE_bench-dragon");

fn stdout(args: &[&str]) -> String {
    let ended = Process::start(program(args)).end();
    assert!(ended.status.success(), "{args:?}: {}", ended.stderr);
    ended.stdout
}

/// Writes the completions of a shell into a folder.
fn completions(folder: &Path, shell: &str) -> String {
    let path = folder.join(shell);
    fs::write(&path, stdout(&["completions", shell])).expect("the folder is writable");
    path.to_str().expect("a path in UTF-8").to_owned()
}

#[test]
fn bash_completes_commands_their_options_values_and_files() {
    let folder = TempDir::new().expect("a folder");
    let script = completions(folder.path(), "bash");
    fs::write(folder.path().join("stage.toml"), "").expect("the folder is writable");
    // compopt only works while keys are read.
    let complete = "source \"$0\"; compopt() { :; }; COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1));
        called=$(complete -p bench-dragon); called=${called##*-F }; called=${called%% *}
        \"$called\" bench-dragon \"${COMP_WORDS[COMP_CWORD]}\" \"${COMP_WORDS[COMP_CWORD - 1]}\"; echo \"${COMPREPLY[*]}\"";
    for (typed, completed) in [
        ("so", "solve"),
        ("solve po", "poses"),
        ("solve contact --pro", "--profile"),
        ("solve contact --format j", "json"),
        ("solve contact --config sta", "stage.toml"),
        ("ctl re", "resume release"),
        ("bridge osc --angle ra", "radians"),
        ("completions fi", "fish"),
    ] {
        let words = ["-c", complete, &script, "bench-dragon"].into_iter().chain(typed.split(' '));
        let mut bash = Command::new("bash");
        bash.args(words).current_dir(folder.path());
        let ended = Process::start(bash).end();
        assert_eq!((ended.stderr.as_str(), ended.stdout.trim_end()), ("", completed), "{typed}");
    }
}

#[test]
fn zsh_and_fish_accept_their_completions() {
    let folder = TempDir::new().expect("a folder");
    for shell in ["zsh", "fish"] {
        if has_programs(&[shell]) {
            let mut check = Command::new(shell);
            check.args(["-n", &completions(folder.path(), shell)]);
            Process::start(check).end().expect_clean();
        }
    }
}

#[test]
fn the_manual_has_a_page_for_every_command_without_warnings() {
    let folder = TempDir::new().expect("a folder");
    let out = folder.path().join("man/man1");
    let listed = stdout(&["man", "--out", out.to_str().expect("a path in UTF-8")]);
    let entries = fs::read_dir(&out).expect("the path exists").map(|entry| entry.expect("an entry").path());
    let mut pages: Vec<_> = entries.collect();
    pages.sort();
    let mut told: Vec<_> = listed.lines().map(Path::new).map(Path::to_owned).collect();
    told.sort();
    assert_eq!(pages, told);
    for name in ["bench-dragon.1", "bench-dragon-show.1", "bench-dragon-solve-contact.1", "bench-dragon-ctl-pause.1"] {
        assert!(pages.contains(&out.join(name)), "{name} in {listed}");
    }
    assert_eq!(
        stdout(&["man", "solve", "contact"]),
        fs::read_to_string(out.join("bench-dragon-solve-contact.1")).expect("text")
    );
    let has_groff = has_programs(&["groff"]);
    for page in pages {
        let text = fs::read_to_string(&page).expect("text");
        for section in [".SH NAME", ".SH SYNOPSIS", ".SH EXAMPLES", ".SH \"EXIT STATUS\""] {
            assert!(text.contains(section), "{section} in {}", page.display());
        }
        if has_groff {
            let mut groff = Command::new("groff");
            groff.args(["-ww", "-man", "-Tutf8"]).arg(&page);
            assert_eq!(Process::start(groff).end().stderr, "", "{}", page.display());
        }
    }
}

#[test]
fn only_terminals_without_no_color_get_colours() {
    let without = [("NO_COLOR", "1")];
    for args in ["--help", "solve", "hz --secons 3", "solve contact --config nowhere.toml", "doctor"] {
        let line = format!("{BINARY} {args}");
        let Some(coloured) = in_terminal(&line, &[]) else { return };
        let plain = in_terminal(&line, &without).expect("the first call succeeded");
        assert!(coloured.contains('\u{1b}'), "{args}: {coloured}");
        assert!(!plain.contains('\u{1b}'), "{args}: {plain}");
        let piped = Process::start(program(&args.split(' ').collect::<Vec<_>>())).end();
        assert!(![piped.stdout, piped.stderr].concat().contains('\u{1b}'), "{args}");
    }
}

#[test]
fn a_long_answer_shows_its_progress_on_a_terminal_only() {
    if has_programs(&["tmux"]) {
        let stage = Stage::new();
        let config = stage.path("long.toml");
        fs::write(&config, "[dragon]\nbenches = 2000\n").expect("the folder is writable");
        let terminal = Tmux::open(&stage, "tmux-256color");
        // This answer takes minutes.
        let question = "solve sensitivity --steps 100 --work 1000000 --config";
        terminal.type_text(&format!("clear; {BINARY} {question} {}", config.display()));
        terminal.press("Enter");
        terminal.until_shown(" %  answers");
        terminal.press("C-c");
        terminal.await_prompt();
    }
    let piped = Process::start(program(&["solve", "turn", "--shortest"])).end().expect_clean();
    assert!(piped.stdout.contains("least clearance") && !piped.stderr.contains(" % "), "{}", piped.stderr);
}

//! What shells, terminals and readers of manuals get: completions, pages, colours, bars.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

use crate::skip::skip;
use crate::stage::program;
use crate::terminal::in_terminal;

const BINARY: &str = env!("CARGO_BIN_EXE_bench-dragon");

/// A dragon so long that the question about its turn takes seconds.
const LONG_DRAGON: &str =
    "[dragon]\nbenches = 1500\n[route]\nkind = \"turnaround\"\npitch_m = 1.7\nstart_s = -3000\nend_s = 3000\n";

fn stdout(args: &[&str]) -> String {
    let output = program(args).output().expect("the program is there");
    assert!(output.status.success(), "{args:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("UTF-8")
}

/// Writes the completions of a shell into a folder.
fn completions(folder: &Path, shell: &str) -> String {
    let path = folder.join(shell);
    fs::write(&path, stdout(&["completions", shell])).expect("the folder is ours");
    path.to_str().expect("a path in UTF-8").to_owned()
}

#[test]
fn bash_completes_commands_their_options_values_and_files() {
    let folder = TempDir::new().expect("a folder");
    let script = completions(folder.path(), "bash");
    fs::write(folder.path().join("stage.toml"), "").expect("the folder is ours");
    // compopt has no effect but while keys are read.
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
        let output = Command::new("bash").args(words).current_dir(folder.path()).output().expect("bash is there");
        assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{typed}");
        assert_eq!(String::from_utf8_lossy(&output.stdout).trim_end(), completed, "{typed}");
    }
}

#[test]
fn zsh_and_fish_take_their_completions() {
    let folder = TempDir::new().expect("a folder");
    for shell in ["zsh", "fish"] {
        match Command::new(shell).args(["-n", &completions(folder.path(), shell)]).output() {
            Ok(output) => assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
            Err(_) => skip(&format!("{shell} is not installed")),
        }
    }
}

#[test]
fn the_manual_has_a_page_for_every_command_that_is_set_without_a_warning() {
    let folder = TempDir::new().expect("a folder");
    let out = folder.path().join("man/man1");
    let listed = stdout(&["man", "--out", out.to_str().expect("a path in UTF-8")]);
    let entries = fs::read_dir(&out).expect("it was made").map(|entry| entry.expect("an entry").path());
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
    for page in pages {
        let text = fs::read_to_string(&page).expect("text");
        for section in [".SH NAME", ".SH SYNOPSIS", ".SH EXAMPLES", ".SH \"EXIT STATUS\""] {
            assert!(text.contains(section), "{section} in {}", page.display());
        }
        match Command::new("groff").args(["-ww", "-man", "-Tutf8"]).arg(&page).output() {
            Ok(output) => assert_eq!(String::from_utf8_lossy(&output.stderr), "", "{}", page.display()),
            Err(error) if error.kind() == ErrorKind::NotFound => return skip("groff is not installed"),
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn colours_are_on_a_terminal_alone_and_not_under_no_color() {
    let without = [("NO_COLOR", "1")];
    for args in ["--help", "solve", "hz --secons 3", "solve contact --config nowhere.toml", "doctor"] {
        let line = format!("{BINARY} {args}");
        let Some(coloured) = in_terminal(&line, &[]) else { return };
        let plain = in_terminal(&line, &without).expect("it was there before");
        assert!(coloured.contains('\u{1b}'), "{args}: {coloured}");
        assert!(!plain.contains('\u{1b}'), "{args}: {plain}");
        let output = program(&args.split(' ').collect::<Vec<_>>()).output().expect("the program is there");
        assert!(![output.stdout, output.stderr].concat().contains(&0x1b), "{args}");
    }
}

#[test]
fn a_long_answer_shows_how_far_it_is_on_a_terminal_and_nothing_in_a_pipe() {
    let folder = TempDir::new().expect("a folder");
    let config = folder.path().join("long.toml");
    fs::write(&config, LONG_DRAGON).expect("the folder is ours");
    let config = config.to_str().expect("a path in UTF-8");
    let Some(shown) = in_terminal(&format!("{BINARY} solve turn --config {config}"), &[]) else { return };
    assert!(shown.contains(" %  passage"), "{shown}");
    let piped = program(&["solve", "turn", "--config", config]).output().expect("the program is there");
    assert_eq!(String::from_utf8_lossy(&piped.stderr), "");
    assert!(String::from_utf8_lossy(&piped.stdout).contains("least clearance"));
}

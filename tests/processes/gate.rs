//! `tests/run` itself, in a copy, with scripts in place of cargo, apt-get and python3: the packages that it installs, its exit
//! status, and its report of skipped tests.

use std::env;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Command;
use std::time::Duration;

use tempfile::TempDir;
use test_support::eventually::within;
use test_support::executable::write_executable;
use test_support::process::{Ended, Process};
use test_support::pytest::pytest;

/// Programs that `tests/run` calls, except those of the tests themselves.
const TOOLS: [&str; 12] = ["bash", "cat", "dirname", "id", "mkdir", "mktemp", "rm", "sed", "sort", "tail", "wc", "env"];

/// A folder with a copy of `tests/run`, and scripts in place of other programs.
struct Gate {
    folder: TempDir,
}

impl Gate {
    /// Creates the folder. `cargo` runs this shell line with cargo's arguments.
    fn new(cargo: &str) -> Self {
        let gate = Self { folder: TempDir::new().expect("a folder") };
        fs::create_dir(gate.path("tests")).expect("the folder is writable");
        fs::create_dir(gate.path("bin")).expect("the folder is writable");
        let original = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/run");
        write_executable(gate.path("tests/run"), fs::read(original).expect("a file of the repository"));
        for tool in TOOLS {
            let found =
                ["/usr/bin", "/bin"].iter().map(|folder| Path::new(folder).join(tool)).find(|path| path.exists());
            symlink(found.expect("every Linux has this program"), gate.path("bin").join(tool))
                .expect("the folder is writable");
        }
        gate.add("cargo", cargo);
        gate
    }

    /// Creates the folder with every program that `tests/run` would install.
    fn complete(cargo: &str) -> Self {
        let gate = Self::new(cargo);
        let run = fs::read_to_string(gate.path("tests/run")).expect("a text");
        let (_, programs) = run.split_once("programs=(").expect("the list of programs");
        let (programs, _) = programs.split_once(')').expect("a list has an end");
        for program in programs.split_whitespace().chain(["python3:python3-venv"]) {
            gate.add(program.split(':').next().expect("a name"), "exit 0");
        }
        gate
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.folder.path().join(name)
    }

    /// Adds a program, or replaces it.
    fn add(&self, name: &str, script: &str) {
        write_executable(self.path("bin").join(name), format!("#!/bin/sh\n{script}\n"));
    }

    /// Runs `tests/run` to its end.
    fn run(&self, args: &[&str], is_ci: bool) -> Ended {
        let mut command = Command::new(self.path("tests/run"));
        command.args(args).env("PATH", self.path("bin")).env("CARGO_TARGET_DIR", self.path("target"));
        command.env("BENCH_DRAGON_PYTHON", "python").env("BENCH_DRAGON_NODE", "node").env_remove("CI");
        // The folder of programs has no `nproc`.
        command.env("RUST_TEST_THREADS", "2");
        if is_ci {
            command.env("CI", "true");
        }
        Process::start(command).end()
    }
}

/// Returns the last lines of stdout.
fn last_lines(ended: &Ended, count: usize) -> Vec<&str> {
    let lines: Vec<&str> = ended.stdout.lines().collect();
    lines[lines.len().saturating_sub(count)..].to_vec()
}

const TWO_SKIPS: &str = r#"
    echo "processes::b: zsh is not installed" >> "$BENCH_DRAGON_SKIPPED"
    echo "processes::a: no network" >> "$BENCH_DRAGON_SKIPPED"
    echo "processes::b: zsh is not installed" >> "$BENCH_DRAGON_SKIPPED"
    echo "test result: ok""#;

#[test]
fn skipped_tests_are_counted_and_named_after_the_tests() {
    let ended = Gate::complete(TWO_SKIPS).run(&[], false);
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(0), ""));
    let expected =
        ["test result: ok", "skipped: 2", "    processes::a: no network", "    processes::b: zsh is not installed"];
    assert_eq!(last_lines(&ended, 4), expected);
    let none = Gate::complete("exit 0").run(&[], false);
    assert_eq!((none.code(), none.stdout.as_str(), none.stderr.as_str()), (Some(0), "skipped: none\n", ""));
}

#[test]
fn a_skipped_test_fails_the_run_where_ci_is_set() {
    let ended = Gate::complete(TWO_SKIPS).run(&[], true);
    assert_eq!(ended.code(), Some(1));
    assert_eq!(ended.stderr, "error: CI is set, so a skipped test is a failure\n");
    assert_eq!(Gate::complete("exit 0").run(&[], true).code(), Some(0));
}

#[test]
fn cargos_arguments_and_its_status_are_passed_on() {
    let gate = Gate::complete(r#"for arg in "$@"; do echo "<$arg>"; done; exit 42"#);
    let ended = gate.run(&["--test", "two words"], false);
    assert_eq!(ended.code(), Some(42));
    assert_eq!(last_lines(&ended, 3), ["<--test>", "<two words>", "skipped: none"]);
    let left: Vec<_> = fs::read_dir(gate.path("target")).expect("the path exists").flatten().collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn packages_that_cannot_be_installed_are_named_and_fail_the_run_where_ci_is_set() {
    for is_ci in [false, true] {
        let gate = Gate::complete("echo tested");
        fs::remove_file(gate.path("bin/zsh")).expect("the file existed");
        gate.add("id", "echo 0");
        gate.add("apt-get", "echo \"apt-get $@\"; exit 100");
        let ended = gate.run(&[], is_ci);
        let (status, stdout) = if is_ci { (1, "") } else { (0, "tested\nskipped: none\n") };
        assert_eq!((ended.code(), ended.stdout.as_str()), (Some(status), stdout), "{}", ended.stderr);
        assert!(ended.stderr.ends_with("not installed: zsh\n"), "{}", ended.stderr);
        assert!(ended.stderr.contains("apt-get update"), "the reason is shown: {}", ended.stderr);
    }
}

#[test]
fn missing_packages_are_installed() {
    let gate = Gate::complete("echo tested");
    fs::remove_file(gate.path("bin/zsh")).expect("the file existed");
    gate.add("id", "echo 0");
    let zsh = gate.path("bin/zsh");
    let install = format!("case $1 in install) echo '#!/bin/sh' > {0}; chmod +x {0};; esac", zsh.display());
    gate.add("apt-get", &install);
    symlink("/bin/chmod", gate.path("bin/chmod")).expect("the folder is writable");
    let ended = gate.run(&[], true);
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(0), ""), "{}", ended.stdout);
    assert!(zsh.exists());
}

#[test]
fn a_python_test_that_is_skipped_is_noted_and_fails_where_ci_is_set() {
    let folder = TempDir::new().expect("a folder");
    let (file, list) = (folder.path().join("test_lacking.py"), folder.path().join("skipped"));
    let tests = "import pytest\n\n@pytest.mark.skip(reason='no desk')\ndef test_marked():\n    pass\n
def test_called():\n    pytest.skip('no lamp')\n\n@pytest.mark.xfail\ndef test_expected():\n    assert False\n";
    fs::write(&file, tests).expect("the folder is writable");
    let run = |is_ci: bool| {
        let mut command = pytest(file.to_str().expect("the path is UTF-8"));
        command.env("BENCH_DRAGON_SKIPPED", &list).env_remove("CI");
        if is_ci {
            command.env("CI", "true");
        }
        Process::start(command).end().code()
    };
    assert_eq!(run(false), Some(0));
    let noted = fs::read_to_string(&list).expect("the path exists");
    let noted: Vec<&str> = noted.lines().filter_map(|line| Some(line.split_once("::")?.1)).collect();
    assert_eq!(noted, ["test_marked: no desk", "test_called: no lamp"]);
    assert_eq!(run(true), Some(1));
}

#[test]
fn a_rust_test_that_is_skipped_is_noted_and_fails_where_ci_is_set() {
    let folder = TempDir::new().expect("a folder");
    let list = folder.path().join("skipped");
    let run = |is_ci: bool| {
        let mut command = Command::new(env::current_exe().expect("the path of this program"));
        // Without a PATH, the test finds no shell.
        command.args(["shell::zsh_and_fish_accept_their_completions", "--exact"]).env("PATH", "");
        command.env("BENCH_DRAGON_SKIPPED", &list).env_remove("CI");
        if is_ci {
            command.env("CI", "true");
        }
        Process::start(command).end()
    };
    assert_eq!(run(false).code(), Some(0));
    let name = "processes::shell::zsh_and_fish_accept_their_completions";
    let lacking = |shell: &str| format!("{name}: {shell} is not installed (tests/run installs it on Debian as root)\n");
    assert_eq!(fs::read_to_string(&list).expect("the path exists"), [lacking("zsh"), lacking("fish")].concat());
    let failed = run(true);
    assert!(failed.code() == Some(101) && failed.stdout.contains("skipped, and CI is set: zsh"), "{failed:?}");
}

#[test]
fn a_wait_of_zero_length_looks_once_and_returns_the_result() {
    assert_eq!(within(Duration::ZERO, || Err::<(), _>("asleep")), Err("asleep"));
    assert_eq!(within(Duration::ZERO, || Ok::<_, ()>(7)), Ok(7));
}

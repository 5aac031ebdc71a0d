//! Python programs and tests, run by the interpreter that `tests/run` installs.

use std::env;
use std::ffi::OsStr;
use std::process::Command;

use crate::eventually::DEADLINE;
use crate::process::Process;

const PYTHON: &str = "BENCH_DRAGON_PYTHON";
/// Folder of the project.
const PROJECT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../..");

/// Returns the interpreter with the packages of tests/requirements.txt, with the project's folder as working directory.
pub fn python() -> Command {
    let python = env::var_os(PYTHON).unwrap_or_else(|| {
        panic!("{PYTHON} is not set: run the tests with tests/run, which installs tests/requirements.txt and sets it")
    });
    let mut command = Command::new(python);
    command.current_dir(PROJECT).env("PYTHONDONTWRITEBYTECODE", "1").env("PYTHONUNBUFFERED", "1");
    command
}

/// Runs the tests of a file in `tests/python`.
#[track_caller]
pub fn run(file: &str, variables: &[(&str, &OsStr)]) {
    run_at(&format!("tests/python/{file}"), variables);
}

/// Runs the tests of a Python file or folder.
#[track_caller]
pub fn run_at(path: &str, variables: &[(&str, &OsStr)]) {
    let mut command = pytest(path);
    command.envs(variables.iter().copied());
    expect_passed(command);
}

/// Returns the command that runs pytest on a file or folder. It prints one line per test. A test that hangs is ended before the
/// deadline of its line, and the stacks of its threads are printed. Skipped tests are noted in the same list as skipped Rust
/// tests.
pub fn pytest(path: &str) -> Command {
    let longest = format!("faulthandler_timeout={}", (DEADLINE * 2 / 3).as_secs());
    let mut command = python();
    command.args(["-m", "pytest", "--verbose", "-r", "s", "-p", "no:cacheprovider", "-p", "skips"]);
    command.args(["-o", &longest, "-o", "faulthandler_exit_on_timeout=true", path]);
    command.env("PYTHONPATH", format!("{PROJECT}/tests/python"));
    command
}

/// Runs pytest. Fails with its report if a test fails.
#[track_caller]
pub fn expect_passed(command: Command) {
    let mut pytest = Process::start(command);
    let mut report = String::new();
    // The report is read line by line, so the deadline applies to each test and not to all together.
    while let Some(line) = pytest.next_line() {
        report += &(line + "\n");
    }
    let ended = pytest.end();
    assert!(ended.status.success(), "{report}{}", ended.stderr);
}

//! What the stock Python packages read, live and from a recording, with no code of ours but the layout; what they must find
//! is in `tests/python`. And our own package, whose tests are beside it.

use std::env;
use std::ffi::OsStr;
use std::process::Command;

use crate::stage::Stage;

const PYTHON: &str = "BENCH_DRAGON_PYTHON";

/// The interpreter that has the packages of tests/requirements.txt, in the project's folder.
pub(crate) fn python() -> Command {
    let python = env::var_os(PYTHON).unwrap_or_else(|| {
        panic!("{PYTHON} is not set: run the tests with tests/run, which installs tests/requirements.txt and sets it")
    });
    let mut command = Command::new(python);
    command.current_dir(env!("CARGO_MANIFEST_DIR")).env("PYTHONDONTWRITEBYTECODE", "1");
    command
}

/// Runs the tests of a file in `tests/python`.
pub(crate) fn run(file: &str, variables: &[(&str, &OsStr)]) {
    run_at(&format!("tests/python/{file}"), variables);
}

/// Runs the tests of a Python file or folder.
fn run_at(path: &str, variables: &[(&str, &OsStr)]) {
    let output = python()
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider", path])
        .envs(variables.iter().copied())
        .output()
        .expect("a Python interpreter");
    assert!(
        output.status.success(),
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
}

#[test]
fn the_stock_iceoryx2_package_reads_the_bus_live() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20", "--time-scale", "2"]);
    let variables = [
        ("BENCH_DRAGON", OsStr::new(env!("CARGO_BIN_EXE_bench-dragon"))),
        ("BENCH_DRAGON_INSTANCE", OsStr::new(stage.domain().instance().as_str())),
    ];
    run("test_live.py", &variables);
    server.stop();
}

#[test]
fn the_python_package_reads_and_commands_live_servers() {
    run_at("ipc/python/tests", &[("BENCH_DRAGON", OsStr::new(env!("CARGO_BIN_EXE_bench-dragon")))]);
}

//! Skipped tests, which lack a program or a right on this machine. `tests/run` counts and names them at the end. If `CI` is
//! set, such a test fails.

use std::env;
use std::io::Write as _;
use std::process::{Command, Stdio};

use crate::list;

/// Environment variable with the path of the list of skipped tests, one per line, for `tests/run`.
const LIST: &str = "BENCH_DRAGON_SKIPPED";

/// Notes that the running test is skipped, at least in part. `why` names the missing requirement.
///
/// # Panics
/// If `CI` is set: there, no requirement may be missing.
#[track_caller]
pub fn skip(why: &str) {
    let line = format!("{}: {why}\n", list::test());
    // The test runner hides the output of passing tests, and stderr may be closed.
    let _ = write!(std::io::stderr(), "\nskipped: {line}");
    list::note(LIST, &line);
    assert!(env::var_os("CI").is_none_or(|ci| ci.is_empty()), "skipped, and CI is set: {why}");
}

/// Whether these programs are installed. Skips the test if one is missing.
#[track_caller]
pub fn has_programs(programs: &[&str]) -> bool {
    let path = env::var_os("PATH").unwrap_or_default();
    let missing = programs.iter().find(|program| !env::split_paths(&path).any(|folder| folder.join(program).exists()));
    if let Some(program) = missing {
        skip(&format!("{program} is not installed (tests/run installs it on Debian as root)"));
    }
    missing.is_none()
}

/// Whether a launcher can start `true`. Skips the test if it cannot.
#[track_caller]
pub fn is_possible(launcher: &[&str]) -> bool {
    let possible = can_start(launcher);
    if !possible {
        skip(&format!("`{}` is not possible here", launcher.join(" ")));
    }
    possible
}

/// Whether a launcher can start `true`.
pub fn can_start(launcher: &[&str]) -> bool {
    let [program, args @ ..] = launcher else { panic!("a launcher has a name") };
    let tried = Command::new(program).args(args).arg("true").stdout(Stdio::null()).stderr(Stdio::null()).status();
    tried.is_ok_and(|status| status.success())
}

//! Executable files that a test writes.

use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

/// Writes an executable file, in a process of its own. It takes the place of a link of that name, and leaves the link's target as it is.
///
/// A file that a test itself writes may be open for writing also in a child that another test is starting at that
/// instant. As long as it is, the kernel does not execute it (`ETXTBSY`).
///
/// # Panics
/// Panics if the file cannot be written.
pub fn write_executable(path: impl AsRef<Path>, contents: impl AsRef<[u8]>) {
    let path = path.as_ref();
    let mut install = Command::new("install");
    install.args(["-m", "755", "/dev/stdin"]).arg(path).stdin(Stdio::piped());
    let mut child = install.spawn().expect("every Linux has install");
    let mut stdin = child.stdin.take().expect("stdin is piped");
    stdin.write_all(contents.as_ref()).expect("install reads its stdin");
    drop(stdin);
    assert!(child.wait().expect("it is a child of the test").success(), "{} cannot be written", path.display());
}

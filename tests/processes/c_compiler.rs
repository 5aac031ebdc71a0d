//! The C library as other programs use it: installed, then compiled and linked with the machine's own tools.

use std::env;
use std::ffi::OsStr;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

use test_support::process::{Ended, Process};

use crate::stage::Stage;

const SOURCES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/ipc/c");

/// Flags that make every warning an error.
const STRICT: [&str; 5] = ["-Wall", "-Wextra", "-Wpedantic", "-Werror", "-pthread"];

/// The language of a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Language {
    C99,
    Cpp17,
}

/// The kind of linkage of a client.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Linkage {
    Shared,
    Static,
}

/// Installs the library once for the tests of this process, from the libraries that cargo has built beside the test.
pub(crate) fn prefix() -> &'static Path {
    static PREFIX: OnceLock<PathBuf> = OnceLock::new();
    PREFIX.get_or_init(|| {
        let prefix = Path::new(env!("CARGO_TARGET_TMPDIR")).join("c-library");
        let mut install = Command::new(format!("{SOURCES}/install.sh"));
        install.arg("--libraries").arg(built_libraries()).arg(&prefix);
        succeed(install);
        prefix
    })
}

/// The folder with the libraries that cargo has built beside the test.
pub(crate) fn built_libraries() -> PathBuf {
    let program = env::current_exe().expect("a process knows its program");
    program.parent().expect("a program is in a folder").to_owned()
}

/// Compiles a client of `ipc/c/tests` into a test's folder.
pub(crate) fn compile(stage: &Stage, source: &str, language: Language, linkage: Linkage) -> PathBuf {
    let program = stage.path(&format!("{source}-{language:?}-{linkage:?}"));
    compile_at(Path::new(&format!("{SOURCES}/tests/{source}")), program, language, linkage)
}

/// Compiles a client.
pub(crate) fn compile_at(source: &Path, program: PathBuf, language: Language, linkage: Linkage) -> PathBuf {
    let mut compiler = match language {
        Language::C99 => with(Command::new("gcc"), &["-std=c99"]),
        Language::Cpp17 => with(Command::new("g++"), &["-std=c++17", "-x", "c++"]),
    };
    compiler.args(STRICT).args(pkg_config(&["--cflags"])).arg(source);
    compiler.args(["-x", "none", "-o"]).arg(&program);
    match linkage {
        Linkage::Shared => {
            compiler.args(pkg_config(&["--libs"])).arg(format!("-Wl,-rpath,{}", library_folder().display()))
        }
        Linkage::Static => compiler.args(pkg_config(&["--variable=static_library"])).args(private_libraries()),
    };
    succeed(compiler);
    program
}

/// Runs a tool, fails unless it succeeds, and returns its stdout.
pub(crate) fn succeed(command: Command) -> String {
    let line = format!("{command:?}");
    let Ended { status, stdout, stderr } = Process::start(command).end();
    assert!(status.success(), "{line}\n{stdout}{stderr}");
    stdout
}

fn with(mut command: Command, args: &[&str]) -> Command {
    command.args(args);
    command
}

fn library_folder() -> PathBuf {
    prefix().join("lib")
}

/// Returns the output of pkg-config for the installed library.
fn pkg_config(args: &[&str]) -> Vec<String> {
    let path = library_folder().join("pkgconfig");
    let mut pkg_config = Command::new("pkg-config");
    pkg_config.args(args).arg("bench-dragon").env("PKG_CONFIG_PATH", path);
    succeed(pkg_config).split_whitespace().map(str::to_owned).collect()
}

/// Returns the system's libraries that the static library needs.
fn private_libraries() -> Vec<String> {
    let mut libraries = pkg_config(&["--static", "--libs-only-l"]);
    libraries.retain(|library| library != "-lbench_dragon_c");
    assert!(!libraries.is_empty(), "the library needs libraries of the system");
    libraries
}

/// Returns the command that runs a program under valgrind. Each error and each leak is a failure.
pub(crate) fn under_valgrind(program: &Path) -> Command {
    let mut command = Command::new("valgrind");
    command.args([
        "--quiet",
        "--error-exitcode=99",
        "--leak-check=full",
        "--show-leak-kinds=definite,indirect,possible",
    ]);
    command.args(["--errors-for-leak-kinds=definite,indirect,possible", "--track-fds=no"]);
    command.arg(AsRef::<OsStr>::as_ref(program));
    command
}

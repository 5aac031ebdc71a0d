//! An instance of the bus for one test, and a folder for its files. At the end of the test, neither may leave remains.

use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread;

use bench_dragon_ipc::{Domain, Instance};
use tempfile::TempDir;
use test_support::process::{Ended, Process};

/// An instance and a folder. A test declares the stage first, so that it is dropped last, after every process and reader.
#[derive(Debug)]
pub(crate) struct Stage {
    domain: Domain,
    folder: TempDir,
}

impl Stage {
    pub(crate) fn new() -> Self {
        static STAGES: AtomicU32 = AtomicU32::new(0);
        let name = format!("test-{}-{}", std::process::id(), STAGES.fetch_add(1, Ordering::Relaxed));
        let instance = Instance::new(&name).expect("the name has only allowed characters");
        let domain = Domain::new(instance).expect("XDG_RUNTIME_DIR is short, or unset");
        Self { domain, folder: tempfile::tempdir().expect("a folder") }
    }

    pub(crate) fn domain(&self) -> &Domain {
        &self.domain
    }

    /// A path in the test's folder.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Returns the program with a command on this instance. A source that waits for readers waits for as long as it can, since a start
    /// takes long on a busy machine.
    pub(crate) fn command<Arg: AsRef<OsStr>>(&self, args: &[Arg]) -> Command {
        let mut command = program(args);
        let has = |name: &str| args.iter().any(|arg| arg.as_ref() == name);
        let is_show = args.first().is_some_and(|arg| arg.as_ref() == "show");
        if (is_show || has("--readers")) && !has("--reader-wait") {
            command.args(["--reader-wait", "25"]);
        }
        command.arg("--instance").arg(self.domain.instance().as_str()).current_dir(self.folder.path());
        command
    }

    /// Starts a command on this instance.
    pub(crate) fn start<Arg: AsRef<OsStr>>(&self, args: &[Arg]) -> Process {
        Process::start(self.command(args))
    }

    /// Runs a command on this instance to its end.
    pub(crate) fn run<Arg: AsRef<OsStr>>(&self, args: &[Arg]) -> Ended {
        self.start(args).end()
    }

    /// Returns all files and directories of this instance.
    pub(crate) fn remains(&self) -> Vec<PathBuf> {
        let prefix = self.domain.prefix();
        let is_ours =
            |path: &PathBuf| path.file_name().and_then(OsStr::to_str).is_some_and(|name| name.starts_with(&prefix));
        let mut remains: Vec<PathBuf> = entries(Path::new("/dev/shm")).into_iter().filter(is_ours).collect();
        if self.domain.root().exists() {
            remains.push(self.domain.root().to_owned());
            remains.extend(entries(self.domain.root()));
        }
        remains
    }

    fn remove_remains(&self) {
        for path in self.remains() {
            // Errors are ignored: a failing test has reported its failure already.
            let _ = if path.is_dir() { fs::remove_dir_all(path) } else { fs::remove_file(path) };
        }
    }
}

impl Drop for Stage {
    fn drop(&mut self) {
        let remains = self.remains();
        self.remove_remains();
        if !thread::panicking() {
            assert!(remains.is_empty(), "left behind: {remains:#?}");
        }
    }
}

/// Returns the program with arguments and no instance.
pub(crate) fn program<Arg: AsRef<OsStr>>(args: &[Arg]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_bench-dragon"));
    command.args(args).env_remove("RUST_LOG");
    command
}

fn entries(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).map(|entries| entries.flatten().map(|entry| entry.path()).collect()).unwrap_or_default()
}

//! Chromium, and a view for its pages. The scenarios are in `tests/node`.

use std::env;
use std::path::PathBuf;
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};

use test_support::process::Process;
use test_support::skip::skip;

use crate::stage::Stage;

/// The programs that the scenarios need. Only one browser runs at a time, since a browser is many processes.
#[derive(Debug)]
pub(crate) struct Browser {
    pub(crate) node: PathBuf,
    chromium: PathBuf,
    _alone: MutexGuard<'static, ()>,
}

/// A view and the address of its page.
#[derive(Debug)]
pub(crate) struct View {
    pub(crate) process: Process,
    pub(crate) url: String,
    pub(crate) address: String,
}

impl Browser {
    /// Finds node and Chromium. Skips the test if one is missing.
    pub(crate) fn find() -> Option<Self> {
        static ALONE: Mutex<()> = Mutex::new(());
        let node = env::var_os("BENCH_DRAGON_NODE").map(PathBuf::from);
        let Some(node) = node.filter(|folder| folder.join("node_modules/playwright-core").exists()) else {
            skip("tests/run has not installed the packages of tests/node");
            return None;
        };
        let programs = ["chromium", "chromium-browser", "google-chrome"];
        let folders: Vec<PathBuf> =
            env::var_os("PATH").map(|path| env::split_paths(&path).collect()).unwrap_or_default();
        let mut found = programs.iter().flat_map(|program| folders.iter().map(move |folder| folder.join(program)));
        let Some(chromium) = found.find(|path| path.exists()) else {
            skip("there is no Chromium");
            return None;
        };
        Some(Self { node, chromium, _alone: ALONE.lock().unwrap_or_else(PoisonError::into_inner) })
    }

    /// Starts a scenario.
    pub(crate) fn play(&self, scenario: &str, args: &[&str]) -> Process {
        let mut node = Command::new("node");
        self.give(&mut node, scenario, args);
        Process::start(node)
    }

    /// Adds a scenario to a command that runs node.
    pub(crate) fn give(&self, command: &mut Command, scenario: &str, args: &[&str]) {
        command.arg(format!("tests/node/{scenario}")).args(args).current_dir(env!("CARGO_MANIFEST_DIR"));
        command.env("BENCH_DRAGON_NODE", &self.node).env("BENCH_DRAGON_CHROMIUM", &self.chromium);
    }
}

impl View {
    pub(crate) fn start(stage: &Stage, args: &[&str]) -> Self {
        Self::announced_by(stage.start(&[&["view", "--format", "json"], args].concat()))
    }

    /// The page of a process that announces its address as a view does.
    pub(crate) fn announced_by(mut process: Process) -> Self {
        let listening = process.json();
        let text = |key: &str| listening[key].as_str().unwrap_or_else(|| panic!("{listening}")).to_owned();
        Self { url: text("url"), address: text("address"), process }
    }

    pub(crate) fn of(stage: &Stage) -> Self {
        Self::start(stage, &["--listen", "127.0.0.1:0"])
    }
}

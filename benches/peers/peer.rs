//! A script of the paper's method and its interpreter.

use std::env;
use std::path::PathBuf;
use std::process::{Command, Stdio};

use serde::Deserialize;
use serde::de::DeserializeOwned;

use crate::process::timed_output;

/// Folder of the scripts.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/benches/peers/");
/// Cargo's target folder.
const TARGET: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/../");
const PYTHON_VERSION: &str = "import platform, numpy, scipy
print(f'Python {platform.python_version()}, numpy {numpy.__version__}, scipy {scipy.__version__}')";
/// No user settings and no history: Octave 7 fails to save an empty history.
const OCTAVE_FLAGS: &[&str] = &["--norc", "--no-history"];

/// A script and its interpreter.
#[derive(Debug)]
pub struct Peer {
    interpreter: PathBuf,
    flags: &'static [&'static str],
    script: &'static str,
    version: String,
}

/// A script's answer and its times.
#[derive(Debug)]
pub struct Reply<A> {
    /// The answer.
    pub answer: A,
    /// Seconds of the work alone, measured by the script.
    pub work_s: f64,
    /// Seconds from the interpreter's start to its end.
    pub process_s: f64,
}

/// Output of a script.
#[derive(Deserialize)]
struct Printed<A> {
    seconds: f64,
    #[serde(flatten)]
    answer: A,
}

impl Peer {
    /// Returns the first Python that has numpy and scipy. The order is: `BENCH_DRAGON_PYTHON`, the environment that
    /// `benches/peers/install` creates, the environment of the tests, and `python3` on the PATH.
    pub fn python() -> Option<Self> {
        let named = env::var_os("BENCH_DRAGON_PYTHON").map(PathBuf::from);
        let installed = PathBuf::from(format!("{TARGET}peers-venv/bin/python"));
        let tests = PathBuf::from(format!("{TARGET}venv/bin/python"));
        [named, Some(installed), Some(tests), Some("python3".into())].into_iter().flatten().find_map(|interpreter| {
            let version = output_of(Command::new(&interpreter).args(["-c", PYTHON_VERSION]))?;
            Some(Self { interpreter, flags: &[], script: "dragon.py", version })
        })
    }

    /// Returns GNU Octave; `None` if it is not on the PATH.
    pub fn octave() -> Option<Self> {
        let interpreter = PathBuf::from("octave-cli");
        let print_version = ["--eval", "puts(['GNU Octave ', version()]);"];
        let version = output_of(Command::new(&interpreter).args(OCTAVE_FLAGS).args(print_version))?;
        Some(Self { interpreter, flags: OCTAVE_FLAGS, script: "dragon.m", version })
    }

    /// Versions of the interpreter and its packages.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Runs the script with a question and returns its answer. The script reports its progress on stderr.
    pub fn ask<A: DeserializeOwned>(&self, question: &[&str]) -> Reply<A> {
        let mut command = Command::new(&self.interpreter);
        command.args(self.flags).arg(format!("{FOLDER}{}", self.script)).args(question);
        let (process_s, stdout) = timed_output(&mut command);
        let Printed { seconds, answer } =
            serde_json::from_slice(&stdout).expect("the script prints its answer as JSON");
        Reply { answer, work_s: seconds, process_s }
    }
}

/// Returns a program's output; `None` if it cannot run or fails.
fn output_of(command: &mut Command) -> Option<String> {
    let output = command.stdin(Stdio::null()).stderr(Stdio::null()).output().ok()?;
    output.status.success().then(|| String::from_utf8_lossy(&output.stdout).trim_end().to_owned())
}

//! Processes of the product.

use std::env;
use std::io::{BufRead as _, BufReader};
use std::path::PathBuf;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::sync::LazyLock;

use bench_dragon_ipc::{Domain, Instance};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// Path of the program. Cargo builds the program for benches in the same package. For benches in another package, this value
/// builds it with zenoh.
static PROGRAM: LazyLock<PathBuf> = LazyLock::new(|| match option_env!("CARGO_BIN_EXE_bench-dragon") {
    Some(path) => path.into(),
    None => build_with_zenoh(),
});

/// Returns a command that runs the program, without arguments.
pub fn program() -> Command {
    Command::new(&*PROGRAM)
}

fn build_with_zenoh() -> PathBuf {
    let manifest = concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml");
    let cargo = env::var_os("CARGO").expect("cargo runs this bench");
    let mut build = Command::new(cargo);
    build.args(["build", "--release", "--locked", "--package", "bench-dragon", "--bin", "bench-dragon"]);
    let built = build.args(["--features", "zenoh", "--manifest-path", manifest]).status();
    assert!(built.expect("cargo is installed").success(), "cargo failed to build the program");
    // TARGET/release/deps/BENCH and TARGET/release/bench-dragon
    let bench = env::current_exe().expect("this bench is a file");
    bench.parent().and_then(|deps| deps.parent()).expect("the bench is in cargo's target folder").join("bench-dragon")
}

/// A running process. Dropping it sends SIGTERM and waits for its end.
#[derive(Debug)]
pub struct Program {
    child: Child,
    stdout: BufReader<ChildStdout>,
}

/// Returns the domain of an instance.
pub fn domain(instance: &str) -> Domain {
    let instance = Instance::new(instance).expect("letters and hyphens are allowed");
    Domain::new(instance).expect("XDG_RUNTIME_DIR is short, or unset")
}

impl Program {
    /// Starts a command on an instance.
    pub fn start(domain: &Domain, args: &[&str]) -> Self {
        Self::start_by(program(), domain, args)
    }

    /// Starts a command on an instance within a network namespace.
    pub fn start_within(namespace: &str, domain: &Domain, args: &[&str]) -> Self {
        let mut command = Command::new("ip");
        command.args(["netns", "exec", namespace]).arg(&*PROGRAM);
        Self::start_by(command, domain, args)
    }

    fn start_by(mut command: Command, domain: &Domain, args: &[&str]) -> Self {
        let mut child = command
            .args(args)
            .args(["--format", "json", "--instance", domain.instance().as_str()])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program has been built");
        let stdout = BufReader::new(child.stdout.take().expect("stdout is piped"));
        Self { child, stdout }
    }

    /// Returns the next line of its output.
    pub fn line(&mut self) -> Value {
        let mut line = String::new();
        self.stdout.read_line(&mut line).expect("a pipe of text");
        serde_json::from_str(&line).expect("the program has not ended")
    }

    /// Reads lines until one has this type, and returns that line.
    pub fn until(&mut self, kind: &str) -> Value {
        loop {
            let line = self.line();
            if line["type"] == kind {
                return line;
            }
        }
    }

    /// Whether the process has ended. Panics if it has ended with an error.
    pub fn has_ended(&mut self) -> bool {
        let status = self.child.try_wait().expect("a child can be waited for");
        assert!(status.is_none_or(|status| status.success()), "a program failed");
        status.is_some()
    }

    pub fn signal(&self, signal: Signal) {
        // The process may have ended by itself. Its id stays reserved until its parent waits for it.
        let _ = kill_process(Pid::from_child(&self.child), signal);
    }

    /// Ends the process and returns its summary, a line of this type.
    pub fn stop(mut self, kind: &str) -> Value {
        self.signal(Signal::TERM);
        self.until(kind)
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            self.signal(Signal::TERM);
            self.signal(Signal::CONT);
            // Reads the rest, because a full pipe would block the process.
            let _ = std::io::copy(&mut self.stdout, &mut std::io::sink());
            let _ = self.child.wait();
        }
    }
}

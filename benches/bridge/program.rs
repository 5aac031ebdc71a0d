//! The product's own processes.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};

use bench_dragon_ipc::{Domain, Instance};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// A running process. One that is dropped is asked to end.
#[derive(Debug)]
pub(crate) struct Program {
    child: Child,
    stdout: BufReader<ChildStdout>,
}

/// An instance of the bus.
pub(crate) fn domain(instance: &str) -> Domain {
    let instance = Instance::new(instance).expect("letters and hyphens are allowed");
    Domain::new(instance).expect("XDG_RUNTIME_DIR is short, or unset")
}

impl Program {
    /// Starts a command on an instance, within a network namespace where there is one.
    pub(crate) fn start(domain: &Domain, namespace: Option<&str>, args: &[&str]) -> Self {
        let program = env!("CARGO_BIN_EXE_bench-dragon");
        let mut command = match namespace {
            Some(namespace) => {
                let mut command = Command::new("ip");
                command.args(["netns", "exec", namespace, program]);
                command
            }
            None => Command::new(program),
        };
        let mut child = command
            .args(args)
            .args(["--format", "json", "--instance", domain.instance().as_str()])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program is there: cargo has built it for this bench");
        let stdout = BufReader::new(child.stdout.take().expect("it is piped"));
        Self { child, stdout }
    }

    /// Its lines up to one of this type, which is returned.
    pub(crate) fn until(&mut self, kind: &str) -> Value {
        loop {
            let line = self.line();
            if line["type"] == kind {
                return line;
            }
        }
    }

    /// Ends it and returns its summary.
    pub(crate) fn stop(mut self, kind: &str) -> Value {
        self.signal();
        self.until(kind)
    }

    fn line(&mut self) -> Value {
        let mut line = String::new();
        self.stdout.read_line(&mut line).expect("a pipe of text");
        serde_json::from_str(&line).expect("the program has not ended")
    }

    fn signal(&self) {
        // It may have ended by itself; the process id stays its own until it is waited for.
        let _ = kill_process(Pid::from_child(&self.child), Signal::TERM);
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        self.signal();
        // Nobody reads any more, and a full pipe would keep it.
        let _ = std::io::copy(&mut self.stdout, &mut std::io::sink());
        let _ = self.child.wait();
    }
}

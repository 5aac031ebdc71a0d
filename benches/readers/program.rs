//! The product's own processes.

use std::io::{BufRead as _, BufReader};
use std::process::{Child, ChildStdout, Command, Stdio};

use bench_dragon_ipc::{Domain, Instance};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// A running process. One that is dropped is asked to end.
#[derive(Debug)]
pub(crate) struct Program {
    domain: Domain,
    child: Child,
    stdout: BufReader<ChildStdout>,
}

impl Program {
    /// A server at 1 kHz, once it is there.
    pub(crate) fn serve(instance: &str) -> Self {
        let instance = Instance::new(instance).expect("letters and hyphens are allowed");
        let domain = Domain::new(instance).expect("XDG_RUNTIME_DIR is short, or unset");
        let mut server = Self::start(domain, &["serve", "--rate", "1000"]);
        assert_eq!(server.line()["type"], "started");
        server
    }

    /// A woken reader at a server, once it reads.
    pub(crate) fn read(server: &Self) -> Self {
        let mut reader = Self::start(server.domain.clone(), &["monitor", "--progress", "0.01"]);
        while reader.line()["frames"].as_u64().unwrap_or_default() == 0 {}
        reader
    }

    /// A reader that ends after two hundred frames.
    pub(crate) fn read_a_while(server: &Self) -> Self {
        Self::start(server.domain.clone(), &["latency", "--seconds", "0.2"])
    }

    fn start(domain: Domain, args: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_bench-dragon"))
            .args(args)
            .args(["--format", "json", "--instance", domain.instance().as_str()])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the program is there: cargo has built it for this bench");
        let stdout = BufReader::new(child.stdout.take().expect("it is piped"));
        Self { domain, child, stdout }
    }

    pub(crate) fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Whether it has ended, well; fails where it has ended otherwise.
    pub(crate) fn has_ended(&mut self) -> bool {
        let status = self.child.try_wait().expect("a child can be waited for");
        assert!(status.is_none_or(|status| status.success()), "a reader failed");
        status.is_some()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        // It may have ended by itself; the process id stays its own until it is waited for.
        let _ = kill_process(Pid::from_child(&self.child), signal);
    }

    /// Ends a server and returns how many releases it skipped.
    pub(crate) fn stop(mut self) -> u64 {
        self.signal(Signal::TERM);
        self.line()["overruns"].as_u64().expect("its summary")
    }

    fn line(&mut self) -> Value {
        let mut line = String::new();
        self.stdout.read_line(&mut line).expect("a pipe of text");
        serde_json::from_str(&line).expect("the program has not ended")
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        if matches!(self.child.try_wait(), Ok(None)) {
            self.signal(Signal::TERM);
            self.signal(Signal::CONT);
            // Nobody reads any more, and a full pipe would keep it.
            let _ = std::io::copy(&mut self.stdout, &mut std::io::sink());
            let _ = self.child.wait();
        }
    }
}

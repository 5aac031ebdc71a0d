//! The measured server and its readers.

use bench_dragon_ipc::Domain;
use rustix::process::Signal;

use crate::shared;

/// A running process on an instance. Dropping it sends SIGTERM and waits for its end.
#[derive(Debug)]
pub(crate) struct Program {
    domain: Domain,
    process: shared::Program,
}

impl Program {
    /// Starts a server at 1 kHz. Returns when it has started.
    pub(crate) fn serve(instance: &str) -> Self {
        let mut server = Self::start(shared::domain(instance), &["serve", "--rate", "1000"]);
        assert_eq!(server.process.line()["type"], "started");
        server
    }

    /// Starts a woken reader of a server. Returns when it has read a frame.
    pub(crate) fn read(server: &Self) -> Self {
        let mut reader = Self::start(server.domain.clone(), &["monitor", "--progress", "0.01"]);
        while reader.process.line()["frames"].as_u64().unwrap_or_default() == 0 {}
        reader
    }

    /// Starts a reader that ends after two hundred frames.
    pub(crate) fn read_a_while(server: &Self) -> Self {
        Self::start(server.domain.clone(), &["latency", "--seconds", "0.2"])
    }

    fn start(domain: Domain, args: &[&str]) -> Self {
        Self { process: shared::Program::start(&domain, args), domain }
    }

    pub(crate) fn domain(&self) -> &Domain {
        &self.domain
    }

    /// Whether the process has ended. Panics if it has ended with an error.
    pub(crate) fn has_ended(&mut self) -> bool {
        self.process.has_ended()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        self.process.signal(signal);
    }

    /// Ends a server and returns the number of periods that it missed.
    pub(crate) fn stop(self) -> u64 {
        self.process.stop("summary")["overruns"].as_u64().expect("the summary has a number of overruns")
    }
}

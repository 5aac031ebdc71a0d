//! A server on a stage, and readers that wait for one.

use std::ffi::OsStr;

use serde_json::Value;
use test_support::process::Process;

use crate::stage::Stage;

/// A server that has created its services. It waits for its readers if the arguments name some.
#[derive(Debug)]
pub(crate) struct Server {
    pub(crate) process: Process,
    pub(crate) run_id: u64,
}

impl Stage {
    /// Starts a reader without a server. Returns when the reader has reported that it waits for one.
    pub(crate) fn start_waiting<Arg: AsRef<OsStr>>(&self, args: &[Arg]) -> Process {
        let process = self.start(args);
        assert_eq!(process.complaint(), format!("waiting for a server on instance {}", self.domain().instance()));
        process
    }

    /// Starts a server, and waits until its services exist.
    pub(crate) fn serve(&self, args: &[&str]) -> Server {
        let mut process = self.start(&[&["serve", "--format", "json"], args].concat());
        let started = process.json();
        assert_eq!(started["type"], "started", "{started}");
        Server { run_id: started["run_id"].as_u64().expect("a run has a number"), process }
    }
}

impl Server {
    /// Ends the server by a signal. Returns its summary.
    pub(crate) fn stop(self) -> Value {
        self.process.terminate().expect_clean().last_json()
    }

    /// Waits for the end of the server. Returns its summary.
    pub(crate) fn summary(self) -> Value {
        self.process.end().expect_clean().last_json()
    }
}

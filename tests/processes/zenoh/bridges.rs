//! The two ends of a bridge.

use serde_json::Value;
use test_support::process::Process;

use crate::stage::Stage;

/// Prefix of all keys of these tests. Bridges of different tests never connect.
pub(crate) const KEY: &str = "test/show";
/// An endpoint at any free port of loopback.
pub(crate) const ANY_PORT: &str = "tcp/127.0.0.1:0";

/// A bridge with an open session.
#[derive(Debug)]
pub(crate) struct Bridge {
    pub(crate) process: Process,
    /// The endpoint at which it listens; empty if it does not listen.
    pub(crate) endpoint: String,
}

impl Bridge {
    /// Starts a bridge on this stage.
    pub(crate) fn start(stage: &Stage, args: &[&str]) -> Self {
        Self::announced(stage.start(&arguments(args)))
    }

    /// Waits for the first line of a bridge that was started in another way.
    pub(crate) fn announced(mut process: Process) -> Self {
        let started = process.json();
        assert_eq!((&started["type"], &started["key"]), (&Value::from("started"), &Value::from(KEY)), "{started}");
        let endpoint = started["listens"][0].as_str().unwrap_or_default().to_owned();
        Self { process, endpoint }
    }

    /// Starts a bridge that sends the frames of this stage's source.
    pub(crate) fn sending(stage: &Stage, args: &[&str]) -> Self {
        let mut bridge = Self::start(stage, &[&["--listen", ANY_PORT], args].concat());
        bridge.until("sending");
        bridge
    }

    /// Starts a receiving bridge, and waits until it has found the run of a sending one.
    pub(crate) fn receiving(stage: &Stage, from: &Self) -> Self {
        let mut bridge = Self::start(stage, &["--receive", "--connect", &from.endpoint]);
        bridge.until("found");
        bridge
    }

    /// Reads lines up to one of this type, and returns that line.
    pub(crate) fn until(&mut self, kind: &str) -> Value {
        self.process
            .json_until(&format!("a line of type {kind}"), |line| line["type"] == kind)
            .pop()
            .expect("the wanted line comes last")
    }

    /// Ends the bridge. Returns its summary.
    pub(crate) fn stop(self) -> Value {
        self.process.terminate().expect_clean().last_json()
    }
}

/// Returns the whole command line of a bridge.
pub(crate) fn arguments<'a>(args: &[&'a str]) -> Vec<&'a str> {
    [&["bridge", "zenoh", "--format", "json", "--key", KEY], args].concat()
}

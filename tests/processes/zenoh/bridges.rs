//! The two ends of a bridge.

use serde_json::Value;
use test_support::process::Process;

use crate::stage::Stage;

/// What all keys of these tests begin with. No two bridges of two tests know of each other.
pub(crate) const KEY: &str = "test/show";
/// A port of loopback that is free.
pub(crate) const ANY_PORT: &str = "tcp/127.0.0.1:0";

/// A bridge that has opened its session.
#[derive(Debug)]
pub(crate) struct Bridge {
    pub(crate) process: Process,
    /// Where it listens; empty where it does not.
    pub(crate) endpoint: String,
}

impl Bridge {
    /// A bridge on this stage, with these arguments.
    pub(crate) fn start(stage: &Stage, args: &[&str]) -> Self {
        Self::announced(stage.start(&arguments(args)))
    }

    /// A bridge that has been started in another way.
    pub(crate) fn announced(mut process: Process) -> Self {
        let started = process.json();
        assert_eq!((&started["type"], &started["key"]), (&Value::from("started"), &Value::from(KEY)), "{started}");
        let endpoint = started["listens"][0].as_str().unwrap_or_default().to_owned();
        Self { process, endpoint }
    }

    /// One that sends what is on this stage's bus, whose source is there.
    pub(crate) fn sending(stage: &Stage, args: &[&str]) -> Self {
        let mut bridge = Self::start(stage, &[&["--listen", ANY_PORT], args].concat());
        bridge.until("sending");
        bridge
    }

    /// One that has found the run that another one sends.
    pub(crate) fn receiving(stage: &Stage, from: &Self) -> Self {
        let mut bridge = Self::start(stage, &["--receive", "--connect", &from.endpoint]);
        bridge.until("found");
        bridge
    }

    /// Its lines up to one of this type, which is returned.
    pub(crate) fn until(&mut self, kind: &str) -> Value {
        self.process
            .json_until(&format!("a line of type {kind}"), |line| line["type"] == kind)
            .pop()
            .expect("it ends with the one that is wanted")
    }

    /// Ends it, and returns its summary.
    pub(crate) fn stop(self) -> Value {
        self.process.terminate().expect_clean().last_json()
    }
}

/// The whole command line of a bridge.
pub(crate) fn arguments<'a>(args: &[&'a str]) -> Vec<&'a str> {
    [&["bridge", "zenoh", "--format", "json", "--key", KEY], args].concat()
}

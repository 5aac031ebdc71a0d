//! The places of readers on the bus. Operators' tools have some of their own, so other programs never lock the operator out.

use bench_dragon_ipc::service::MAX_READERS;
use bench_dragon_ipc::{
    AlertSubscriber, BusError, CommandClient, CommandEventReader, DescriptionReader, Domain, FrameSubscriber,
    ReaderReports, StatusReader,
};
use rustix::process::{Resource, Rlimit, getrlimit, setrlimit};
use test_support::eventually::eventually_from;

use crate::ctl_status::status_with;
use crate::http::get;
use crate::stage::Stage;

/// All ports of a program that reads everything.
struct Readers {
    frames: FrameSubscriber,
    _others: (StatusReader, DescriptionReader, AlertSubscriber, CommandEventReader, ReaderReports, CommandClient),
}

impl Readers {
    fn open(domain: &Domain) -> Result<Self, BusError> {
        let others = (
            StatusReader::open(domain, "other")?,
            DescriptionReader::open(domain, "other")?,
            AlertSubscriber::open(domain, "other")?,
            CommandEventReader::open(domain, "other")?,
            ReaderReports::open(domain, "other")?,
            CommandClient::open(domain, "other")?,
        );
        Ok(Self { frames: FrameSubscriber::open(domain, "other")?, _others: others })
    }
}

/// Lets this process open as many files as it may: each of many readers needs some dozens.
fn raise_open_files() {
    let maximum = getrlimit(Resource::Nofile).maximum;
    setrlimit(Resource::Nofile, Rlimit { current: maximum, maximum }).expect("up to the hard limit");
}

#[test]
fn with_all_places_of_readers_taken_the_operators_tools_still_read_and_command() {
    raise_open_files();
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let mut readers: Vec<Readers> =
        (0..MAX_READERS).map(|_| Readers::open(stage.domain()).expect("a place for each reader")).collect();
    assert!(matches!(Readers::open(stage.domain()), Err(BusError::TooManyClients { .. })));
    let refused = stage.run(&["hz", "--seconds", "1"]);
    assert_eq!(refused.code(), Some(1));
    assert!(refused.stderr.contains("has as many clients as it allows"), "{}", refused.stderr);

    let mut view = stage.start(&["view", "--listen", "127.0.0.1:0", "--format", "json"]);
    let address = view.json()["address"].as_str().and_then(|address| address.parse().ok()).expect("an address");
    eventually_from("the view reads the server", || {
        let text = get(address, "/metrics").body;
        if text.contains("\nbench_dragon_up 1\n") { Ok(()) } else { Err(text) }
    });
    let (json, code) = status_with(&stage, "the show", |json| json["link"] == "live");
    assert_eq!(code, Some(0), "{json}");
    stage.run(&["ctl", "hold"]).expect_clean();
    stage.run(&["ctl", "release"]).expect_clean();
    let doctor = stage.run(&["doctor", "--format", "json"]).last_json();
    let guard = doctor["checks"].as_array().and_then(|checks| checks.iter().find(|check| check["name"] == "guard"));
    assert!(guard.is_some_and(|guard| guard["message"].to_string().contains("not guarded")), "{guard:?}");
    for reader in &mut readers {
        assert!(reader.frames.receive().expect("the bus is readable").is_some(), "each reader has frames");
    }
    view.terminate().expect_clean();
    drop(readers);
    server.stop();
}

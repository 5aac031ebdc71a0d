//! The network between two machines, cut and connected again.

use std::process::Command;

use bench_dragon_ipc::Continuity;
use test_support::process::Process;
use test_support::skip::{has_programs, skip};

use super::bridges::{Bridge, arguments};
use super::cable::Cable;
use crate::reader::Reader;
use crate::stage::Stage;

/// Starts a bridge of a stage in a namespace.
fn start_within(namespace: &str, stage: &Stage, args: &[&str]) -> Bridge {
    let command = stage.command(&arguments(args));
    let mut within = Command::new("ip");
    within
        .args(["netns", "exec", namespace])
        .arg(command.get_program())
        .args(command.get_args())
        .env_remove("RUST_LOG");
    Bridge::announced(Process::start(within))
}

#[test]
fn a_run_continues_after_its_network_was_cut() {
    if !has_programs(&["ip"]) {
        return;
    }
    let Some(cable) = Cable::lay() else { return skip("network namespaces are not possible here") };
    let (near, far) = (Stage::new(), Stage::new());
    // At this rate, the buffer of the reader, which waits for the reports of the bridges, holds ten seconds.
    let server = near.serve(&["--rate", "20"]);
    let mut sender = start_within(&cable.near, &near, &["--listen", Cable::ENDPOINT]);
    sender.until("sending");
    let mut receiver = start_within(&cable.far, &far, &["--receive", "--connect", Cable::ENDPOINT]);
    let receiving = receiver.until("receiving");
    let mut reader = Reader::join(&far);
    let before = reader.next();

    cable.set("down");
    let silent = receiver.until("silent");
    assert_eq!((&silent["run_id"], &silent["reason"]), (&receiving["run_id"], &"link_or_source".into()), "{silent}");
    cable.set("up");
    let resumed = receiver.until("resumed");
    assert_eq!(resumed["run_id"], receiving["run_id"]);

    let mut after = reader.read_unread();
    after.push(reader.next());
    assert_eq!((after[0].header.tick, after[0].continuity), (before.header.tick + 1, Continuity::Next));
    for shot in &after {
        assert_eq!(receiving["run_id"], shot.header.run_id);
        assert!(
            matches!(shot.continuity, Continuity::Next),
            "a hole in the ticks of the far bus: {:?}",
            shot.continuity
        );
    }
    server.stop();
    let (sent, received) = (sender.process.terminate().last_json(), receiver.process.terminate().last_json());
    let lost = received["lost"].as_u64().expect("a number");
    assert_eq!(received["runs"], 1);
    assert!(
        sent["frames"].as_u64() >= Some(received["frames"].as_u64().expect("a number") + lost),
        "{sent} {received}"
    );
    assert_eq!(sent["lost"], 0, "the near bridge has read every frame");
}

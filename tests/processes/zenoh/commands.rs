//! Commands from the far side.

use bench_dragon_ipc::{Census, IntoBytes as _, Request, ShowState};
use rustix::process::Signal;
use serde_json::Value;
use test_support::eventually::{DEADLINE, eventually};
use zenoh::Wait as _;

use super::bridges::{Bridge, KEY};
use super::hostile::connected_to_sender;
use crate::reader::Reader;
use crate::stage::Stage;

fn ctl(stage: &Stage, order: &[&str]) -> Value {
    stage.run(&[&["ctl", "--format", "json"], order].concat()).last_json()
}

#[test]
fn a_bridge_takes_no_commands_without_the_flag() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "50"]);
    let sender = Bridge::sending(&near, &[]);
    let mut receiver = Bridge::receiving(&far, &sender);
    receiver.until("receiving");
    for order in [&["pause"][..], &["seek", "100"], &["stop"]] {
        let reply = ctl(&far, order);
        assert_eq!(reply["accepted"], false, "{reply}");
        let reason = "the server is on another host: start its bridge with --allow-commands to send commands";
        assert_eq!(reply["reason"], reason, "{reply}");
    }
    let shot = Reader::join(&near).next();
    assert_eq!(shot.state(), ShowState::Running);
    assert_eq!(sender.stop()["commands"], 0);
    let silent = receiver
        .process
        .json_until("the bridge has no connection", |line| line["reason"] == "no_connection")
        .pop()
        .expect("a line");
    assert_eq!(silent["type"], "silent");
    let reply = ctl(&far, &["pause"]);
    assert_eq!(reply["reason"], "the server is on another host, which does not answer", "{reply}");
    server.stop();
    receiver.stop();
}

#[test]
fn a_bridge_with_the_flag_passes_commands_and_the_servers_replies() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "50"]);
    // The ticks of the two buses then differ.
    Reader::join(&near).read_to_tick(5);
    let sender = Bridge::sending(&near, &["--allow-commands"]);
    let mut receiver = Bridge::receiving(&far, &sender);
    let run_id = receiver.until("receiving")["run_id"].clone();
    let mut reader = Reader::join(&far);
    reader.next();

    let paused = ctl(&far, &["pause"]);
    assert_eq!((&paused["accepted"], &paused["run_id"]), (&Value::Bool(true), &run_id), "{paused}");
    let shots = reader.read_until("the show is paused", |header| header.show_state() == Some(ShowState::Paused));
    let tick = shots.last().expect("at least one frame").header.tick;
    assert_eq!(paused["tick"], tick, "the tick is the tick of the far bus");

    let odd = ctl(&far, &["seek", "1e9"]);
    let reason = odd["reason"].as_str().expect("a reason");
    assert!(
        reason.starts_with("the show time is 1000000000 s, must be from 0 to 432.75"),
        "the reason is not the server's: {odd}"
    );
    let sought = ctl(&far, &["seek", "100"]);
    assert_eq!(sought["accepted"], true, "{sought}");
    let shots = reader.read_to_tick(sought["tick"].as_u64().expect("a tick"));
    assert_eq!(shots.last().expect("at least one frame").header.show_time_s(), 100.0);

    assert_eq!(ctl(&far, &["stop"])["accepted"], true);
    server.summary();
    assert_eq!(receiver.stop()["commands"], 4);
    assert_eq!(sender.stop()["commands"], 4);
}

#[test]
fn a_command_refused_for_lack_of_an_answer_is_not_executed_later() {
    let (near, far) = (Stage::new(), Stage::new());
    let server = near.serve(&["--rate", "20"]);
    let sender = Bridge::sending(&near, &["--allow-commands"]);
    let mut receiver = Bridge::receiving(&far, &sender);
    receiver.until("receiving");
    assert_eq!(ctl(&near, &["pause"])["accepted"], true);
    Reader::join(&far).read_until("the show is paused", |header| header.show_state() == Some(ShowState::Paused));

    sender.process.signal(Signal::STOP);
    let refused = ctl(&far, &["resume"]);
    assert_eq!(refused["reason"], "the server is on another host, which does not answer", "{refused}");
    receiver.until("silent");
    sender.process.signal(Signal::CONT);
    receiver.until("resumed");
    // The first frames are as old as the stop: a command of someone who has seen no newer one is refused as too old. A seek on
    // the server's side shows when the far side is up to date.
    assert_eq!(ctl(&near, &["seek", "50"])["accepted"], true);
    Reader::join(&far).read_until("show time is 50 s", |header| header.show_time_s() == 50.0);
    // This command follows the refused one, and is accepted: so the refused one has been handled.
    let mut reader = Reader::join(&near);
    let sought = ctl(&far, &["seek", "100"]);
    assert_eq!(sought["accepted"], true, "{sought}");
    let shots = reader.read_until("show time is 100 s", |header| header.show_time_s() == 100.0);
    assert!(shots.iter().all(|shot| shot.state() == ShowState::Paused));
    server.stop();
    receiver.stop();
    let sent = sender.stop();
    assert_eq!((&sent["commands"], &sent["refused"]), (&1.into(), &1.into()), "{sent}");
}

#[test]
fn a_bridge_that_ends_passes_no_more_waiting_commands() {
    const ASKED: u64 = 12;
    let near = Stage::new();
    let server = near.serve(&["--rate", "20"]);
    let sender = Bridge::sending(&near, &["--allow-commands"]);
    let session = connected_to_sender(&sender);
    let command = Request::Pause.to_wire();
    server.process.signal(Signal::STOP);
    let replies: Vec<_> = (0..ASKED)
        .map(|_| {
            session.get(format!("{KEY}/commands")).payload(command.as_bytes()).wait().expect("the session is open")
        })
        .collect();
    // This query is answered, although the server answers none of the commands before it.
    let described = session.get(format!("{KEY}/description")).wait().expect("the session is open");
    let described = described.recv_timeout(DEADLINE).expect("the session is open");
    assert!(described.is_some_and(|reply| reply.result().is_ok()));
    eventually("the bridge has begun to pass the first command", || {
        let living = Census::take(near.domain()).ok()?.living;
        living.iter().any(|node| node.name == "bridge-commands").then_some(())
    });
    let sent = sender.stop();
    let (commands, refused) = (sent["commands"].as_u64().expect("a count"), sent["refused"].as_u64().expect("a count"));
    assert!((1..ASKED).contains(&commands), "{sent}");
    assert_eq!(commands + refused, ASKED, "{sent}");
    drop(replies);
    session.close().wait().expect("the session is open");
    server.process.signal(Signal::CONT);
    server.stop();
}

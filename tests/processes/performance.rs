//! A performance: nothing but its operator ends it.

use std::fs;

use bench_dragon_ipc::{FrameHeader, ShowState};
use rustix::process::Signal;
use serde_json::{Value, json};
use test_support::children::{await_child, children, kill, send};
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::reader::Reader;
use crate::show::{Playing, logged};
use crate::stage::{Stage, program};

/// A performance whose server has published a frame.
fn start(stage: &Stage, args: &[&str]) -> (Process, Reader) {
    let show = stage.start(&[&["show", "--stay", "--rate", "100", "--out", "out", "--format", "json"], args].concat());
    let reader = Reader::await_server(stage);
    (show, reader)
}

/// Ends a performance by a command. Returns its summary.
fn stop(stage: &Stage, show: Process) -> Value {
    stage.run(&["ctl", "stop"]).expect_clean();
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let summary = ended.last_json();
    let outcome = &summary["outcome"];
    assert_eq!((&outcome["kind"], &outcome["sender"]), (&json!("stopped"), &json!("ctl")), "{summary}");
    summary
}

fn is_in(state: ShowState) -> impl Fn(&FrameHeader) -> bool {
    move |header| header.show_state() == Some(state)
}

/// Fails unless the dragon stands in this state for a second, with every process of the show.
fn assert_stands(show: &Process, reader: &mut Reader, state: ShowState) {
    let from = reader.read_until(state.name(), is_in(state)).pop().expect("the frame that ended the reading").header;
    let shots = reader.read_to_tick(from.tick + 100);
    assert!(shots.iter().all(|shot| shot.state() == state), "{:?}", shots.last().map(|shot| shot.header));
    assert_eq!(children(show.pid()).len(), 3, "server, monitor and recorder run");
}

#[test]
fn after_a_contact_a_performance_goes_on() {
    let stage = Stage::new();
    let (show, mut reader) = start(&stage, &["--start-at", "410", "--time-scale", "5"]);
    show.complaint_with("412.473838 s: contact, benches 0 and 8");
    reader.read_until("the dragon walks on", |header| header.show_time_s() > 414.0);
    drop(reader);
    let summary = stop(&stage, show);
    assert_eq!(summary["contact"]["benches"], json!([0, 8]));
}

#[test]
fn at_the_guards_permanent_stop_a_performance_stands_held_until_a_seek() {
    let stage = Stage::new();
    let (show, mut reader) = start(&stage, &["--guard", "--start-at", "410", "--time-scale", "5"]);
    show.complaint_with("412.454970 s: held by the guard permanently, clearance 0.0005");
    // A guarded show also begins held, until its first grant.
    reader.read_until("the dragon is at its rest", |header| header.show_time_s() > 412.45);
    assert_stands(&show, &mut reader, ShowState::Held);
    stage.run(&["ctl", "seek", "400"]).expect_clean();
    reader.read_until("the dragon walks from the sought time", |header| (400.1..405.0).contains(&header.show_time_s()));
    drop(reader);
    let summary = stop(&stage, show);
    assert!(summary["guard"]["held_at_s"].as_f64().is_some(), "{summary}");
}

#[test]
fn at_its_end_a_performance_stands_finished_until_a_seek() {
    for end in [&["--until", "101"][..], &[]] {
        let stage = Stage::new();
        let (args, back_s) = if end.is_empty() {
            fs::write(stage.path("short.toml"), SHORT).expect("a file");
            (vec!["--config", "short.toml"], "0.5")
        } else {
            ([&["--start-at", "100"][..], end].concat(), "100.5")
        };
        let (show, mut reader) = start(&stage, &args);
        assert_stands(&show, &mut reader, ShowState::Finished);
        show.complaint_with(" s: finished; only `ctl stop` or Ctrl-C ends this show");
        stage.run(&["ctl", "seek", back_s]).expect_clean();
        reader.read_until("the dragon walks again", is_in(ShowState::Running));
        assert_stands(&show, &mut reader, ShowState::Finished);
        drop(reader);
        stop(&stage, show);
        let mut verify = program(&["replay", "out/recording.mcap", "--verify"]);
        verify.current_dir(stage.path("."));
        let verified = Process::start(verify).end();
        assert_eq!(verified.code(), Some(0), "{}{}", verified.stdout, verified.stderr);
    }
}

/// Three benches walk two metres.
const SHORT: &str =
    "[dragon]\nbenches = 3\n[route]\nkind = \"path\"\n[[route.segments]]\nkind = \"line\"\nlength_m = 2.0\n";

#[test]
fn the_configuration_makes_a_show_a_performance() {
    let stage = Stage::new();
    fs::write(stage.path("stay.toml"), format!("[show]\nstay = true\n{SHORT}")).expect("a file");
    let show = stage.start(&["show", "--config", "stay.toml", "--rate", "100", "--out", "out", "--format", "json"]);
    let mut reader = Reader::await_server(&stage);
    assert_stands(&show, &mut reader, ShowState::Finished);
    drop(reader);
    stop(&stage, show);
}

#[test]
fn ctrl_c_ends_a_performance() {
    let (summary, _) = Playing::start(&["--stay"]).interrupt();
    assert_eq!(summary["outcome"]["kind"], "signal");
}

#[test]
fn a_performance_starts_a_server_again_that_a_signal_has_ended() {
    let playing = Playing::start(&["--stay"]);
    let server = await_child(playing.show.pid(), "serve", None);
    send(server, Signal::TERM).expect("the process runs");
    assert_eq!(logged(&playing.show), "serve ended with exit status: 0: starting it again");
    await_child(playing.show.pid(), "serve", Some(server));
    let (summary, _) = playing.interrupt();
    assert_eq!(summary["restarts"]["serve"], 1);
}

/// The last restart comes some 110 seconds after the first end.
#[test]
fn a_performance_never_gives_up_its_server_and_keeps_its_other_processes() {
    let playing = Playing::start(&["--stay"]);
    let pid = playing.show.pid();
    let others: Vec<u32> = ["monitor", "record"].map(|name| await_child(pid, name, None)).to_vec();
    let mut server = await_child(pid, "serve", None);
    for _ in 0..12 {
        kill(server);
        playing.show.complaint_with("serve ended with signal: 9 (SIGKILL): ");
        server = await_child(pid, "serve", Some(server));
    }
    let still: Vec<u32> = ["monitor", "record"].map(|name| await_child(pid, name, None)).to_vec();
    assert_eq!(still, others);
    // The server that runs now can be commanded.
    eventually("the dragon can be released", || {
        (playing.stage.run(&["ctl", "release"]).code() == Some(0)).then_some(())
    });
    let (summary, _) = playing.interrupt();
    assert_eq!(summary["restarts"], json!({ "serve": 12, "monitor": 0, "record": 0, "view": 0 }));
}

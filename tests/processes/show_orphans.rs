//! The children of a killed show: none of them survives, stopped or not.

use bench_dragon::recording::repair;
use bench_dragon_ipc::{Status, StatusReader};
use rustix::process::Signal;
use test_support::children::{await_child, children, send};
use test_support::eventually::eventually;
use test_support::process::Process;
use test_support::pytest::python;

use crate::record;
use crate::show::{CALM, Playing};
use crate::stage::Stage;

/// Starts a program, becomes the parent of its orphans, and ends when no process is left.
const REAPER: &str = "
import ctypes, os, subprocess, sys
PR_SET_CHILD_SUBREAPER = 36
assert ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0) == 0
print(subprocess.Popen(sys.argv[1:]).pid, flush=True)
try:
    while True:
        os.wait()
except ChildProcessError:
    pass
";

/// Fails unless the recording has no hole, and a new server can start on the bus.
fn assert_recovers(stage: &Stage) {
    let recording = stage.path("out/recording.mcap");
    repair(&recording).expect("the recording of a killed show can be repaired");
    let (frames, was_cut) = record::read(&recording);
    assert!(!was_cut && !frames.is_empty());
    assert!(frames.iter().enumerate().all(|(tick, header)| header.tick == tick as u64));
    stage.serve(&["--until", "0"]).summary();
}

#[test]
fn no_child_outlives_its_killed_show_whichever_is_stopped() {
    for stopped in ["serve", "monitor", "record", "view", "hz"] {
        let stage = Stage::new();
        std::fs::write(stage.path("stage.toml"), "[[show.also]]\ncommand = \"hz\"\n").expect("a file");
        let args = ["json", "--out", "out", "--config", "stage.toml", "--view=127.0.0.1:0"];
        let show = stage.start(&[&CALM[..], &args].concat());
        let pid = show.pid();
        let child = await_child(pid, stopped, None);
        await_child(pid, "hz", None);
        record::await_frames(&stage.path("out/recording.mcap"));
        send(child, Signal::STOP).expect("the process runs");
        show.kill();
        eventually(&format!("the children are gone, of which {stopped} was stopped"), || {
            children(pid).is_empty().then_some(())
        });
        assert_recovers(&stage);
    }
}

/// Here the kernel does not continue stopped children by itself, since their new parent belongs to their session.
#[test]
fn children_that_are_all_stopped_do_not_outlive_a_killed_show_beside_their_reaper() {
    let stage = Stage::new();
    let program = env!("CARGO_BIN_EXE_bench-dragon");
    let instance = stage.domain().instance().to_string();
    let mut command = python();
    command.args(["-c", REAPER, program]).args(CALM).args(["json", "--out", "out", "--instance", &instance]);
    command.current_dir(stage.path(""));
    let mut reaper = Process::start(command);
    let pid: u32 = reaper.next_line().and_then(|line| line.parse().ok()).expect("the show's process id");
    record_some(&stage);
    for name in ["serve", "monitor", "record"] {
        send(await_child(pid, name, None), Signal::STOP).expect("the process runs");
    }
    send(pid, Signal::KILL).expect("the process runs");
    let ended = reaper.end();
    assert_eq!((ended.code(), children(pid)), (Some(0), vec![]), "{}", ended.stderr);
    assert_recovers(&stage);
}

/// Waits until a show has recorded frames.
fn record_some(stage: &Stage) {
    let status = eventually("a server has created the services", || StatusReader::open(stage.domain(), "test").ok());
    let is_walking = |status: &Status| status.tick >= 1;
    eventually("the server publishes", || status.poll().expect("the bus is readable").filter(is_walking));
    record::await_frames(&stage.path("out/recording.mcap"));
}

/// No event marks the progress of a child's start, so many shows are killed.
#[test]
fn a_child_that_is_stopped_while_it_starts_does_not_outlive_its_killed_show() {
    let stage = Stage::new();
    for round in 0..18 {
        let show = stage.start(&[&CALM[..], &["json", "--out", &format!("killed-{round}")]].concat());
        let pid = show.pid();
        let wanted = ["serve", "monitor", "record"][round % 3];
        let child = await_child(pid, wanted, None);
        send(child, Signal::STOP).expect("the process runs");
        show.kill();
        eventually(&format!("the children are gone, of which {wanted} was stopped as it started"), || {
            children(pid).is_empty().then_some(())
        });
    }
    stage.serve(&["--until", "0"]).summary();
}

#[test]
fn an_interrupted_show_does_not_wait_for_a_stopped_child() {
    let playing = Playing::start(&[]);
    record::await_frames(&playing.stage.path("out/recording.mcap"));
    for name in ["monitor", "record"] {
        send(await_child(playing.show.pid(), name, None), Signal::STOP).expect("the process runs");
    }
    let (summary, ended) = playing.interrupt();
    assert_eq!(summary["restart_log"], serde_json::json!([]), "{}", ended.stderr);
    assert!(!ended.stderr.contains("killing it"), "{}", ended.stderr);
}

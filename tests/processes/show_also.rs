//! The configured commands of a show: checked first, started with the first frame, supervised like the other children.

use std::fs;
use std::net::UdpSocket;

use rustix::process::Signal;
use serde_json::json;
use test_support::children::{await_child, children, kill, send};
use test_support::eventually::eventually;

use crate::ctl_status::{lamp, status_with};
use crate::show::Playing;
use crate::stage::Stage;

#[test]
fn configured_commands_run_beside_the_show_and_are_restarted() {
    let receiver = UdpSocket::bind("127.0.0.1:0").expect("a port");
    let to = receiver.local_addr().expect("the socket is bound");
    let stage = Stage::new();
    let text =
        format!("[[show.also]]\ncommand = \"bridge psn --to {to}\"\n[[show.also]]\ncommand = \"hz --format json\"\n");
    let config = stage.path("stage.toml");
    fs::write(&config, text).expect("a file");
    let playing = Playing::start(&["--config", config.to_str().expect("a path in UTF-8")]);
    let pid = playing.show.pid();
    let bridge = await_child(pid, "bridge", None);
    receiver.recv(&mut [0; 2048]).expect("poses from the bridge");
    kill(bridge);
    await_child(pid, "bridge", Some(bridge));
    // Before that, the bridge has reported its receiver.
    playing.show.complaint_with("bridge psn ended with signal: 9 (SIGKILL): starting it again");

    let log = playing.stage.path("out/hz.log");
    eventually("hz has printed", || fs::read_to_string(&log).ok().filter(|text| text.contains("\"rate_hz\":")));
    let hz = await_child(pid, "hz", None);
    send(hz, Signal::STOP).expect("the process runs");
    playing.show.complaint_with("hz has shown no sign of life for 5 s: killing it");
    await_child(pid, "hz", Some(hz));

    let (summary, _) = playing.interrupt();
    let restarts = json!({ "serve": 0, "monitor": 0, "record": 0, "view": 0, "bridge psn": 1, "hz": 1 });
    assert_eq!(summary["restarts"], restarts);
    let log = summary["restart_log"].as_array().expect("a list");
    let told: Vec<_> = log.iter().map(|entry| (&entry["role"], &entry["reason"])).collect();
    assert_eq!(told[0], (&json!("bridge psn"), &json!("signal: 9 (SIGKILL)")));
    assert_eq!(told[1], (&json!("hz"), &json!("no sign of life for 5 s")));
    assert_eq!(children(pid), []);
}

#[test]
fn a_show_continues_without_a_command_that_keeps_failing() {
    let stage = Stage::new();
    // No interface has an address of TEST-NET-1.
    let text = "[[show.also]]\ncommand = \"bridge psn --interface 192.0.2.1\"\n";
    fs::write(stage.path("stage.toml"), text).expect("a file");
    let show = stage.start(&["show", "--config", "stage.toml", "--rate", "50", "--out", "out", "--format", "json"]);
    let given_up = "bridge psn ended with exit status: 1: the show goes on without it";
    show.complaint_with(given_up);
    let (status, code) = status_with(&stage, "the missing bridge", |json| lamp(json, "psn").0 == "danger");
    assert_eq!((code, lamp(&status, "psn").1), (Some(1), "configured, but does not run"));
    assert_eq!(lamp(&status, "osc"), ("off", "not started"));
    show.signal(Signal::INT);
    let ended = show.end();
    assert_eq!(ended.code(), Some(1), "{}", ended.stderr);
    let summary = ended.last_json();
    assert_eq!(summary["restarts"]["bridge psn"], 11);
    let log = summary["restart_log"].as_array().expect("a list");
    let restarted: Vec<bool> = log.iter().filter_map(|entry| entry["restarted"].as_bool()).collect();
    assert_eq!(restarted, [[true; 11].as_slice(), &[false]].concat());
}

#[test]
fn a_wrong_command_is_one_line_before_anything_starts() {
    let stage = Stage::new();
    let text = "[[show.also]]\ncommand = \"hz\"\n[[show.also]]\ncommand = \"ctl stop\"\n";
    fs::write(stage.path("stage.toml"), text).expect("a file");
    let ended = stage.run(&["show", "--config", "stage.toml", "--out", "out"]);
    assert_eq!((ended.code(), ended.stdout.as_str()), (Some(2), ""));
    let reason =
        "must be one of bridge, view, metrics, monitor, hz and echo: commands that read until they are stopped";
    assert_eq!(ended.stderr, format!("error: [[show.also]] command is \"ctl stop\", {reason}\n"));
    assert!(!stage.path("out").exists());
}

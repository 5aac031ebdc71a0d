//! The monitor as a process: its reports on stdout and on the bus, at any time scale, across seeks and restarts.

use std::time::Duration;

use bench_dragon_ipc::{Alert, AlertKind, AlertSubscriber};
use serde_json::{Value, json};
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::periods::assert_no_frame_missing;
use crate::reader::Reader;
use crate::server::Server;
use crate::stage::Stage;

const CONTACT_S: f64 = 412.473_838;
const CONTACT_BENCHES: [u32; 2] = [0, 8];

/// Starts a server, a subscriber of alerts, and a monitor that reads from tick 0 on. On return, the monitor has joined.
fn watch(stage: &Stage, args: &[&str]) -> (Server, AlertSubscriber, Process) {
    let server = stage.serve(&[&["--readers", "2"], args].concat());
    let alerts = AlertSubscriber::open(stage.domain(), "test").expect("a server has created the services");
    let monitor = stage.start(&["monitor", "--format", "json"]);
    // This is the second reader: it gets tick 0 when the monitor has joined too.
    Reader::join(stage).read_to_tick(0);
    (server, alerts, monitor)
}

/// Returns the alerts among a monitor's lines.
fn alerts_in(lines: &[Value]) -> Vec<Value> {
    lines.iter().filter(|line| line["type"] == "alert").cloned().collect()
}

fn of_kind(alerts: &[Value], kind: &str) -> Vec<Value> {
    alerts.iter().filter(|alert| alert["kind"] == kind).cloned().collect()
}

/// Returns an alert of the bus as the line that a monitor prints.
fn line_of(alert: &Alert) -> Value {
    let pair = alert.pair();
    json!({
        "type": "alert",
        "kind": alert.alert_kind().expect("a kind that this version knows").name(),
        "time_s": alert.show_time_ns as f64 * 1e-9,
        "tick": alert.tick,
        "run_id": alert.run_id,
        "benches": pair,
        "bench": alert.bench(),
        "clearance_m": pair.map(|_| alert.clearance_m),
        "point_m": pair.map(|_| alert.point_m),
        "forecast_s": alert.forecast(),
    })
}

fn all_of(alerts: &AlertSubscriber) -> Vec<Value> {
    std::iter::from_fn(|| alerts.receive().expect("the bus is readable")).map(|alert| line_of(&alert)).collect()
}

/// Waits until a monitor has reported a kind of alert, then ends it. Returns its lines and the alerts among them, which equal
/// those on the bus.
fn end_after_alert(mut monitor: Process, alerts: &AlertSubscriber, kind: &str) -> (Vec<Value>, Vec<Value>) {
    let mut lines = monitor.json_until(&format!("an alert of kind {kind}"), |line| line["kind"] == kind);
    // A subscriber finds a publisher when it reads, so it must read once while the monitor runs.
    let mut heard = all_of(alerts);
    lines.extend(monitor.terminate().expect_clean().json_lines());
    heard.extend(all_of(alerts));
    let told = alerts_in(&lines);
    assert_eq!(heard, told, "stdout and the bus agree");
    (lines, told)
}

fn assert_is_the_contact(alert: &Value) {
    let time_s = alert["time_s"].as_f64().expect("a time");
    assert!((time_s - CONTACT_S).abs() < 1e-6, "{alert}");
    assert_eq!(alert["benches"], json!(CONTACT_BENCHES));
    assert_eq!((&alert["clearance_m"], &alert["forecast_s"]), (&json!(0.0), &alert["time_s"]));
}

#[test]
fn a_monitor_reports_near_benches_and_their_contact_on_stdout_and_on_the_bus() {
    let stage = Stage::new();
    let (server, alerts, monitor) =
        watch(&stage, &["--start-at", "411", "--time-scale", "20", "--until", "413", "--catch-up", "0"]);
    let run_id = server.run_id;
    let served = server.summary();
    assert_no_frame_missing(&served, 101);
    let (lines, told) = end_after_alert(monitor, &alerts, "contact");

    let near = of_kind(&told, "near");
    let [contact] = &of_kind(&told, "contact")[..] else { panic!("one contact: {told:?}") };
    assert_is_the_contact(contact);
    assert!(
        near.iter().any(|alert| alert["benches"] == contact["benches"]),
        "alerts of near benches precede the contact: {near:?}"
    );
    assert!(near.iter().all(|alert| alert["clearance_m"].as_f64() <= Some(0.02)), "{near:?}");
    assert!(told.iter().all(|alert| alert["run_id"] == run_id));

    let summary = lines.last().expect("a summary");
    assert_eq!((&summary["frames"], &summary["lost"]), (&served["frames"], &json!(0)));
    assert_eq!(summary["contact"], json!({ "time_s": contact["time_s"], "benches": CONTACT_BENCHES }));
    assert!(
        summary["least_clearance"]["clearance_m"].as_f64() < Some(0.0),
        "the benches overlap after the contact: {summary}"
    );
}

#[test]
fn the_contact_is_found_at_the_same_instant_at_any_time_scale() {
    for (time_scale, rate, periods) in [("400", "1000", 36), ("1000", "200", 4), ("50", "50", 15)] {
        let stage = Stage::new();
        let pace = ["--start-at", "400", "--time-scale", time_scale, "--rate", rate, "--until", "414"];
        let (server, alerts, monitor) = watch(&stage, &pace);
        assert_no_frame_missing(&server.summary(), periods);
        let (_, told) = end_after_alert(monitor, &alerts, "contact");
        assert_is_the_contact(&of_kind(&told, "contact")[0]);
    }
}

#[test]
fn fail_on_contact_ends_the_monitor_at_the_first_contact_with_status_3() {
    let stage = Stage::new();
    let server = stage.serve(&["--readers", "1", "--start-at", "411", "--time-scale", "20", "--rate", "50"]);
    let ended = stage.run(&["monitor", "--format", "json", "--fail-on-contact"]);
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(3), ""));
    let lines = ended.json_lines();
    let contacts = of_kind(&alerts_in(&lines), "contact");
    assert_is_the_contact(&contacts[0]);
    assert_eq!(lines.last().map(|line| &line["contact"]["time_s"]), Some(&contacts[0]["time_s"]));
    server.stop();
}

#[test]
fn a_monitor_in_text_prints_one_line_per_alert() {
    let stage = Stage::new();
    let server = stage.serve(&["--readers", "1", "--start-at", "411", "--time-scale", "20", "--until", "413"]);
    let monitor = stage.start(&["monitor"]);
    server.summary();
    let text = monitor.terminate().expect_clean().stdout;
    assert!(text.contains("  412.473838 s  contact    benches 0 and 8, clearance 0.000000 m at ("), "{text}");
    assert!(text.ends_with("first contact at 412.473838 s, benches 0 and 8\n"), "{text}");
}

#[test]
fn nothing_is_swept_across_a_seek() {
    let stage = Stage::new();
    let (server, alerts, monitor) = watch(&stage, &["--start-at", "411", "--rate", "50", "--held"]);
    let mut reader = Reader::join(&stage);
    for time in ["415", "411", "410"] {
        let reply = stage.run(&["ctl", "seek", time, "--format", "json"]).expect_clean().last_json();
        // The frame is read before the next seek: of two seeks in one tick, only the second is visible.
        reader.read_to_tick(reply["tick"].as_u64().expect("a tick"));
    }
    drop(reader);
    server.stop();
    let (_, told) = end_after_alert(monitor, &alerts, "contact");
    for contact in of_kind(&told, "contact") {
        assert_eq!(contact["time_s"], 415.0, "the contact is measured at the target of the seek");
        assert!(contact["clearance_m"].as_f64() < Some(0.0), "{contact}");
    }
    assert!(of_kind(&told, "parted").is_empty(), "{told:?}");
}

#[test]
fn a_seek_back_across_near_benches_reports_none_of_them() {
    let stage = Stage::new();
    let (server, alerts, mut monitor) = watch(&stage, &["--start-at", "411", "--rate", "50", "--held"]);
    monitor.json_until("an alert of kind near", |line| line["kind"] == "near");
    all_of(&alerts);
    stage.run(&["ctl", "seek", "300"]).expect_clean();
    stage.run(&["ctl", "release"]).expect_clean();
    server.stop();
    let lines = monitor.terminate().expect_clean().json_lines();
    assert!(alerts_in(&lines).iter().all(|alert| alert["time_s"] == 411.0), "{lines:?}");
    assert_eq!(all_of(&alerts), alerts_in(&lines));
}

#[test]
fn a_restart_of_the_server_is_reported_with_the_new_run_id() {
    let stage = Stage::new();
    let (server, alerts, mut monitor) = watch(&stage, &["--start-at", "411", "--rate", "50"]);
    monitor.json_until("an alert of kind near", |line| line["kind"] == "near");
    server.process.kill();
    let server = stage.serve(&["--rate", "50"]);
    let told = monitor.json_until("an alert of kind restarted", |line| line["kind"] == "restarted");
    let restarted = told.last().expect("the line that was waited for");
    assert_eq!((&restarted["run_id"], &restarted["benches"]), (&json!(server.run_id), &Value::Null));
    let heard = eventually("an alert of the restart", || {
        let alert = alerts.wait(Duration::from_millis(100)).expect("the bus is readable");
        alert.filter(|alert| alert.alert_kind() == Some(AlertKind::Restarted)).map(|alert| line_of(&alert))
    });
    assert_eq!(heard, *restarted);
    monitor.terminate().expect_clean();
    drop(alerts);
    server.stop();
}

#[test]
fn a_hold_is_reported_once() {
    let stage = Stage::new();
    let (server, alerts, monitor) = watch(&stage, &["--rate", "50"]);
    let reply = stage.run(&["ctl", "hold", "--format", "json"]).expect_clean().last_json();
    let tick = reply["tick"].as_u64().expect("a tick");
    Reader::join(&stage).read_to_tick(tick + 5);
    server.stop();
    let (_, told) = end_after_alert(monitor, &alerts, "held");
    let [held] = &of_kind(&told, "held")[..] else { panic!("one hold: {told:?}") };
    assert_eq!((&held["tick"], &held["benches"]), (&reply["tick"], &Value::Null));
}

#[test]
fn a_monitor_that_is_woken_and_one_that_sleeps_by_the_clock_report_the_same_alerts() {
    let stage = Stage::new();
    let server = stage.serve(&["--readers", "2", "--start-at", "411", "--time-scale", "20", "--until", "413"]);
    let flags: [&[&str]; 2] = [&[], &["--spin-us", "100"]];
    let monitors = flags.map(|flags| stage.start(&[&["monitor", "--format", "json"], flags].concat()));
    server.summary();
    let [first, second] = monitors.map(|monitor| alerts_in(&monitor.terminate().expect_clean().json_lines()));
    let without_forecast = |alerts: &[Value]| {
        let strip =
            |alert: &Value| [&alert["kind"], &alert["time_s"], &alert["benches"], &alert["tick"]].map(Value::clone);
        alerts.iter().map(strip).collect::<Vec<_>>()
    };
    assert_eq!(without_forecast(&first), without_forecast(&second));
}

#[test]
fn a_monitor_reports_the_outcome_and_the_sender_of_each_command() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    assert_eq!(stage.run(&["ctl", "speed", "0.8"]).code(), Some(0));
    let mut monitor = stage.start(&["monitor", "--format", "json"]);
    let mut text = stage.start(&["monitor"]);
    monitor.json_until("the speed is reported", |line| line["command"] == "speed");
    // Both monitors read the bus from here on.
    let mut told = text.next_line().expect("a line");
    while !told.contains("  ctl: speed 0.8 m/s, accepted from tick ") {
        told = text.next_line().expect("the speed is reported in text");
    }
    assert!(told.contains(" s  command    20"), "{told}");
    assert_eq!(stage.run(&["ctl", "release"]).code(), Some(1));
    let ctl = stage.start(&["ctl", "seek", "1e6"]);
    let ctl_pid = ctl.pid();
    assert_eq!(ctl.end().code(), Some(1));
    let lines = monitor.json_until("the seek is reported", |line| line["command"] == "seek");
    let seek = lines.last().expect("the line that was waited for");
    assert_eq!((&seek["type"], &seek["sender"], &seek["pid"]), (&json!("command"), &json!("ctl"), &json!(ctl_pid)));
    assert_eq!(
        (&seek["accepted"], &seek["values"], &seek["run_id"]),
        (&json!(false), &json!([1e6]), &json!(server.run_id))
    );
    let reason = seek["reason"].as_str().expect("a reason");
    assert!(reason.starts_with("the show time is 1000000 s, must be from 0 to "), "{reason}");
    let wall_time = seek["wall_time"].as_str().expect("a time");
    assert!(wall_time.parse::<jiff::Timestamp>().is_ok() && wall_time.ends_with('Z'), "{wall_time}");
    server.stop();
    let summary = monitor.terminate().expect_clean().last_json();
    assert_eq!(
        summary["commands"],
        json!({ "accepted": 2, "refused": 2, "grants": 0, "lost": 0 }),
        "the signal is counted too"
    );
    let text = text.terminate().expect_clean().stdout;
    assert!(text.contains("\ncommands: 2 accepted, 2 refused, 0 grants, 0 lost\n"), "{text}");
}

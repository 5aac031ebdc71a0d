//! `ctl status`: the state of the show, as text, as JSON, and as exit status.

use bench_dragon_ipc::ShowState;
use serde_json::Value;
use test_support::eventually::eventually_from;

use crate::reader::Reader;
use crate::stage::Stage;

/// Returns the status and the exit status.
pub(crate) fn status(stage: &Stage) -> (Value, Option<i32>) {
    let ended = stage.run(&["ctl", "status", "--format", "json"]);
    (ended.last_json(), ended.code())
}

/// Repeats the command until the status is as wanted: on a busy machine a reader reports late.
pub(crate) fn status_with(stage: &Stage, what: &str, is_wanted: impl Fn(&Value) -> bool) -> (Value, Option<i32>) {
    eventually_from(what, || {
        let (json, code) = status(stage);
        if is_wanted(&json) { Ok((json, code)) } else { Err(json.to_string()) }
    })
}

pub(crate) fn lamp<'a>(status: &'a Value, name: &str) -> (&'a str, &'a str) {
    let lamps = status["lamps"].as_array().expect("lamps");
    let lamp = lamps.iter().find(|lamp| lamp["name"] == name).expect("each part has a lamp");
    (lamp["level"].as_str().expect("a level"), lamp["text"].as_str().expect("a text"))
}

#[test]
fn without_a_server_the_status_is_red_and_every_command_is_refused() {
    let stage = Stage::new();
    let (json, code) = status(&stage);
    assert_eq!(
        (code, &json["well"], &json["link"], &json["state"]),
        (Some(1), &false.into(), &"waiting".into(), &Value::Null)
    );
    assert_eq!(lamp(&json, "server"), ("danger", "no server"));
    assert_eq!(json["refusals"]["hold"], "no server runs");
}

#[test]
fn a_missing_monitor_is_a_warning_and_a_missing_guard_is_red() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50", "--start-at", "300"]);
    let mut reader = Reader::join(&stage);
    let (json, code) = status_with(&stage, "a live show with a forecast", |json| {
        json["well"] == true && json["ahead"]["kind"] == "contact" && lamp(json, "monitor").0 == "warning"
    });
    assert_eq!((code, &json["state"]), (Some(0), &"running".into()), "{json}");
    assert_eq!((lamp(&json, "monitor"), lamp(&json, "guard").0), (("warning", "missing"), "off"), "{json}");
    assert_eq!(json["ahead"]["benches"], serde_json::json!([0, 8]), "{json}");
    let monitor = stage.start(&["monitor"]);
    status_with(&stage, "the monitor's lamp", |json| lamp(json, "monitor") == ("good", "runs"));
    stage.run(&["ctl", "hold"]).expect_clean();
    reader.read_until("the hold", |header| header.show_state() == Some(ShowState::Held));
    eventually_from("the text has the held show, its forecast and its last command", || {
        let text = stage.run(&["ctl", "status"]).stdout;
        let wanted = [" of walking (show time ", "ctl: hold, accepted from tick "];
        let is_so = text.starts_with("held, show time ") && wanted.iter().all(|part| text.contains(part));
        if is_so { Ok(()) } else { Err(text) }
    });
    monitor.terminate().expect_clean();
    server.stop();
    let guarded = stage.serve(&["--rate", "50", "--start-at", "300", "--guarded"]);
    let (json, code) = status_with(&stage, "a missing guard", |json| json["guard"]["kind"] == "missing");
    assert_eq!((code, lamp(&json, "guard")), (Some(1), ("danger", "missing, margin 0.5 mm")), "{json}");
    let guard = stage.start(&["monitor", "--guard"]);
    let (_, code) = status_with(&stage, "the guard's lamp and stop", |json| {
        json["well"] == true && lamp(json, "guard").0 == "good" && json["ahead"]["kind"] == "guard_stop"
    });
    assert_eq!(code, Some(0));
    guard.terminate().expect_clean();
    guarded.stop();
}

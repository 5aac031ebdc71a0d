//! The guard as a process: the head walks only within its grants, whatever happens to the guard.

use std::fs;

use bench_dragon_ipc::{Request, ShowState};
use serde_json::Value;
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::lying_source::LyingSource;
use crate::periods::assert_no_frame_missing;
use crate::reader::{Reader, Shot};
use crate::seed::Seed;
use crate::stage::Stage;

/// Show time in seconds, and travel in metres, at which the guarded paper's dragon rests, at 1 m/s.
const REST_S: f64 = 412.454_970;
const MARGIN_M: f64 = 0.0005;

fn assert_is_the_rest(guard: &Value) {
    let [held_at_s, clearance_m, forecast_s] =
        ["held_at_s", "clearance_m", "forecast_contact_s"].map(|key| guard[key].as_f64().expect("a number"));
    assert!((held_at_s - REST_S).abs() < 5e-7, "{guard}");
    assert!((MARGIN_M..MARGIN_M + 1e-6).contains(&clearance_m), "{guard}");
    assert!((forecast_s - 412.473_838).abs() < 5e-7, "{guard}");
}

pub(crate) fn start_guard(stage: &Stage) -> Process {
    stage.start(&["monitor", "--guard", "--format", "json"])
}

/// Waits until a guard reports the permanent rest of the head.
fn await_rest(guard: &mut Process) -> Value {
    guard
        .json_until("the guard reports its hold", |line| line["type"] == "guard")
        .pop()
        .expect("the line that was waited for")
}

/// Fails unless travel never decreases and never exceeds the rest.
fn assert_never_past_rest(shots: &[Shot]) {
    for shot in shots {
        assert!(shot.header.head_travel_m <= REST_S + 5e-7, "tick {}: {}", shot.header.tick, shot.header.head_travel_m);
    }
    assert!(shots.windows(2).all(|pair| pair[0].header.head_travel_m <= pair[1].header.head_travel_m));
}

#[test]
fn a_guarded_show_ends_with_status_0_half_a_millimetre_before_the_contact_at_any_time_scale() {
    for time_scale in ["1", "20", "400"] {
        let stage = Stage::new();
        let show = ["show", "--guard", "--out", "out", "--start-at", "405", "--format", "json"];
        let ended = stage.run(&[&show[..], &["--time-scale", time_scale]].concat());
        assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
        let summary = ended.last_json();
        assert_is_the_rest(&summary["guard"]);
        assert_eq!(summary["contact"], Value::Null);
        let kept: Value =
            serde_json::from_slice(&fs::read(stage.path("out/summary.json")).expect("a file")).expect("JSON");
        assert_eq!(kept, summary);
    }
}

/// Two straight dragons on one clock. The head of silver walks towards a crowd, 40 m ahead of where it begins.
const TOWARDS_A_CROWD: &str = "[[dragons]]\nname = \"gold\"\nbenches = 5\n[dragons.route]\nkind = \"path\"\n\
    segments = [{ kind = \"line\", length_m = 60 }]\n[[dragons]]\nname = \"silver\"\nbenches = 5\n[dragons.route]\nkind = \"path\"\n\
    start_y_m = 9\nsegments = [{ kind = \"line\", length_m = 60 }]\n[stage]\ncrowd = [[40, 8], [40, 12]]\nclear_m = 2\nguard = true\n";

#[test]
fn a_guarded_show_of_two_dragons_rests_before_a_board_is_too_near_to_the_crowd() {
    for is_kept in [true, false] {
        let stage = Stage::new();
        let text = if is_kept { TOWARDS_A_CROWD.to_owned() } else { TOWARDS_A_CROWD.replace("guard = true", "") };
        fs::write(stage.path("plan.toml"), text).expect("a configuration");
        let show =
            ["show", "--guard", "--config", "plan.toml", "--out", "out", "--time-scale", "20", "--format", "json"];
        let ended = stage.run(&show);
        assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
        let summary = ended.last_json();
        if !is_kept {
            assert_eq!((&summary["guard"], &summary["outcome"]["kind"]), (&Value::Null, &Value::from("end_of_run")));
            // Boards walk through the crowd's line. Of their row, the first is reported, and the last once it is clear.
            let counts = &summary["alert_counts"];
            assert_eq!((&counts["too_near"], &counts["clear"]), (&Value::from(1), &Value::from(1)), "{counts}");
            continue;
        }
        let guard = &summary["guard"];
        let held_at_s = guard["held_at_s"].as_f64().expect("a number");
        // The board of the head reaches 0.275 m beyond its handle.
        assert!((held_at_s - (40.0 - 2.0 - 0.275)).abs() < 1e-6, "{guard}");
        let border = &guard["border"];
        assert_eq!((&border["border"], &border["dragons"][0]), (&Value::from("crowd"), &Value::from("silver")));
        assert!((border["distance_m"].as_f64().expect("a number") - 2.0).abs() < 1e-6, "{guard}");
        let text = summary["outcome"]["text"].as_str().expect("a sentence");
        assert!(text.ends_with("beyond, silver 0 comes nearer to crowd than clear_m."), "{text}");
    }
}

#[test]
fn a_show_without_a_guard_has_none_in_its_summary() {
    let stage = Stage::new();
    let ended = stage.run(&["show", "--out", "out", "--start-at", "1", "--until", "1.1", "--format", "json"]);
    assert_eq!(ended.expect_clean().last_json().get("guard"), Some(&Value::Null));
}

#[test]
fn a_guarded_server_stands_held_until_there_is_a_guard_and_walks_with_it() {
    let stage = Stage::new();
    let server = stage.serve(&["--guarded", "--rate", "100"]);
    let mut reader = Reader::join(&stage);
    let standing = reader.read_to_tick(20);
    assert!(standing.iter().all(|shot| shot.state() == ShowState::Held && shot.header.show_time_ns == 0));
    for order in ["release", "resume"] {
        let refused = stage.run(&["ctl", order]);
        let reason = "refused: the guard holds the dragon: it walks on by itself if the guard proves the travel ahead, else only a seek \
                      moves it\n";
        assert_eq!((refused.code(), refused.stderr.as_str()), (Some(1), reason));
    }
    let guard = start_guard(&stage);
    reader.read_until("the head is past 0.1 m", |header| header.head_travel_m > 0.1);
    guard.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_killed_guard_leaves_the_head_at_rest_within_its_grant_until_the_next_guard() {
    let stage = Stage::new();
    let server = stage.serve(&["--guarded", "--rate", "100", "--catch-up", "0"]);
    let mut reader = Reader::join(&stage);
    let mut travel_m = 0.0;
    for _ in 0..3 {
        let guard = start_guard(&stage);
        let mut walking =
            reader.read_until("the head goes on by 0.1 m", |header| header.head_travel_m > travel_m + 0.1);
        guard.kill();
        // The last frame that the guard saw is no newer than the newest frame now.
        walking.extend(reader.read_unread());
        let seen_m = walking.last().expect("the frame that was waited for").header.head_travel_m;
        let braking = reader.read_until("the show is held", |header| header.show_state() == Some(ShowState::Held));
        let rest = braking.last().expect("the frame that was waited for").header;
        assert!(rest.head_travel_m < seen_m + 1.0, "the head walked beyond the horizon of the last grant: {rest:?}");
        travel_m = rest.head_travel_m;
    }
    server.stop();
}

#[test]
fn a_guard_killed_at_random_instants_allows_no_contact() {
    let mut random = Seed::announced().random(0);
    let stage = Stage::new();
    let server = stage.serve(&["--guarded", "--rate", "200", "--start-at", "400", "--time-scale", "4"]);
    let mut reader = Reader::join(&stage);
    let mut shots = Vec::new();
    for _ in 0..20 {
        let guard = start_guard(&stage);
        // The instants are counted in frames, from the guard's start-up to its first grants.
        for _ in 0..random.u32(0..30) {
            shots.push(reader.next());
        }
        guard.kill();
    }
    let mut guard = start_guard(&stage);
    shots.extend(reader.read_until("the head rests", |header| header.head_travel_m > REST_S - 1e-6));
    assert_is_the_rest(&await_rest(&mut guard));
    guard.terminate().expect_clean();
    server.stop();
    shots.extend(reader.read_unread());
    assert_never_past_rest(&shots);
    let last: Vec<ShowState> = shots.iter().rev().take(2).map(Shot::state).collect();
    assert_eq!(last, [ShowState::Ended, ShowState::Held]);
}

#[test]
fn a_seek_is_accepted_if_the_guard_can_prove_its_target() {
    let stage = Stage::new();
    let server = stage.serve(&["--guarded", "--rate", "100"]);
    let mut reader = Reader::join(&stage);
    let unguarded = stage.run(&["ctl", "seek", "300", "--format", "json"]);
    let reason =
        "no guard has proved that the benches are apart there: no guard runs, start `bench-dragon monitor --guard`";
    assert_eq!(unguarded.last_json()["reason"], reason);
    let guard = start_guard(&stage);
    reader.read_until("the head walks", |header| header.head_travel_m > 0.0);
    // `ctl` waits 5 s for the guard's proof, which may take longer on a busy machine.
    eventually("the seek is accepted", || (stage.run(&["ctl", "seek", "300"]).code() == Some(0)).then_some(()));
    reader.read_until("the head is past 300.1 m", |header| header.head_travel_m > 300.1);
    let overlapping = stage.run(&["ctl", "seek", "412.6"]);
    assert_eq!(overlapping.code(), Some(1));
    let last = reader.read_until("the head is past 300.5 m", |header| header.head_travel_m > 300.5);
    assert!(last.iter().all(|shot| shot.header.head_travel_m < 400.0));
    guard.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_restarted_server_has_no_grant_and_the_guard_begins_anew() {
    let stage = Stage::new();
    let server = stage.serve(&["--guarded", "--rate", "100"]);
    let mut reader = Reader::join(&stage);
    let mut guard = start_guard(&stage);
    reader.read_until("the head is past 0.1 m", |header| header.head_travel_m > 0.1);
    server.process.kill();
    let server = stage.serve(&["--guarded", "--rate", "100", "--start-at", "412", "--readers", "2"]);
    let run_id = server.run_id;
    let first = reader
        .read_until("a frame of the new run", |header| header.run_id == run_id)
        .pop()
        .expect("the frame that was waited for");
    assert_eq!((first.state(), first.header.head_travel_m), (ShowState::Held, 412.0));
    assert_is_the_rest(&await_rest(&mut guard));
    guard.terminate().expect_clean();
    server.stop();
}

#[test]
fn there_is_one_guard_at_a_time() {
    let stage = Stage::new();
    let server = stage.serve(&["--guarded", "--rate", "100"]);
    let mut reader = Reader::join(&stage);
    let first = start_guard(&stage);
    reader.read_until("the head walks", |header| header.head_travel_m > 0.0);
    let second = start_guard(&stage).end();
    let expected = format!(
        "error: a guard already runs on instance \"{}\", pid {}: stop it first\n",
        stage.domain().instance(),
        first.pid()
    );
    assert_eq!((second.code(), second.stderr), (Some(1), expected));
    first.terminate().expect_clean();
    server.stop();
}

#[test]
fn a_guard_of_an_unguarded_server_warns_and_monitors() {
    let stage = Stage::new();
    let server = stage.serve(&["--readers", "1", "--start-at", "411", "--time-scale", "20", "--until", "413"]);
    let guard = start_guard(&stage);
    assert_no_frame_missing(&server.summary(), 101);
    let ended = guard.terminate();
    assert!(
        ended.stderr.contains("the server is not guarded") && ended.stderr.lines().count() == 1,
        "{}",
        ended.stderr
    );
    let summary = ended.last_json();
    assert_eq!((&summary["guard"], &summary["contact"]["benches"]), (&Value::Null, &serde_json::json!([0, 8])));
}

#[test]
fn a_frame_that_differs_from_the_description_is_a_fault_and_ends_the_grants() {
    let stage = Stage::new();
    let mut source = LyingSource::start(stage.domain());
    let mut guard = start_guard(&stage);
    let mut requests = Vec::new();
    while requests.is_empty() {
        requests.extend(source.publish(1.0));
    }
    assert!(matches!(requests[0], Request::Grant { from_m: 0.0, .. }), "{requests:?}");
    while !requests.contains(&Request::Hold) {
        requests.extend(source.publish(1.0 + 1e-6));
    }
    let lines = guard.json_until("an alert of kind fault", |line| line["kind"] == "fault");
    assert!(lines.iter().all(|line| line["kind"] != "contact"));
    // The guard reports the fault after the reply to its hold, possibly long after the fault.
    let told = guard.complaint();
    assert!(told.contains("it grants no more, and it has held the show"), "{told}");
    assert_eq!(guard.terminate().last_json()["faults"], 1);
    assert_eq!(source.publish(1.0), []);
}

//! A replay in the hands of a director: it shows the recorded alerts and commands, and is paused, sought and sped up.

use bench_dragon_ipc::{
    Alert, AlertKind, AlertSubscriber, CommandEvent, CommandEventReader, EventKind, FrameHeader, ReplayStatus,
    ReplayStatusReader, ShowState,
};
use serde_json::Value;
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::reader::{Reader, Shot, assert_whole};
use crate::record::await_frames;
use crate::replay::{recorded, replay};
use crate::stage::Stage;

/// Records two seconds before the paper's first contact until its end, with a monitor and a change of speed.
pub(crate) fn record_contact(stage: &Stage, name: &str) {
    let server = stage.serve(&["--rate", "100", "--start-at", "411", "--until", "413.2", "--held", "--readers", "1"]);
    let recorder = stage.start(&["record", name]);
    await_frames(&stage.path(name));
    assert_eq!(stage.run(&["ctl", "hold"]).code(), Some(0));
    let mut monitor = stage.start(&["monitor", "--format", "json"]);
    monitor.json_until("the monitor reports that the show is held", |line| line["kind"] == "held");
    for command in [&["speed", "1.1"][..], &["release"]] {
        assert_eq!(stage.run(&[&["ctl"], command].concat()).code(), Some(0));
    }
    server.summary();
    monitor.terminate().expect_clean();
    recorder.terminate().expect_clean();
}

/// The newest status of a replay that is as wanted.
#[track_caller]
fn await_position(reader: &ReplayStatusReader, what: &str, is_wanted: impl Fn(&ReplayStatus) -> bool) -> ReplayStatus {
    eventually(what, || reader.poll().expect("the bus is readable").filter(&is_wanted))
}

fn ctl(stage: &Stage, command: &[&str]) -> Value {
    stage.run(&[&["ctl", "--format", "json"], command].concat()).expect_clean().last_json()
}

fn is_standing(shot: &Shot) -> bool {
    shot.header.head_speed_mps == 0.0 && shot.handles.iter().all(|handle| handle.velocity_mps == [0.0; 3])
}

#[test]
fn a_replay_publishes_the_recorded_alerts_and_commands_in_step_with_its_frames() {
    let stage = Stage::new();
    record_contact(&stage, "a.mcap");
    let recorded_to_ns = recorded(&stage.path("a.mcap")).last().expect("a frame").0.log_time_ns.cast_signed();
    let (process, started) = replay(&stage, &["a.mcap", "--readers", "1"]);
    let alerts = AlertSubscriber::open(stage.domain(), "test").expect("the replay has created the services");
    let events = CommandEventReader::open(stage.domain(), "test").expect("the replay has created the services");
    let mut reader = Reader::join(&stage);
    let (mut shots, mut contact, mut seen): (Vec<Shot>, Option<Alert>, Vec<CommandEvent>) = Default::default();
    while shots.last().is_none_or(|shot| !matches!(shot.state(), ShowState::Finished | ShowState::Ended)) {
        shots.push(reader.next());
        while let Some(alert) = alerts.receive().expect("the bus is readable") {
            if alert.alert_kind() == Some(AlertKind::Contact) {
                contact = contact.or(Some(alert));
            }
        }
        seen.extend(std::iter::from_fn(|| events.receive().expect("the bus is readable")));
    }
    let run_id = started["run_id"].as_u64().expect("a run has a number");
    assert_whole(&shots, run_id);
    let contact = contact.expect("the contact was published before the last frame");
    assert_eq!((contact.run_id, contact.pair()), (run_id, Some([0, 8])));
    assert!((contact.show_time_ns as f64 / 1e9 - 412.473_838).abs() < 0.2, "{contact:?}");
    let at =
        shots.iter().find(|shot| shot.header.show_time_ns >= contact.show_time_ns).expect("a frame of the contact");
    assert_eq!(contact.tick, at.header.tick, "the alert has the tick of this replay");

    let kinds: Vec<_> = seen.iter().filter_map(CommandEvent::event_kind).collect();
    assert_eq!(kinds, [EventKind::Hold, EventKind::Speed, EventKind::Release], "without start and end");
    for (number, event) in (0..).zip(&seen) {
        assert_eq!((event.run_id, event.number), (run_id, number));
        let shot = &shots[event.tick as usize];
        assert!(shot.header.show_time_ns.abs_diff(event.show_time_ns) <= 20_000_000, "{event:?} {:?}", shot.header);
        assert!(event.wall_ns < recorded_to_ns, "the wall time is the recorded one");
    }
    process.end().expect_clean();
}

#[test]
fn a_replay_without_events_publishes_only_frames() {
    let stage = Stage::new();
    record_contact(&stage, "a.mcap");
    let (process, _) = replay(&stage, &["a.mcap", "--readers", "1", "--frames-only", "--rate", "4"]);
    let alerts = AlertSubscriber::open(stage.domain(), "test").expect("the replay has created the services");
    let events = CommandEventReader::open(stage.domain(), "test").expect("the replay has created the services");
    Reader::join(&stage).read_to_end();
    process.end().expect_clean();
    assert!(alerts.receive().expect("the bus is readable").is_none());
    assert!(events.receive().expect("the bus is readable").is_none());
}

#[test]
fn a_replay_is_paused_sought_and_sped_up_and_stays_at_its_end() {
    let stage = Stage::new();
    record_contact(&stage, "a.mcap");
    let (process, started) = replay(&stage, &["a.mcap", "--paused", "--stay", "--readers", "1"]);
    let positions = ReplayStatusReader::open(stage.domain(), "test").expect("the replay has created the services");
    let mut reader = Reader::join(&stage);
    let mut shots = reader.read_to_tick(5);
    assert!(shots.iter().all(|shot| shot.state() == ShowState::Paused && is_standing(shot)), "{:?}", shots[0].header);
    assert!(shots.iter().all(|shot| shot.header.show_time_ns == shots[0].header.show_time_ns), "the picture stands");
    let begin = await_position(&positions, "the replay is paused at its begin", |status| status.paused == 1);
    assert_eq!((begin.position_ns, begin.pace, begin.at_end), (0, 1.0, 0));
    assert_eq!(started["run_id"], begin.run_id);
    let length_ns = begin.length_ns;
    assert!(length_ns > 2_000_000_000, "{begin:?}");

    // A seek of a paused replay shows the picture there.
    // The dragon walks in the last two seconds.
    let middle_s = length_ns as f64 / 1e9 - 1.0;
    ctl(&stage, &["seek", &middle_s.to_string()]);
    let middle = await_position(&positions, "the replay is in the middle", |status| status.position_ns > 0);
    assert!((middle.position_ns as f64 / 1e9 - middle_s).abs() < 0.1 && middle.paused == 1, "{middle:?}");
    let sought = reader.read_until("the picture is another one", |header| header.show_time_s() > 411.1);
    let there_s = sought.last().expect("a frame").header.show_time_s();
    shots.extend(sought);
    assert!(is_standing(shots.last().expect("a frame")));

    ctl(&stage, &["pace", "0.5"]);
    await_position(&positions, "the pace is half", |status| status.pace == 0.5);
    ctl(&stage, &["resume"]);
    shots.extend(reader.read_until("the replay runs", |header| header.show_state() == Some(ShowState::Running)));
    let walking = shots.last().expect("a frame");
    assert!((walking.header.time_scale - 0.5).abs() < 0.051 && !is_standing(walking), "{:?}", walking.header);
    assert!(walking.header.show_time_s() >= there_s, "it goes on where it was sought");

    for pace in ["0", "101"] {
        let refused = stage.run(&["ctl", "pace", pace]);
        assert_eq!(refused.code(), Some(1), "{}", refused.stderr);
        assert!(refused.stderr.contains("must be from 0.01 to 100"), "{}", refused.stderr);
    }
    ctl(&stage, &["pace", "2"]);
    shots.extend(reader.read_until("the replay stands at the end", |header| {
        header.show_state() == Some(ShowState::Finished) && header.time_scale == 2.0
    }));
    let end = await_position(&positions, "the replay is at its end", |status| status.at_end == 1);
    assert!(end.position_ns <= length_ns && length_ns - end.position_ns < 1_000_000_000, "{end:?}");
    ctl(&stage, &["pace", "1"]);
    ctl(&stage, &["seek", "0"]);
    shots.extend(reader.read_until("the replay begins again", |header| {
        header.show_time_s() < 411.5 && header.show_state() != Some(ShowState::Finished)
    }));
    ctl(&stage, &["seek", "1e9"]);
    await_position(&positions, "a position beyond the end is the end", |status| status.at_end == 1);
    ctl(&stage, &["stop"]);
    let passes = process.end().expect_clean().json_lines();
    shots.extend(reader.read_unread());
    assert!(shots.iter().all(|shot| shot.header.run_id == begin.run_id), "a seek within a run begins no other one");
    assert!(shots.is_sorted_by_key(|shot| shot.header.tick), "the ticks go on after a seek back");
    let last = shots.last().expect("a frame").header.tick;
    assert_eq!(passes[0]["frames"], last + 1, "the ticks of a sought replay have no hole");
    for pace in ["-1", "10001", "nan"] {
        assert_eq!(stage.run(&["ctl", "pace", pace]).code(), Some(2));
    }
}

/// Records two runs of 0.8 s, from 100 s and from 200 s, as `a.mcap`.
fn record_two_runs(stage: &Stage, rate: &str) {
    let recorder = stage.start(&["record", "a.mcap"]);
    for start in ["100", "200"] {
        stage
            .serve(&["--rate", rate, "--start-at", start, "--until", &format!("{start}.8"), "--readers", "1"])
            .summary();
    }
    recorder.terminate();
}

#[test]
fn a_seek_into_another_recorded_run_begins_another_pass() {
    let stage = Stage::new();
    record_two_runs(&stage, "20");
    let (mut process, first) = replay(&stage, &["a.mcap", "--paused", "--stay", "--readers", "1"]);
    let positions = ReplayStatusReader::open(stage.domain(), "test").expect("the replay has created the services");
    let mut reader = Reader::join(&stage);
    assert!((reader.next().header.show_time_s() - 100.0).abs() < 0.5);
    let begin = await_position(&positions, "the replay is paused", |status| status.paused == 1);
    ctl(&stage, &["seek", &(begin.length_ns as f64 / 1e9 - 0.2).to_string()]);
    let second = next_start(&mut process);
    assert_ne!((&second["run_id"], &second["recorded_run_id"]), (&first["run_id"], &first["recorded_run_id"]));
    let shots = reader.read_until("the second run is shown", |header| header.show_time_s() > 200.0);
    assert_eq!(
        (shots.last().expect("a frame").header.run_id, shots.last().map(Shot::state)),
        (second["run_id"].as_u64().expect("a run"), Some(ShowState::Paused))
    );
    ctl(&stage, &["seek", "0"]);
    let third = next_start(&mut process);
    assert_eq!(third["recorded_run_id"], first["recorded_run_id"]);
    assert_ne!(third["run_id"], first["run_id"], "ticks of a run are not counted twice");
    ctl(&stage, &["stop"]);
    process.end().expect_clean();
}

#[test]
fn a_replay_that_stays_also_stays_after_a_seek_beyond_its_last_frame() {
    let stage = Stage::new();
    record_two_runs(&stage, "20");
    for to_s in [100.4, 200.4] {
        let (process, _) = replay(&stage, &["a.mcap", "--stay", "--to", &to_s.to_string(), "--readers", "1"]);
        let mut reader = Reader::join(&stage);
        let is_end = |header: &FrameHeader| {
            header.show_state() == Some(ShowState::Finished) && (header.show_time_s() - to_s).abs() < 0.06
        };
        let end = reader.read_until("the replay stands at its last frame", is_end);
        ctl(&stage, &["seek", "1e9"]);
        let after = end.last().expect("a frame").header.published_ns;
        reader.read_until("it stands there again", |header| is_end(header) && header.published_ns > after);
        ctl(&stage, &["stop"]);
        process.end().expect_clean();
    }
}

#[test]
fn a_sought_run_is_shown_at_once_however_far_it_is() {
    let stage = Stage::new();
    record_two_runs(&stage, "100");
    // At this pace, the time between the two runs takes minutes.
    let (mut process, _) = replay(&stage, &["a.mcap", "--paused", "--stay", "--rate", "0.01", "--readers", "1"]);
    let positions = ReplayStatusReader::open(stage.domain(), "test").expect("the replay has created the services");
    let mut reader = Reader::join(&stage);
    let begin = await_position(&positions, "the replay is paused", |status| status.paused == 1);
    let in_second = (begin.length_ns as f64 / 1e9 - 0.4).to_string();
    for (command, state) in [("pause", ShowState::Paused), ("resume", ShowState::Running)] {
        ctl(&stage, &[command]);
        for (position, is_there) in [(&*in_second, (|s| s > 200.0) as fn(f64) -> bool), ("0", |s| s < 101.0)] {
            ctl(&stage, &["seek", position]);
            let started = next_start(&mut process);
            let shots = reader.read_until("the sought run is shown", |header| {
                started["run_id"] == header.run_id && header.show_state() == Some(state)
            });
            assert!(is_there(shots.last().expect("a frame").header.show_time_s()), "{position}");
        }
    }
    ctl(&stage, &["seek", &in_second]);
    let last = next_start(&mut process);
    for (command, state) in [("pause", ShowState::Paused), ("resume", ShowState::Running)] {
        ctl(&stage, &[command]);
        reader.read_until("the replay obeys in the sought run", |header| {
            last["run_id"] == header.run_id && header.show_state() == Some(state)
        });
    }
    ctl(&stage, &["stop"]);
    process.end().expect_clean();
}

fn next_start(process: &mut Process) -> Value {
    process.json_until("another pass begins", |line| line["type"] == "started").pop().expect("a line")
}

#[test]
fn the_pace_of_a_server_is_the_factor_on_its_planned_speed() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    let mut reader = Reader::join(&stage);
    stage.run(&["ctl", "pace", "0.5"]).expect_clean();
    reader.read_until("the head walks at half of its speed", |header| header.head_speed_mps == 0.5);
    let refused = stage.run(&["ctl", "pace", "11", "--format", "json"]);
    let line = refused.last_json();
    assert_eq!((refused.code(), &line["accepted"]), (Some(1), &Value::Bool(false)));
    assert_eq!(line["reason"], "the pace is 11 times the planned one, must be from 0 to 10 times the planned one");
    server.stop();
}

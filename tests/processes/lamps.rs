//! The lamps: each cause is made as it happens in a show, and `ctl status`, or an exporter that was there before, shows it.

use std::fs;
use std::path::Path;

use bench_dragon_ipc::clear;
use rustix::process::Signal;
use serde_json::Value;
use test_support::children::{await_child, children, kill};
use test_support::eventually::{eventually, eventually_from};
use test_support::process::Process;
use test_support::skip::is_possible;

use crate::ctl_status::{lamp, status, status_with};
use crate::metrics::Exporter;
use crate::reader::Reader;
use crate::record::await_frames;
use crate::resources::{behind, empty_disk, fill_disk};
use crate::show::CALM;
use crate::stage::Stage;
use crate::suspended::suspend;
use crate::timecode::{self, Desk};

/// Waits until an exporter reports this level for a lamp: 0 off, 1 good, 2 warning, 3 danger.
fn await_level(exporter: &Exporter, name: &str, level: u8) -> String {
    await_sample(exporter, &format!("lamp_level{{lamp=\"{name}\"}} {level}"))
}

/// Waits for a sample, given without the name of the program. Returns all samples of that moment.
fn await_sample(exporter: &Exporter, sample: &str) -> String {
    eventually_from(sample, || {
        let text = exporter.scrape();
        if has(&text, sample) { Ok(text) } else { Err(text) }
    })
}

fn has(text: &str, sample: &str) -> bool {
    text.lines().any(|line| line == format!("bench_dragon_{sample}"))
}

/// Starts a recorder in a mount namespace in which the folder `disk` is a file system of its own.
fn record_on_disk(stage: &Stage, options: &str) -> Process {
    fs::create_dir_all(stage.path("disk")).expect("the folder is there");
    let script = format!(r#"mount -t tmpfs -o {options} none disk && exec "$@""#);
    let launcher = ["unshare", "--mount", "sh", "-c", &script, "sh"];
    behind(&launcher, &stage.command(&["record", "disk/show.mcap"]))
}

#[test]
fn overlapping_boards_are_red_everywhere() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50", "--start-at", "430", "--held"]);
    let exporter = Exporter::start(&stage);
    let (json, code) = status_with(&stage, "the overlap", |json| lamp(json, "clearance").0 == "danger");
    assert_eq!((code, &json["well"]), (Some(1), &false.into()), "{json}");
    assert!(lamp(&json, "clearance").1.contains(" overlap by "), "{json}");
    let standing = &json["standing"];
    assert_eq!((&standing["level"], &standing["word"]), (&"danger".into(), &"READY".into()), "{json}");
    assert!(standing["cause"].as_str().is_some_and(|cause| cause.starts_with("CONTACT: benches ")), "{json}");
    let text = stage.run(&["ctl", "status"]).stdout;
    assert!(text.contains("\ndanger: CONTACT: benches "), "{text}");
    let metrics = await_level(&exporter, "clearance", 3);
    assert!(has(&metrics, "standing_level 3"), "{metrics}");
    stage.run(&["ctl", "seek", "100"]).expect_clean();
    let (json, code) = status_with(&stage, "boards that are apart", |json| lamp(json, "clearance").0 == "good");
    assert_eq!((code, &json["standing"]["level"]), (Some(0), &"calm".into()), "{json}");
    // The exporter has seen the contact, which stays red for a minute.
    let metrics = await_level(&exporter, "clearance", 3);
    assert!(has(&metrics, "standing_level 3"), "{metrics}");
    exporter.stop();
    server.stop();
}

#[test]
fn a_near_pair_is_a_warning() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50", "--start-at", "409.8", "--held"]);
    let (_, code) = status_with(&stage, "the near pair", |json| lamp(json, "clearance").0 == "warning");
    assert_eq!(code, Some(0));
    server.stop();
}

#[test]
fn a_killed_server_leaves_no_green_lamp() {
    let stage = Stage::new();
    let exporter = Exporter::start(&stage);
    let server = stage.serve(&["--rate", "50"]);
    for name in ["server", "source", "clearance"] {
        await_level(&exporter, name, 1);
    }
    server.process.kill();
    let metrics = await_level(&exporter, "server", 3);
    for name in ["source", "clearance", "monitor", "guard", "recorder", "timecode", "readers"] {
        assert!(has(&metrics, &format!("lamp_level{{lamp=\"{name}\"}} 0")), "{name} in\n{metrics}");
    }
    assert!(has(&metrics, "standing_level 3") && has(&metrics, "up 0"), "{metrics}");
    exporter.stop();
}

#[test]
fn a_killed_recorder_or_bridge_and_a_stopped_monitor_are_red() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let exporter = Exporter::start(&stage);
    let recorder = stage.start(&["record", "show.mcap"]);
    let monitor = stage.start(&["monitor"]);
    let bridge = stage.start(&["bridge", "osc", "--to", "127.0.0.1:9"]);
    let timecode = stage.start(&["bridge", "timecode", "--art-net", "127.0.0.1:9"]);
    let parts = ["recorder", "monitor", "osc", "timecode-out"];
    for name in parts {
        await_level(&exporter, name, 1);
    }
    recorder.kill();
    bridge.kill();
    timecode.kill();
    monitor.signal(Signal::STOP);
    for name in parts {
        await_level(&exporter, name, 3);
    }
    monitor.signal(Signal::CONT);
    await_level(&exporter, "monitor", 1);
    monitor.terminate();
    await_level(&exporter, "monitor", 2);
    exporter.stop();
    server.stop();
}

#[test]
fn a_recorder_that_ended_because_its_disk_is_full_leaves_a_red_lamp_until_the_next_one_records() {
    if !is_possible(&["unshare", "--mount"]) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1000"]);
    let exporter = Exporter::start(&stage);
    let ended = record_on_disk(&stage, "size=8m").end();
    assert_eq!(ended.code(), Some(4), "{}", ended.stderr);
    // The lamp is red before, while the disk is nearly full. The standing is red once it is full.
    await_sample(&exporter, "standing_level 3");
    await_level(&exporter, "recorder", 3);
    let again = stage.start(&["record", "again.mcap"]);
    await_level(&exporter, "recorder", 1);
    again.terminate().expect_clean();
    await_level(&exporter, "recorder", 0);
    exporter.stop();
    server.stop();
}

#[test]
fn a_show_without_room_for_its_recording_is_red_until_there_is_room() {
    if !is_possible(&["unshare", "--mount"]) {
        return;
    }
    let stage = Stage::new();
    let (show, mut told) = fill_disk(&stage);
    // A status that begins now has received no report of the recorder.
    // On a busy machine, an observer that is late itself says that before all else.
    let is_told =
        |json: &Value| json["standing"]["cause"].as_str().is_some_and(|cause| cause.starts_with("The disk is full"));
    let (json, code) = status_with(&stage, "the full disk", is_told);
    assert_eq!((code, &json["well"]), (Some(1), &false.into()), "{json}");
    assert_eq!(lamp(&json, "recorder"), ("danger", "disk full, not recorded"));
    empty_disk(&stage, &show);
    status_with(&stage, "the next recording", |json| lamp(json, "recorder").1.ends_with("of disk left"));
    let ended = show.terminate();
    told.extend(ended.stderr.lines().map(str::to_owned));
    assert!(!told.iter().any(|line| line.contains("killed recorder")), "no recorder was killed: {told:#?}");
}

#[test]
fn the_disk_of_a_standing_show_lasts_no_longer_than_that_of_a_walking_one() {
    if !is_possible(&["unshare", "--mount"]) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1000", "--held"]);
    let recorder = record_on_disk(&stage, "size=1g");
    // A walking dragon fills a gigabyte in 163 seconds, a standing one in half an hour.
    let (json, _) =
        status_with(&stage, "the recorder's time", |json| lamp(json, "recorder").1.contains("of disk left"));
    assert_eq!(lamp(&json, "recorder"), ("warning", "2 min of disk left"), "{json}");
    recorder.terminate();
    server.stop();
}

#[test]
fn a_killed_guard_and_a_stopped_guard_are_red() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--guarded", "--start-at", "100"]);
    let guard = stage.start(&["monitor", "--guard"]);
    let beside = stage.start(&["monitor"]);
    status_with(&stage, "a guarded walk", |json| json["state"] == "running" && lamp(json, "guard").0 == "good");
    guard.signal(Signal::STOP);
    let (json, _) = status_with(&stage, "the end of the grant, and a guard that hangs", |json| {
        json["state"] == "held" && lamp(json, "guard").0 == "danger"
    });
    assert_eq!(json["standing"]["level"], "danger", "{json}");
    assert!(json["standing"]["cause"].as_str().is_some_and(|cause| cause.starts_with("The guard does not")), "{json}");
    guard.kill();
    let (json, code) = status_with(&stage, "the missing guard", |json| json["guard"]["kind"] == "missing");
    assert_eq!((code, &json["standing"]["level"]), (Some(1), &"danger".into()), "{json}");
    assert!(json["standing"]["cause"].as_str().is_some_and(|cause| cause.starts_with("No guard runs")), "{json}");
    assert!(json["standing"]["remedy"].as_str().is_some_and(|remedy| remedy.contains("monitor --guard")), "{json}");
    beside.terminate().expect_clean();
    server.stop();
}

#[test]
fn at_the_guards_permanent_end_a_release_is_refused_with_the_truth() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--guarded", "--start-at", "411.5"]);
    let guard = stage.start(&["monitor", "--guard"]);
    let (json, code) = status_with(&stage, "the permanent end", |json| json["guard"]["for_good"] == true);
    let standing = &json["standing"];
    assert_eq!((&standing["level"], &standing["word"]), (&"danger".into(), &"HELD".into()), "{json}");
    assert!(standing["cause"].as_str().is_some_and(|cause| cause.contains("permanently")), "{json}");
    assert_eq!(standing["remedy"], "Only a seek moves the dragon: a release does not.", "{json}");
    assert_eq!(json["refusals"]["release"], "the guard has stopped the dragon permanently: only a seek moves it");
    assert_eq!((code, lamp(&json, "guard").0), (Some(0), "warning"), "{json}");
    let refused = stage.run(&["ctl", "release"]);
    assert_eq!(refused.code(), Some(1));
    assert!(refused.stderr.contains("else only a seek moves it"), "{}", refused.stderr);
    guard.terminate();
    server.stop();
}

#[test]
fn lost_timecode_is_red() {
    let stage = Stage::new();
    let (mut server, listen) = timecode::serve(&stage, "artnet:127.0.0.1:0", &[]);
    status_with(&stage, "no timecode yet", |json| lamp(json, "timecode") == ("warning", "Art-Net, none received yet"));
    let mut desk = Desk::start(&["artnet", &listen]);
    desk.order("play 60");
    let (json, _) = status_with(&stage, "locked timecode", |json| lamp(json, "timecode").0 == "good");
    assert_eq!(lamp(&json, "timecode").1, "Art-Net, locked");
    desk.order("silence");
    timecode::event(&mut server.process, "lost");
    let (_, code) = status_with(&stage, "lost timecode", |json| lamp(json, "timecode") == ("danger", "Art-Net, lost"));
    assert_eq!(code, Some(1));
    server.stop();
}

#[test]
fn many_missed_periods_of_the_last_minute_are_a_warning() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--catch-up", "10"]);
    let mut reader = Reader::join(&stage);
    reader.next();
    suspend(&server.process, 1_000_000_000);
    reader.next();
    let (json, code) = status_with(&stage, "the overruns", |json| lamp(json, "server").0 == "warning");
    assert!(lamp(&json, "server").1.ends_with(" in the last minute"), "{json}");
    assert_eq!(code, Some(0));
    server.stop();
}

#[test]
fn each_cause_of_standing_has_its_sentence_and_a_show_that_waits_is_calm() {
    let stage = Stage::new();
    let show = stage.start(&["show", "--rate", "100", "--held", "--out", "show"]);
    let standing = |json: &Value| ["level", "word", "cause", "remedy"].map(|key| json["standing"][key].to_string());
    let shows = |what: &str, level: &str, word: &str, cause: &str, remedy: &str| {
        status_with(&stage, what, |json| {
            let [found_level, found_word, found_cause, found_remedy] = standing(json);
            found_level.contains(level)
                && found_word.contains(word)
                && found_cause.contains(cause)
                && found_remedy.contains(remedy)
        })
    };
    let (json, code) = shows("the start", "calm", "READY", "waits at its start", "A release starts it.");
    assert_eq!(code, Some(0), "{json}");
    stage.run(&["ctl", "release"]).expect_clean();
    shows("the walk", "good", "RUNNING", "walks", "null");
    stage.run(&["ctl", "hold"]).expect_clean();
    let (json, code) =
        shows("the hold", "danger", "HELD", "An operator (ctl) holds the show", "A release lifts the hold.");
    assert_eq!((code, &json["well"]), (Some(0), &true.into()), "a hold is no fault: {json}");
    stage.run(&["ctl", "release"]).expect_clean();
    kill(await_child(show.pid(), "serve", None));
    shows("the restart", "danger", "HELD", "The server was restarted", "then release it");
    stage.run(&["ctl", "release"]).expect_clean();
    stage.run(&["ctl", "pause"]).expect_clean();
    shows("the pause", "caution", "PAUSED", "An operator has paused the show", "resume");
    show.terminate();
}

#[test]
fn doctor_looks_at_the_disk_of_the_shows_folder() {
    if !is_possible(&["unshare", "--mount"]) {
        return;
    }
    let stage = Stage::new();
    fs::create_dir(stage.path("disk")).expect("the folder is there");
    let script = r#"mount -t tmpfs -o size=8m none disk && exec "$@""#;
    let launcher = ["unshare", "--mount", "sh", "-c", script, "sh"];
    let doctor = stage.command(&["doctor", "--out", "disk/tonight", "--format", "json"]);
    let json = behind(&launcher, &doctor).end().last_json();
    let disk = check(&json, "disk");
    assert_eq!((&disk["status"], &disk["value"]), (&"warning".into(), &"8.4 MB free".into()), "{disk}");
    assert!(
        disk["message"].as_str().is_some_and(|message| message.starts_with("disk/tonight has 8.4 MB free")),
        "{disk}"
    );
    assert!(!Path::new(&stage.path("disk/tonight")).exists());
}

fn check<'a>(doctor: &'a Value, name: &str) -> &'a Value {
    let checks = doctor["checks"].as_array().expect("checks");
    checks.iter().find(|check| check["name"] == name).expect("a check")
}

#[test]
fn doctor_finds_a_server_and_a_guard_of_another_pid_namespace() {
    let launcher = ["unshare", "--pid", "--fork", "--mount-proc"];
    if !is_possible(&launcher) {
        return;
    }
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50", "--guarded"]);
    let guard = stage.start(&["monitor", "--guard"]);
    status_with(&stage, "the guard", |json| lamp(json, "guard").0 == "good");
    let json = behind(&launcher, &stage.command(&["doctor", "--format", "json"])).end().last_json();
    for (name, part) in
        [("server", "a server runs in another PID namespace"), ("guard", "a guard runs in another PID namespace")]
    {
        let found = check(&json, name);
        assert_eq!(found["status"], "ok", "{found}");
        assert!(found["message"].as_str().is_some_and(|message| message.contains(part)), "{found}");
    }
    guard.terminate();
    server.stop();
}

#[test]
fn without_a_server_nothing_proposes_to_start_the_papers_dragon() {
    let stage = Stage::new();
    let (json, code) = status(&stage);
    assert_eq!((code, &json["standing"]["word"]), (Some(1), &"NO SERVER".into()), "{json}");
    let refused = stage.run(&["ctl", "pause"]);
    for text in [json["standing"]["remedy"].to_string(), refused.stderr] {
        assert!(text.contains("--config FILE") && text.contains("--held"), "{text}");
    }
}

#[test]
fn a_killed_recorder_stays_red_however_often_somebody_looks() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let recorder = stage.start(&["record", "show.mcap"]);
    status_with(&stage, "the recorder", |json| lamp(json, "recorder").0 == "good");
    recorder.kill();
    status_with(&stage, "the killed recorder", |json| lamp(json, "recorder").0 == "danger");
    for _ in 0..2 {
        let (json, code) = status_with(&stage, "the killed recorder", |json| lamp(json, "recorder").0 != "off");
        assert_eq!((code, lamp(&json, "recorder").0), (Some(1), "danger"), "{json}");
        let standing = &json["standing"];
        assert_eq!((&standing["level"], &standing["word"]), (&"caution".into(), &"RUNNING".into()), "{json}");
        assert!(standing["cause"].as_str().is_some_and(|cause| cause.contains("The lamp recorder is red")), "{json}");
    }
    let exporter = Exporter::start(&stage);
    await_level(&exporter, "recorder", 3);
    exporter.stop();
    // The next process of the show removes the remains.
    let again = stage.start(&["record", "again.mcap"]);
    status_with(&stage, "the next recorder", |json| lamp(json, "recorder").0 == "good");
    again.terminate();
    status_with(&stage, "no recorder", |json| lamp(json, "recorder").0 == "off");
    server.stop();
}

#[test]
fn a_fresh_look_finds_a_stopped_recorder_and_a_stopped_or_killed_server() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let recorder = stage.start(&["record", "show.mcap"]);
    status_with(&stage, "the recorder", |json| lamp(json, "recorder").0 == "good");
    recorder.signal(Signal::STOP);
    status_with(&stage, "the stopped recorder", |json| {
        let (level, text) = lamp(json, "recorder");
        level == "danger" && text.starts_with("does not report (pid ")
    });
    recorder.signal(Signal::CONT);
    recorder.terminate();
    server.process.signal(Signal::STOP);
    status_with(&stage, "the stopped server", |json| {
        json["standing"]["word"] == "SILENT"
            && json["standing"]["level"] == "danger"
            && lamp(json, "server").0 == "danger"
    });
    server.process.signal(Signal::CONT);
    server.process.kill();
    // Looking does not remove what the look finds.
    for _ in 0..2 {
        let (json, code) = status(&stage);
        assert_eq!((code, &json["standing"]["word"]), (Some(1), &"SERVER LOST".into()), "{json}");
    }
    clear(stage.domain()).expect("no process is left");
}

#[test]
fn a_killed_show_is_lost_until_something_is_started_again() {
    let stage = Stage::new();
    let reader = stage.start(&["hz"]);
    let show = stage.start(&[&CALM[..], &["json", "--out", "out"]].concat());
    await_frames(&stage.path("out/recording.mcap"));
    let pid = show.pid();
    show.kill();
    eventually("the children of the show have ended", || children(pid).is_empty().then_some(()));
    let (json, code) = status_with(&stage, "the killed show", |json| json["standing"]["word"] == "SHOW LOST");
    let standing = &json["standing"];
    assert_eq!((code, &standing["level"]), (Some(1), &"danger".into()), "{json}");
    assert!(standing["remedy"].as_str().is_some_and(|remedy| remedy.contains("serve --config FILE --held")), "{json}");
    stage.serve(&["--until", "0"]).summary();
    status_with(&stage, "no show", |json| json["standing"]["word"] == "NO SERVER");
    reader.terminate();
}

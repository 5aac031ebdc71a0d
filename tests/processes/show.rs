//! A whole show: a supervised server, monitor and recorder as children, and a report at the end.

use std::fs;

use bench_dragon_ipc::{Continuity, FrameHeader, ShowState, Status, StatusReader};
use rustix::process::Signal;
use serde_json::{Value, json};
use test_support::children::{await_child, children, kill, send};
use test_support::eventually::eventually;
use test_support::process::{Ended, Process};

use crate::periods::assert_no_frame_missing;
use crate::reader::{Reader, Shot};
use crate::record;
use crate::stage::Stage;

/// A show so slow that a reader's buffer holds four seconds.
pub(crate) const CALM: [&str; 6] = ["show", "--rate", "50", "--start-at", "100", "--format"];
/// The folder of such a show, as arguments.
const OUT: [&str; 2] = ["--out", "out"];

/// A show whose server has published a frame.
pub(crate) struct Playing {
    pub(crate) show: Process,
    pub(crate) stage: Stage,
}

impl Playing {
    pub(crate) fn start(args: &[&str]) -> Self {
        let stage = Stage::new();
        let show = stage.start(&[&CALM[..], &["json"], &OUT, args].concat());
        let playing = Self { show, stage };
        playing.await_status(|status| status.tick >= 1);
        playing
    }

    /// Waits for a server, then for its status to be as wanted.
    pub(crate) fn await_status(&self, is_wanted: impl Fn(&Status) -> bool) -> Status {
        let status =
            eventually("a server has created the services", || StatusReader::open(self.stage.domain(), "test").ok());
        eventually("the status is as wanted", || status.poll().expect("the bus is readable").filter(&is_wanted))
    }

    /// Interrupts the show as Ctrl-C does. Returns its summary.
    pub(crate) fn interrupt(self) -> (Value, Ended) {
        let (summary, ended, _) = self.interrupt_and_read();
        (summary, ended)
    }

    /// Interrupts the show. Returns its summary and the frames of its first recording.
    pub(crate) fn interrupt_and_read(self) -> (Value, Ended, Vec<FrameHeader>) {
        self.end_by(Signal::INT)
    }

    /// Ends the show by a signal. Returns its summary, which equals the one in the folder, and the frames of its first
    /// recording.
    fn end_by(self, signal: Signal) -> (Value, Ended, Vec<FrameHeader>) {
        let Self { show, stage } = self;
        let pid = show.pid();
        show.signal(signal);
        let ended = show.end();
        assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
        assert_eq!(children(pid), []);
        let summary = ended.last_json();
        let written = fs::read_to_string(stage.path("out/summary.json")).expect("a summary");
        assert_eq!(serde_json::from_str::<Value>(&written).expect("JSON"), summary);
        assert_books_balance(&stage, &summary);
        (summary, ended, record::read(&stage.path("out/recording.mcap")).0)
    }
}

/// Returns the next line of the show's log without its wall time.
#[track_caller]
pub(crate) fn logged(show: &Process) -> String {
    let line = show.complaint();
    let (time, text) = line.split_once("  ").unwrap_or_else(|| panic!("no wall time: {line}"));
    time.parse::<jiff::civil::Time>().unwrap_or_else(|error| panic!("{line}: {error}"));
    text.to_owned()
}

/// Fails unless published frames are the sum of read and missed ones, every recording is whole, and the recordings together
/// have all recorded frames.
fn assert_books_balance(stage: &Stage, summary: &Value) {
    let count = |name: &str| summary["frames"][name].as_u64().unwrap_or_else(|| panic!("{name} in {summary}"));
    assert_eq!(count("published"), count("monitored") + count("missed_by_monitor"), "{summary}");
    assert_eq!(count("published"), count("recorded") + count("missed_by_recorder"), "{summary}");
    let files = fs::read_dir(stage.path("out")).expect("the show's folder").flatten().map(|entry| entry.path());
    let recordings = files.filter(|path| path.extension().is_some_and(|extension| extension == "mcap"));
    let recorded: usize = recordings
        .map(|recording| {
            let (frames, was_cut) = record::read(&recording);
            assert!(!was_cut, "{} is whole", recording.display());
            frames.len()
        })
        .sum();
    assert_eq!(recorded as u64, count("recorded"), "{summary}");
    assert_eq!(summary["recording"], "out/recording.mcap");
}

#[test]
fn a_show_plays_to_its_first_contact_and_reports_it() {
    let stage = Stage::new();
    let show = ["show", "--start-at", "405", "--time-scale", "20", "--rate", "100", "--out", "out", "--format", "json"];
    let ended = stage.run(&show);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let summary = ended.last_json();
    let time_s = summary["contact"]["time_s"].as_f64().expect("a contact");
    assert!((time_s - 412.473_838).abs() < 1e-6, "{time_s}");
    assert_eq!(summary["contact"]["benches"], json!([0, 8]));
    assert_eq!(summary["frames"]["missed_by_monitor"], 0);
    assert_eq!(summary["frames"]["missed_by_recorder"], 0);
    assert_eq!(summary["restarts"], json!({ "serve": 0, "monitor": 0, "record": 0, "view": 0 }));
    assert!(
        ended.stderr.lines().any(|line| line.ends_with("  412.473838 s: contact, benches 0 and 8")),
        "{}",
        ended.stderr
    );
    let written = fs::read_to_string(stage.path("out/summary.json")).expect("a summary");
    assert_eq!(serde_json::from_str::<Value>(&written).expect("JSON"), summary);
    assert_books_balance(&stage, &summary);

    let (frames, _) = record::read(&stage.path("out/recording.mcap"));
    assert_eq!(summary["run_id"], frames[0].run_id);
    assert_eq!((frames[0].tick, frames[0].show_time_ns), (0, 405_000_000_000), "the first tick reaches the recorder");
    assert!(frames.iter().enumerate().all(|(tick, header)| header.tick == tick as u64));
}

#[test]
fn a_show_at_full_rate_accounts_for_every_frame() {
    let stage = Stage::new();
    let ended = stage.run(&["show", "--start-at", "370", "--time-scale", "20", "--out", "out", "--fail-on-contact"]);
    assert_eq!(ended.code(), Some(3), "{}", ended.stderr);
    assert!(ended.stdout.starts_with("first contact   412.473838 s, benches 0 and 8\n"), "{}", ended.stdout);
    let written = fs::read_to_string(stage.path("out/summary.json")).expect("a summary");
    assert_books_balance(&stage, &serde_json::from_str(&written).expect("JSON"));
}

/// Fails unless the servers of a show with this many periods published a frame in each period that they did not miss.
pub(crate) fn assert_published(summary: &Value, periods: u64) {
    let (frames, overruns) = (&summary["frames"]["published"], &summary["overruns"]);
    assert_no_frame_missing(&json!({ "frames": frames, "overruns": overruns }), periods);
}

#[test]
fn a_show_ends_at_the_requested_time() {
    let stage = Stage::new();
    let ended = stage.run(&[&CALM[..], &["json", "--until", "102", "--fail-on-contact"], &OUT].concat());
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let summary = ended.last_json();
    assert_eq!(summary["contact"], Value::Null);
    assert_published(&summary, 101);
    let published = &summary["frames"]["published"];
    assert_eq!((&summary["frames"]["monitored"], &summary["frames"]["recorded"]), (published, published));
    assert_books_balance(&stage, &summary);
}

#[test]
fn a_configuration_is_played_and_kept_in_the_shows_folder() {
    let stage = Stage::new();
    let text = "[dragon]\nbenches = 20\n[serve]\nrate_hz = 50\ntime_scale = 2.0\n";
    fs::write(stage.path("stage.toml"), text).expect("a file");
    let ended = stage.run(&["show", "--config", "stage.toml", "--until", "1", "--out", "out", "--format", "json"]);
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let summary = ended.last_json();
    assert_no_frame_missing(&json!({ "frames": summary["frames"]["recorded"], "overruns": summary["overruns"] }), 26);
    let kept = fs::read_to_string(stage.path("out/config.toml")).expect("a configuration");
    let config = bench_dragon::config::Config::from_toml(&kept).expect("a whole configuration");
    assert_eq!(
        (config.tables().serve.rate_hz, config.tables().serve.time_scale, config.lead().dimensions().benches()),
        (50, 2.0, 20)
    );
    assert_eq!(record::read(&stage.path("out/recording.mcap")).0[0].bench_count, 20);
}

#[test]
fn an_interrupted_show_ends_its_children_and_reports() {
    for signal in [Signal::INT, Signal::TERM] {
        let playing = Playing::start(&[]);
        let (summary, ..) = playing.end_by(signal);
        assert_eq!(summary["frames"]["missed_by_monitor"], 0);
        assert_eq!(summary["frames"]["missed_by_recorder"], 0);
    }
}

#[test]
fn a_show_ends_when_its_server_receives_a_stop() {
    let Playing { show, stage } = Playing::start(&[]);
    stage.run(&["ctl", "stop"]).expect_clean();
    let ended = show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    let summary = ended.last_json();
    assert_eq!(summary["restarts"], json!({ "serve": 0, "monitor": 0, "record": 0, "view": 0 }));
    assert_books_balance(&stage, &summary);
}

#[test]
fn a_killed_monitor_is_restarted() {
    let playing = Playing::start(&[]);
    let first = await_child(playing.show.pid(), "monitor", None);
    kill(first);
    await_child(playing.show.pid(), "monitor", Some(first));
    let complaint = logged(&playing.show);
    assert_eq!(complaint, "monitor ended with signal: 9 (SIGKILL): starting it again");
    let (summary, _) = playing.interrupt();
    assert_eq!(summary["restarts"], json!({ "serve": 0, "monitor": 1, "record": 0, "view": 0 }));
    assert_eq!(summary["frames"]["missed_by_recorder"], 0, "the recorder is not affected");
}

#[test]
fn the_log_has_the_wall_time_of_this_machines_zone() {
    let stage = Stage::new();
    let mut command = stage.command(&[&CALM[..], &["json"], &OUT].concat());
    // Nine hours ahead of UTC.
    command.env("TZ", "JST-9");
    let show = Process::start(command);
    let zone = jiff::tz::TimeZone::fixed(jiff::tz::offset(9));
    let now = || jiff::Timestamp::now().to_zoned(zone.clone()).time().to_string()[..8].to_owned();
    let monitor = await_child(show.pid(), "monitor", None);
    let before = now();
    kill(monitor);
    let line = show.complaint_with("monitor ended with signal: 9 (SIGKILL)");
    let after = now();
    // Midnight in Tokyo may lie between the two.
    assert!(before > after || (&before[..]..=&after[..]).contains(&&line[..8]), "{before} {line} {after}");
    show.signal(Signal::INT);
    assert_eq!(show.end().code(), Some(0));
}

#[test]
fn a_killed_recorder_is_restarted_beside_its_repaired_file() {
    let playing = Playing::start(&[]);
    let first = await_child(playing.show.pid(), "record", None);
    kill(first);
    await_child(playing.show.pid(), "record", Some(first));
    eventually("the second recording is there", || playing.stage.path("out/recording-2.mcap").exists().then_some(()));
    let (summary, _) = playing.interrupt();
    assert_eq!(summary["restarts"], json!({ "serve": 0, "monitor": 0, "record": 1, "view": 0 }));
    assert_eq!(summary["frames"]["missed_by_monitor"], 0, "the monitor is not affected");
}

#[test]
fn a_terminated_recorder_is_restarted_and_counted_once() {
    let playing = Playing::start(&[]);
    let recorder = await_child(playing.show.pid(), "record", None);
    record::await_frames(&playing.stage.path("out/recording.mcap"));
    send(recorder, Signal::TERM).expect("the process runs");
    assert_eq!(logged(&playing.show), "record ended with exit status: 0: starting it again");
    let (summary, _) = playing.interrupt();
    assert_eq!(summary["restarts"]["record"], 1);
    assert_eq!(summary["recordings"][0], "out/recording.mcap");
}

#[test]
fn a_killed_server_is_restarted_and_the_dragon_is_held_where_it_was() {
    let playing = Playing::start(&[]);
    let mut reader = Reader::join(&playing.stage);
    let before = reader.next().header;
    kill(await_child(playing.show.pid(), "serve", None));

    let mut walked = reader.read_until("a frame of the next run", |header| header.run_id != before.run_id);
    let first = walked.pop().expect("the frame that ended the reading");
    assert_eq!((first.continuity, first.header.tick), (Continuity::Restarted, 0));
    let last_seen = walked.last().map_or(before, |shot| shot.header);
    assert!(first.header.head_travel_m >= last_seen.head_travel_m, "the dragon was moved back: {last_seen:?}");
    let mut held = vec![first];
    held.extend(reader.read_to_tick(20));

    let released = playing.stage.run(&["ctl", "release", "--format", "json"]).expect_clean().last_json();
    let tick = released["tick"].as_u64().expect("a tick");
    held.extend(reader.read_to_tick(tick));
    let first_step = held.pop().expect("the frame of the release");
    assert_stand_held(&held);
    let stood = &held[0].header;
    assert_eq!((first_step.state(), first_step.header.tick), (ShowState::Running, tick));
    assert_eq!(first_step.header.show_time_ns - stood.show_time_ns, 20_000_000);
    assert!((first_step.header.head_travel_m - stood.head_travel_m - 0.02).abs() < 1e-9, "{first_step:?}");

    drop(reader);
    let remedy = format!("`bench-dragon ctl release --instance {}` lets it walk on", playing.stage.domain().instance());
    let (summary, ended, recorded) = playing.interrupt_and_read();
    let mut walked_m =
        recorded.iter().filter(|header| header.run_id == before.run_id).map(|header| header.head_travel_m);
    assert_eq!(
        walked_m.next_back(),
        Some(held[0].header.head_travel_m),
        "the dragon is held at the pose of the last frame"
    );
    assert_eq!(summary["restarts"], json!({ "serve": 1, "monitor": 0, "record": 0, "view": 0 }));
    assert_eq!(summary["run_id"], first_step.header.run_id);
    assert!(ended.stderr.contains("serve ended with signal: 9 (SIGKILL): starting it again"), "{}", ended.stderr);
    assert!(ended.stderr.contains(&remedy), "{}", ended.stderr);
}

/// Fails unless all frames are held at the same pose.
fn assert_stand_held(shots: &[Shot]) {
    let stood = &shots[0];
    for shot in shots {
        assert_eq!((shot.state(), shot.header.head_travel_m), (ShowState::Held, stood.header.head_travel_m));
        assert_eq!((shot.header.show_time_ns, shot.header.head_speed_mps), (stood.header.show_time_ns, 0.0));
        assert_eq!(shot.handles, stood.handles);
    }
}

#[test]
fn with_auto_resume_a_restarted_server_walks_at_once() {
    let playing = Playing::start(&["--auto-resume"]);
    let mut reader = Reader::join(&playing.stage);
    let before = reader.next().header;
    kill(await_child(playing.show.pid(), "serve", None));
    let mut shots = reader.read_until("a frame of the next run", |header| header.run_id != before.run_id);
    let first = shots.pop().expect("the frame that ended the reading");
    assert_eq!((first.state(), first.header.tick), (ShowState::Running, 0));
    assert!(first.header.head_travel_m >= before.head_travel_m, "{first:?}");
    drop(reader);
    let (summary, _) = playing.interrupt();
    assert_eq!(summary["restarts"]["serve"], 1);
}

#[test]
fn the_children_of_a_killed_show_end_and_finish_the_recording() {
    let Playing { show, stage } = Playing::start(&[]);
    let pid = show.pid();
    assert_eq!(children(pid).len(), 3);
    show.kill();
    eventually("the children of the killed show are gone", || children(pid).is_empty().then_some(()));
    let (frames, was_cut) = record::read(&stage.path("out/recording.mcap"));
    assert!(!was_cut, "the recorder has ended in order");
    assert!(frames.iter().enumerate().all(|(tick, header)| header.tick == tick as u64) && !frames.is_empty());
    // The next server removes the remains of the killed show.
    stage.serve(&["--until", "0"]).summary();
}

/// No event marks the time between a child's start and its request to end with its parent, so many shows are killed.
#[test]
fn a_show_killed_in_its_start_up_leaves_no_child_and_the_next_one_starts_at_once() {
    let stage = Stage::new();
    for round in 0..20 {
        let show = stage.start(&[&CALM[..], &["json", "--out", &format!("killed-{round}")]].concat());
        let pid = show.pid();
        let wanted = round % 4;
        eventually(&format!("the show has {wanted} children"), || (children(pid).len() >= wanted).then_some(()));
        show.kill();
        eventually("the children of the killed show are gone", || children(pid).is_empty().then_some(()));
    }
    let ended = stage.run(&[&CALM[..], &["json", "--until", "101", "--out", "next"]].concat());
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    assert_published(&ended.last_json(), 51);
}

#[test]
fn the_next_show_waits_for_the_server_of_a_killed_one_to_end() {
    let Playing { show, stage } = Playing::start(&[]);
    show.kill();
    let ended = stage.run(&[&CALM[..], &["json", "--until", "101", "--out", "next"]].concat());
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    assert_published(&ended.last_json(), 51);
}

#[test]
fn a_stopped_child_is_killed_and_restarted() {
    for command in ["serve", "monitor", "record"] {
        let playing = Playing::start(&["--auto-resume"]);
        let first = await_child(playing.show.pid(), command, None);
        if command != "serve" {
            // By then its first sign of life has arrived.
            playing.await_status(|status| status.tick >= 150);
        }
        send(first, Signal::STOP).expect("the process runs");
        assert_eq!(logged(&playing.show), format!("{command} has shown no sign of life for 5 s: killing it"));
        assert_eq!(logged(&playing.show), format!("{command} ended with signal: 9 (SIGKILL): starting it again"));
        await_child(playing.show.pid(), command, Some(first));
        let (summary, _) = playing.interrupt();
        assert_eq!(summary["restarts"][command], 1);
        let entry = &summary["restart_log"][0];
        assert_eq!((&entry["role"], &entry["restarted"]), (&json!(command), &json!(true)), "{summary}");
        assert_eq!(entry["reason"], "no sign of life for 5 s");
    }
}

#[test]
fn a_second_show_on_an_instance_is_refused_and_the_first_goes_on() {
    let playing = Playing::start(&[]);
    let second = playing.stage.run(&["show", "--out", "second"]);
    assert_eq!(second.code(), Some(1), "{}", second.stdout);
    assert!(second.stderr.contains("a show already runs on instance"), "{}", second.stderr);
    let (summary, _) = playing.interrupt();
    assert_eq!(summary["restarts"], json!({ "serve": 0, "monitor": 0, "record": 0, "view": 0 }));
}

#[test]
fn a_second_show_in_the_same_folder_is_refused_and_changes_nothing() {
    let playing = Playing::start(&[]);
    let folder = playing.stage.path("out");
    let config = fs::read(folder.join("config.toml")).expect("a configuration");
    let elsewhere = Stage::new();
    let refused = elsewhere.run(&["show", "--rate", "77", "--out", folder.to_str().expect("a path in UTF-8")]);
    assert_eq!(refused.code(), Some(2));
    assert_eq!(refused.stderr, format!("error: --out is {}, which another show is using\n", folder.display()));
    assert_eq!(fs::read(folder.join("config.toml")).expect("a configuration"), config);
    playing.interrupt();
}

#[test]
fn the_counts_of_a_show_balance_if_it_is_interrupted_during_a_restart() {
    for command in ["monitor", "record"] {
        let playing = Playing::start(&[]);
        kill(await_child(playing.show.pid(), command, None));
        assert_eq!(logged(&playing.show), format!("{command} ended with signal: 9 (SIGKILL): starting it again"));
        let (summary, _) = playing.interrupt();
        assert_eq!(summary["restarts"][command], 1);
    }
}

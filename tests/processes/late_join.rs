//! A reader that joins during a show gets the same frames as the others from then on, and the description and status of the
//! run.

use std::time::Duration;

use bench_dragon::config::Config;
use bench_dragon_ipc::{
    Alert, AlertKind, AlertSubscriber, DescriptionReader, EventKind, FrameSubscriber, Show, ShowState, StatusReader,
};
use test_support::eventually::eventually;

use crate::ctl_status::{lamp, status_with};
use crate::reader::{Reader, assert_accounted_for};
use crate::stage::Stage;

#[test]
fn a_late_subscriber_receives_the_frames_after_it_joined() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let seen = Reader::join(&stage).read_to_tick(5);
    let last_seen = seen.last().expect("the frame of some tick").header.tick;

    let mut late = Reader::join(&stage);
    let mut shots = vec![late.next()];
    let first_tick = shots[0].header.tick;
    shots.extend(late.read_to_tick(first_tick + 20));
    assert!(shots[0].header.tick > last_seen, "a subscriber gets no earlier frames");
    assert_eq!(shots[0].header.run_id, server.run_id);
    assert_accounted_for(&shots, late.lost());
    drop(late);
    server.stop();
}

#[test]
fn a_late_subscriber_receives_the_description_of_the_run() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "250", "--time-scale", "0.5"]);
    Reader::join(&stage).read_to_tick(5);

    let reader = DescriptionReader::open(stage.domain(), "test").expect("a server has created the services");
    let description = eventually("the description has arrived", || reader.poll().expect("the bus is readable"));
    assert_eq!(description.run_id, server.run_id);
    let config = Config::from_toml(&description.toml).expect("the description is a whole configuration");
    assert_eq!((config.tables().serve.rate_hz, config.tables().serve.time_scale), (250, 0.5));
    assert_eq!(config.to_toml(), description.toml, "every key is written out");
    drop(reader);
    server.stop();
}

#[test]
fn a_late_subscriber_receives_the_status_of_the_run() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "250", "--held"]);
    Reader::join(&stage).read_to_tick(5);

    let reader = StatusReader::open(stage.domain(), "test").expect("a server has created the services");
    let status = eventually("the status has arrived", || reader.poll().expect("the bus is readable"));
    assert_eq!((status.run_id, status.rate_hz, status.pid), (server.run_id, 250, server.process.pid()));
    let later = eventually("a later status has arrived", || {
        reader.poll().expect("the bus is readable").filter(|later| later.tick > status.tick)
    });
    assert_eq!((later.show_state(), later.show_time_ns), (Some(ShowState::Ready), 0));
    assert!(later.overruns >= status.overruns && later.lateness_max_ns >= status.lateness_max_ns);
    drop(reader);
    server.stop();
}

/// A polling reader keeps the service of the frames alive, but not the service of the wake-ups.
#[test]
fn a_reader_that_joins_after_the_server_waits_for_the_next_server() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100"]);
    let polling = FrameSubscriber::open(stage.domain(), "polling").expect("a server has created the services");
    server.stop();
    let mut woken = FrameSubscriber::open(stage.domain(), "woken").expect("the other reader keeps the frames");
    assert!(woken.wait(Duration::from_millis(1)).expect("the bus is readable").is_none());
    let server = stage.serve(&["--rate", "100"]);
    let frame =
        eventually("a frame wakes the reader", || woken.wait(Duration::from_millis(100)).expect("the bus is readable"));
    assert_eq!(frame.header().run_id, server.run_id);
    drop((frame, woken, polling));
    server.stop();
}

#[test]
fn a_reader_that_starts_before_the_server_waits_for_it() {
    let stage = Stage::new();
    let echo = stage.start_waiting(&["echo", "--count", "3", "--format", "json"]);
    let server = stage.serve(&["--rate", "100", "--readers", "1"]);
    let echoed = echo.end();
    let ticks: Vec<_> = echoed.json_lines().iter().map(|frame| frame["tick"].clone()).collect();
    assert_eq!((echoed.code(), ticks), (Some(0), vec![0.into(), 1.into(), 2.into()]));
    server.stop();
}

#[test]
fn a_late_observer_reports_a_contact_that_is_past_and_a_late_client_starts_from_now() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--start-at", "412", "--readers", "1"]);
    let mut monitor = stage.start(&["monitor", "--format", "json"]);
    monitor.json_until("the contact", |line| line["kind"] == "contact");
    for command in [&["hold"][..], &["seek", "300"]] {
        stage.run(&[&["ctl"], command].concat()).expect_clean();
    }
    let (json, code) = status_with(&stage, "the past contact", |json| lamp(json, "clearance").0 == "danger");
    let standing = &json["standing"];
    assert_eq!((code, &standing["level"]), (Some(1), &"danger".into()), "{json}");
    assert!(
        standing["cause"]
            .as_str()
            .is_some_and(|cause| cause.starts_with("CONTACT: benches 0 and 8 touched at 412.474")),
        "{json}"
    );

    let from_now = AlertSubscriber::open(stage.domain(), "test").expect("a server has created the services");
    let with_past = AlertSubscriber::open_with_past(stage.domain(), "test").expect("a server has created the services");
    let is_contact = |alert: &Alert| alert.alert_kind() == Some(AlertKind::Contact);
    let past = eventually("the past contact", || with_past.receive().expect("the bus is readable").filter(is_contact));
    assert_eq!((past.run_id, past.pair()), (server.run_id, Some([0, 8])));
    assert_eq!(from_now.receive().expect("the bus is readable"), None);
    monitor.terminate().expect_clean();
    drop((from_now, with_past));
    server.stop();
}

#[test]
fn the_first_look_at_command_events_returns_the_earlier_ones() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50"]);
    let show = Show::open(stage.domain(), "test", Duration::ZERO).expect("a server has created the services");
    let first = show.command_event(Duration::ZERO).expect("the bus is readable").expect("the start of the run");
    assert_eq!((first.run_id, first.number, first.event_kind()), (server.run_id, 0, Some(EventKind::Start)));
    assert_eq!(show.command_event(Duration::ZERO).expect("the bus is readable"), None);
    drop(show);
    server.stop();
}

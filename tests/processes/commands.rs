//! Every command of `ctl`, its reply, and the frames around the tick from which it applies.

use std::time::Duration;

use bench_dragon::config::Config;
use bench_dragon_ipc::{CommandClient, Refusal, Request, ShowState};
use serde_json::{Value, json};
use test_support::process::Ended;

use crate::periods::periods;
use crate::reader::{Reader, Shot, assert_whole};
use crate::server::Server;
use crate::stage::Stage;

/// Slow, so that the reader's buffer holds twenty seconds.
const RATE_HZ: i64 = 10;
const TICK_NS: i64 = 1_000_000_000 / RATE_HZ;

/// A server, and a reader that keeps every frame.
struct Rehearsal {
    server: Server,
    reader: Reader,
    shots: Vec<Shot>,
    // The stage is dropped last.
    stage: Stage,
}

impl Rehearsal {
    fn start(args: &[&str]) -> Self {
        let stage = Stage::new();
        let server = stage.serve(&[&["--rate", &RATE_HZ.to_string(), "--readers", "1"], args].concat());
        let mut reader = Reader::join(&stage);
        let shots = reader.read_to_tick(0);
        Self { server, reader, shots, stage }
    }

    fn ctl(&self, order: &[&str]) -> Ended {
        self.stage.run(&[&["ctl", "--format", "json"], order].concat())
    }

    /// Sends a command that is accepted. Returns the last frame before it and its first frame.
    fn accept(&mut self, order: &[&str]) -> [Shot; 2] {
        let ended = self.ctl(order).expect_clean();
        let reply = ended.last_json();
        let tick = reply["tick"].as_u64().expect("a tick");
        assert_eq!(reply, json!({ "accepted": true, "run_id": self.server.run_id, "tick": tick, "reason": null }));
        self.around(tick)
    }

    /// Sends a command that is refused. Returns the reason.
    fn refuse(&mut self, order: &[&str]) -> String {
        let ended = self.ctl(order);
        let mut reply = ended.last_json();
        assert_eq!((ended.code(), &reply["accepted"]), (Some(1), &Value::Bool(false)), "{reply}");
        let [before, after] = self.around(reply["tick"].as_u64().expect("a tick"));
        assert_eq!(before.state(), after.state(), "a refused command changes nothing");
        match reply["reason"].take() {
            Value::String(reason) => reason,
            other => panic!("no reason: {other}"),
        }
    }

    /// Sends a request without the command line, which would reject it. Returns the refusal.
    fn refuse_request(&mut self, request: Request) -> Refusal {
        let client = CommandClient::open(self.stage.domain(), "test").expect("a server runs");
        let reply = client.ask(request, Duration::from_mins(1)).expect("the server answers");
        let [before, after] = self.around(reply.tick);
        assert_eq!(before.state(), after.state(), "a refused command changes nothing");
        reply.outcome().expect_err("the value is out of range")
    }

    /// Returns the frame before a tick and the frame of that tick.
    fn around(&mut self, tick: u64) -> [Shot; 2] {
        if self.shots.last().is_none_or(|shot| shot.header.tick < tick) {
            self.shots.extend(self.reader.read_to_tick(tick));
        }
        assert_whole(&self.shots, self.server.run_id);
        [self.shots[tick as usize - 1].clone(), self.shots[tick as usize].clone()]
    }

    /// Reads the next frame.
    fn next(&mut self) -> Shot {
        self.shots.push(self.reader.next());
        self.shots.last().expect("just pushed").clone()
    }

    /// Ends the server, and checks the properties of every frame of any show.
    fn end(self) {
        let Self { stage: _stage, server, mut reader, mut shots } = self;
        let run_id = server.run_id;
        let published = server.stop()["frames"].clone();
        shots.extend(reader.read_unread());
        assert_whole(&shots, run_id);
        assert_eq!(published, shots.len());
        for pair in shots.windows(2) {
            assert_stands_unless_running(&pair[0], &pair[1]);
        }
    }
}

fn assert_stands_unless_running(before: &Shot, after: &Shot) {
    let (last, next) = (&before.header, &after.header);
    if after.state() != ShowState::Running {
        assert_eq!(next.head_speed_mps, 0.0, "tick {}", next.tick);
        assert!(after.handles.iter().all(|handle| handle.velocity_mps == [0.0; 3]), "tick {}", next.tick);
        if before.state() == after.state() && last.show_time_ns == next.show_time_ns {
            assert_eq!(last.head_travel_m, next.head_travel_m, "tick {}", next.tick);
        }
    }
}

/// Returns the periods of show time from one frame to the next, in which the show runs. A show that stood before advances by
/// one period.
fn periods_between(before: &Shot, after: &Shot) -> f64 {
    let ran = before.state() == ShowState::Running;
    let periods = if ran { periods(&before.header, &after.header, RATE_HZ as u64) } else { 1 };
    periods as f64 * after.header.time_scale
}

/// Fails unless the second frame is one step of a running show after the first.
fn assert_walked(before: &Shot, after: &Shot, speed_mps: f64) {
    let (last, next) = (&before.header, &after.header);
    assert_eq!(after.state(), ShowState::Running);
    let periods = periods_between(before, after);
    assert_eq!(next.show_time_ns - last.show_time_ns, (periods * TICK_NS as f64).round() as i64, "tick {}", next.tick);
    // A new speed applies from its tick on. During the periods missed before, the head walked at the old speed.
    let earlier_m = (periods - next.time_scale) * last.head_speed_mps / RATE_HZ as f64;
    let expected_m = last.head_travel_m + earlier_m + next.time_scale * speed_mps / RATE_HZ as f64;
    assert!((next.head_travel_m - expected_m).abs() < 1e-12, "tick {}: {}", next.tick, next.head_travel_m);
    assert_eq!(next.head_speed_mps, speed_mps);
}

/// Fails unless the second frame has the first frame's position, advanced at 1 m/s by the periods missed in between.
fn assert_stands(before: &Shot, after: &Shot, state: ShowState) {
    assert_eq!(after.state(), state);
    let ran = before.state() == ShowState::Running;
    let periods = if ran { periods(&before.header, &after.header, RATE_HZ as u64) - 1 } else { 0 };
    assert_eq!(after.header.show_time_ns, before.header.show_time_ns + periods as i64 * TICK_NS);
    let walked_m = after.header.head_travel_m - before.header.head_travel_m;
    assert!((walked_m - periods as f64 / RATE_HZ as f64).abs() < 1e-12, "{walked_m}");
}

#[test]
fn a_pause_applies_from_its_tick_to_the_tick_of_the_resume() {
    let mut rehearsal = Rehearsal::start(&[]);
    let [running, paused] = rehearsal.accept(&["pause"]);
    assert_eq!(running.state(), ShowState::Running);
    assert_stands(&running, &paused, ShowState::Paused);
    let [still_paused, resumed] = rehearsal.accept(&["resume"]);
    assert_stands(&paused, &still_paused, ShowState::Paused);
    assert_walked(&still_paused, &resumed, 1.0);
    rehearsal.end();
}

#[test]
fn a_hold_applies_from_its_tick_to_the_tick_of_the_release() {
    let mut rehearsal = Rehearsal::start(&[]);
    let [running, held] = rehearsal.accept(&["hold"]);
    assert_eq!(running.state(), ShowState::Running);
    assert_stands(&running, &held, ShowState::Held);
    assert_eq!(rehearsal.refuse(&["resume"]), "the show is held: release it first");
    let [still_held, released] = rehearsal.accept(&["release"]);
    assert_stands(&held, &still_held, ShowState::Held);
    assert_walked(&still_held, &released, 1.0);
    assert_eq!(rehearsal.refuse(&["release"]), "the show is not held");
    rehearsal.end();
}

#[test]
fn a_server_started_held_walks_from_the_release_on() {
    let mut rehearsal = Rehearsal::start(&["--held", "--start-at", "100"]);
    let [held, released] = rehearsal.accept(&["release"]);
    assert_eq!((held.state(), held.header.show_time_ns), (ShowState::Ready, 100_000_000_000));
    assert_walked(&held, &released, 1.0);
    rehearsal.end();
}

#[test]
fn a_server_that_waits_for_its_readers_answers_commands() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "10", "--readers", "1"]);
    let reply = stage.run(&["ctl", "--format", "json", "seek", "100"]).expect_clean().last_json();
    assert_eq!(reply, json!({ "accepted": true, "run_id": server.run_id, "tick": 0, "reason": null }));
    let shots = Reader::join(&stage).read_to_tick(0);
    assert_eq!(shots[0].header.show_time_ns, 100_000_000_000);
    server.stop();
}

#[test]
fn a_server_that_waits_for_its_readers_can_be_stopped() {
    let stage = Stage::new();
    let server = stage.serve(&["--readers", "1"]);
    stage.run(&["ctl", "stop"]).expect_clean();
    assert_eq!(server.summary()["frames"], 1, "the only frame is the last one of the run");
}

#[test]
fn a_new_speed_changes_the_travel_of_its_tick_and_not_the_show_time() {
    let mut rehearsal = Rehearsal::start(&[]);
    let [before, at] = rehearsal.accept(&["speed", "2.5"]);
    assert_eq!(before.header.head_speed_mps, 1.0);
    assert_walked(&before, &at, 2.5);
    let [before, at] = rehearsal.accept(&["speed", "0"]);
    assert_walked(&before, &at, 0.0);
    let after = rehearsal.next();
    assert_walked(&at, &after, 0.0);
    rehearsal.end();
}

#[test]
fn a_seek_shows_its_target_at_its_tick_and_goes_on_from_there() {
    let mut rehearsal = Rehearsal::start(&[]);
    let [before, at] = rehearsal.accept(&["seek", "300"]);
    assert!(before.header.show_time_ns < 300_000_000_000, "{}", before.header.show_time_ns);
    assert_eq!(
        (at.state(), at.header.show_time_ns, at.header.head_travel_m),
        (ShowState::Running, 300_000_000_000, 300.0)
    );
    let after = rehearsal.next();
    assert_walked(&at, &after, 1.0);
    rehearsal.accept(&["pause"]);
    let [_, at] = rehearsal.accept(&["seek", "12.5"]);
    assert_eq!(
        (at.state(), at.header.show_time_ns, at.header.head_travel_m),
        (ShowState::Paused, 12_500_000_000, 12.5)
    );
    rehearsal.end();
}

#[test]
fn values_out_of_range_are_refused_with_the_range() {
    let end_s = Config::from_toml("").expect("the paper's dragon").end_s();
    let mut rehearsal = Rehearsal::start(&[]);
    for speed_mps in [11.0, -0.1, f64::NAN, f64::INFINITY] {
        let refusal = rehearsal.refuse_request(Request::Speed { speed_mps });
        assert_eq!(refusal, Refusal::OutOfRange { lowest: 0.0, highest: 10.0 }, "{speed_mps}");
    }
    for show_time_s in [432.76, -1.0, f64::NAN, f64::INFINITY] {
        let refusal = rehearsal.refuse_request(Request::Seek { show_time_s });
        assert_eq!(refusal, Refusal::OutOfRange { lowest: 0.0, highest: end_s }, "{show_time_s}");
    }
    assert_eq!(
        rehearsal.refuse(&["seek", "432.76"]),
        format!("the show time is 432.76 s, must be from 0 to {} s", (end_s * 1e3).floor() / 1e3)
    );
    rehearsal.end();
}

#[test]
fn a_refusal_in_text_is_one_line_on_stderr_and_an_acceptance_one_on_stdout() {
    let stage = Stage::new();
    let server = stage.serve(&["--held"]);
    let refused = stage.run(&["ctl", "resume"]);
    let expected = "refused: the show waits at its start: release it first\n";
    assert_eq!((refused.code(), refused.stdout.as_str(), refused.stderr.as_str()), (Some(1), "", expected));
    let accepted = stage.run(&["ctl", "release"]).expect_clean();
    assert!(accepted.stdout.starts_with("accepted, from tick ") && accepted.stdout.ends_with(" on\n"));
    server.stop();
}

#[test]
fn a_stop_ends_the_server_after_the_tick_of_its_reply() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "10", "--readers", "1"]);
    let mut reader = Reader::join(&stage);
    let mut shots = reader.read_to_tick(0);
    let reply = stage.run(&["ctl", "stop", "--format", "json"]).expect_clean().last_json();
    let tick = reply["tick"].as_u64().expect("a tick");
    let run_id = server.run_id;
    assert_eq!(server.summary()["frames"], tick + 1);
    shots.extend(reader.read_unread());
    assert_whole(&shots, run_id);
    assert_eq!(shots.len() as u64, tick + 1);
}

#[test]
fn commands_of_several_clients_are_each_answered_once() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1000"]);
    let clients: Vec<_> = (0..8)
        .map(|_| CommandClient::open(stage.domain(), "test").expect("a server has created the services"))
        .collect();
    let mut last_tick = 0;
    for client in clients.iter().cycle().take(80) {
        let request = Request::Speed { speed_mps: 1.5 };
        let reply = client.call(request, Duration::MAX / 4).expect("1.5 m/s is allowed");
        assert!(reply.tick >= last_tick && reply.run_id == server.run_id, "the ticks of the replies never decrease");
        last_tick = reply.tick;
    }
    drop(clients);
    server.stop();
}

#[test]
fn a_finished_show_refuses_to_resume_and_is_started_again_by_a_seek() {
    let mut rehearsal = Rehearsal::start(&["--start-at", "432.7"]);
    let finished = rehearsal.reader.read_to_end();
    rehearsal.shots.extend(finished);
    let end = rehearsal.shots.last().expect("the last frame").header;
    let end_m = Config::from_toml("").expect("the paper's dragon").lead().end_travel_m();
    assert_eq!(end.head_travel_m, end_m, "the show ends exactly at the end of the run");
    assert_eq!(rehearsal.refuse(&["resume"]), "the show is finished: seek to start it again");
    let [_, at] = rehearsal.accept(&["seek", "0"]);
    assert_eq!((at.state(), at.header.show_time_ns), (ShowState::Running, 0));
    rehearsal.end();
}

//! Orderly ends of a run, and its record of commands.

use bench_dragon_ipc::{
    CommandClient, CommandEvent, CommandEventReader, EventKind, GuardState, Refusal, Request, Sender, ShowState,
    SourceKind, StatusReader, Stop,
};
use rustix::process::Signal;
use test_support::eventually::eventually;

use crate::reader::{Reader, Shot, assert_whole};
use crate::server::Server;
use crate::stage::Stage;

/// A server whose head brakes from 1 m/s to rest in two show seconds: 40 periods, of which a busy machine may miss some.
fn serve_braking(stage: &Stage, args: &[&str]) -> Server {
    std::fs::write(stage.path("braking.toml"), "[head]\naccel_mps2 = 0.5\n").expect("the folder is there");
    stage.serve(&[&["--config", "braking.toml", "--rate", "20", "--readers", "1"], args].concat())
}

/// Fails unless the head walks, brakes evenly to rest, and is ended in the first frame at rest.
fn assert_brakes_and_ends(shots: &[Shot]) {
    let states: Vec<ShowState> = shots.iter().map(Shot::state).collect();
    let (last, before) = states.split_last().expect("some frames");
    assert_eq!(*last, ShowState::Ended, "{states:?}");
    let braking = before.iter().filter(|state| **state == ShowState::Stopping).count();
    assert!(braking >= 5, "{states:?}");
    assert!(before[..before.len() - braking].iter().all(|state| *state == ShowState::Running), "{states:?}");
    let speeds: Vec<f64> = shots[shots.len() - braking..].iter().map(|shot| shot.header.head_speed_mps).collect();
    assert!(speeds.windows(2).all(|pair| pair[1] < pair[0]), "{speeds:?}");
    assert_eq!(speeds.last(), Some(&0.0));
}

fn read_until_it_walks(reader: &mut Reader) -> Vec<Shot> {
    reader.read_until("the head walks at 1 m/s", |header| header.head_speed_mps == 1.0)
}

#[test]
fn a_stopped_server_brakes_first_and_its_last_frame_and_status_are_ended() {
    let stage = Stage::new();
    let server = serve_braking(&stage, &[]);
    let run_id = server.run_id;
    let status = StatusReader::open(stage.domain(), "test").expect("a server has created the services");
    let mut reader = Reader::join(&stage);
    let mut shots = read_until_it_walks(&mut reader);
    stage.run(&["ctl", "stop"]).expect_clean();
    let frames = server.summary()["frames"].clone();
    shots.extend(reader.read_unread());
    assert_whole(&shots, run_id);
    assert_eq!(frames, shots.len());
    assert_brakes_and_ends(&shots);
    let last = eventually("the last status", || {
        status.poll().expect("the bus is readable").filter(|status| status.show_state() == Some(ShowState::Ended))
    });
    assert_eq!(
        (last.run_id, last.source_kind(), last.guard_state()),
        (run_id, Some(SourceKind::Server), Some(GuardState::None))
    );
    assert!(last.stops().has(Stop::Ending), "{:?}", last.stops());
}

#[test]
fn a_server_that_gets_a_signal_brakes_first() {
    let stage = Stage::new();
    let server = serve_braking(&stage, &[]);
    let run_id = server.run_id;
    let mut reader = Reader::join(&stage);
    let mut shots = read_until_it_walks(&mut reader);
    server.process.signal(Signal::INT);
    let _summary = server.summary();
    shots.extend(reader.read_unread());
    assert_whole(&shots, run_id);
    assert_brakes_and_ends(&shots);
}

#[test]
fn a_run_with_an_end_is_ended_there() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--readers", "1", "--until", "0.5"]);
    let shots = Reader::join(&stage).read_to_end();
    let last = shots.last().expect("frames");
    assert_eq!((last.state(), last.header.show_time_ns), (ShowState::Ended, 500_000_000));
    server.summary();
}

/// Reads all events up to the end of the run.
fn read_to_the_end(events: &CommandEventReader) -> Vec<CommandEvent> {
    let mut read = Vec::new();
    eventually("the event of the end", || {
        read.extend(std::iter::from_fn(|| events.receive().expect("the bus is readable")));
        read.last().is_some_and(|event| event.event_kind() == Some(EventKind::End)).then_some(())
    });
    assert!(read.iter().enumerate().all(|(number, event)| event.number == number as u64), "{read:?}");
    read
}

#[test]
fn every_command_is_an_event_with_its_sender_also_for_a_late_reader() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "50", "--start-at", "7"]);
    let run_id = server.run_id;
    stage.run(&["ctl", "hold"]).expect_clean();
    assert_eq!(stage.run(&["ctl", "resume"]).code(), Some(1));
    let client = CommandClient::open(stage.domain(), "test").expect("a server runs");
    let refused = client.ask(Request::Speed { speed_mps: 11.0 }, std::time::Duration::from_mins(1));
    let tick = refused.expect("the server answers").tick;
    let late = CommandEventReader::open(stage.domain(), "test").expect("a server has created the services");
    server.stop();
    let events = read_to_the_end(&late);
    let told: Vec<_> = events.iter().map(|event| (event.event_kind(), event.sent_by(), event.outcome())).collect();
    let expected = [
        (EventKind::Start, Sender::Server, Ok(())),
        (EventKind::Hold, Sender::Ctl, Ok(())),
        (EventKind::Resume, Sender::Ctl, Err(Refusal::Held)),
        (EventKind::Speed, Sender::Client, Err(Refusal::OutOfRange { lowest: 0.0, highest: 10.0 })),
        (EventKind::Stop, Sender::Signal, Ok(())),
        (EventKind::End, Sender::Server, Ok(())),
    ];
    assert_eq!(told, expected.map(|(kind, sender, outcome)| (Some(kind), Some(sender), outcome)));
    let start = events[0].run_start().expect("the start");
    assert_eq!((start.start_s, start.travel_m, start.speed_mps, start.until_s), (7.0, 7.0, 1.0, None));
    assert_eq!((events[3].tick, events[3].values[0], events[3].pid), (tick, 11.0, std::process::id()));
    assert!(events.iter().all(|event| event.run_id == run_id && event.wall_ns > 1_700_000_000_000_000_000));
    assert!(events.windows(2).all(|pair| pair[0].wall_ns <= pair[1].wall_ns && pair[0].tick <= pair[1].tick));
}

#[test]
fn a_guards_grants_are_events_and_the_status_has_the_guards_state_and_end() {
    let stage = Stage::new();
    let server = stage.serve(&["--guarded", "--rate", "100", "--start-at", "412"]);
    let events = CommandEventReader::open(stage.domain(), "test").expect("a server has created the services");
    let status = StatusReader::open(stage.domain(), "test").expect("a server has created the services");
    let guard_is = |wanted: GuardState| {
        eventually("the state of the guard", || {
            status.poll().expect("the bus is readable").filter(|status| status.guard_state() == Some(wanted))
        })
    };
    guard_is(GuardState::Missing);
    let guard = stage.start(&["monitor", "--guard"]);
    guard_is(GuardState::Running);
    let rest = eventually("the end of the proven travel", || {
        status.poll().expect("the bus is readable").filter(|status| status.guard_end().is_some())
    });
    assert!((rest.guard_end_m - 412.454_969).abs() < 1e-5, "{}", rest.guard_end_m);
    assert_eq!(rest.granted_to_m, rest.guard_end_m);
    guard.kill();
    guard_is(GuardState::Missing);
    server.stop();
    let grants: Vec<_> = read_to_the_end(&events)
        .into_iter()
        .filter_map(|event| match event.request() {
            Some(Request::Grant { to_m, is_final, .. }) => Some((event.sent_by(), to_m, is_final)),
            _ => None,
        })
        .collect();
    assert_eq!(grants.last(), Some(&(Some(Sender::Guard), rest.guard_end_m, true)), "{grants:?}");
}

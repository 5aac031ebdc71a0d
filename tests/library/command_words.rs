//! Commands and their outcomes in words, and as lines of JSON.

use bench_dragon::output::command_words::{CommandLine, CommandWords};
use bench_dragon_ipc::{Command, CommandEvent, CommandReply, EventKind, Refusal, Request, RunStart, Sender};

fn words(request: Request, reply: CommandReply) -> String {
    let command = Command { sender: Sender::Ctl.to_wire(), ..request.to_wire() };
    CommandWords::from(&CommandEvent::answered(&command, &reply)).text
}

#[test]
fn a_refused_command_has_its_reason_and_its_unit() {
    let refused = CommandReply::refused(1, 9, Refusal::OutOfRange { lowest: 0.0, highest: 10.0 });
    let text = words(Request::Speed { speed_mps: 11.0 }, refused);
    assert_eq!(text, "ctl: speed 11 m/s, refused at tick 9: the speed is 11 m/s, must be from 0 to 10 m/s");
    let held = CommandReply::refused(1, 9, Refusal::Held);
    assert_eq!(words(Request::Resume, held), format!("ctl: resume, refused at tick 9: {}", Refusal::Held));
}

#[test]
fn the_start_and_the_end_of_a_run_are_worded() {
    let start = RunStart {
        start_s: 0.1,
        travel_m: 0.1,
        speed_mps: 1.0,
        until_s: None,
        is_held: true,
        is_paused: false,
        is_guarded: true,
        follows_timecode: true,
        is_ready: false,
        is_restarted: false,
        stays: false,
    };
    let text = |event: &CommandEvent| CommandWords::from(event).text;
    assert_eq!(text(&start.event(7)), "server: the run begins at 0.1 s, held, guarded, follows timecode");
    assert_eq!(text(&CommandEvent::plain(EventKind::End, Sender::Server, 77)), "server: the run ends, at tick 77");
    let stand = CommandEvent::plain(EventKind::Stand, Sender::Timecode, 5);
    assert_eq!(text(&stand), "timecode: the show stands with the timecode, at tick 5");
}

#[test]
fn an_event_of_a_newer_version_is_worded_too() {
    let event = CommandEvent { kind: 99, sender: 98, ..CommandEvent::default() };
    let text = CommandWords::from(&event).text;
    assert_eq!(text, "sender 98: a command of an unknown kind, at tick 0");
}

#[test]
fn a_line_has_the_sender_the_wall_time_and_the_values_of_its_kind() {
    let command = Command { sender: Sender::Page.to_wire(), pid: 12, ..Request::Seek { show_time_s: 12.5 }.to_wire() };
    let event = CommandEvent::answered(&command, &CommandReply::accepted(7, 41));
    let line = CommandLine::from(&CommandEvent { wall_ns: 1_700_000_000_123_456_789, ..event });
    assert_eq!(line.wall_time, "2023-11-14T22:13:20.123456789Z");
    assert_eq!((line.command.as_str(), line.sender.as_str(), line.pid), ("seek", "page", Some(12)));
    assert_eq!((line.tick, line.values, line.accepted, line.reason), (41, vec![Some(12.5)], true, None));
}

#[test]
fn an_unknown_command_and_a_time_before_1970_make_a_line_too() {
    let event = CommandEvent {
        kind: CommandEvent::UNKNOWN_KIND,
        sender: 99,
        refusal: 1,
        wall_ns: i64::MIN,
        ..Default::default()
    };
    let line = CommandLine::from(&event);
    assert_eq!((line.command.as_str(), line.sender.as_str(), line.pid), ("unknown", "sender 99", None));
    assert!(line.wall_time.starts_with("1677-09-21T") && !line.accepted && line.values.is_empty(), "{line:?}");
}

//! Terminals, pipes and files that accept no output: they stop no process and delay no end.

use std::fs;
use std::process::{Command, Stdio};

use bench_dragon_ipc::{AlertKind, AlertSubscriber, StatusReader};
use rustix::process::Signal;
use serde_json::Value;
use test_support::children::{await_child, children, kill};
use test_support::eventually::eventually;
use test_support::process::Process;

use crate::pty::Pty;
use crate::stage::{Stage, program};

/// A show of five seconds with a contact, with more frames than a reader's buffer holds, which are those of four seconds.
const TO_CONTACT: [&str; 8] = ["--start-at", "405", "--time-scale", "5", "--rate", "50", "--until", "430"];

/// A dragon so long that the question about its turn takes longer than the delay of the progress bar.
const LONG_DRAGON: &str =
    "[dragon]\nbenches = 1500\n[route]\nkind = \"turnaround\"\npitch_m = 1.7\nstart_s = -3000\nend_s = 3000\n";

/// Waits until the server has published a frame, and so its reader has joined.
fn await_frame(stage: &Stage) {
    let status = eventually("a server runs", || StatusReader::open(stage.domain(), "test").ok());
    let poll = || status.poll().expect("the bus is readable");
    eventually("a frame is published", || poll().filter(|status| status.tick >= 1));
}

/// Returns the lines of JSON in the output of a terminal.
fn json_lines(text: &str) -> Vec<Value> {
    let lines = text.lines().filter(|line| line.starts_with('{'));
    lines.map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{error} in {line}"))).collect()
}

#[test]
fn a_monitor_on_a_stuck_terminal_reads_every_frame_and_sends_every_alert() {
    let stage = Stage::new();
    let server = stage.serve(&[&TO_CONTACT[..], &["--readers", "1"]].concat());
    let alerts = AlertSubscriber::open(stage.domain(), "test").expect("a server has created the services");
    let terminal = Pty::stuck();
    let monitor = terminal.start(stage.command(&["monitor", "--format", "json"]));
    let frames = server.summary()["frames"].clone();
    let mut alerted = Vec::new();
    while let Some(alert) = alerts.receive().expect("the bus is readable") {
        alerted.push(alert.alert_kind().map(AlertKind::name));
    }
    assert!(alerted.contains(&Some(AlertKind::Contact.name())), "{alerted:?}");
    drop(alerts);

    let output = terminal.read();
    monitor.signal(Signal::INT);
    assert_eq!(monitor.end().code(), Some(0));
    let output = output.join().expect("the terminal is read");
    let lines = json_lines(&output);
    let printed: Vec<_> =
        lines.iter().filter(|line| line["type"] == "alert").map(|line| line["kind"].as_str()).collect();
    assert_eq!(printed, alerted, "{output}");
    let summary = lines.last().expect("a summary");
    assert_eq!((&summary["frames"], &summary["lost"]), (&frames, &0.into()), "{output}");
}

#[test]
fn lines_that_a_terminal_does_not_accept_are_counted_and_later_lines_follow() {
    let stage = Stage::new();
    fs::write(stage.path("short.toml"), "[dragon]\nbenches = 20\n").expect("the folder is writable");
    let pace = ["--config", "short.toml", "--rate", "100", "--until", "12", "--readers", "1"];
    let server = stage.serve(&pace);
    let terminal = Pty::stuck();
    let monitor = terminal.start(stage.command(&["monitor", "--format", "json", "--progress", "0.01"]));
    let frames = server.summary()["frames"].clone();
    let output = terminal.read();
    // The monitor reports the dropped lines before the next lines.
    monitor.signal(Signal::INT);
    assert_eq!(monitor.end().code(), Some(0));
    let output = output.join().expect("the terminal is read");
    let reports: Vec<&str> = output.lines().filter(|line| !line.starts_with('{')).collect();
    let [report] = reports[..] else { panic!("{reports:?} in {output}") };
    let dropped = report.strip_suffix(" lines were dropped: the terminal took no output");
    let dropped: usize = dropped.and_then(|count| count.parse().ok()).unwrap_or_else(|| panic!("{report}"));
    let (last, lines) = (json_lines(&output).pop(), json_lines(&output).len());
    assert!(dropped > 0 && lines > 10, "{dropped} of {lines}");
    assert!(last.is_none_or(|line| line["type"] != "summary" || line["frames"] == frames), "{output}");
}

#[test]
fn a_guarded_show_on_a_stuck_terminal_walks_to_its_rest_and_ends() {
    let stage = Stage::new();
    let pace = ["--start-at", "405", "--time-scale", "20", "--rate", "100", "--out", "out"];
    let terminal = Pty::stuck();
    let show = terminal.start(stage.command(&[&["show", "--guard"], &pace[..]].concat()));
    assert_eq!(show.end().code(), Some(0));
    let summary = fs::read_to_string(stage.path("out/summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    let held_at_s = summary["guard"]["held_at_s"].as_f64().expect("a number");
    assert!((held_at_s - 412.454_970).abs() < 1e-5, "{summary}");
    assert_eq!((&summary["contact"], &summary["frames"]["missed_by_monitor"]), (&Value::Null, &0.into()));
    drop(terminal);
}

#[test]
fn a_show_on_a_stuck_terminal_restarts_its_server_and_ends_at_a_signal() {
    let stage = Stage::new();
    let terminal = Pty::stuck();
    let show = terminal.start(stage.command(&["show", "--out", "out", "--rate", "50", "--start-at", "100"]));
    let first = await_child(show.pid(), "serve", None);
    await_frame(&stage);
    // By then the live line was drawn more often than a terminal has room for.
    let status = StatusReader::open(stage.domain(), "test").expect("a server runs");
    eventually("tick 50", || status.poll().expect("the bus is readable").filter(|status| status.tick >= 50));
    drop(status);
    kill(first);
    await_child(show.pid(), "serve", Some(first));
    show.signal(Signal::INT);
    let pid = show.pid();
    assert_eq!(show.end().code(), Some(0));
    assert_eq!(children(pid), []);
    let summary = fs::read_to_string(stage.path("out/summary.json")).expect("a summary");
    let summary: Value = serde_json::from_str(&summary).expect("JSON");
    assert_eq!(summary["restarts"]["serve"], 1, "{summary}");
    drop(terminal);
}

#[test]
fn a_signal_ends_every_reader_on_a_stuck_terminal() {
    let readers: [&[&str]; 7] = [
        &["monitor"],
        &["record", "a.mcap"],
        &["echo"],
        &["hz"],
        &["latency", "--seconds", "1000"],
        &["view", "--listen", "127.0.0.1:0"],
        &["bridge", "osc", "--to", "127.0.0.1:9"],
    ];
    for reader in readers {
        let stage = Stage::new();
        let server = stage.serve(&["--rate", "100", "--readers", "1"]);
        let terminal = Pty::stuck();
        let process = terminal.start(stage.command(reader));
        await_frame(&stage);
        process.signal(Signal::INT);
        assert_eq!(process.end().code(), Some(0), "{reader:?}");
        server.stop();
        drop(terminal);
    }
}

#[test]
fn a_server_on_a_stuck_terminal_serves_and_ends_also_with_timecode() {
    for timecode in [&[][..], &["--timecode", "osc:127.0.0.1:0"]] {
        let stage = Stage::new();
        let terminal = Pty::stuck();
        let server = terminal.start(stage.command(&[&["serve", "--rate", "100"], timecode].concat()));
        await_frame(&stage);
        server.signal(Signal::INT);
        assert_eq!(server.end().code(), Some(0), "{timecode:?}");
        drop(terminal);
    }
}

#[test]
fn an_answer_to_a_pipe_is_whole_though_the_bar_is_on_a_stuck_terminal() {
    let stage = Stage::new();
    fs::write(stage.path("long.toml"), LONG_DRAGON).expect("the folder is writable");
    let terminal = Pty::stuck();
    let mut solve = program(&["solve", "turn", "--work", "10000", "--config", "long.toml"]);
    solve.current_dir(stage.path("")).stdin(Stdio::null()).stderr(terminal.slave());
    let answered = solve.output().expect("the program exists");
    drop(terminal);
    assert_eq!(answered.status.code(), Some(0));
    assert!(String::from_utf8_lossy(&answered.stdout).contains("least clearance"));
}

#[test]
fn a_signal_ends_an_echo_with_a_full_pipe() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "1000"]);
    let mut echo = stage.start(&["echo", "--format", "json"]);
    echo.next_line().expect("a frame");
    let mut reader = crate::reader::Reader::join(&stage);
    let tick = reader.next().header.tick;
    // By then there were more frames than the pipe and the queue have room for.
    reader.read_to_tick(tick + 400);
    drop(reader);
    echo.signal(Signal::INT);
    // The test reads no output until the echo has ended.
    eventually("the echo has ended", || has_ended(&echo).then_some(()));
    assert_eq!(echo.end().code(), Some(0));
    server.stop();
}

/// Whether a process that has not been waited for is a zombie.
fn has_ended(process: &Process) -> bool {
    let stat =
        fs::read_to_string(format!("/proc/{}/stat", process.pid())).expect("the process has not been waited for");
    stat.rsplit(')').next().is_some_and(|rest| rest.trim_start().starts_with('Z'))
}

#[test]
fn a_contact_sets_the_status_also_with_a_closed_stdout() {
    let stage = Stage::new();
    let pace = ["--start-at", "411", "--time-scale", "5", "--rate", "100"];
    let server = stage.serve(&[&pace[..], &["--readers", "1"]].concat());
    let mut monitor = stage.start(&["monitor", "--fail-on-contact"]);
    monitor.close_stdout();
    let ended = monitor.end();
    assert_eq!((ended.code(), ended.stderr.as_str()), (Some(3), ""));
    server.stop();
    let mut show = stage.start(&[&["show", "--fail-on-contact", "--out", "out"], &pace[..]].concat());
    show.close_stdout();
    let ended = show.end();
    assert_eq!(ended.code(), Some(3), "{}", ended.stderr);
}

#[test]
fn an_answer_to_a_full_disk_is_an_error() {
    let long = ["solve", "poses", "--from", "0", "--to", "100", "--step", "1", "--format", "csv"];
    let answers: [&[&str]; 6] =
        [&["--help"], &["--version"], &["solve", "--help"], &["solve", "pitch"], &long, &["completions", "bash"]];
    for args in answers {
        let full = fs::File::options().write(true).open("/dev/full").expect("Linux has this file");
        let ended = program(args).stdin(Stdio::null()).stdout(full).output().expect("the program exists");
        let told = String::from_utf8_lossy(&ended.stderr).into_owned();
        let expected = "error: cannot write to stdout: No space left on device (os error 28)\n";
        assert_eq!((ended.status.code(), told.as_str()), (Some(1), expected), "{args:?}");
    }
}

#[test]
fn a_closed_pipe_ends_an_answer_without_an_error() {
    let line = format!(
        "{} solve poses --from 0 --to 300 --step 1 --format csv | head -n 1",
        env!("CARGO_BIN_EXE_bench-dragon")
    );
    let output = Command::new("bash").args(["-o", "pipefail", "-c", &line]).output().expect("bash is installed");
    assert_eq!((output.status.code(), String::from_utf8_lossy(&output.stderr).as_ref()), (Some(0), ""));
    assert_eq!(output.stdout, b"time_s,handle,x_m,y_m,speed_mps\n");
}

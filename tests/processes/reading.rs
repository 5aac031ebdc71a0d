//! Configurations that are no plain files, and the zone of local times.

use std::fs::{self, File};
use std::io::Write as _;
use std::process::Command;
use std::thread;

use rustix::fs::{CWD, FileType, Mode, mknodat};
use test_support::process::Process;

use crate::stage::{Stage, program};

/// A pipe with a name in the folder of a stage.
fn pipe(stage: &Stage) -> String {
    let path = stage.path("pipe.toml");
    mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0).expect("a pipe");
    path.display().to_string()
}

fn poses(config: &str) -> Command {
    program(&["solve", "poses", "--at", "0", "--config", config])
}

#[test]
fn a_configuration_may_be_a_pipe_that_ends() {
    let stage = Stage::new();
    let path = pipe(&stage);
    let process = Process::start(poses(&path));
    let writer = thread::spawn(move || {
        let mut pipe = File::options().write(true).open(path).expect("a reader");
        pipe.write_all(b"[dragon]\nbenches = 3\n").expect("a reader");
    });
    process.end().expect_clean();
    writer.join().expect("the writer ends");
}

#[test]
fn a_configuration_that_never_ends_is_refused_in_one_line() {
    let stage = Stage::new();
    let path = pipe(&stage);
    for (file, reason) in [
        (path.as_str(), "cannot be read: is a pipe that did not end within 10 s"),
        ("/dev/zero", "is longer than 262144 bytes, the most that is allowed"),
    ] {
        let ended = Process::start(poses(file)).end();
        assert_eq!((ended.code(), ended.stdout.as_str()), (Some(2), ""), "{}", ended.stderr);
        assert!(ended.stderr.lines().count() == 1 && ended.stderr.contains(reason), "{}", ended.stderr);
    }
}

#[test]
fn a_number_of_very_many_digits_is_shortened_in_an_error() {
    let stage = Stage::new();
    let digits = "9".repeat(300);
    for text in [format!("[serve]\nrate_hz = {digits}.0\n"), "[serve]\nrate_hz = 1e300\n".to_owned()] {
        fs::write(stage.path("long.toml"), text).expect("a configuration");
        let ended = Process::start(poses(&stage.path("long.toml").display().to_string())).end();
        assert_eq!(ended.code(), Some(2), "{}", ended.stderr);
        assert!(ended.stderr.lines().count() == 1 && ended.stderr.len() < 300 + 60, "{}", ended.stderr);
    }
}

#[test]
fn local_times_are_those_of_the_zone_in_the_environment() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "20"]);
    for (zone, offset) in [("Asia/Kolkata", "+05:30"), ("America/Bogota", "-05:00"), ("UTC", "+00:00")] {
        let mut status = stage.command(&["ctl", "status", "--format", "json"]);
        status.env("TZ", zone);
        let answer = Process::start(status).end().expect_clean().last_json();
        let wall_time = answer["wall_time"].as_str().expect("a time");
        assert!(wall_time.ends_with(offset), "{zone}: {wall_time}");
    }
    server.stop();
}

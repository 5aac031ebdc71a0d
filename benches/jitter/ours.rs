//! Our server: the real program and the status that it publishes.

use std::io::{BufRead, BufReader, Read};
use std::process::{Command, Stdio};
use std::thread;
use std::time::Duration;

use bench_dragon::ServeLine;
use bench_dragon_ipc::{Domain, Instance, Status, StatusReader, TimeHistogram};

use crate::setting::{RATE_HZ, Setting, TICKS};

/// The same in every turn, so that each server removes the remains of one that was killed.
const INSTANCE: &str = "bench-jitter";
/// Period of reading the status, long enough not to affect the server.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

/// Returns the lateness of all ticks of one turn.
pub(crate) fn measure(setting: &Setting) -> TimeHistogram {
    let until_s = (TICKS - 1) as f64 / RATE_HZ as f64;
    let mut server = Command::new(env!("CARGO_BIN_EXE_bench-dragon"))
        .args(["serve", "--format", "json", "--instance", INSTANCE, "--rate", &RATE_HZ.to_string()])
        .args(["--until", &until_s.to_string(), "--cpu", &setting.cpu.to_string(), "--priority", &setting.priority()])
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .spawn()
        .expect("cargo has built the program for this bench");
    let mut stdout = BufReader::new(server.stdout.take().expect("stdout is piped"));
    stdout.read_line(&mut String::new()).expect("a pipe of text");
    let domain = Domain::new(Instance::new(INSTANCE).expect("allowed characters")).expect("a short path");
    let reader = StatusReader::open(&domain, "bench").expect("the server has created its services");
    let mut last = Status::default();
    while last.tick == 0 {
        look(&reader, &mut last);
    }
    setting.assert_taken(server.id());
    while server.try_wait().expect("the server is our child").is_none() {
        look(&reader, &mut last);
    }
    // The server's last status.
    look(&reader, &mut last);
    let mut summary = String::new();
    stdout.read_to_string(&mut summary).expect("a pipe of text");
    let Ok(ServeLine::Summary(summary)) = serde_json::from_str(&summary) else { panic!("{summary}") };
    assert_eq!(last.lateness.count(), summary.frames, "every tick is counted");
    assert!(summary.frames + last.overruns >= TICKS, "{} frames and {} missed periods", summary.frames, last.overruns);
    last.lateness
}

fn look(reader: &StatusReader, last: &mut Status) {
    thread::sleep(LOOK_PERIOD);
    if let Some(status) = reader.poll().expect("the bus is readable") {
        *last = status;
    }
}

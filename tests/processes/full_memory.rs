//! A full `/dev/shm` during a show: running processes own their memory, and a killed server starts again once there is room.

use std::fs::{self, File, OpenOptions};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use bench_dragon::recording::FrameReader;
use rustix::process::Signal;
use serde_json::json;
use test_support::children::{await_child, kill, send};
use test_support::eventually::{eventually, eventually_from};
use test_support::process::{Ended, Process};
use test_support::skip::is_possible;

use crate::resources::behind;
use crate::stage::Stage;

/// A process with a small `/dev/shm` of its own.
struct Confined {
    show: Process,
    stage: Stage,
}

impl Confined {
    /// Starts a show. `None` if this machine does not allow mounts.
    fn start(args: &[&str]) -> Option<Self> {
        let script = r#"mount -t tmpfs -o size=100m none /dev/shm && exec "$@""#;
        let launcher = ["unshare", "--mount", "sh", "-c", script, "sh"];
        if !is_possible(&launcher) {
            return None;
        }
        let stage = Stage::new();
        let show = stage.command(&[&["show", "--out", "out", "--format", "json"], args].concat());
        Some(Self { show: behind(&launcher, &show), stage })
    }

    /// A file in the `/dev/shm` of the show.
    fn filler(&self) -> PathBuf {
        format!("/proc/{}/root/dev/shm/filler", self.show.pid()).into()
    }

    /// Runs a command on the show's instance, in its namespace.
    fn run(&self, args: &[&str]) -> Ended {
        let target = format!("--target={}", self.show.pid());
        behind(&["nsenter", &target, "--mount"], &self.stage.command(args)).end()
    }

    /// Waits until the recording has frames up to a show time.
    fn await_recorded(&self, file: &str, wanted_s: f64) {
        let path = self.stage.path(file);
        eventually_from(&format!("{file} reaches {wanted_s} s"), || {
            let last = last_s(&path);
            last.filter(|last_s| *last_s >= wanted_s).map(drop).ok_or_else(|| format!("{last:?}"))
        });
    }
}

/// Show time of the last frame of a recording in seconds, if it has one.
fn last_s(path: &Path) -> Option<f64> {
    let frames = FrameReader::open(path).ok()?;
    frames.map_while(Result::ok).last().map(|frame| frame.header.show_time_s())
}

/// Writes into a file until its file system is full.
fn fill(filler: &mut File) {
    for block in [vec![1; 1 << 20], vec![1; 4 << 10]] {
        while filler.write_all(&block).is_ok() {}
    }
}

/// Ends the filling when it is dropped, also by a panic.
struct MakesRoom<'a>(&'a AtomicBool);

impl Drop for MakesRoom<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Relaxed);
    }
}

fn create(filler: &Path) -> File {
    OpenOptions::new().append(true).create(true).open(filler).expect("the show has a /dev/shm")
}

#[test]
fn a_show_goes_on_while_shared_memory_is_full() {
    let Some(confined) = Confined::start(&["--rate", "1000"]) else { return };
    let pid = confined.show.pid();
    confined.await_recorded("out/recording.mcap", 0.5);
    fill(&mut create(&confined.filler()));
    // While its readers stand, the server uses more of its memory.
    for command in ["monitor", "record"] {
        let reader = await_child(pid, command, None);
        send(reader, Signal::STOP).expect("the process runs");
        let file = if command == "record" { None } else { Some("out/recording.mcap") };
        let begun = std::time::Instant::now();
        eventually("the reader has missed frames", || (begun.elapsed().as_millis() > 1500).then_some(()));
        send(reader, Signal::CONT).expect("the process is stopped");
        if let Some(file) = file {
            confined.await_recorded(file, 1.5);
        }
    }
    // A further reader is refused in one line, and does no harm.
    let refused = confined.run(&["echo", "--count", "1"]);
    assert_eq!(refused.code(), Some(1), "{}", refused.stdout);
    assert!(refused.stderr.starts_with("error: /dev/shm has less than the "), "{}", refused.stderr);
    confined.await_recorded("out/recording.mcap", 5.0);
    // The server keeps memory for operators' tools.
    for command in ["hold", "release", "hold"] {
        confined.run(&["ctl", command]).expect_clean();
    }
    let status = confined.run(&["ctl", "status", "--format", "json"]).last_json();
    assert_eq!(status["state"], "held", "{status}");
    confined.show.signal(Signal::INT);
    let ended = confined.show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    assert_eq!(ended.last_json()["restarts"], json!({ "serve": 0, "monitor": 0, "record": 0, "view": 0 }));
}

#[test]
fn a_server_without_room_in_shared_memory_starts_again_once_there_is_room() {
    let Some(confined) = Confined::start(&["--rate", "100"]) else { return };
    let pid = confined.show.pid();
    confined.await_recorded("out/recording.mcap", 0.5);
    let filler = confined.filler();
    let has_room = AtomicBool::new(false);
    thread::scope(|scope| {
        scope.spawn(|| {
            let mut file = create(&filler);
            // The file takes what the killed server leaves.
            while !has_room.load(Ordering::Relaxed) {
                fill(&mut file);
                thread::yield_now();
            }
            // The show's own /dev/shm has gone with a show that has failed.
            let _ = fs::remove_file(&filler);
        });
        let _makes_room = MakesRoom(&has_room);
        kill(await_child(pid, "serve", None));
        // Five restarts within a second and a half, and two more.
        for _ in 0..7 {
            confined.show.complaint_with("serve ended with exit status: 1: starting it again");
        }
    });
    eventually("the dragon can be released", || (confined.run(&["ctl", "release"]).code() == Some(0)).then_some(()));
    confined.show.signal(Signal::INT);
    let ended = confined.show.end();
    assert_eq!(ended.code(), Some(0), "{}", ended.stderr);
    assert!(ended.last_json()["restarts"]["serve"].as_u64() >= Some(7), "{}", ended.stderr);
}

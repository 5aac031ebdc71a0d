//! The recorded show: starts a server and a recorder, watches them and ends them.

use std::io::{BufRead as _, BufReader};
use std::panic::resume_unwind;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon::source::server::ServerSummary;
use bench_dragon::system::stop::StopFlag;
use bench_dragon::{RecordLine, RecordSummary, ServeLine};
use rustix::process::{Pid, Signal, kill_process};
use serde::de::DeserializeOwned;

use crate::RATE_HZ;
use crate::cores::{CoreTimes, cpu_seconds_at_end};

/// The same in every run, so that each run removes the remains of one that was killed.
const INSTANCE: &str = "bench-record";
/// Period of checks for a signal.
const LOOK_PERIOD: Duration = Duration::from_millis(50);

/// Results of a show.
#[derive(Debug)]
pub(crate) struct Show {
    pub(crate) run_id: u64,
    pub(crate) frames_published: u64,
    pub(crate) frames_recorded: u64,
    pub(crate) frames_lost: u64,
    pub(crate) overruns: u64,
    pub(crate) recorded_bytes: u64,
    pub(crate) elapsed_s: f64,
    pub(crate) server_cpu_s: f64,
    pub(crate) recorder_cpu_s: f64,
    pub(crate) tick_p50_us: f64,
    pub(crate) tick_p999_us: f64,
    /// The share of time that each core was busy, including all other programs on the machine.
    pub(crate) busy_shares: Vec<f64>,
}

/// Runs the paper's dragon for a number of seconds and records it. A signal ends the show early.
pub(crate) fn record_show(file: &Path, seconds: u32, stop: &StopFlag) -> Show {
    let mut recorder = Process::start(&["record", file.to_str().expect("the path of cargo's folder is UTF-8")]);
    assert!(matches!(recorder.line(), RecordLine::Started { .. }), "a recorder's first line is `started`");
    let (rate, until) = (RATE_HZ.to_string(), seconds.to_string());
    let mut server = Process::start(&["serve", "--rate", &rate, "--until", &until, "--readers", "1"]);
    let ServeLine::Started { run_id } = server.line() else { panic!("a server's first line is `started`") };
    let (begun, times_before) = (Instant::now(), CoreTimes::now());
    let ServeLine::Summary(served) = server.line_or_stop(stop) else { panic!("a server's last line is its summary") };
    let (elapsed_s, times) = (begun.elapsed().as_secs_f64(), CoreTimes::now());
    let server_cpu_s = cpu_seconds_at_end(&mut server.child);
    terminate(Pid::from_child(&recorder.child));
    let recorded = summary_of(&mut recorder);
    let recorder_cpu_s = cpu_seconds_at_end(&mut recorder.child);
    let ServerSummary { frames, overruns, tick_us, .. } = served;
    Show {
        run_id,
        frames_published: frames,
        frames_recorded: recorded.frames,
        frames_lost: recorded.lost,
        overruns,
        recorded_bytes: recorded.bytes,
        elapsed_s,
        server_cpu_s,
        recorder_cpu_s,
        tick_p50_us: tick_us.p50,
        tick_p999_us: tick_us.p999,
        busy_shares: times.busy_shares_since(&times_before),
    }
}

/// Returns the recorder's last line. Warnings about the disk may precede it.
fn summary_of(recorder: &mut Process) -> RecordSummary {
    loop {
        if let RecordLine::Summary(summary) = recorder.line() {
            return summary;
        }
    }
}

/// A process of the program, on this bench's instance.
#[derive(Debug)]
struct Process {
    child: Child,
    stdout: BufReader<ChildStdout>,
}

impl Process {
    fn start(arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_bench-dragon"))
            .args(arguments)
            .args(["--format", "json", "--instance", INSTANCE, "--parent", &std::process::id().to_string()])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .spawn()
            .expect("cargo has built the program for this bench");
        let stdout = BufReader::new(child.stdout.take().expect("stdout is piped"));
        Self { child, stdout }
    }

    /// Returns the next line of its output.
    fn line<Line: DeserializeOwned>(&mut self) -> Line {
        let mut line = String::new();
        self.stdout.read_line(&mut line).expect("the process prints text");
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error} in {line:?}"))
    }

    /// Returns the next line. If a signal arrives during the wait, this ends the process.
    fn line_or_stop<Line: DeserializeOwned + Send>(&mut self, stop: &StopFlag) -> Line {
        let pid = Pid::from_child(&self.child);
        thread::scope(|scope| {
            let line = scope.spawn(|| self.line());
            while !line.is_finished() && !stop.is_set() {
                thread::sleep(LOOK_PERIOD);
            }
            if stop.is_set() {
                terminate(pid);
            }
            line.join().unwrap_or_else(|panic| resume_unwind(panic))
        })
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // No effect on a process that has been waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends SIGTERM to a process that has not been waited for.
fn terminate(pid: Pid) {
    kill_process(pid, Signal::TERM).expect("the process id is valid until the parent waits");
}

//! The requests of a server to the kernel: a processor, a priority, locked memory, spinning.

use std::fs;
use std::path::Path;
use std::process::Command;
use std::thread;

use bench_dragon::config::Config;
use bench_dragon::system::processors::Processors;
use rustix::process::geteuid;
use test_support::process::Process;
use test_support::skip::{is_possible, skip};
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

use crate::reader::{Reader, assert_whole};
use crate::stage::Stage;

/// Numbers of the kernel's scheduling policies.
const SCHED_OTHER: u32 = 0;
const SCHED_FIFO: u32 = 1;
const SCHED_RR: u32 = 2;

/// Arguments of a server that requests a priority.
const SERVE_AT_80: [&str; 9] =
    ["serve", "--format", "json", "--rate", "100", "--readers", "1", "--priority", "fifo:80"];

/// A thread's scheduling, as the kernel reports it.
#[derive(Debug, PartialEq)]
struct Thread {
    is_loop: bool,
    policy: u32,
    priority: u32,
    cpus: String,
}

#[test]
fn only_the_loop_has_the_requested_processor_and_priority() {
    if !may_take_priority() {
        skip("real-time priorities are not granted here");
        return;
    }
    let (cpu, all) = (last_cpu(), processors().to_string());
    for (priority, policy, level) in [("fifo:80", SCHED_FIFO, 80), ("rr:7", SCHED_RR, 7)] {
        let stage = Stage::new();
        let server = stage.serve(&["--rate", "100", "--readers", "1", "--cpu", &cpu, "--priority", priority]);
        Reader::join(&stage).read_to_tick(1);
        for thread in threads(server.process.pid()) {
            let expected = if thread.is_loop {
                Thread { is_loop: true, policy, priority: level, cpus: cpu.clone() }
            } else {
                Thread { is_loop: false, policy: SCHED_OTHER, priority: 0, cpus: all.clone() }
            };
            assert_eq!(thread, expected);
        }
        assert!(locked_kib(server.process.pid()) > 0);
        server.stop();
    }
}

#[test]
fn a_server_without_flags_has_no_priority_and_no_processor_of_its_own() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "100", "--readers", "1"]);
    Reader::join(&stage).read_to_tick(1);
    let all = processors().to_string();
    for thread in threads(server.process.pid()) {
        assert_eq!((thread.policy, thread.priority, &thread.cpus), (SCHED_OTHER, 0, &all));
    }
    assert_eq!(locked_kib(server.process.pid()), 0);
    server.stop();
}

#[test]
fn without_the_privilege_the_server_runs_and_reports_the_missing_rights_in_one_line() {
    let stage = Stage::new();
    let Some(command) = unprivileged(&stage.command(&SERVE_AT_80)) else { return };
    let mut server = Process::start(command);
    assert_eq!(server.json()["type"], "started");
    Reader::join(&stage).read_to_tick(3);
    let is_real_time = |thread: &Thread| thread.policy != SCHED_OTHER;
    assert!(!threads(server.pid()).iter().any(is_real_time) && locked_kib(server.pid()) == 0);
    let ended = server.terminate();
    assert_eq!((ended.code(), ended.stderr.lines().count()), (Some(0), 1), "{}", ended.stderr);
    let told = [
        "running without locked memory (",
        ") and priority fifo:80 (",
        "; grant memlock unlimited (LimitMEMLOCK=infinity) and rtprio 80 (LimitRTPRIO=80), as packaging/limits.conf",
    ];
    assert!(told.iter().all(|part| ended.stderr.contains(part)), "{}", ended.stderr);
}

#[test]
fn a_missing_processor_is_reported_with_the_available_ones() {
    let stage = Stage::new();
    if processors().contains(1023) {
        skip("this machine has all 1024 processors");
        return;
    }
    fs::write(stage.path("stage.toml"), "[serve]\ncpu = 1023\n").expect("a file");
    let expected = format!("error: cpu is 1023, must be one that this process may run on: {}\n", processors());
    for args in [&["serve", "--cpu", "1023"][..], &["show", "--cpu", "1023"], &["serve", "--config", "stage.toml"]] {
        let ended = stage.run(args);
        assert_eq!((ended.code(), ended.stderr.as_str()), (Some(2), expected.as_str()), "{args:?}");
    }
}

#[test]
fn a_spinning_server_sends_every_frame_and_none_before_it_is_due() {
    let stage = Stage::new();
    let server = stage.serve(&["--spin-us", "300", "--until", "0.2", "--readers", "1"]);
    let shots = Reader::join(&stage).read_to_end();
    assert_whole(&shots, server.run_id);
    assert!(shots.iter().all(|shot| shot.header.published_ns >= shot.header.scheduled_ns));
    assert_eq!(server.summary()["frames"], shots.len());
}

#[test]
fn a_show_passes_its_real_time_flags_to_its_server() {
    let (stage, cpu) = (Stage::new(), last_cpu());
    let show = ["show", "--out", "out", "--until", "0.1", "--cpu", &cpu, "--spin-us", "20", "--priority", "other"];
    stage.run(&show).expect_clean();
    let text = fs::read_to_string(stage.path("out/config.toml")).expect("the show leaves its configuration");
    let config = Config::from_toml(&text).expect("a server has read it");
    assert_eq!((config.tables().serve.cpu.map(|cpu| cpu.to_string()), config.tables().serve.spin_us), (Some(cpu), 20));
    assert!(text.contains("priority = \"other\""), "{text}");
}

/// Returns the command without the right to a priority or to locked memory; `None` if the rights cannot be removed.
fn unprivileged(command: &Command) -> Option<Command> {
    let mut with: Vec<&str> = vec!["prlimit", "--rtprio=0", "--memlock=65536"];
    if geteuid().is_root() {
        with.splice(0..0, ["setpriv", "--bounding-set=-sys_nice,-ipc_lock"]);
    }
    if !is_possible(&with) {
        return None;
    }
    let mut without = Command::new(with[0]);
    without.args(&with[1..]).arg(command.get_program()).args(command.get_args()).env_remove("RUST_LOG");
    Some(without)
}

/// Whether a thread of this user may take a real-time priority.
fn may_take_priority() -> bool {
    let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
    let take = move || set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Max, policy).is_ok();
    thread::spawn(take).join().expect("the thread does not panic")
}

fn processors() -> Processors {
    Processors::of_this_process().expect("the kernel reports it")
}

/// Returns the last processor that this process may use.
fn last_cpu() -> String {
    let cpus = processors();
    (0..=1023).rev().find(|&cpu| cpus.contains(cpu)).expect("this process runs on a processor").to_string()
}

fn threads(pid: u32) -> Vec<Thread> {
    let tasks = fs::read_dir(format!("/proc/{pid}/task")).expect("the process runs");
    let threads: Vec<Thread> = tasks.map(|task| thread(pid, &task.expect("the process runs").path())).collect();
    assert!(threads.len() > 1 && threads.iter().filter(|thread| thread.is_loop).count() == 1, "{threads:?}");
    threads
}

/// Reads a thread's scheduling. The loop runs in the first thread of the process.
fn thread(pid: u32, task: &Path) -> Thread {
    let stat = fs::read_to_string(task.join("stat")).expect("the thread runs");
    // After the name in brackets, the fields are numbered from 3.
    let (_, fields) = stat.rsplit_once(") ").expect("the name is in brackets");
    let field =
        |number: usize| fields.split(' ').nth(number - 3).and_then(|field| field.parse().ok()).expect("a number");
    let status = fs::read_to_string(task.join("status")).expect("the thread runs");
    Thread {
        is_loop: task.ends_with(pid.to_string()),
        policy: field(41),
        priority: field(40),
        cpus: value(&status, "Cpus_allowed_list"),
    }
}

fn locked_kib(pid: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{pid}/status")).expect("the process runs");
    value(&status, "VmLck").trim_end_matches(" kB").parse().expect("a number")
}

fn value(status: &str, key: &str) -> String {
    let line = status.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'));
    line.expect("the kernel reports it").trim().to_owned()
}

//! Scheduling that both contestants request, and the check that they have it.

use std::fs;
use std::path::Path;
use std::thread;

use bench_dragon::system::processors::Processors;
use thread_priority::{
    RealtimeThreadSchedulePolicy, ThreadPriority, ThreadSchedulePolicy, set_thread_priority_and_policy,
    thread_native_id,
};

/// Ticks per second.
pub(crate) const RATE_HZ: u64 = 1000;
/// Ticks per turn.
pub(crate) const TICKS: u64 = 3000;
/// Priority among real-time programs.
pub(crate) const LEVEL: u32 = 80;
/// The kernel's number of `SCHED_FIFO`.
const SCHED_FIFO: u32 = 1;

/// Processor and scheduling policy of the sleeping threads.
#[derive(Debug)]
pub(crate) struct Setting {
    pub(crate) cpu: u32,
    is_real_time: bool,
}

impl Setting {
    /// Returns the last processor, which probably handles the fewest interrupts, and whether the system grants real-time
    /// priority.
    pub(crate) fn of_this_machine() -> Self {
        let processors = Processors::of_this_process().expect("the kernel reports the processors");
        let cpu = (0..=1023).rev().find(|&cpu| processors.contains(cpu)).expect("this process runs on a processor");
        let policy = ThreadSchedulePolicy::Realtime(RealtimeThreadSchedulePolicy::Fifo);
        let take = move || set_thread_priority_and_policy(thread_native_id(), ThreadPriority::Max, policy).is_ok();
        let is_real_time = thread::spawn(take).join().expect("the thread does not panic");
        if !is_real_time {
            println!("real-time priorities are not allowed here: the figures of cyclictest are null");
        }
        Self { cpu, is_real_time }
    }

    pub(crate) fn is_real_time(&self) -> bool {
        self.is_real_time
    }

    /// Returns the server's argument of `--priority`.
    pub(crate) fn priority(&self) -> String {
        if self.is_real_time { format!("fifo:{LEVEL}") } else { "other".to_owned() }
    }

    /// Panics unless exactly one thread of a process has the priority and runs only on the processor, and memory is locked.
    pub(crate) fn assert_taken(&self, pid: u32) {
        if !self.is_real_time {
            return;
        }
        let tasks = fs::read_dir(format!("/proc/{pid}/task")).expect("the process is running").flatten();
        let threads: Vec<(u32, u32, String)> = tasks.map(|task| scheduling(&task.path())).collect();
        let is_it = |thread: &&(u32, u32, String)| thread.0 == SCHED_FIFO;
        let taken: Vec<_> = threads.iter().filter(is_it).collect();
        assert_eq!(taken, [&(SCHED_FIFO, LEVEL, self.cpu.to_string())], "{threads:?}");
        let status = fs::read_to_string(format!("/proc/{pid}/status")).expect("the process is running");
        assert_ne!(value(&status, "VmLck"), "0 kB");
    }
}

/// Returns a thread's policy, priority and allowed processors.
fn scheduling(task: &Path) -> (u32, u32, String) {
    let stat = fs::read_to_string(task.join("stat")).expect("the thread is running");
    // The fields after the name, which is in brackets, have the numbers from 3 on.
    let (_, fields) = stat.rsplit_once(") ").expect("the name is in brackets");
    let field =
        |number: usize| fields.split(' ').nth(number - 3).and_then(|field| field.parse().ok()).expect("a number");
    let status = fs::read_to_string(task.join("status")).expect("the thread is running");
    (field(41), field(40), value(&status, "Cpus_allowed_list"))
}

fn value(status: &str, key: &str) -> String {
    let line = status.lines().find_map(|line| line.strip_prefix(key)?.strip_prefix(':'));
    line.expect("the kernel reports this key").trim().to_owned()
}

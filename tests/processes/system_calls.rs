//! The system calls of the server's loop in steady state. The test stops the loop at each call.
#![cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]

use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread;
use std::time::Duration;

use bench_dragon_ipc::service::{Member, Role};
use bench_dragon_ipc::{FrameHeader, FrameSubscriber};
use nix::libc::{SYS_clock_nanosleep, SYS_futex, SYS_sendto, c_long};
use nix::sys::ptrace::{self, Options};
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::Pid;
use rustix::process::{Signal, kill_process};
use test_support::eventually::{DEADLINE, eventually};
use test_support::process::Process;
use test_support::skip::skip;

use crate::server::Server;
use crate::stage::Stage;
use crate::steady_desk::send_timecode;

/// Number of tested ticks: more than a reader's buffer holds.
const TICKS: u64 = 500;

/// The loop's thread, which runs from one system call to the next. It is the first thread of its process.
struct Traced {
    pid: Pid,
    /// The process is killed unless this is dropped within the deadline. Then the next wait for it fails.
    _watchdog: Sender<()>,
}

impl Traced {
    /// Traces the loop from its next sleep on. Skips the test and returns `None` if the kernel does not allow it.
    fn at_sleep(process: &Process) -> Option<Self> {
        let pid = Pid::from_raw(process.pid() as i32);
        if let Err(error) = ptrace::seize(pid, Options::PTRACE_O_TRACESYSGOOD) {
            skip(&format!("ptrace: {error}"));
            return None;
        }
        ptrace::interrupt(pid).expect("the process is traced");
        waitpid(pid, Some(WaitPidFlag::__WALL)).expect("the process is a child of the test");
        let traced = Self { pid, _watchdog: watch(process) };
        while traced.next() != SYS_clock_nanosleep {}
        Some(traced)
    }

    /// Runs until the loop is about to enter a system call. Returns the number of the call, before it runs.
    fn next(&self) -> c_long {
        loop {
            self.run();
            let number = self.number();
            if self.is_entering() {
                return number;
            }
        }
    }

    /// Runs to the next entry into a system call or return from one.
    fn run(&self) {
        ptrace::syscall(self.pid, None).expect("the process is stopped");
        let status = waitpid(self.pid, Some(WaitPidFlag::__WALL)).expect("the process is a child of the test");
        assert!(
            matches!(status, WaitStatus::PtraceSyscall(_)),
            "waited at most {DEADLINE:?} for a system call: {status:?}"
        );
    }

    fn is_entering(&self) -> bool {
        const PTRACE_SYSCALL_INFO_ENTRY: u8 = 1;
        ptrace::syscall_info(self.pid).expect("the process is stopped").op == PTRACE_SYSCALL_INFO_ENTRY
    }

    #[cfg(target_arch = "x86_64")]
    fn number(&self) -> c_long {
        ptrace::getregs(self.pid).expect("the process is stopped").orig_rax.cast_signed()
    }

    #[cfg(target_arch = "aarch64")]
    fn number(&self) -> c_long {
        ptrace::getregs(self.pid).expect("the process is stopped").regs[8].cast_signed()
    }

    fn let_go(self) {
        ptrace::detach(self.pid, None).expect("the process is stopped");
    }
}

#[test]
fn a_tick_takes_one_system_call_which_is_its_sleep() {
    let stage = Stage::new();
    assert_only_sleeps(&stage, stage.serve(&["--readers", "1"]));
}

#[test]
fn a_tick_that_follows_timecode_takes_the_same_single_call() {
    let stage = Stage::new();
    let mut server = stage.serve(&["--readers", "1", "--timecode", "osc:0"]);
    let listen = server.process.json()["listen"].as_str().expect("an address").to_owned();
    let (begun, over) = mpsc::channel::<()>();
    thread::scope(|scope| {
        scope.spawn(move || send_timecode(&listen, &over));
        // Dropped at the end of this scope, also if the test fails.
        let _begun = begun;
        assert_only_sleeps(&stage, server);
    });
}

fn assert_only_sleeps(stage: &Stage, server: Server) {
    // The reader only polls, so the server wakes no reader.
    let mut reader = FrameSubscriber::open(stage.domain(), "test").expect("a server has created the services");
    let mut newest = None;
    let mut last_tick = || {
        let read = reader.latest().expect("the bus is readable").map(|frame| frame.header().tick);
        newest = read.or(newest);
        newest
    };
    eventually("the first frame", &mut last_tick);
    let Some(traced) = Traced::at_sleep(&server.process) else {
        server.stop();
        return;
    };
    let first = last_tick();
    for tick in 0..TICKS {
        assert_eq!(traced.next(), SYS_clock_nanosleep, "after {tick} ticks");
    }
    assert_eq!(last_tick(), first.map(|first| first + TICKS));
    traced.let_go();
    drop(reader);
    server.stop();
}

#[test]
fn all_woken_readers_together_take_one_more_call_and_a_reader_that_gave_up_at_most_one() {
    let stage = Stage::new();
    let server = stage.serve(&["--readers", "2"]);
    let open = || FrameSubscriber::open(stage.domain(), "test").expect("a server has created the services");
    let mut readers = [open(), open()];
    for reader in &mut readers {
        eventually("the first frame", || reader.receive().expect("the bus is readable").map(drop));
    }
    let Some(traced) = Traced::at_sleep(&server.process) else {
        server.stop();
        return;
    };
    let mut wait = || readers.each_mut().map(read_all_and_wait);
    wait();
    for tick in 0..TICKS {
        assert_eq!([traced.next(), traced.next()], [SYS_futex, SYS_clock_nanosleep], "after {tick} ticks");
        assert!(wait().iter().all(Option::is_some));
    }
    assert_eq!(traced.next(), SYS_futex, "the readers may still wait");
    for tick in 0..TICKS {
        assert_eq!(traced.next(), SYS_clock_nanosleep, "after {tick} ticks without a waiting reader");
    }
    traced.let_go();
    drop(readers);
    server.stop();
}

#[test]
fn a_stock_listener_takes_one_more_call_of_its_own() {
    let stage = Stage::new();
    let server = stage.serve(&["--readers", "1"]);
    let mut reader = FrameSubscriber::open(stage.domain(), "test").expect("a server has created the services");
    eventually("the first frame", || reader.receive().expect("the bus is readable").map(drop));
    let member = Member::join(stage.domain(), "stock", Role::Client).expect("a server runs");
    let events = member.frame_events().expect("a server has created the services");
    let listener = events.listener_builder().create().expect("no other listener exists");
    let Some(traced) = Traced::at_sleep(&server.process) else {
        server.stop();
        return;
    };
    let wake_ups = || {
        let mut count = 0;
        listener.try_wait(|_| count += 1).expect("the listener is open");
        count
    };
    // The server connects to the listener at its next tick.
    while traced.next() != SYS_clock_nanosleep {}
    wake_ups();
    for tick in 0..TICKS {
        assert_eq!([traced.next(), traced.next()], [SYS_sendto, SYS_clock_nanosleep], "after {tick} ticks");
        assert_eq!(wake_ups(), 1);
    }
    traced.let_go();
    drop((reader, listener, events, member));
    server.stop();
}

/// Kills a process after the deadline, unless the returned sender is dropped before.
fn watch(process: &Process) -> Sender<()> {
    let pid = rustix::process::Pid::from_raw(process.pid().cast_signed()).expect("a process id is not 0");
    let (dropped, is_dropped) = mpsc::channel();
    thread::spawn(move || {
        if is_dropped.recv_timeout(DEADLINE) == Err(RecvTimeoutError::Timeout) {
            // The kill fails if the process has ended.
            let _ = kill_process(pid, Signal::KILL);
        }
    });
    dropped
}

/// Reads all frames, then waits for more, so that the next frame wakes this reader. Returns the newest frame.
fn read_all_and_wait(reader: &mut FrameSubscriber) -> Option<FrameHeader> {
    let mut newest = None;
    while let Some(frame) = reader.wait(Duration::from_millis(1)).expect("the bus is readable") {
        newest = Some(*frame.header());
    }
    newest
}

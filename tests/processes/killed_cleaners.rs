//! A process is killed or stopped while it removes the node of a killed server. The next server starts at the first try, while
//! clients continue. The test lets the process run from one removal of a file to the next, and ends it there.
#![cfg(any(target_arch = "x86_64", target_arch = "aarch64"))]

use std::fs::{self, File, OpenOptions};
use std::io::Write as _;
use std::os::unix::fs::OpenOptionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use bench_dragon_ipc::service::{Member, Role};
use nix::libc::{self, c_long};
use nix::sys::ptrace::{self, Options};
use nix::sys::signal::Signal;
use nix::sys::wait::{WaitPidFlag, WaitStatus, waitpid};
use nix::unistd::Pid;
use test_support::process::Process;

use crate::reader::Reader;
use crate::stage::Stage;

/// Each stop is tested. A stop is before or after the removal of a file.
const KILLED_STRIDE: usize = 1;
/// For stopped processes, only some stops are tested.
const STOPPED_STRIDE: usize = 7;
/// Upper bound of the stops of a process.
const MOST_STOPS: usize = 1000;

#[cfg(target_arch = "x86_64")]
const REMOVALS: [c_long; 3] = [libc::SYS_unlink, libc::SYS_unlinkat, libc::SYS_rmdir];
#[cfg(target_arch = "aarch64")]
const REMOVALS: [c_long; 1] = [libc::SYS_unlinkat];

/// The signal to the process that cleans up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Interruption {
    Killed,
    Stopped,
}

#[test]
fn a_server_starts_at_first_try_wherever_a_cleaner_was_killed() {
    let stops = servers_after_cleaners(Interruption::Killed, KILLED_STRIDE);
    println!("{stops} cleaners were killed");
}

#[test]
fn a_server_starts_at_first_try_wherever_a_cleaner_is_stopped() {
    let stops = servers_after_cleaners(Interruption::Stopped, STOPPED_STRIDE);
    println!("{stops} cleaners were stopped");
}

/// Leaves the segment of a process that was killed after it created the segment and before it set the size.
fn leave_empty_segment(stage: &Stage, of: &str) -> PathBuf {
    let shared_memory = Path::new("/dev/shm");
    let names = fs::read_dir(shared_memory).expect("shared memory").flatten().map(|entry| entry.file_name());
    let mut names = names.filter_map(|name| name.into_string().ok());
    let prefix = stage.domain().prefix();
    let name = names.find(|name| name.starts_with(&prefix) && name.ends_with(of)).expect("a segment of this kind");
    let path = shared_memory.join(name);
    fs::remove_file(&path).expect("this user owns it");
    let empty = OpenOptions::new().write(true).create_new(true).mode(0o200).open(&path).expect("shared memory");
    drop(empty);
    path
}

#[test]
fn a_server_starts_at_first_try_beside_a_connection_without_a_size() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "200"]);
    let mut reader = Reader::join(&stage);
    reader.next();
    server.process.kill();
    let path = leave_empty_segment(&stage, ".connection");
    let server = stage.serve(&["--rate", "200"]);
    reader.read_until("a frame of the next server", |header| header.run_id == server.run_id);
    assert!(fs::metadata(&path).map_or(true, |metadata| metadata.len() > 0), "{} is still empty", path.display());
    drop(reader);
    server.stop();
}

#[test]
fn a_running_server_removes_a_segment_that_stays_without_a_size() {
    let stage = Stage::new();
    let server = stage.serve(&["--rate", "200"]);
    let path = PathBuf::from(format!("/dev/shm/{}1_2.connection", stage.domain().prefix()));
    File::create_new(&path).expect("shared memory");
    let mut reader = Reader::join(&stage);
    while path.exists() {
        reader.next();
    }
    drop(reader);
    server.stop();
}

/// Kills a server, ends its cleaner one stop later each time, and starts the next server, until a cleaner completes.
fn servers_after_cleaners(interruption: Interruption, stride: usize) -> usize {
    let stage = Stage::new();
    let mut server = stage.serve(&["--rate", "200"]);
    let mut reader = Reader::join(&stage);
    let keeper = Member::join(stage.domain(), "keeper", Role::Client).expect("a server runs");
    // If a stopped process is the last member of a service, the next server names it and does not start.
    let kept = (interruption == Interruption::Stopped).then(|| services_of(&keeper));
    let monitor = stage.start(&["monitor", "--format", "json"]);
    let mut cleaners = 0;
    for stop in (0..MOST_STOPS).step_by(stride) {
        server.process.kill();
        let Some(cleaner) = cleaner_at(&stage, stop, interruption) else { break };
        cleaners += 1;
        server = stage.serve(&["--rate", "200"]);
        reader.read_until("a frame of the next server", |header| header.run_id == server.run_id);
        cleaner.end_now();
    }
    assert!(cleaners > 1, "a cleaner removes files");
    drop((reader, kept, keeper));
    monitor.signal(rustix::process::Signal::INT);
    monitor.end();
    // The last cleaner has completed and no server runs: the next member of the bus removes everything.
    stage.serve(&["--rate", "200"]).stop();
    cleaners
}

/// Opens all services of the bus, so that no other client is the last member of one.
fn services_of(member: &Member) -> impl Sized + use<> {
    let events = (member.frame_events().expect("a service"), member.alert_events().expect("a service"));
    let latest = (member.description().expect("a service"), member.status().expect("a service"));
    let others = (member.alerts().expect("a service"), member.readers().expect("a service"));
    let others = (others, member.replay().expect("a service"));
    (events, latest, others, member.frames().expect("a service"), member.commands().expect("a service"))
}

/// A process that was killed or stopped while it cleaned up.
struct Cleaner(Process);

impl Cleaner {
    fn end_now(self) {
        // This has no effect on a dead process.
        self.0.signal(rustix::process::Signal::KILL);
        self.0.end();
    }
}

/// Returns a shell that becomes the command when it has read a line: the process can be traced before the command begins.
fn at_a_line(command: &Command) -> Command {
    let mut shell = Command::new("sh");
    shell.args(["-c", r#"read -r _ && exec "$0" "$@""#]).arg(command.get_program()).args(command.get_args());
    shell.current_dir(command.get_current_dir().expect("the stage's folder")).env_remove("RUST_LOG");
    shell
}

/// Starts a client, which removes the killed server's nodes, and ends it at a stop. Returns `None` if the client completes
/// before.
fn cleaner_at(stage: &Stage, stop: usize, interruption: Interruption) -> Option<Cleaner> {
    let (process, mut start) = Process::start_with_stdin(at_a_line(&stage.command(&["ctl", "hold"])));
    let pid = Pid::from_raw(process.pid() as i32);
    ptrace::seize(pid, Options::PTRACE_O_TRACESYSGOOD).expect("a test may trace its children");
    ptrace::interrupt(pid).expect("the process is traced");
    writeln!(start).expect("the shell waits for the line");
    let mut stops = 0;
    loop {
        match waitpid(pid, Some(WaitPidFlag::__WALL)).expect("the process is a child of the test") {
            WaitStatus::Exited(..) | WaitStatus::Signaled(..) => return None,
            WaitStatus::PtraceSyscall(_) if REMOVALS.contains(&number(pid)) => stops += 1,
            WaitStatus::Stopped(_, signal) if signal != Signal::SIGTRAP => {
                ptrace::syscall(pid, signal).expect("the process is stopped");
                continue;
            }
            _ => {}
        }
        if stops > stop {
            let signal = if interruption == Interruption::Killed { Signal::SIGKILL } else { Signal::SIGSTOP };
            ptrace::detach(pid, signal).expect("the process is stopped");
            return Some(Cleaner(process));
        }
        ptrace::syscall(pid, None).expect("the process is stopped");
    }
}

#[cfg(target_arch = "x86_64")]
fn number(pid: Pid) -> c_long {
    ptrace::getregs(pid).expect("the process is stopped").orig_rax.cast_signed()
}

#[cfg(target_arch = "aarch64")]
fn number(pid: Pid) -> c_long {
    ptrace::getregs(pid).expect("the process is stopped").regs[8].cast_signed()
}

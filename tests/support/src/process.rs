//! A process of the program: started, read line by line, signalled, waited for. One that a failing test leaves is killed.
//!
//! Each wait has a deadline. Past it, the test fails with the command line, what was waited for, and what the process has
//! written to stderr so far.

use std::io::{BufRead as _, BufReader, ErrorKind, Read as _};
use std::process::{Child, ChildStderr, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::Instant;

use rustix::fs::{OFlags, fcntl_getfl, fcntl_setfl};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

use crate::eventually::{DEADLINE, before_deadline};

/// A running process.
#[derive(Debug)]
pub struct Process {
    /// The command line.
    name: String,
    child: Child,
    stdout: Option<BufReader<ChildStdout>>,
    /// The lines of stderr, taken off it as they come, so that the process never waits for us.
    complaints: Receiver<String>,
    /// All of stderr so far.
    stderr: Arc<Mutex<String>>,
}

/// What a process has left when it has ended.
#[derive(Debug)]
pub struct Ended {
    /// How it ended.
    pub status: ExitStatus,
    /// What has not been read before.
    pub stdout: String,
    /// All that has not been read before.
    pub stderr: String,
}

impl Process {
    /// Starts a process that has nothing to read.
    pub fn start(mut command: Command) -> Self {
        Self::spawn(command.stdin(Stdio::null()))
    }

    /// Starts a process that reads from us.
    pub fn start_with_stdin(mut command: Command) -> (Self, ChildStdin) {
        let mut process = Self::spawn(command.stdin(Stdio::piped()));
        let stdin = process.child.stdin.take().expect("stdin is piped");
        (process, stdin)
    }

    fn spawn(command: &mut Command) -> Self {
        let name = format!("{command:?}");
        let spawned = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn();
        let mut child = spawned.unwrap_or_else(|error| panic!("{name}: {error}"));
        let stdout = child.stdout.take().map(without_blocking);
        let (sender, complaints) = mpsc::channel();
        let stderr = Arc::new(Mutex::new(String::new()));
        let (source, log) = (child.stderr.take().expect("stderr is piped"), Arc::clone(&stderr));
        thread::spawn(move || listen(source, &log, &sender));
        Self { name, child, stdout, complaints, stderr }
    }

    /// Its id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// The next line of stdout, without its end; `None` where the process has closed it.
    #[track_caller]
    pub fn next_line(&mut self) -> Option<String> {
        let mut line = Vec::new();
        self.read("the next line of stdout", |stdout| stdout.read_until(b'\n', &mut line));
        let line = String::from_utf8(line).expect("a pipe of text");
        (!line.is_empty()).then(|| line.trim_end_matches('\n').to_owned())
    }

    /// The next line of stderr, without its end.
    #[track_caller]
    pub fn complaint(&self) -> String {
        match self.complaints.recv_timeout(DEADLINE) {
            Ok(line) => line,
            Err(RecvTimeoutError::Timeout) => self.fail_waiting("the next line of stderr"),
            Err(RecvTimeoutError::Disconnected) => {
                panic!("{} ended before it wrote another line to stderr, which was: {}", self.name, self.stderr())
            }
        }
    }

    /// The next line of stderr with this in it.
    #[track_caller]
    pub fn complaint_with(&self, wanted: &str) -> String {
        let begun = Instant::now();
        loop {
            let line = self.complaint();
            if line.contains(wanted) {
                return line;
            }
            if begun.elapsed() > DEADLINE {
                self.fail_waiting(&format!("a line of stderr with {wanted:?}"));
            }
        }
    }

    /// The next line of stdout as JSON.
    #[track_caller]
    pub fn json(&mut self) -> Value {
        let line =
            self.next_line().unwrap_or_else(|| panic!("{} has ended: {}", self.name, self.remaining_complaints()));
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error} in {line}"))
    }

    /// Lines of JSON up to the first one that is wanted, which comes last. `what` completes "waited until …".
    #[track_caller]
    pub fn json_until(&mut self, what: &str, is_wanted: impl Fn(&Value) -> bool) -> Vec<Value> {
        let begun = Instant::now();
        let mut lines = vec![self.json()];
        while let Some(last) = lines.last().filter(|line| !is_wanted(line)) {
            if begun.elapsed() > DEADLINE {
                self.fail_waiting(&format!("until {what}, last read {last},"));
            }
            lines.push(self.json());
        }
        lines
    }

    /// Closes our end of its stdout, as `head` does when it has enough.
    pub fn close_stdout(&mut self) {
        self.stdout = None;
    }

    /// Sends it a signal.
    pub fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).expect("the process has not been waited for");
    }

    /// Ends it as a crash does, and waits until it is gone.
    #[track_caller]
    pub fn kill(self) {
        self.signal(Signal::KILL);
        self.end();
    }

    /// Asks it to end, and waits.
    #[track_caller]
    pub fn terminate(self) -> Ended {
        self.signal(Signal::TERM);
        self.end()
    }

    /// Waits for its end.
    #[track_caller]
    pub fn end(mut self) -> Ended {
        let mut stdout = Vec::new();
        if self.stdout.is_some() {
            self.read("the end of stdout", |source| source.read_to_end(&mut stdout));
        }
        let stderr = self.remaining_complaints();
        let child = &mut self.child;
        let ended = before_deadline(|| child.try_wait().expect("a child can be waited for").ok_or(()));
        let status = ended.unwrap_or_else(|()| self.fail_waiting("the end"));
        Ended { status, stdout: String::from_utf8_lossy(&stdout).into_owned(), stderr }
    }

    /// Reads from stdout until `read` has what it wants.
    #[track_caller]
    fn read(&mut self, what: &str, mut read: impl FnMut(&mut BufReader<ChildStdout>) -> std::io::Result<usize>) {
        let stdout = self.stdout.as_mut().expect("stdout is open until it is closed by the test");
        let done = before_deadline(|| match read(stdout) {
            Err(error) if error.kind() == ErrorKind::WouldBlock => Err(()),
            done => Ok(done.expect("a pipe can be read")),
        });
        if done.is_err() {
            self.fail_waiting(what);
        }
    }

    /// The rest of stderr, which ends with the process.
    #[track_caller]
    fn remaining_complaints(&self) -> String {
        let begun = Instant::now();
        let mut rest = String::new();
        loop {
            match self.complaints.recv_timeout(DEADLINE.saturating_sub(begun.elapsed())) {
                Ok(line) => rest += &(line + "\n"),
                Err(RecvTimeoutError::Disconnected) => return rest,
                Err(RecvTimeoutError::Timeout) => self.fail_waiting("the end of stderr"),
            }
        }
    }

    #[track_caller]
    fn fail_waiting(&self, what: &str) -> ! {
        panic!("waited {DEADLINE:?} for {what} of {}; its stderr so far: {}", self.name, self.stderr())
    }

    fn stderr(&self) -> String {
        self.stderr.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Without effect on one that has been waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Ended {
    /// Its exit status; none where a signal ended it.
    pub fn code(&self) -> Option<i32> {
        self.status.code()
    }

    /// Fails unless it ended with status 0 and had nothing to complain about.
    #[allow(clippy::return_self_not_must_use, reason = "often the check is all that a test wants")]
    pub fn expect_clean(self) -> Self {
        assert_eq!((self.code(), self.stderr.as_str()), (Some(0), ""), "{}", self.stdout);
        self
    }

    /// The lines of stdout as JSON.
    pub fn json_lines(&self) -> Vec<Value> {
        self.stdout.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("{line}"))).collect()
    }

    /// The last line of stdout as JSON.
    pub fn last_json(&self) -> Value {
        self.json_lines().pop().unwrap_or_else(|| panic!("nothing printed: {}", self.stderr))
    }
}

/// Reads from a pipe fail where there is nothing to read: so a wait for more can have a deadline. The process's end of the pipe
/// stays as it is.
fn without_blocking(stdout: ChildStdout) -> BufReader<ChildStdout> {
    let flags = fcntl_getfl(&stdout).expect("it is open");
    fcntl_setfl(&stdout, flags | OFlags::NONBLOCK).expect("it is open");
    BufReader::new(stdout)
}

/// Takes stderr off the process line by line, to its end.
fn listen(source: ChildStderr, log: &Mutex<String>, sender: &Sender<String>) {
    for line in BufReader::new(source).lines() {
        let line = line.expect("a pipe of text");
        log.lock().unwrap_or_else(PoisonError::into_inner).extend([line.as_str(), "\n"]);
        // Where the test is over, nobody listens any more.
        let _ = sender.send(line);
    }
}

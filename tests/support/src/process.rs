//! A process of the program, which a test starts, reads line by line, signals and waits for. If the test fails, the process is
//! killed.
//!
//! Each wait has a deadline. After it, the test fails with the command line, the awaited event, and the stderr of the process
//! so far.

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
    /// The lines of stderr. A thread reads them at once, so the process never waits for the test.
    complaints: Receiver<String>,
    /// All of stderr so far.
    stderr: Arc<Mutex<String>>,
}

/// The exit status and the remaining output of a process that has ended.
#[derive(Clone, Debug)]
pub struct Ended {
    /// Exit status.
    pub status: ExitStatus,
    /// The part of stdout that the test has not read yet.
    pub stdout: String,
    /// The part of stderr that the test has not read yet.
    pub stderr: String,
}

impl Process {
    /// Starts a process with an empty stdin.
    pub fn start(mut command: Command) -> Self {
        Self::spawn(command.stdin(Stdio::null()))
    }

    /// Starts a process, and returns it with its stdin.
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

    /// Process id.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// Returns the next line of stdout without its line feed; `None` if the process has closed stdout.
    #[track_caller]
    pub fn next_line(&mut self) -> Option<String> {
        let mut line = Vec::new();
        self.read("the next line of stdout", |stdout| stdout.read_until(b'\n', &mut line));
        let line = String::from_utf8(line).expect("the output is UTF-8");
        (!line.is_empty()).then(|| line.trim_end_matches('\n').to_owned())
    }

    /// Returns the next line of stderr without its line feed.
    #[track_caller]
    pub fn complaint(&self) -> String {
        match self.complaints.recv_timeout(DEADLINE) {
            Ok(line) => line,
            Err(RecvTimeoutError::Timeout) => self.fail_waiting("the next line of stderr"),
            Err(RecvTimeoutError::Disconnected) => {
                panic!("{} ended before another line on stderr; its stderr: {}", self.name, self.stderr())
            }
        }
    }

    /// Returns the next line of stderr that contains a text.
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

    /// Returns the next line of stdout as JSON.
    #[track_caller]
    pub fn json(&mut self) -> Value {
        let line =
            self.next_line().unwrap_or_else(|| panic!("{} has ended: {}", self.name, self.remaining_complaints()));
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error} in {line}"))
    }

    /// Returns lines of JSON up to the first wanted one, which is the last element. `what` completes the message "waited …
    /// until".
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

    /// Closes the test's end of stdout, as `head` does after its last line.
    pub fn close_stdout(&mut self) {
        self.stdout = None;
    }

    /// Sends a signal.
    pub fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).expect("the process has not been waited for");
    }

    /// Kills the process, and waits for its end.
    #[track_caller]
    pub fn kill(self) {
        self.signal(Signal::KILL);
        self.end();
    }

    /// Sends SIGTERM, and waits for the end.
    #[track_caller]
    pub fn terminate(self) -> Ended {
        self.signal(Signal::TERM);
        self.end()
    }

    /// Waits for the end.
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

    /// Calls `read` on stdout until it does not fail for lack of input.
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

    /// Returns the rest of stderr, up to the end of the process.
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
        // This has no effect if the process has been waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Ended {
    /// Exit status as a number; `None` if a signal ended the process.
    pub fn code(&self) -> Option<i32> {
        self.status.code()
    }

    /// Fails unless the exit status is 0 and stderr is empty.
    #[allow(clippy::return_self_not_must_use, reason = "many tests need only the check")]
    pub fn expect_clean(self) -> Self {
        assert_eq!((self.code(), self.stderr.as_str()), (Some(0), ""), "{}", self.stdout);
        self
    }

    /// Returns the lines of stdout as JSON.
    pub fn json_lines(&self) -> Vec<Value> {
        self.stdout.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("{line}"))).collect()
    }

    /// Returns the last line of stdout as JSON.
    pub fn last_json(&self) -> Value {
        self.json_lines().pop().unwrap_or_else(|| panic!("no line on stdout; stderr: {}", self.stderr))
    }
}

/// Makes reads of an empty pipe fail, so that a wait can have a deadline. The process's end of the pipe stays unchanged.
fn without_blocking(stdout: ChildStdout) -> BufReader<ChildStdout> {
    let flags = fcntl_getfl(&stdout).expect("the descriptor is open");
    fcntl_setfl(&stdout, flags | OFlags::NONBLOCK).expect("the descriptor is open");
    BufReader::new(stdout)
}

/// Reads stderr line by line up to its end.
fn listen(source: ChildStderr, log: &Mutex<String>, sender: &Sender<String>) {
    for line in BufReader::new(source).lines() {
        let line = line.expect("the output is UTF-8");
        log.lock().unwrap_or_else(PoisonError::into_inner).extend([line.as_str(), "\n"]);
        // The send fails if the test is over.
        let _ = sender.send(line);
    }
}

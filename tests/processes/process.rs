//! A process of the program: started, read line by line, signalled, waited for. One that a failing test leaves is killed.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, ChildStdout, Command, ExitStatus, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

/// A running process.
#[derive(Debug)]
pub(crate) struct Process {
    child: Child,
    stdout: Option<BufReader<ChildStdout>>,
    /// The program's own lines of stderr, taken off it as they come, so that the process never waits for us.
    complaints: Receiver<String>,
}

/// What a process has left when it has ended.
#[derive(Debug)]
pub(crate) struct Ended {
    pub(crate) status: ExitStatus,
    /// What has not been read before.
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Process {
    pub(crate) fn start(mut command: Command) -> Self {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program is there: cargo has built it for this test");
        let stdout = child.stdout.take().map(BufReader::new);
        let mut stderr = BufReader::new(child.stderr.take().expect("stderr is piped"));
        let (sender, complaints) = mpsc::channel();
        thread::spawn(move || {
            while let Some(line) = read_line(&mut stderr) {
                if !is_of_iceoryx2(&line) {
                    // Where the test is over, nobody listens any more.
                    let _ = sender.send(line);
                }
            }
        });
        Self { child, stdout, complaints }
    }

    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    /// The next line of stdout, without its end; `None` where the process has closed it.
    pub(crate) fn next_line(&mut self) -> Option<String> {
        read_line(self.stdout.as_mut().expect("stdout is open until it is closed by the test"))
    }

    /// The next line of stderr, without its end.
    pub(crate) fn complaint(&self) -> String {
        self.complaints.recv().expect("the process has something to say before it ends")
    }

    /// The next line of stdout as JSON.
    pub(crate) fn json(&mut self) -> Value {
        let line = self.next_line().unwrap_or_else(|| panic!("it has ended: {}", self.remaining_complaints()));
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{error} in {line}"))
    }

    /// Lines of JSON up to the first one that is wanted, which comes last.
    pub(crate) fn json_until(&mut self, is_wanted: impl Fn(&Value) -> bool) -> Vec<Value> {
        let mut lines = vec![self.json()];
        while !lines.last().is_some_and(&is_wanted) {
            lines.push(self.json());
        }
        lines
    }

    /// Closes our end of its stdout, as `head` does when it has enough.
    pub(crate) fn close_stdout(&mut self) {
        self.stdout = None;
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.child), signal).expect("the process has not been waited for");
    }

    /// Ends it as a crash does, and waits until it is gone.
    pub(crate) fn kill(self) {
        self.signal(Signal::KILL);
        self.end();
    }

    /// Asks it to end, and waits.
    pub(crate) fn terminate(self) -> Ended {
        self.signal(Signal::TERM);
        self.end()
    }

    /// Waits for its end.
    pub(crate) fn end(mut self) -> Ended {
        let stdout = self.stdout.take().map(read_all).unwrap_or_default();
        let stderr = self.remaining_complaints();
        Ended { status: self.child.wait().expect("a child can be waited for"), stdout, stderr }
    }

    /// The rest of stderr, which ends with the process.
    fn remaining_complaints(&self) -> String {
        self.complaints.iter().map(|line| line + "\n").collect()
    }
}

/// Whether a line of stderr is a warning of iceoryx2's, which begins with a capital: ours do not. Of a peer that was killed
/// while it joined it says, rightly, that it could not be connected to; whether it does is chance.
fn is_of_iceoryx2(line: &str) -> bool {
    line.strip_prefix(" WARN ").is_some_and(|message| message.starts_with(char::is_uppercase))
}

impl Drop for Process {
    fn drop(&mut self) {
        // Without effect on one that has been waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Ended {
    pub(crate) fn code(&self) -> Option<i32> {
        self.status.code()
    }

    /// Fails unless it ended with status 0 and had nothing to complain about.
    pub(crate) fn expect_clean(self) -> Self {
        assert_eq!((self.code(), self.stderr.as_str()), (Some(0), ""), "{}", self.stdout);
        self
    }

    /// The lines of stdout as JSON.
    pub(crate) fn json_lines(&self) -> Vec<Value> {
        self.stdout.lines().map(|line| serde_json::from_str(line).unwrap_or_else(|_| panic!("{line}"))).collect()
    }

    /// The last line of stdout as JSON.
    pub(crate) fn last_json(&self) -> Value {
        self.json_lines().pop().unwrap_or_else(|| panic!("nothing printed: {}", self.stderr))
    }
}

/// The next line, without its end; `None` at the end of all.
fn read_line(source: &mut impl BufRead) -> Option<String> {
    let mut line = String::new();
    let length = source.read_line(&mut line).expect("a pipe of text");
    (length > 0).then(|| line.trim_end_matches('\n').to_owned())
}

fn read_all(mut source: impl Read) -> String {
    let mut text = Vec::new();
    source.read_to_end(&mut text).expect("a pipe can be read to its end");
    String::from_utf8_lossy(&text).into_owned()
}

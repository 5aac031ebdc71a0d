//! The processes of a turn, from their parent's side. No process outlives the bench, and every wait has a timeout.

use std::io::{BufRead as _, BufReader, Write as _};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc::{self, Receiver};
use std::thread;
use std::time::Duration;

use rustix::process::{Pid, Signal, kill_process};

use crate::frame_source::RATE_HZ;
use crate::outcome::Outcome;
use crate::setting::Setting;
use crate::shared;

/// First argument of a publisher.
pub(crate) const PUBLISH: &str = "publish";
/// First argument of a reader.
pub(crate) const READ: &str = "read";
/// Timeout for a line of a process. It is longer than a whole turn.
const LINE_TIMEOUT: Duration = Duration::from_secs(30);

/// A running process.
struct Process {
    child: Child,
    lines: Receiver<String>,
}

/// A process that sends frames.
pub(crate) struct Publisher {
    process: Process,
    place: String,
    ends_by_signal: bool,
}

/// A process that reads frames.
pub(crate) struct Reader(Process);

impl Publisher {
    /// Starts a publisher. Returns when readers can connect.
    pub(crate) fn start(setting: Setting) -> Self {
        if setting.transport.publish.is_none() {
            return Self::serve(setting);
        }
        let process = Process::start(myself().arg(PUBLISH).args(setting.to_args()));
        let place = process.line();
        Self { process, place, ends_by_signal: false }
    }

    /// Starts the real server on its own instance.
    fn serve(setting: Setting) -> Self {
        let place = format!("latency-{}", std::process::id());
        let mut serve = shared::program();
        serve.args(["serve", "--format", "json", "--instance", &place]);
        serve.args(["--rate", &RATE_HZ.to_string(), "--readers", &setting.readers.to_string()]);
        let process = Process::start(&mut serve);
        // The line `started`: the services exist.
        process.line();
        Self { process, place, ends_by_signal: true }
    }

    /// Name or address by which readers connect.
    pub(crate) fn place(&self) -> &str {
        &self.place
    }

    /// Ends the publisher, and waits until it has cleaned up.
    pub(crate) fn stop(mut self) {
        if self.ends_by_signal {
            let pid = Pid::from_child(&self.process.child);
            kill_process(pid, Signal::TERM).expect("the process id is valid until the parent waits");
        }
        drop(self.process.child.stdin.take());
        self.process.end();
    }
}

impl Reader {
    pub(crate) fn start(setting: Setting, place: &str) -> Self {
        Self(Process::start(myself().arg(READ).arg(place).args(setting.to_args())))
    }

    /// Waits for the reader's first frame.
    pub(crate) fn wait_for_frames(&self) {
        assert_eq!(self.0.line(), "reading");
    }

    /// Starts the reader's turn.
    pub(crate) fn go(&mut self) {
        let stdin = self.0.child.stdin.as_mut().expect("stdin is piped");
        stdin.write_all(b"go\n").expect("the reader is running");
    }

    /// Waits for the end of the turn and returns the result.
    pub(crate) fn outcome(mut self) -> Outcome {
        let outcome = Outcome::from_json(&self.0.line());
        self.0.end();
        outcome
    }
}

impl Process {
    fn start(command: &mut Command) -> Self {
        let mut child = command
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("cargo has built this bench and the program");
        let stdout = BufReader::new(child.stdout.take().expect("stdout is piped"));
        let (sender, lines) = mpsc::channel();
        thread::spawn(move || {
            for line in stdout.lines().map_while(Result::ok) {
                // Fails after the receiver has been dropped. The line is not needed then.
                let _ = sender.send(line);
            }
        });
        Self { child, lines }
    }

    fn line(&self) -> String {
        self.lines.recv_timeout(LINE_TIMEOUT).expect("a process prints its line within 30 s")
    }

    fn end(&mut self) {
        let status = self.child.wait().expect("a child can be waited for");
        assert!(status.success(), "a process of the bench failed: {status}");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // No effect on a process that has been waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn myself() -> Command {
    Command::new(std::env::current_exe().expect("this bench is a file"))
}

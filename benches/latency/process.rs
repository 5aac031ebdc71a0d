//! The processes of a turn, as their parent sees them. None outlives the bench, and none is waited for without end.

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
/// Longer than any of them takes for anything, a turn among it.
const PATIENCE: Duration = Duration::from_secs(30);

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
    /// Starts one, and returns when readers may come.
    pub(crate) fn start(setting: Setting) -> Self {
        if setting.transport.publish.is_none() {
            return Self::serve(setting);
        }
        let process = Process::start(myself().arg(PUBLISH).args(setting.to_args()));
        let place = process.line();
        Self { process, place, ends_by_signal: false }
    }

    /// The real server, on an instance of its own.
    fn serve(setting: Setting) -> Self {
        let place = format!("latency-{}", std::process::id());
        let mut serve = shared::program();
        serve.args(["serve", "--format", "json", "--instance", &place]);
        serve.args(["--rate", &RATE_HZ.to_string(), "--readers", &setting.readers.to_string()]);
        let process = Process::start(&mut serve);
        // It says that its services are there.
        process.line();
        Self { process, place, ends_by_signal: true }
    }

    /// Where readers find it.
    pub(crate) fn place(&self) -> &str {
        &self.place
    }

    /// Ends it, and waits until it has cleared up.
    pub(crate) fn stop(mut self) {
        if self.ends_by_signal {
            let pid = Pid::from_child(&self.process.child);
            kill_process(pid, Signal::TERM).expect("it has not been waited for");
        }
        drop(self.process.child.stdin.take());
        self.process.end();
    }
}

impl Reader {
    pub(crate) fn start(setting: Setting, place: &str) -> Self {
        Self(Process::start(myself().arg(READ).arg(place).args(setting.to_args())))
    }

    /// Returns when the first frame has come.
    pub(crate) fn wait_for_frames(&self) {
        assert_eq!(self.0.line(), "reading");
    }

    /// Lets it begin its turn.
    pub(crate) fn go(&mut self) {
        let stdin = self.0.child.stdin.as_mut().expect("stdin is piped");
        stdin.write_all(b"go\n").expect("the reader is there");
    }

    /// Waits for the end of its turn.
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
                // Where nobody waits for it any more, it is not needed.
                let _ = sender.send(line);
            }
        });
        Self { child, lines }
    }

    fn line(&self) -> String {
        self.lines.recv_timeout(PATIENCE).expect("a process says what it has to within half a minute")
    }

    fn end(&mut self) {
        let status = self.child.wait().expect("a child can be waited for");
        assert!(status.success(), "a process of the bench has failed: {status}");
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        // Without effect on one that has been waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

fn myself() -> Command {
    Command::new(std::env::current_exe().expect("this bench is a file"))
}

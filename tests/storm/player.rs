//! A running process of a role, and its output.

use std::io::{BufRead as _, BufReader, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{self, JoinHandle};

use crate::role::{Role, run_id};

/// A process of a role. It is killed when this is dropped.
#[derive(Debug)]
pub(crate) struct Player {
    pub(crate) role: Role,
    /// Number of the process, over all roles.
    pub(crate) turn: usize,
    child: Child,
    heard: Arc<Heard>,
    listeners: Vec<JoinHandle<()>>,
}

/// The output of a process.
#[derive(Debug, Default)]
struct Heard {
    progress: AtomicU64,
    run_id: AtomicU64,
    complaints: Mutex<Vec<String>>,
}

impl Player {
    pub(crate) fn start(role: Role, turn: usize, mut command: Command) -> Self {
        let mut child = command
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the program is there: cargo has built it for this test");
        let heard = Arc::new(Heard::default());
        let stdout = child.stdout.take().expect("the stream is piped");
        let stderr = child.stderr.take().expect("the stream is piped");
        let (of_lines, of_complaints) = (Arc::clone(&heard), Arc::clone(&heard));
        let listeners = vec![
            listen(stdout, move |line| of_lines.take(role, line)),
            listen(stderr, move |line| of_complaints.complain(line)),
        ];
        Self { role, turn, child, heard, listeners }
    }

    /// Progress of the process: frames, replies or starts.
    pub(crate) fn progress(&self) -> u64 {
        self.heard.progress.load(Ordering::Relaxed)
    }

    /// The last run that the process has reported.
    pub(crate) fn run_id(&self) -> Option<u64> {
        Some(self.heard.run_id.load(Ordering::Relaxed)).filter(|&run_id| run_id != 0)
    }

    /// The lines of stderr so far.
    pub(crate) fn complaints(&self) -> Vec<String> {
        self.heard.complaints.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Exit status of the process, if it has ended.
    pub(crate) fn ended(&mut self) -> Option<ExitStatus> {
        let status = self.child.try_wait().expect("a child can be waited for")?;
        self.listen_to_end();
        Some(status)
    }

    /// Kills the process, and waits for its end. Returns its lines of stderr, or an error if it had ended by itself.
    pub(crate) fn kill(mut self) -> Result<Vec<String>, (Self, ExitStatus)> {
        if let Some(status) = self.ended() {
            return Err((self, status));
        }
        self.child.kill().expect("the process has not been waited for");
        self.child.wait().expect("a child can be waited for");
        self.listen_to_end();
        Ok(self.complaints())
    }

    pub(crate) fn pid(&self) -> u32 {
        self.child.id()
    }

    fn listen_to_end(&mut self) {
        for listener in self.listeners.drain(..) {
            listener.join().expect("what the program prints is well formed");
        }
    }
}

impl Drop for Player {
    fn drop(&mut self) {
        // This has no effect if the process has been waited for.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

impl Heard {
    fn take(&self, role: Role, line: &str) {
        if let Some(run_id) = run_id(line) {
            self.run_id.store(run_id, Ordering::Relaxed);
        }
        self.progress.fetch_add(role.progress(line), Ordering::Relaxed);
    }

    fn complain(&self, line: &str) {
        self.complaints.lock().unwrap_or_else(PoisonError::into_inner).push(line.to_owned());
    }
}

/// Passes every whole line to `take`. A killed process may leave a partial line.
fn listen(source: impl Read + Send + 'static, mut take: impl FnMut(&str) + Send + 'static) -> JoinHandle<()> {
    thread::spawn(move || {
        let mut source = BufReader::new(source);
        let mut line = String::new();
        while source.read_line(&mut line).is_ok_and(|length| length > 0) {
            if line.ends_with('\n') {
                take(line.trim_end());
            }
            line.clear();
        }
    })
}

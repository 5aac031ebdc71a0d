//! A pseudo-terminal for a program. It accepts output only when the test reads it.

use std::fs::{File, OpenOptions};
use std::io::{ErrorKind, Read as _, Write as _};
use std::os::unix::fs::OpenOptionsExt as _;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::{self, JoinHandle};

use nix::fcntl::OFlag;
use nix::pty::{PtyMaster, grantpt, posix_openpt, ptsname_r, unlockpt};
use rustix::process::{Pid, Signal, kill_process};
use test_support::eventually::eventually;

/// The two ends of the terminal.
#[derive(Debug)]
pub(crate) struct Pty {
    master: PtyMaster,
    slave: File,
    path: String,
}

/// A process on a terminal. If the test fails, the process is killed.
#[derive(Debug)]
pub(crate) struct OnPty(Child);

impl Pty {
    /// Opens a terminal with unread output. No process inherits its other end, so that it can be closed.
    pub(crate) fn open() -> Self {
        let master =
            posix_openpt(OFlag::O_RDWR | OFlag::O_NOCTTY | OFlag::O_CLOEXEC).expect("the system has terminals");
        grantpt(&master).and_then(|()| unlockpt(&master)).expect("this user owns it");
        let path = ptsname_r(&master).expect("the terminal has a name");
        let slave = open_slave(&path, OFlag::empty());
        Self { master, slave, path }
    }

    /// Opens a terminal whose buffer is full, so that it accepts no output.
    pub(crate) fn stuck() -> Self {
        let pty = Self::open();
        let mut filler = open_slave(&pty.path, OFlag::O_NONBLOCK);
        let full = loop {
            if let Err(error) = filler.write(&[b'x'; 64]) {
                break error;
            }
        };
        assert_eq!(full.kind(), ErrorKind::WouldBlock, "the terminal is full");
        pty
    }

    /// Starts a program whose stdout and stderr are this terminal.
    pub(crate) fn start(&self, mut command: Command) -> OnPty {
        command.stdin(Stdio::null()).stdout(self.slave()).stderr(self.slave()).env("TERM", "xterm");
        OnPty(command.spawn().expect("the program exists"))
    }

    /// Starts a program with this controlling terminal: it gets a SIGHUP when the terminal is closed, also if the tests run
    /// under `nohup`. `launcher` runs the program.
    pub(crate) fn start_session(&self, launcher: &[&str], command: &Command) -> OnPty {
        let mut session = Command::new("env");
        session
            .args(["--default-signal=HUP", "setsid", "--ctty"])
            .args(launcher)
            .arg(command.get_program())
            .args(command.get_args());
        session.env_remove("RUST_LOG").env("TERM", "xterm");
        session.current_dir(command.get_current_dir().expect("the stage has a folder"));
        session.stdin(self.slave()).stdout(self.slave()).stderr(self.slave());
        OnPty(session.spawn().expect("env is installed"))
    }

    /// Returns a handle of the terminal for a program.
    pub(crate) fn slave(&self) -> Stdio {
        Stdio::from(self.slave.try_clone().expect("a descriptor"))
    }

    /// Reads all output until no process has the terminal open. Returns the output without the bytes that filled the buffer.
    pub(crate) fn read(self) -> JoinHandle<String> {
        let Self { mut master, slave, .. } = self;
        drop(slave);
        thread::spawn(move || {
            let mut output = Vec::new();
            // The read ends with EIO.
            let _ = master.read_to_end(&mut output);
            String::from_utf8_lossy(&output).trim_start_matches('x').replace("\r\n", "\n")
        })
    }

    /// Closes the terminal of a running process.
    pub(crate) fn close(self) {
        drop(self);
    }
}

fn open_slave(path: &str, flags: OFlag) -> File {
    let flags = flags.union(OFlag::O_NOCTTY).bits();
    OpenOptions::new().read(true).write(true).custom_flags(flags).open(path).expect("the terminal belongs to the test")
}

impl OnPty {
    pub(crate) fn pid(&self) -> u32 {
        self.0.id()
    }

    pub(crate) fn signal(&self, signal: Signal) {
        kill_process(Pid::from_child(&self.0), signal).expect("the process has not been waited for");
    }

    /// Waits for the end.
    pub(crate) fn end(mut self) -> ExitStatus {
        eventually("a process on a terminal has ended", || self.0.try_wait().expect("a child can be waited for"))
    }
}

impl Drop for OnPty {
    fn drop(&mut self) {
        // This has no effect if the process has been waited for.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

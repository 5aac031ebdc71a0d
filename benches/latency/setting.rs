//! Setting of one turn.

use std::thread;

use crate::transport::Transport;

/// How a reader detects a new frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    Polling,
    Woken,
    /// Sleeps by the clock until shortly before the frame is due, then polls. Only ours can: readers of others are woken.
    Clock,
}

/// A transport, and the number and mode of its readers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Setting {
    pub(crate) transport: &'static Transport,
    pub(crate) mode: Mode,
    pub(crate) readers: usize,
}

impl Mode {
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Polling => "polling",
            Self::Woken => "woken",
            Self::Clock => "clock",
        }
    }
}

impl Setting {
    /// Returns the arguments that pass this setting to a child process.
    pub(crate) fn to_args(self) -> [String; 3] {
        [self.transport.name.to_owned(), self.mode.name().to_owned(), self.readers.to_string()]
    }

    /// Parses the arguments from a parent process.
    pub(crate) fn from_args(args: &[&str]) -> Self {
        let [transport, mode, readers] = args else {
            panic!("arguments are {args:?}, must be a transport, a mode and a number of readers")
        };
        let transport = crate::CONTESTANTS.iter().find(|known| known.name == *transport);
        let mode = [Mode::Polling, Mode::Woken, Mode::Clock].into_iter().find(|known| known.name() == *mode);
        Self {
            transport: transport.expect("the parent passes a known transport"),
            mode: mode.expect("the parent passes a known mode"),
            readers: readers.parse().expect("the parent passes a number of readers"),
        }
    }

    /// Whether polling readers and the publisher outnumber the cores.
    pub(crate) fn is_crowded(self) -> bool {
        self.readers + 1 > thread::available_parallelism().map_or(1, usize::from)
    }
}

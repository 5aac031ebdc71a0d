//! What one turn is played with.

use std::thread;

use crate::transport::Transport;

/// How a reader comes to know of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Mode {
    Polling,
    Woken,
}

/// A transport, and who reads from it.
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
        }
    }
}

impl Setting {
    /// The arguments that tell a child process.
    pub(crate) fn to_args(self) -> [String; 3] {
        [self.transport.name.to_owned(), self.mode.name().to_owned(), self.readers.to_string()]
    }

    /// What a parent process told.
    pub(crate) fn from_args(args: &[&str]) -> Self {
        let [transport, mode, readers] = args else { panic!("a transport, a mode and a number of readers: {args:?}") };
        let transport = crate::CONTESTANTS.iter().find(|known| known.name == *transport);
        let mode = [Mode::Polling, Mode::Woken].into_iter().find(|known| known.name() == *mode);
        Self {
            transport: transport.expect("our parent names transports as we do"),
            mode: mode.expect("our parent names modes as we do"),
            readers: readers.parse().expect("our parent writes numbers"),
        }
    }

    /// Whether those who look all the time have to share the cores, with each other or with the publisher.
    pub(crate) fn is_crowded(self) -> bool {
        self.readers + 1 > thread::available_parallelism().map_or(1, usize::from)
    }
}

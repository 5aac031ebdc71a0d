//! The arguments of `bridge zenoh`.

use std::path::PathBuf;

use clap::{Args, ValueEnum, ValueHint};

use super::value::{rate, within};
use crate::bridge::zenoh::wire::MAX_EVERY;
use crate::bridge::zenoh::{KeyPrefix, KeyPrefixError, SessionMode, check_endpoint};

/// Arguments of `bridge zenoh`.
#[derive(Clone, Debug, Args)]
pub(crate) struct ZenohArgs {
    /// Put what comes from another host onto this instance's bus, instead of sending what is there.
    #[arg(long)]
    pub(crate) receive: bool,
    /// zenoh's own configuration, JSON5: TLS, passwords, timeouts. What it does not name stays off.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub(crate) config: Option<PathBuf>,
    /// Connect to this endpoint; again for more.
    #[arg(long, value_name = "ENDPOINT", value_parser = check_endpoint)]
    pub(crate) connect: Vec<String>,
    /// Listen on this endpoint; again for more. Loopback is heard on this machine alone.
    #[arg(long, value_name = "ENDPOINT", value_parser = check_endpoint)]
    pub(crate) listen: Vec<String>,
    /// What to be among zenoh's: a peer unless the configuration says otherwise.
    #[arg(long, value_enum)]
    pub(crate) mode: Option<Mode>,
    /// What all keys begin with [default: bench-dragon/ and the instance].
    #[arg(long, value_name = "PREFIX", value_parser = key)]
    pub(crate) key: Option<KeyPrefix>,
    /// Send one frame of so many.
    #[arg(long, value_name = "N", conflicts_with_all = ["rate", "receive"], allow_negative_numbers = true, value_parser = every)]
    pub(crate) every: Option<u64>,
    /// Send at most so many frames a second.
    #[arg(long, value_name = "HZ", conflicts_with = "receive", allow_negative_numbers = true, value_parser = rate)]
    pub(crate) rate: Option<u32>,
    /// Let whoever reaches this bridge command the server: pause, seek, stop and all else.
    #[arg(long, conflicts_with = "receive")]
    pub(crate) allow_commands: bool,
}

/// The parts that a session may play.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Mode {
    /// Talks to others directly.
    Peer,
    /// Has one router, or one peer, do so for it.
    Client,
    /// Hands on what others say as well.
    Router,
}

impl From<Mode> for SessionMode {
    fn from(mode: Mode) -> Self {
        match mode {
            Mode::Peer => Self::Peer,
            Mode::Client => Self::Client,
            Mode::Router => Self::Router,
        }
    }
}

fn key(text: &str) -> Result<KeyPrefix, KeyPrefixError> {
    text.parse()
}

fn every(text: &str) -> Result<u64, String> {
    within(text, &(1..=MAX_EVERY))
}

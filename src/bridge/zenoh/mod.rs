//! The way to other machines: a bus here, and over zenoh the same bus there.
//!
//! ```text
//! serve ──▶ bridge zenoh ──────network──────▶ bridge zenoh --receive ──▶ every client, unchanged
//!   ▲            │                                      │
//!   └─commands───┘◀──────────(--allow-commands)─────────┘◀── ctl
//! ```
//!
//! **What is sent.** Frames as they lie in shared memory ([`wire`]), all of them or a share ([`Share`]), alerts, and the
//! description, under the keys of a [`KeyPrefix`]. A liveliness token is there for as long as a source is. A [`SendingBridge`] is
//! a reader of the bus like any other: nothing that happens to it or beyond it reaches the server.
//!
//! **What is received.** A [`ReceivingBridge`] is a source like the server. Each run of the other host has a number of its own
//! here, its ticks count from 0 without a hole, and its frames are due when they came (`remote_run`); all else is bit for
//! bit what was sent. What was lost on the way is counted by the ticks there. A run whose frames stop and come again goes on
//! as the same run: its services stay, so do its readers.
//!
//! **Who waits.** Nobody. What finds no room on the way is dropped; zenoh's threads put what comes into bounded queues, and
//! one thread has the bus. A command is passed on, and answered when its answer comes.
//!
//! **Who is trusted.** Nobody: payloads are checked, rates limited, runs and queues bounded, and what is refused is counted.
//! Commands are taken only where that was asked for. Who may join at all is for zenoh's own configuration to say: TLS with
//! certificates of both sides, or passwords.

pub mod wire;

mod command_forwarder;
mod command_relay;
mod inbox;
mod key_prefix;
mod known_runs;
mod query_server;
mod rate_limit;
mod received_run;
mod receiver;
mod remote_run;
mod report;
mod sender;
mod sent_runs;
mod session;
mod session_settings;

pub use key_prefix::{KeyPrefix, KeyPrefixError};
pub use receiver::ReceivingBridge;
pub use report::{ReceiverSummary, SenderSummary, Silence, ZenohReport};
pub use sender::{SenderPorts, SenderSettings, SendingBridge};
pub use sent_runs::Share;
pub use session::{BridgeError, BridgeSession};
pub use session_settings::{DEFAULT_ENDPOINT, SessionMode, SessionSettings, Side, check_endpoint};

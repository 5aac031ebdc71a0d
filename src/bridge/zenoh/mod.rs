//! The way to other machines: a bus here, and over zenoh the same bus there.
//!
//! ```text
//! serve ──▶ bridge zenoh ──────network──────▶ bridge zenoh --receive ──▶ every client, unchanged
//!   ▲            │                                      │
//!   └─commands───┘◀──────────(--allow-commands)─────────┘◀── ctl
//! ```
//!
//! **What is sent.** Frames as they lie in shared memory ([`wire`]), all of them or a share ([`Share`]), alerts, and the
//! description, under the keys of a [`KeyPrefix`]. A liveliness token is there for as long as a source is. A [`Sender`] is
//! a reader of the bus like any other: nothing that happens to it or beyond it reaches the server.
//!
//! **What is received.** A [`Receiver`] is a source like the server. Each run of the other host has a number of its own
//! here, its ticks count from 0 without a hole, and its frames are due when they came ([`RemoteRun`]); all else is bit for
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

mod advance;
mod backlog;
mod clerk;
mod company;
mod desk;
mod error;
mod inbox;
mod keys;
mod known_runs;
mod line;
mod link;
mod link_error;
mod link_settings;
mod orders;
mod rate_limit;
mod received_run;
mod receiver;
mod relay;
mod remote_run;
mod sender;
mod sent_runs;
mod subscriptions;
mod thinning;

pub use error::BridgeError;
pub use keys::{KeyPrefix, KeyPrefixError};
pub use line::{ReceiverSummary, SenderSummary, Silence, ZenohLine};
pub use link::Link;
pub use link_error::LinkError;
pub use link_settings::{DEFAULT_ENDPOINT, LinkMode, LinkSettings, Side, check_endpoint};
pub use receiver::Receiver;
pub use remote_run::{NotNew, RemoteRun};
pub use sender::{Sender, SenderPorts, SenderSettings};
pub use thinning::{Share, Thinning};

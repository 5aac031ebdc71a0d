//! Copies of a bus on other machines, over zenoh.
//!
//! ```text
//! serve ──▶ bridge zenoh ──────network──────▶ bridge zenoh --receive ──▶ every client, unchanged
//!   ▲            │                                      │
//!   └─commands───┘◀──────────(--allow-commands)─────────┘◀── ctl
//! ```
//!
//! **Sending.** A [`SendingBridge`] sends frames as they are in shared memory ([`wire`]), all of them or a share ([`Share`]).
//! It also sends alerts and the description. The keys have a common [`KeyPrefix`]. A liveliness token exists while a source
//! exists. The bridge is an ordinary reader of the bus: a failure of the bridge or of the network does not affect the server.
//!
//! **Receiving.** A [`ReceivingBridge`] is a source like the server. Each run of the other host gets a new run id here. Its
//! ticks count from 0 without a gap, and each frame is due at its arrival (`remote_run`). All other values are identical bit
//! for bit. Frames lost on the link are counted by the other host's ticks. If frames stop and resume, the same run continues:
//! its services and their readers stay.
//!
//! **Waiting.** No thread waits for the network. Messages without room on the link are dropped. zenoh's threads put received
//! messages into bounded queues, and one thread uses the bus. A command is forwarded, and answered when the answer arrives.
//!
//! **Trust.** Other hosts are not trusted. Payloads are checked, rates are limited, runs and queues are bounded, and rejected
//! messages are counted. Commands are accepted only if a flag allows them. zenoh's own configuration controls access: TLS
//! with certificates on both sides, or passwords.

pub mod wire;

mod command_forwarder;
mod command_relay;
mod inbox;
mod key_prefix;
mod known_runs;
mod query_server;
mod received_run;
mod receiver;
mod remote_clock;
mod remote_run;
mod report;
mod sender;
mod sent_runs;
mod session;
mod session_settings;
mod tick_bound;

pub use key_prefix::{KeyPrefix, KeyPrefixError};
pub use receiver::ReceivingBridge;
pub use report::{ReceiverSummary, SenderSummary, Silence, ZenohReport};
pub use sender::{SenderPorts, SenderSettings, SendingBridge};
pub use sent_runs::Share;
pub use session::{BridgeError, BridgeSession};
pub use session_settings::{DEFAULT_ENDPOINT, SessionMode, SessionSettings, Side, check_endpoint};

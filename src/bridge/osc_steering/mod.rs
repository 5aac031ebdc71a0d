//! Steering by Open Sound Control: desks and controllers send commands to the server, and get its replies.
//!
//! | address | arguments | needs `--full` |
//! |---|---|---|
//! | `/dragon/hold`, `/pause`, `/resume` | none, or one number: 0 does nothing | no |
//! | `/dragon/speed`, `/dragon/pace` | a number | no |
//! | `/dragon/release`, `/dragon/stop` | none, or one number: 0 does nothing | yes |
//! | `/dragon/seek` | a number | yes |
//! | `/dragon/state` | none: sends the state to this sender for a minute | no |
//!
//! The [`SteeringListener`] answers with `/dragon/reply` (command, accepted, tick, reason), and sends `/dragon/state` (state, show
//! time, speed, tick) at each change and once a second.
//!
//! **Access.** Off by default. Only addresses of [`AllowedNetworks`] are read. With a [`Secret`], each message has it as its first
//! argument. Messages of strangers are counted and reported at a bounded rate, and never answered.
//!
//! **Order.** Commands go through a [`CommandQueue`](crate::command_queue::CommandQueue): a hold overtakes all others. Of the values
//! of a fader, the newest one replaces those that wait.
//!
//! **Bounds.** A packet has at most 2,048 bytes and 16 messages, a second at most 50,000 packets, a queue 8 commands, and the state
//! at most 32 receivers. The time of a bundle is not used: a command is carried out when it arrives.

mod admission;
mod listener;
mod message;
mod reply;
mod state;

pub use admission::{AllowedNetworks, Network, NetworkError, Secret, SecretError};
pub use listener::{Refused, SteeringCounts, SteeringEvent, SteeringListener, SteeringSettings};
pub(crate) use reply::encode_cue;

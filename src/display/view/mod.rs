//! The live view: one page in a browser, drawn from a stream of frames.
//!
//! - *Frames* go out as binary messages over a WebSocket ([`wire`]), never more than two that the page has not acknowledged;
//!   the next one is always the newest. So a slow browser, or a slow network, gets fewer frames and never older ones.
//! - *Commands* come in as requests that bear the token, and go out through a queue ([`CommandQueue`](crate::command_queue::CommandQueue)): in their order, a
//!   hold past all of them.
//! - *Who may:* the token is needed to steer, and off loopback to look.
//!
//! The page is in `page/`, and in the program: it needs nothing from anywhere else.

pub mod wire;

mod access;
mod assets;
mod order;
mod page_stream;
mod seats;
mod shown;
mod token;

#[expect(clippy::module_inception, reason = "what the module is about")]
mod view;

pub use seats::MAX_VIEWERS;
pub use token::{Token, TokenError};
pub use view::{View, ViewSettings};

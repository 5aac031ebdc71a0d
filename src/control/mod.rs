//! Steering: commands to the server of an instance, and their replies.
//!
//! [`call()`] sends one command and waits for its reply. A [`Desk`] is for whoever may not wait, or sends many: it keeps their
//! order, and lets a hold past all of them.

mod call;
mod desk;

pub use call::{HOLD_PATIENCE, call};
pub use desk::{Desk, DeskError};

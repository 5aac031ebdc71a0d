//! The wake word: how a source wakes all readers that wait, with one system call and none where nobody waits.

mod descriptor;
mod due;
mod page;
mod word;

pub(crate) use descriptor::WakeDescriptor;
pub(crate) use due::{DueWindow, Polled, poll_when_due};
pub use page::WakePage;
pub(crate) use word::wait;

//! Code that several tests share: waits with a deadline, processes of the program, Python, random
//! properties, and skipped tests.

pub mod eventually;
mod list;
pub mod process;
pub mod property;
pub mod pytest;
pub mod skip;

//! Code that several tests share: waits with a deadline, processes of the program, Python, and skipped tests.

pub mod eventually;
pub mod process;
pub mod pytest;
pub mod skip;

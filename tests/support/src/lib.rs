//! What several tests share: waits with a deadline, processes of the program, Python, and tests that are skipped.

pub mod eventually;
pub mod process;
pub mod pytest;
pub mod skip;

//! Code that several tests share: waits with a deadline, generated files, executable files, processes of the program and the
//! children of a show, Python, random properties, dragons and their poses, and skipped tests.

pub mod children;
pub mod dragons;
pub mod eventually;
pub mod executable;
pub mod foreign_form;
pub mod hills;
mod list;
pub mod process;
pub mod property;
pub mod pytest;
pub mod skip;

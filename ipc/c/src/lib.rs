//! The bench dragon's bus for C, C++17 and whatever calls C.
//!
//! A thin face of [`bench_dragon_ipc`]: each function checks what it is given, calls the Rust client and puts its answer into
//! a [`result::bd_result_t`]. The contract in words is the head of the header, `include/bench_dragon.h`, which cbindgen
//! generates from these files; names here are those of C, so that either is found from the other.
//!
//! What is unsafe, and why it is not:
//!
//! - *Pointers from C* come in as references that may be missing, which is what a C pointer is where the contract is kept.
//! - *Frames* point into shared memory that the reader behind them keeps mapped ([`frames`]).
//! - *Threads*: iceoryx2 counts references to a port without atomics, so a port never leaves its lock
//!   (`confined::Confined`).
//! - *Panics* end in an error code ([`result`]), never in C.

#![allow(unsafe_code, reason = "functions are exported to C, frames are lent to it")]
#![allow(non_camel_case_types, reason = "types have their C names")]

pub mod alert;
pub mod bench;
pub mod command;
pub mod continuity;
pub mod description;
pub mod dragon;
pub mod frame;
pub mod frames;
pub mod result;
pub mod status;

mod confined;
mod layout;
mod patience;

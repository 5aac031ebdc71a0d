//! The bench dragon's bus for C, C++17 and every language that calls C.
//!
//! A thin layer over [`bench_dragon_ipc`]: each function checks its arguments, calls the Rust client and returns a
//! [`result::bd_result_t`]. The contract in words is at the top of the header, `include/bench_dragon.h`, which cbindgen
//! generates from these files. Names here are those of the header.
//!
//! Unsafe parts, and why they are sound:
//!
//! - *Pointers from C* are optional references. A C pointer is one if the caller keeps the contract.
//! - *Clients* are numbers in the place of pointers, so a closed one is an error ([`show`]).
//! - *Headers of frames* are passed on as types of the same layout ([`frame`]).
//! - *Panics* become an error code ([`result`]) and never reach C.

#![allow(unsafe_code, reason = "functions are exported to C, frames are lent to it")]
#![allow(non_camel_case_types, reason = "types have their C names")]

pub mod alert;
pub mod bench;
pub mod command;
pub mod command_event;
pub mod continuity;
pub mod description;
pub mod frame;
pub mod frames;
pub mod result;
pub mod show;
pub mod status;

mod layout;

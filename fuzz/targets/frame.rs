#![no_main]
//! Fuzz target `frame`. `tests/hostile_input/frame.rs` defines the properties that must hold.

#[path = "../../tests/hostile_input/frame.rs"]
mod frame;

libfuzzer_sys::fuzz_target!(|input: &[u8]| frame::check(input));

#![no_main]
//! `frame`: see `tests/hostile_input`, which has what must hold.

#[path = "../../tests/hostile_input/frame.rs"]
mod frame;

libfuzzer_sys::fuzz_target!(|input: &[u8]| frame::check(input));

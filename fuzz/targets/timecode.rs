#![no_main]
//! Fuzz target `timecode`. `tests/hostile_input/timecode.rs` defines the properties that must hold.

#[path = "../../tests/hostile_input/timecode.rs"]
mod timecode;

libfuzzer_sys::fuzz_target!(|input: &[u8]| timecode::check(input));

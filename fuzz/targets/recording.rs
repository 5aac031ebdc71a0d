#![no_main]
//! Fuzz target `recording`. `tests/hostile_input/recording.rs` defines the properties that must hold.

#[path = "../../tests/hostile_input/recording.rs"]
mod recording;

libfuzzer_sys::fuzz_target!(|input: &[u8]| recording::check(input));

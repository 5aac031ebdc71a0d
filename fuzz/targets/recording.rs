#![no_main]
//! `recording`: see `tests/hostile_input`, which has what must hold.

#[path = "../../tests/hostile_input/recording.rs"]
mod recording;

libfuzzer_sys::fuzz_target!(|input: &[u8]| recording::check(input));

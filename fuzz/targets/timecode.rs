#![no_main]
//! `timecode`: see `tests/hostile_input`, which has what must hold.

#[path = "../../tests/hostile_input/timecode.rs"]
mod timecode;

libfuzzer_sys::fuzz_target!(|input: &[u8]| timecode::check(input));

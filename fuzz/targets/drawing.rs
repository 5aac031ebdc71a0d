#![no_main]
//! Fuzz target `drawing`. `tests/hostile_input/drawing.rs` defines the properties that must hold.

#[path = "../../tests/hostile_input/drawing.rs"]
mod drawing;

libfuzzer_sys::fuzz_target!(|input: &[u8]| drawing::check(input));

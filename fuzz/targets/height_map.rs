#![no_main]
//! Fuzz target `height_map`. `tests/hostile_input/height_map.rs` defines the properties that must hold.

#[path = "../../tests/hostile_input/height_map.rs"]
mod height_map;

libfuzzer_sys::fuzz_target!(|input: &[u8]| height_map::check(input));

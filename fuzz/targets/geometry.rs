#![no_main]
//! `geometry`: see `tests/hostile_input`, which has what must hold.

#[path = "../../tests/hostile_input/config.rs"]
mod config;
#[path = "../../tests/hostile_input/geometry.rs"]
mod geometry;

libfuzzer_sys::fuzz_target!(|input: &[u8]| geometry::check(input));

#![no_main]
//! Fuzz target `geometry`. `tests/hostile_input/geometry.rs` defines the properties that must hold.

#[path = "../../tests/hostile_input/config.rs"]
mod config;
#[path = "../../tests/hostile_input/geometry.rs"]
mod geometry;

libfuzzer_sys::fuzz_target!(|input: &[u8]| geometry::check(input));

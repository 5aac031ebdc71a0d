#![no_main]
//! Fuzz target `config`. `tests/hostile_input/config.rs` defines the properties that must hold.

#[path = "../../tests/hostile_input/config.rs"]
mod config;

libfuzzer_sys::fuzz_target!(|input: &[u8]| config::check(input));

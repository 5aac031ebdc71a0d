#![no_main]
//! `config`: see `tests/hostile_input`, which has what must hold.

#[path = "../../tests/hostile_input/config.rs"]
mod config;

libfuzzer_sys::fuzz_target!(|input: &[u8]| config::check(input));

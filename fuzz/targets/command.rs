#![no_main]
//! Fuzz target `command`. `tests/hostile_input/command.rs` defines the properties that must hold.

#[path = "../../tests/hostile_input/command.rs"]
mod command;

libfuzzer_sys::fuzz_target!(|input: &[u8]| command::check(input));

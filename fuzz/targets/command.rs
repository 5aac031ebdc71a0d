#![no_main]
//! `command`: see `tests/hostile_input`, which has what must hold.

#[path = "../../tests/hostile_input/command.rs"]
mod command;

libfuzzer_sys::fuzz_target!(|input: &[u8]| command::check(input));

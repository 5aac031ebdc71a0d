//! Input from outside may be arbitrary: a configuration, a drawing, a command, a message of a recording, a recording, timecode.
//!
//! Each file checks the properties of every input of a kind. The fuzz targets (`fuzz/run`) search for an input that violates
//! them. This test checks a small corpus: the seeds and the findings of the fuzz targets.

mod command;
mod config;
mod drawing;
mod frame;
mod geometry;
mod recording;
mod timecode;

use std::fs;
use std::panic::catch_unwind;
use std::path::Path;

/// Checks every input of a kind.
fn check_corpus(kind: &str, check: fn(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hostile_input/corpus").join(kind);
    let inputs = fs::read_dir(&folder).expect("the corpus").map(|entry| entry.expect("an input").path());
    let mut inputs: Vec<_> = inputs.collect();
    inputs.sort();
    assert!(!inputs.is_empty(), "{} has inputs", folder.display());
    for input in inputs {
        let bytes = fs::read(&input).expect("a readable input");
        assert!(catch_unwind(|| check(&bytes)).is_ok(), "{}", input.display());
    }
}

#[test]
fn any_configuration_is_written_back_unchanged_or_refused_in_one_line() {
    check_corpus("config", config::check);
}

#[test]
fn a_drawing_is_followed_within_its_tolerance_or_refused_in_one_line() {
    check_corpus("drawing", drawing::check);
}

#[test]
fn a_configuration_of_any_numbers_is_refused_or_its_dragon_can_walk() {
    check_corpus("geometry", geometry::check);
}

#[test]
fn commands_of_any_bits_leave_the_motion_within_its_run() {
    check_corpus("command", command::check);
}

#[test]
fn a_message_is_read_as_a_frame_with_the_same_bits_or_rejected() {
    check_corpus("frame", frame::check);
}

#[test]
fn a_recording_is_read_up_to_its_damage_and_repair_keeps_these_frames() {
    check_corpus("recording", recording::check);
}

#[test]
fn timecode_of_any_bytes_leaves_the_show_within_its_run() {
    check_corpus("timecode", timecode::check);
}

//! Input from outside may be arbitrary: a configuration, a drawing, a height map, a command, a message of a recording,
//! a recording, timecode.
//!
//! Each file checks the properties of every input of a kind. The fuzz targets (`fuzz/run`) search for an input that violates
//! them. This test checks a small corpus: the seeds and the findings of the fuzz targets.

mod command;
mod config;
mod drawing;
mod frame;
mod geometry;
mod height_map;
mod recording;
mod timecode;

use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};

use test_support::property::case_count;

/// Number of damaged forms of an input, and of bytes that are changed in one.
const DAMAGES: u32 = 2000;
const MAX_DAMAGED_BYTES: usize = 4;

/// Checks every input of a kind.
fn check_corpus(kind: &str, check: fn(&[u8])) {
    for (path, bytes) in corpus(kind) {
        check_one(&path, &bytes, check);
    }
}

/// Checks every beginning of every input of a kind, and random changes of some of its bytes.
fn check_damaged_corpus(kind: &str, damages: u32, check: fn(&[u8])) {
    let mut random = fastrand::Rng::with_seed(7);
    for (path, bytes) in corpus(kind) {
        for len in 0..bytes.len() {
            check_one(&path, &bytes[..len], check);
        }
        for _ in 0..damages {
            let mut damaged = bytes.clone();
            for _ in 0..random.usize(1..=MAX_DAMAGED_BYTES) {
                // The first byte selects the format.
                damaged[random.usize(1..bytes.len())] = random.u8(..);
            }
            check_one(&path, &damaged, check);
        }
    }
}

fn check_one(path: &Path, bytes: &[u8], check: fn(&[u8])) {
    assert!(catch_unwind(|| check(bytes)).is_ok(), "{}: {bytes:?}", path.display());
}

/// The inputs of a kind.
fn corpus(kind: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/hostile_input/corpus").join(kind);
    let inputs = fs::read_dir(&folder).expect("the corpus").map(|entry| entry.expect("an input").path());
    let mut inputs: Vec<_> = inputs.collect();
    inputs.sort();
    assert!(!inputs.is_empty(), "{} has inputs", folder.display());
    inputs.into_iter().map(|path| (path.clone(), fs::read(&path).expect("a readable input"))).collect()
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
fn a_height_map_has_heights_in_their_range_or_is_refused_in_one_line() {
    check_corpus("height_map", height_map::check);
}

#[test]
fn a_damaged_height_map_has_heights_in_their_range_or_is_refused_in_one_line() {
    check_damaged_corpus("height_map", case_count(DAMAGES), height_map::check);
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

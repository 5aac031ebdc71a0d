//! Recordings: what is recorded comes back bit for bit, whatever happens to the recorder, the file or the disk.

mod dance;
#[path = "../processes/eventually.rs"]
#[allow(dead_code, reason = "these tests use a part of it")]
mod eventually;
mod full_disk;
mod in_place;
mod kill;
mod lossless;
#[path = "../processes/process.rs"]
#[allow(dead_code, reason = "these tests use a part of it")]
mod process;
#[path = "../processes/pytest.rs"]
#[allow(dead_code, reason = "these tests use a part of it")]
mod pytest;
mod python;
mod repair;
mod rotation;
#[path = "../processes/skip.rs"]
#[allow(dead_code, reason = "these tests use a part of it")]
mod skip;
mod verify;

//! Recordings: recorded frames are read back bit for bit, whatever happens to the recorder, the file or the disk.

mod dance;
mod dragons;
mod full_disk;
mod in_place;
mod kill;
mod lossless;
mod parts;
mod python;
mod repair;
mod rotation;
mod verify;

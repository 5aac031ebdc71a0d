//! Real-time motion server for the bench dragon: 223 hinged benches led along a route.
//!
//! | room | what is in it |
//! |---|---|
//! | [`source`] | what publishes frames: the server, a replay, and timecode that steers them |
//! | [`safety`] | the monitor of clearances and contacts, and the guard |
//! | [`recording`] | MCAP files: writing, repair, reading, export |
//! | [`bridge`] | frames for lighting desks, media servers and other machines |
//! | [`display`] | what people look at: browser page, terminal view, metrics |
//! | [`command_queue`] | commands to a server, one at a time and in their order, and holds past all others |
//! | [`output`] | tables, figures, histograms, the log, and how they are printed |
//! | [`config`] | the validated TOML document |
//! | [`system`] | clocks, processors, signals, limits, whole files |
//! | `command` | a file for each command, with its arguments, and the program's `main` |
//!
//! A room uses only rooms below it; `tests/rooms.rs` has the order. The mathematics is the crate `bench_dragon_geometry`, the bus `bench_dragon_ipc`.

pub mod bridge;
mod command;
pub mod command_queue;
pub mod config;
pub mod display;
pub mod output;
pub mod recording;
pub mod safety;
pub mod source;
pub mod system;

pub use command::{RecordLine, RecordSummary, ServeLine, main};

//! Real-time motion server for the bench dragon: 223 hinged benches led along a route.
//!
//! | room | contents |
//! |---|---|
//! | [`source`] | publishers of frames: the server and the replay; timecode, which steers the server |
//! | [`safety`] | the monitor of clearances and contacts, and the guard |
//! | [`recording`] | MCAP files: writing, repair, reading, export |
//! | [`bridge`] | frames for lighting desks, media servers and other machines |
//! | [`display`] | views for people: browser page, terminal view, metrics |
//! | [`command_queue`] | commands to a server, one at a time and in order; holds overtake all others |
//! | `hand_over` | a plan as files: page, paper, floor, sheets, tables |
//! | [`output`] | tables, figures, histograms, the log, and their printing |
//! | [`config`] | the validated TOML document |
//! | [`drawing`] | routes that are drawn, in SVG, DXF, CSV, GPX, KML and GeoJSON files |
//! | [`height_map`] | heights of the ground, in GeoTIFF, ESRI ASCII and PNG files |
//! | [`system`] | clocks, processors, signals, limits, input files, whole files |
//! | `cli` | one file per subcommand, with its arguments, and the program's `main` |
//!
//! The rooms depend on each other in one direction only; `tests/rooms.rs` lists the order and checks it. The mathematics is in
//! the crate `bench_dragon_geometry`, the bus in `bench_dragon_ipc`.

pub mod bridge;
mod cli;
pub mod command_queue;
pub mod config;
pub mod display;
pub mod drawing;
mod hand_over;
pub mod height_map;
pub mod output;
pub mod recording;
pub mod safety;
pub mod source;
pub mod system;

/// The pure parts of the supervision by `show`: when a child is restarted, and how a restarted server continues.
pub mod supervision {
    pub use crate::cli::{
        LEAST_ROOM_BYTES, LONGEST_DISK_SILENCE, LONGEST_LOOK, LONGEST_SILENCE, LastSeen, Liveness, Look, MAX_RESTARTS,
        Phase, Resumption, ResumptionSettings, run_start,
    };
}

pub use cli::{RecordLine, RecordSummary, ServeLine, main};

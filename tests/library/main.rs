//! Public modules of the library, as a client uses them: one file per module.

mod art_net;
mod bench_selection;
mod command_words;
mod follower;
mod height_map;
mod hill;
mod histogram;
mod interval_search;
mod osc;
mod osc_timecode;
mod outage;
mod playback_clock;
mod psn;
mod schedule;
mod stage_transform;
mod table;
mod timecode;
#[cfg(feature = "zenoh")]
mod zenoh;

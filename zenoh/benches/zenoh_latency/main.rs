//! The program's bench `latency` with two more contestants: zenoh over TCP, and over zenoh's shared memory.
#![allow(clippy::print_stdout, reason = "a bench prints")]

#[path = "../../../benches/shared/mod.rs"]
mod shared;

#[path = "../../../benches/latency/arrival.rs"]
mod arrival;
#[path = "../../../benches/latency/contest.rs"]
mod contest;
#[path = "../../../benches/latency/frame_bytes.rs"]
mod frame_bytes;
#[path = "../../../benches/latency/frame_source.rs"]
mod frame_source;
#[path = "../../../benches/latency/outcome.rs"]
mod outcome;
#[path = "../../../benches/latency/process.rs"]
mod process;
#[path = "../../../benches/latency/publishing.rs"]
mod publishing;
#[path = "../../../benches/latency/reading.rs"]
mod reading;
#[path = "../../../benches/latency/scores.rs"]
mod scores;
#[path = "../../../benches/latency/setting.rs"]
mod setting;
#[path = "../../../benches/latency/transport/mod.rs"]
mod transport;

mod zenoh;

use transport::{BARE, OURS, SEQLOCK, Transport, UDP, UNIX};

/// The contestants. Ours must be first.
static CONTESTANTS: [Transport; 7] = [OURS, BARE, SEQLOCK, UNIX, UDP, zenoh::TCP, zenoh::SHARED_MEMORY];

fn main() {
    contest::play_part("zenoh_latency");
    zenoh::clear_up();
}

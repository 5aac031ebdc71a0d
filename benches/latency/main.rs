//! How long a frame takes from one process to another, side by side: our server and subscriber, a bare iceoryx2 publisher
//! and subscriber, a Unix stream socket and UDP on loopback. The bench `zenoh_latency` adds zenoh.
//!
//! The frame is that of the paper's dragon, 224 handles and a header: 10,824 bytes, a thousand times a second. Publisher
//! and readers are processes of their own. Ours is `bench-dragon serve`; the others have its schedule, its sleep and its
//! computation of the frame, so that they differ in the transport alone. Each is timed up to the instant at which a
//! reader has read every handle, from two instants that the header carries: from *due*, when the tick was to begin, so
//! that a stalled publisher is not hidden, and from *sent*, when the frame was ready and handed to the transport.
//!
//! A *polling* reader looks for the next frame all the time; where readers and publisher are more than the cores, it
//! yields its core after each look, and what is measured then is mostly the kernel's dealing out of cores. A *woken* one
//! sleeps in the kernel until there is something.
//!
//! Contestants take turns of half a second each, several times over. A turn counts only if every frame in it was right: a
//! reader sums up what it reads, and after the turn holds each frame's sums against the exact solver. Percentiles are of
//! all turns together; a ratio is the median of the turns' ratios.
#![allow(clippy::print_stdout, reason = "a bench prints")]

#[path = "../shared/mod.rs"]
mod shared;

mod arrival;
mod contest;
mod frame_bytes;
mod frame_source;
mod outcome;
mod process;
mod publishing;
mod reading;
mod scores;
mod setting;
mod transport;

use transport::{BARE, OURS, Transport, UDP, UNIX};

/// Ours comes first.
static CONTESTANTS: [Transport; 4] = [OURS, BARE, UNIX, UDP];

fn main() {
    contest::play_part("latency");
}

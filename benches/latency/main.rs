//! Measures the latency of a frame from one process to another for several transports: our server and subscriber, a bare
//! iceoryx2 publisher and subscriber, a seqlock ring in shared memory as the physical limit (polling only), a Unix stream socket and UDP
//! on loopback. The bench `zenoh_latency` adds zenoh.
//!
//! The frame is that of the paper's dragon, 224 handles and a header: 10,824 bytes, a thousand times per second. The publisher
//! and each reader are separate processes. Our publisher is `bench-dragon serve`. The others use the same schedule, sleep and
//! computation of the frame, so only the transport differs. Latency ends when a reader has read every handle. It counts
//! from two instants in the header. *Due* is when the tick should begin, so a stalled publisher stays visible. *Sent* is when
//! the publisher passes the finished frame to the transport.
//!
//! A *polling* reader checks for the next frame in a busy loop. If readers and publisher outnumber the cores, it yields its
//! core after each check; the result then mostly measures the kernel's scheduler. A *woken* reader sleeps in the kernel until
//! a frame arrives. A reader by the *clock* sleeps until 100 µs before a frame is due, and polls until it arrives; only ours knows
//! when frames are due, the others are woken in that contest.
//!
//! Contestants take turns of half a second each, for several rounds. A turn counts only if all its frames are right: a reader
//! sums the values of each frame, and compares the sums with the exact solver after the turn. Percentiles cover all turns
//! together; a ratio is the median of the turns' ratios.
//!
//! Then follow the latency of a command (see `command`) and of GO (see `go`). `cargo bench --bench latency -- command` and `-- go`
//! measure these alone.
#![allow(clippy::print_stdout, reason = "a bench prints")]

#[path = "../shared/mod.rs"]
mod shared;

mod arrival;
mod command;
mod contest;
mod frame_bytes;
mod frame_source;
mod go;
mod outcome;
mod process;
mod publishing;
mod reading;
mod scores;
mod setting;
mod transport;

use transport::{BARE, OURS, SEQLOCK, Transport, UDP, UNIX};

/// The contestants. Ours must be first.
static CONTESTANTS: [Transport; 5] = [OURS, BARE, SEQLOCK, UNIX, UDP];

fn main() {
    let args: Vec<String> = std::env::args().skip(1).collect();
    match args.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [command::ANSWER, place, habit] => command::answer(place, habit),
        [command::COMMAND, ..] => command::measure(),
        [go::GO, ..] => go::measure(),
        [process::PUBLISH | process::READ, ..] => contest::play_part("latency"),
        _ => {
            contest::play_part("latency");
            command::measure();
            go::measure();
        }
    }
}

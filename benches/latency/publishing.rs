//! The loop of a publishing process: the server's schedule and sleep, with any transport.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;

use bench_dragon::source::server::schedule::Schedule;
use bench_dragon::system::clock::{monotonic_ns, sleep_precisely, sleep_until};
use bench_dragon_ipc::{FrameHeader, HandleState};

use crate::frame_source::{FrameSource, RATE_HZ};

const LEAD_NS: u64 = 1_000_000;

/// The publisher's end of a transport.
pub(crate) trait Sender {
    /// Sends one frame. `fill` writes the handles and returns the header. The sender adds the instant of sending.
    fn send(&mut self, fill: impl FnOnce(&mut [HandleState]) -> FrameHeader);
}

/// Prints the name or address of this publisher for the parent, which then starts the readers.
pub(crate) fn announce(place: &str) {
    println!("{place}");
}

/// Sends frame after frame until the parent closes our stdin.
pub(crate) fn publish(mut sender: impl Sender) {
    let (over, mut source) = (at_end_of_stdin(), FrameSource::new());
    sleep_precisely();
    let mut schedule = Schedule::new(monotonic_ns() + LEAD_NS, RATE_HZ);
    while !over.load(Ordering::Relaxed) {
        while !sleep_until(schedule.due_ns()) {}
        sender.send(|handles| source.fill(handles, schedule.due_ns()));
        schedule.advance(monotonic_ns());
    }
}

fn at_end_of_stdin() -> Arc<AtomicBool> {
    let over = Arc::new(AtomicBool::new(false));
    let flag = Arc::clone(&over);
    thread::spawn(move || {
        // The end of stdin, with or without an error, ends publishing.
        let _ = io::copy(&mut io::stdin(), &mut io::sink());
        flag.store(true, Ordering::Relaxed);
    });
    over
}

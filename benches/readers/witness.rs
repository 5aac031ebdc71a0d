//! A reader that takes from each frame's stamps how long after its release it was sent.

use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_ipc::FrameSubscriber;

use crate::program::Program;

/// How often it looks: the bus keeps two hundred frames for it.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// The reader. It polls, so that it costs the server nothing.
#[derive(Debug)]
pub(crate) struct Witness(FrameSubscriber);

impl Witness {
    pub(crate) fn join(server: &Program) -> Self {
        Self(FrameSubscriber::open(server.domain(), "witness").expect("the server is there"))
    }

    /// The delays of a phase in microseconds, sorted.
    pub(crate) fn watch(&mut self, phase: Duration) -> Vec<f64> {
        self.watch_while(phase, || {})
    }

    /// The same while something else is done again and again.
    pub(crate) fn watch_while(&mut self, phase: Duration, mut act: impl FnMut()) -> Vec<f64> {
        // What was sent before belongs to another phase.
        self.0.latest().expect("the bus is readable");
        let mut delays = Vec::new();
        let begun = Instant::now();
        while begun.elapsed() < phase {
            act();
            while let Some(frame) = self.0.receive().expect("the bus is readable") {
                let header = frame.header();
                delays.push((header.published_ns - header.scheduled_ns) as f64 * 1e-3);
            }
            thread::sleep(LOOK_PERIOD);
        }
        assert!(!delays.is_empty(), "the server publishes");
        delays.sort_by(f64::total_cmp);
        delays
    }

    /// Frames that it never got.
    pub(crate) fn lost(&self) -> u64 {
        self.0.lost()
    }
}

//! A reader that computes each frame's delay from its due instant to its sending, from the times in its header.

use std::thread;
use std::time::{Duration, Instant};

use bench_dragon_ipc::FrameSubscriber;

use crate::program::Program;

/// Period of polling. The bus buffers two hundred frames for a reader, so none is lost.
const LOOK_PERIOD: Duration = Duration::from_millis(5);

/// The reader. It polls, so the server does not have to wake it.
#[derive(Debug)]
pub(crate) struct Witness(FrameSubscriber);

impl Witness {
    pub(crate) fn join(server: &Program) -> Self {
        Self(FrameSubscriber::open(server.domain(), "witness").expect("the server is running"))
    }

    /// Returns the delays of a phase in microseconds, sorted.
    pub(crate) fn watch(&mut self, phase: Duration) -> Vec<f64> {
        self.watch_while(phase, || {})
    }

    /// Returns the delays of a phase in microseconds, sorted, and calls `act` repeatedly during the phase.
    pub(crate) fn watch_while(&mut self, phase: Duration, mut act: impl FnMut()) -> Vec<f64> {
        // Skips frames that were sent before this phase.
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

    /// Number of frames that the witness lost.
    pub(crate) fn lost(&self) -> u64 {
        self.0.lost()
    }
}

//! The newest frame, copied out of shared memory, so that a bridge holds on to nothing of a server that is gone.

use bench_dragon_ipc::{BenchState, Frame, FrameHeader};

use super::freshness::Freshness;

/// What a bridge tells at one release.
#[derive(Clone, Debug)]
pub struct Snapshot {
    /// The frame's header.
    pub header: FrameHeader,
    /// The benches, head first.
    pub benches: Vec<BenchState>,
    /// Whether the frame may still be believed.
    pub freshness: Freshness,
}

impl Snapshot {
    /// Copies a frame that has just been read.
    pub fn of(frame: &Frame) -> Self {
        Self { header: *frame.header(), benches: frame.benches().collect(), freshness: Freshness::Fresh }
    }

    /// The same with another frame, in the same memory.
    pub fn replace(&mut self, frame: &Frame) {
        self.header = *frame.header();
        self.benches.clear();
        self.benches.extend(frame.benches());
        self.freshness = Freshness::Fresh;
    }

    /// What turns a speed per show second into one that is told: the time scale, or 0 where the frame is stale.
    pub fn speed_factor(&self) -> f64 {
        if self.freshness.is_fresh() { self.header.time_scale } else { 0.0 }
    }
}

//! Continuity of frames: whether a frame directly follows the previous one.

use crate::wire::FrameHeader;

/// Relation of a frame to the previously received one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuity {
    /// The first frame that this reader has received.
    First,
    /// The next tick of the same run.
    Next,
    /// The same run, but this many frames between the two did not reach the reader.
    Lost(u64),
    /// Another run: the source was restarted. The number of frames lost from either run is unknown.
    Restarted,
}

/// Tracks `run_id` and `tick` from frame to frame.
///
/// ```
/// use bench_dragon_ipc::{Continuity, ContinuityTracker, FrameHeader};
///
/// let mut tracker = ContinuityTracker::default();
/// let frame = |run_id, tick| FrameHeader { run_id, tick, ..FrameHeader::default() };
/// assert_eq!(tracker.track(&frame(7, 100)), Continuity::First);
/// assert_eq!(tracker.track(&frame(7, 101)), Continuity::Next);
/// assert_eq!(tracker.track(&frame(7, 105)), Continuity::Lost(3));
/// assert_eq!(tracker.track(&frame(8, 0)), Continuity::Restarted);
/// assert_eq!(tracker.lost(), 3);
/// ```
#[derive(Clone, Copy, Debug, Default)]
pub struct ContinuityTracker {
    last: Option<(u64, u64)>,
    lost: u64,
}

impl ContinuityTracker {
    /// Takes the next frame's header and returns its relation to the previous frame.
    pub fn track(&mut self, header: &FrameHeader) -> Continuity {
        let continuity = match self.last {
            None => Continuity::First,
            Some((run_id, _)) if run_id != header.run_id => Continuity::Restarted,
            Some((_, tick)) => match header.tick.saturating_sub(tick) {
                0 | 1 => Continuity::Next,
                step => Continuity::Lost(step - 1),
            },
        };
        if let Continuity::Lost(frames) = continuity {
            self.lost += frames;
        }
        self.last = Some((header.run_id, header.tick));
        continuity
    }

    /// Number of frames lost since the first one, over all runs.
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

//! Whether a frame follows on the one before it.

use crate::frame::FrameHeader;

/// How a frame stands to the one received before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Continuity {
    /// The first frame that this reader has received.
    First,
    /// The next tick of the same run.
    Next,
    /// The same run, but this many frames between the two never reached the reader.
    Lost(u64),
    /// Another run: the source was started again. What the reader lost of either run is not known.
    Restarted,
}

/// Follows `run_id` and `tick` from frame to frame.
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
    /// Takes the next frame's header and says how it stands to the one before.
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

    /// Frames lost since the first one, over all runs.
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

//! Local ticks for a run of another host, without gaps.
//!
//! Pure. A gap in the ticks means to a reader that the reader itself lost frames. Frames lost on the link are counted here.

use std::collections::VecDeque;

use super::wire::Described;

/// Most remote ticks that are remembered with their local ticks: about four seconds at the usual rate.
const REMEMBERED: usize = 4096;

/// A run of another host.
#[derive(Clone, Debug)]
pub(super) struct RemoteRun {
    /// The run's description, which another sender may change.
    pub(super) described: Described,
    /// Remote ticks of the last frames, the newest last.
    there: VecDeque<u64>,
    /// Local tick of the next frame: the number of frames so far.
    pub(super) next_tick: u64,
    /// Frames that the sender selected between the first and the last frame, but that did not arrive.
    pub(super) lost: u64,
}

impl RemoteRun {
    pub(super) fn new(described: Described) -> Self {
        Self { described, there: VecDeque::with_capacity(REMEMBERED), next_tick: 0, lost: 0 }
    }

    /// Returns the remote tick of the last frame.
    pub(super) fn last_tick(&self) -> Option<u64> {
        self.there.back().copied()
    }

    /// Counts a frame and returns its local tick. Returns `None` and changes nothing if the frame has already arrived, or is
    /// older than the last frame.
    pub(super) fn take(&mut self, tick: u64) -> Option<u64> {
        if let Some(&last) = self.there.back() {
            if tick <= last {
                return None;
            }
            let every = self.described.every;
            // Selected ticks since the last frame. A frame that changes the state is sent in addition to these.
            let due = tick / every - last / every;
            self.lost = self.lost.saturating_add(due - u64::from(tick.is_multiple_of(every)));
        }
        if self.there.len() == REMEMBERED {
            self.there.pop_front();
        }
        self.there.push_back(tick);
        self.next_tick += 1;
        Some(self.next_tick - 1)
    }

    /// Returns the first local tick at or after a remote tick. For a future tick it assumes that no more frames are lost.
    pub(super) fn tick_here(&self, tick: u64) -> u64 {
        let index = self.there.partition_point(|&there| there < tick);
        let first = self.next_tick - self.there.len() as u64;
        let ahead = match self.there.back() {
            Some(&last) if index == self.there.len() => {
                let every = self.described.every;
                tick.div_ceil(every).saturating_sub(last / every + 1)
            }
            _ => 0,
        };
        first.saturating_add(index as u64).saturating_add(ahead)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::*;

    fn run(every: u64) -> RemoteRun {
        RemoteRun::new(Described { run_id: 1, every, rate_hz: 1000 })
    }

    #[test]
    fn local_ticks_have_no_gap_and_lost_frames_are_counted() {
        let mut run = run(1);
        let here: Vec<_> = [100, 101, 105, 106].into_iter().map(|tick| run.take(tick)).collect();
        assert_eq!(here, [Some(0), Some(1), Some(2), Some(3)]);
        assert_eq!((run.lost, run.next_tick), (3, 4));
    }

    #[test]
    fn a_repeated_or_late_frame_changes_nothing() {
        let mut run = run(1);
        assert_eq!(run.take(7), Some(0));
        assert_eq!((run.take(7), run.take(3)), (None, None));
        assert_eq!((run.take(8), run.lost), (Some(1), 0));
    }

    #[test]
    fn frames_that_were_not_selected_are_not_lost() {
        let mut run = run(10);
        // 23 and 31 are changes of the state.
        for tick in [10, 20, 23, 30, 31, 40] {
            assert!(run.take(tick).is_some());
        }
        assert_eq!(run.lost, 0);
        assert!(run.take(70).is_some(), "50 and 60 are missing");
        assert_eq!(run.lost, 2);
        assert!(run.take(85).is_some(), "80 is missing");
        assert_eq!(run.lost, 3);
    }

    #[test]
    fn a_remote_tick_has_a_local_tick() {
        let mut run = run(10);
        assert_eq!(run.tick_here(55), 0, "before the first frame");
        for tick in [100, 110, 130, 140] {
            assert!(run.take(tick).is_some());
        }
        let here: Vec<_> = [99, 100, 101, 110, 115, 130, 140].into_iter().map(|tick| run.tick_here(tick)).collect();
        assert_eq!(here, [0, 0, 1, 1, 2, 2, 3]);
        let ahead: Vec<_> = [141, 150, 151, 170].into_iter().map(|tick| run.tick_here(tick)).collect();
        assert_eq!(ahead, [4, 4, 5, 6]);
    }

    #[test]
    fn the_number_of_remembered_ticks_is_bounded() {
        let mut run = run(1);
        for tick in 0..3 * REMEMBERED as u64 {
            assert_eq!(run.take(tick), Some(tick));
        }
        assert_eq!(run.there.len(), REMEMBERED);
        assert_eq!(run.tick_here(3 * REMEMBERED as u64 - 1), 3 * REMEMBERED as u64 - 1);
        assert_eq!(run.tick_here(0), 2 * REMEMBERED as u64, "the oldest remembered tick");
    }

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn no_sequence_of_ticks_panics(ticks: Vec<u64>, every in 1_u64..=u64::MAX, asked: u64) {
            let mut run = run(every);
            for tick in ticks {
                let next = run.next_tick;
                prop_assert_eq!(run.take(tick).unwrap_or(next), next);
                prop_assert!(run.tick_here(tick) < run.next_tick);
            }
            let _ = run.tick_here(asked);
        }
    }
}

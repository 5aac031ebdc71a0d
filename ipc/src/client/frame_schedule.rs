//! When the next frame is due, according to the frames that a reader has read.

use crate::wire::FrameHeader;

/// Number of frames missed one after the other, after which a reader no longer waits by the clock: its processor is too busy.
const MOST_MISSES: u32 = 8;
/// Number of frames for which it then lets the source wake it.
const REST: u32 = 100;

/// The schedule of a source.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrameSchedule {
    last: LastFrame,
    /// Least distance of two successive frames of the run, in nanoseconds; 0 until it is known. A frame after missed periods is
    /// further away.
    period_ns: u64,
    misses: u32,
    rest: u32,
}

/// Run, number and due instant of a frame.
#[derive(Clone, Copy, Debug, Default)]
struct LastFrame {
    run_id: u64,
    tick: u64,
    due_ns: u64,
}

impl FrameSchedule {
    /// Takes the next frame's header.
    pub(crate) fn note(&mut self, header: &FrameHeader) {
        let LastFrame { run_id, tick, due_ns } = self.last;
        if run_id != header.run_id {
            self.period_ns = 0;
        } else if header.tick == tick + 1 && header.scheduled_ns > due_ns {
            let period_ns = header.scheduled_ns - due_ns;
            self.period_ns = if self.period_ns == 0 { period_ns } else { self.period_ns.min(period_ns) };
        }
        self.last = LastFrame { run_id: header.run_id, tick: header.tick, due_ns: header.scheduled_ns };
    }

    /// The instant at which the next frame is due, in nanoseconds of `CLOCK_MONOTONIC`. `None` if it is not known, or if the reader
    /// should be woken.
    pub(crate) fn next_due_ns(&mut self) -> Option<u64> {
        if self.rest > 0 {
            self.rest -= 1;
            return None;
        }
        (self.period_ns > 0).then(|| self.last.due_ns + self.period_ns)
    }

    /// Notes whether a wait by the clock met its frame.
    pub(crate) fn settle(&mut self, is_punctual: bool) {
        self.misses = if is_punctual { 0 } else { self.misses + 1 };
        if self.misses == MOST_MISSES {
            (self.misses, self.rest) = (0, REST);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(frames: &[(u64, u64, u64)]) -> FrameSchedule {
        let mut schedule = FrameSchedule::default();
        for &(run_id, tick, scheduled_ns) in frames {
            schedule.note(&FrameHeader { run_id, tick, scheduled_ns, ..FrameHeader::default() });
        }
        schedule
    }

    #[test]
    fn the_next_frame_is_due_one_period_after_the_last_one() {
        assert_eq!(after(&[(7, 0, 5_000)]).next_due_ns(), None);
        assert_eq!(after(&[(7, 0, 5_000), (7, 1, 6_000)]).next_due_ns(), Some(7_000));
        let lost = after(&[(7, 0, 5_000), (7, 1, 6_000), (7, 9, 14_000)]);
        assert_eq!({ lost }.next_due_ns(), Some(15_000));
    }

    #[test]
    fn missed_periods_do_not_change_the_period_and_a_new_run_does() {
        let missed = after(&[(7, 0, 5_000), (7, 1, 6_000), (7, 2, 256_000)]);
        assert_eq!({ missed }.next_due_ns(), Some(257_000));
        let restarted = after(&[(7, 0, 5_000), (7, 1, 6_000), (8, 0, 7_000)]);
        assert_eq!({ restarted }.next_due_ns(), None);
        let slower = after(&[(7, 0, 5_000), (7, 1, 6_000), (8, 0, 7_000), (8, 1, 9_000)]);
        assert_eq!({ slower }.next_due_ns(), Some(11_000));
    }

    #[test]
    fn a_reader_that_misses_eight_frames_is_woken_for_the_next_hundred() {
        let mut schedule = after(&[(7, 0, 5_000), (7, 1, 6_000)]);
        for miss in 0..14 {
            schedule.settle(miss == 6);
        }
        assert_eq!(schedule.next_due_ns(), Some(7_000));
        schedule.settle(false);
        let waits = (0..100).filter(|_| schedule.next_due_ns().is_none()).count();
        assert_eq!((waits, schedule.next_due_ns()), (100, Some(7_000)));
    }
}

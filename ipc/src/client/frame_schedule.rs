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
    /// Distance of the last two frames in nanoseconds; 0 if they were not successive ones of a run.
    distance_ns: u64,
    /// Least distance that the run had twice in a row; 0 until it is known. After missed periods a frame is further away, and a reader
    /// that took this for the period would sleep too long.
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
        }
        let is_next = run_id == header.run_id && Some(header.tick) == tick.checked_add(1);
        let distance_ns = if is_next { header.scheduled_ns.saturating_sub(due_ns) } else { 0 };
        // Instants are rounded to nanoseconds.
        if distance_ns > 0 && distance_ns.abs_diff(self.distance_ns) <= 1 {
            self.period_ns = if self.period_ns == 0 { distance_ns } else { self.period_ns.min(distance_ns) };
        }
        self.distance_ns = distance_ns;
        self.last = LastFrame { run_id: header.run_id, tick: header.tick, due_ns: header.scheduled_ns };
    }

    /// The instant at which the next frame is due, in nanoseconds of `CLOCK_MONOTONIC`. `None` if it is not known, or if the reader
    /// should be woken.
    pub(crate) fn next_due_ns(&mut self) -> Option<u64> {
        if self.rest > 0 {
            self.rest -= 1;
            return None;
        }
        (self.period_ns > 0).then(|| self.last.due_ns.saturating_add(self.period_ns))
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
        assert_eq!(after(&[(7, 0, 4_000), (7, 1, 5_000), (7, 2, 6_000)]).next_due_ns(), Some(7_000));
        let lost = after(&[(7, 0, 4_000), (7, 1, 5_000), (7, 2, 6_000), (7, 10, 14_000)]);
        assert_eq!({ lost }.next_due_ns(), Some(15_000));
        let rounded = after(&[(7, 0, 3_999), (7, 1, 5_000), (7, 2, 6_000)]);
        assert_eq!({ rounded }.next_due_ns(), Some(7_000));
    }

    #[test]
    fn missed_periods_do_not_change_the_period_and_a_new_run_does() {
        let missed = after(&[(7, 0, 4_000), (7, 1, 5_000), (7, 2, 6_000), (7, 3, 256_000)]);
        assert_eq!({ missed }.next_due_ns(), Some(257_000));
        let restarted = after(&[(7, 0, 4_000), (7, 1, 5_000), (7, 2, 6_000), (8, 0, 7_000)]);
        assert_eq!({ restarted }.next_due_ns(), None);
        let slower = after(&[(7, 0, 5_000), (7, 1, 6_000), (8, 0, 7_000), (8, 1, 9_000), (8, 2, 11_000)]);
        assert_eq!({ slower }.next_due_ns(), Some(13_000));
    }

    #[test]
    fn the_first_distance_alone_may_be_of_missed_periods_and_is_not_slept_through() {
        let late = [(7, 0, 5_000), (7, 1, 905_000), (7, 2, 906_000), (7, 3, 907_000)];
        let due_ns: Vec<Option<u64>> = (1..=4).map(|frames| after(&late[..frames]).next_due_ns()).collect();
        assert_eq!(due_ns, [None, None, None, Some(908_000)]);
    }

    #[test]
    fn a_lying_source_makes_no_reader_panic() {
        let last = after(&[
            (7, u64::MAX - 2, 1),
            (7, u64::MAX - 1, u64::MAX / 2),
            (7, u64::MAX, u64::MAX - 2),
            (7, 0, u64::MAX),
        ]);
        assert_eq!({ last }.next_due_ns(), Some(u64::MAX));
    }

    #[test]
    fn a_reader_that_misses_eight_frames_is_woken_for_the_next_hundred() {
        let mut schedule = after(&[(7, 0, 4_000), (7, 1, 5_000), (7, 2, 6_000)]);
        for miss in 0..14 {
            schedule.settle(miss == 6);
        }
        assert_eq!(schedule.next_due_ns(), Some(7_000));
        schedule.settle(false);
        let waits = (0..100).filter(|_| schedule.next_due_ns().is_none()).count();
        assert_eq!((waits, schedule.next_due_ns()), (100, Some(7_000)));
    }
}

//! Due times of the frames of a lap: the recorded ones without the cuts and without long gaps.

use bench_dragon_ipc::FrameHeader;

/// Longest time that a replay spends on a gap of the recording, in nanoseconds: missing frames, or the time between two runs.
const LONGEST_GAP_NS: u64 = 1_000_000_000;

/// The frames of a lap so far, by their headers.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Trail {
    last_played: Option<FrameHeader>,
    /// The last frame read, played or not.
    last: Option<FrameHeader>,
    /// Length of all cuts so far in nanoseconds. Negative if the clock of a later run begins anew.
    cut_ns: i128,
}

impl Trail {
    /// Notes a frame that is not played.
    pub(super) fn skip(&mut self, header: &FrameHeader) {
        self.last = Some(*header);
    }

    /// Adds a frame to play. Returns its due time without cuts, and the number of missing frames before it. Across a cut, its
    /// distance from the played frame before it is its recorded distance from its predecessor. A gap takes at most one second.
    pub(super) fn play(&mut self, header: &FrameHeader) -> (u64, u64) {
        let mut missing = 0;
        if let (Some(played), Some(last)) = (self.last_played, self.last) {
            let is_same_run = last.run_id == header.run_id;
            let lost = if is_same_run { header.tick.saturating_sub(last.tick).saturating_sub(1) } else { 0 };
            if last == played {
                missing = lost;
            }
            let after_ns = header.scheduled_ns.saturating_sub(last.scheduled_ns);
            let step_ns = if lost > 0 || !is_same_run { after_ns.min(LONGEST_GAP_NS) } else { after_ns };
            let due_ns = i128::from(played.scheduled_ns) - self.cut_ns + i128::from(step_ns);
            self.cut_ns = i128::from(header.scheduled_ns) - due_ns;
        }
        (self.last_played, self.last) = (Some(*header), Some(*header));
        let due_ns = (i128::from(header.scheduled_ns) - self.cut_ns).clamp(0, i128::from(u64::MAX));
        (due_ns as u64, missing)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(tick: u64, scheduled_ns: u64) -> FrameHeader {
        FrameHeader { run_id: 7, tick, scheduled_ns, ..FrameHeader::default() }
    }

    #[test]
    fn a_cut_takes_as_long_as_one_frame() {
        let mut trail = Trail::default();
        assert_eq!(trail.play(&header(5, 500)), (500, 0));
        assert_eq!(trail.play(&header(6, 600)), (600, 0));
        trail.skip(&header(90, 9_000));
        assert_eq!(trail.play(&header(91, 9_110)), (710, 0), "110 ns after the frame before, as recorded");
        assert_eq!(trail.play(&header(92, 9_210)), (810, 0));
    }

    #[test]
    fn lost_frames_are_counted_and_cut_frames_are_not() {
        let mut trail = Trail::default();
        trail.skip(&header(3, 300));
        assert_eq!(trail.play(&header(5, 500)), (500, 0));
        assert_eq!(trail.play(&header(9, 900)), (900, 3));
        trail.skip(&header(20, 2_000));
        assert_eq!(trail.play(&header(23, 2_300)).1, 0, "the lost frames may have been outside of the interval");
    }

    #[test]
    fn a_gap_takes_at_most_a_second_and_a_recorded_standstill_its_whole_time() {
        let (second, mut trail) = (1_000_000_000, Trail::default());
        assert_eq!(trail.play(&header(0, 0)).0, 0);
        assert_eq!(trail.play(&header(1, 50 * second)).0, 50 * second, "no frame is missing");
        assert_eq!(trail.play(&header(9, 90 * second)), (51 * second, 7), "seven frames are missing");
        let next_run = |tick, scheduled_ns| FrameHeader { run_id: 8, ..header(tick, scheduled_ns) };
        assert_eq!(trail.play(&next_run(0, 500 * second)).0, 52 * second);
        assert_eq!(trail.play(&next_run(1, 501 * second)).0, 53 * second);
        let rebooted = FrameHeader { run_id: 9, ..header(0, 3) };
        assert_eq!(trail.play(&rebooted).0, 53 * second, "the clock begins anew");
    }
}

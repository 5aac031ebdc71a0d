//! Selection of the runs and frames that are sent. Pure.
//!
//! The bus buffers frames for a slow reader, but keeps only the last description. So after a restart the bridge may read frames
//! of a run after the description of the next run. These frames are outdated and are not sent.

use std::collections::VecDeque;

use bench_dragon_ipc::FrameHeader;

/// Most ended runs that are remembered. A reader's buffer never holds frames of so many runs.
const MAX_PAST_RUNS: usize = 64;

/// The runs of a bus, in order.
#[derive(Debug, Default)]
pub(super) struct SentRuns {
    described: Option<SentRun>,
    /// A run that sends frames, but has no description.
    nameless: Option<SentRun>,
    past: VecDeque<u64>,
}

#[derive(Debug)]
struct SentRun {
    run_id: u64,
    thinning: Thinning,
    has_begun: bool,
}

/// Decision about a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrameDisposition {
    /// The frame is sent.
    Sent,
    /// The frame is skipped, because only a share of the frames is sent.
    LeftOut,
    /// The frame is too late: another run has followed its run.
    Past,
}

impl SentRuns {
    /// Begins a run that has been described. The other runs end.
    pub(super) fn describe(&mut self, run_id: u64, thinning: Thinning) {
        let mut has_begun = false;
        for run in [self.described.take(), self.nameless.take()].into_iter().flatten() {
            if run.run_id == run_id {
                has_begun = run.has_begun;
            } else {
                self.end(run.run_id);
            }
        }
        self.described = Some(SentRun { run_id, thinning, has_begun });
    }

    /// Returns the run that was described last.
    pub(super) fn run_id(&self) -> Option<u64> {
        self.described.as_ref().map(|run| run.run_id)
    }

    /// Whether a run is current, or is remembered as ended.
    pub(super) fn knows(&self, run_id: u64) -> bool {
        let mut going_on = self.described.iter().chain(&self.nameless);
        going_on.any(|run| run.run_id == run_id) || self.past.contains(&run_id)
    }

    /// Handles a run whose description has not arrived in time. If the described run has had no frame yet, this run preceded
    /// it, and ends. Otherwise all frames of this run are sent. Returns whether they are sent.
    pub(super) fn do_without_description(&mut self, run_id: u64) -> bool {
        if self.described.as_ref().is_some_and(|described| !described.has_begun) {
            self.end(run_id);
            return false;
        }
        let thinning = Thinning::of(Share::OneOf(1), 0);
        let before = self.nameless.replace(SentRun { run_id, thinning, has_begun: false });
        if let Some(run) = before {
            self.end(run.run_id);
        }
        true
    }

    /// Decides about a frame of a known run.
    pub(super) fn disposition(&mut self, header: &FrameHeader) -> FrameDisposition {
        let mut going_on = self.described.iter_mut().chain(&mut self.nameless);
        let Some(run) = going_on.find(|run| run.run_id == header.run_id) else { return FrameDisposition::Past };
        run.has_begun = true;
        if run.thinning.takes(header) { FrameDisposition::Sent } else { FrameDisposition::LeftOut }
    }

    fn end(&mut self, run_id: u64) {
        if self.past.len() == MAX_PAST_RUNS {
            self.past.pop_front();
        }
        self.past.push_back(run_id);
    }
}

/// Share of the frames that is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// One frame of every N, at least 1.
    OneOf(u64),
    /// At most this many frames per second, at least 1. The bridge reduces the rate by a whole factor.
    RateHz(u32),
}

/// Selection of frames for one run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thinning {
    /// The frames whose tick is a multiple of this are sent, and those that change the state.
    pub(super) every: u64,
    state: Option<u32>,
}

impl Thinning {
    /// Returns the selection for a run of `rate_hz` frames per second. If the rate is unknown (0), [`Share::RateHz`] selects
    /// all frames.
    pub(super) fn of(share: Share, rate_hz: u32) -> Self {
        let every = match share {
            Share::OneOf(every) => every.max(1),
            Share::RateHz(wanted_hz) => u64::from(rate_hz.div_ceil(wanted_hz.max(1)).max(1)),
        };
        Self { every, state: None }
    }

    /// Returns whether to send this frame. A change of the state is always sent, because it may be the last frame.
    pub(super) fn takes(&mut self, header: &FrameHeader) -> bool {
        let is_change = self.state.is_some_and(|state| state != header.state);
        self.state = Some(header.state);
        is_change || header.tick.is_multiple_of(self.every)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::*;
    use crate::source::replay::FASTEST_HZ;

    fn one_of(every: u64) -> Thinning {
        Thinning::of(Share::OneOf(every), 1_000)
    }

    fn dispositions(runs: &mut SentRuns, run_id: u64, ticks: std::ops::Range<u64>) -> Vec<FrameDisposition> {
        ticks.map(|tick| runs.disposition(&FrameHeader { run_id, tick, ..FrameHeader::default() })).collect()
    }

    #[test]
    fn late_frames_of_an_earlier_run_are_not_sent() {
        let mut runs = SentRuns::default();
        runs.describe(1, one_of(50));
        assert_eq!(dispositions(&mut runs, 1, 50..52), [FrameDisposition::Sent, FrameDisposition::LeftOut]);
        runs.describe(2, one_of(50));
        assert!(runs.knows(1), "the bridge does not wait for its description");
        assert_eq!(dispositions(&mut runs, 1, 52..54), [FrameDisposition::Past, FrameDisposition::Past]);
        assert_eq!(dispositions(&mut runs, 2, 0..2), [FrameDisposition::Sent, FrameDisposition::LeftOut]);
    }

    #[test]
    fn an_undescribed_run_ends_when_the_run_after_it_is_described() {
        let mut runs = SentRuns::default();
        runs.describe(1, one_of(50));
        assert_eq!(dispositions(&mut runs, 1, 0..1), [FrameDisposition::Sent]);
        runs.describe(3, one_of(50));
        assert!(!runs.knows(2));
        assert!(!runs.do_without_description(2));
        assert_eq!((runs.knows(2), dispositions(&mut runs, 2, 0..1)), (true, vec![FrameDisposition::Past]));
        assert_eq!(dispositions(&mut runs, 3, 0..2), [FrameDisposition::Sent, FrameDisposition::LeftOut]);
    }

    #[test]
    fn all_frames_of_a_run_without_a_description_are_sent_until_one_comes() {
        let mut runs = SentRuns::default();
        assert!(!runs.knows(1));
        assert!(runs.do_without_description(1));
        assert_eq!(dispositions(&mut runs, 1, 0..2), [FrameDisposition::Sent, FrameDisposition::Sent]);
        runs.describe(1, one_of(2));
        assert_eq!(dispositions(&mut runs, 1, 2..4), [FrameDisposition::Sent, FrameDisposition::LeftOut]);
        assert!(runs.do_without_description(2), "the described run has had frames, so this run follows it");
        assert_eq!(dispositions(&mut runs, 2, 1..2), [FrameDisposition::Sent]);
    }

    #[test]
    fn the_number_of_remembered_runs_is_bounded() {
        let mut runs = SentRuns::default();
        (0..1_000).for_each(|run_id| runs.describe(run_id, one_of(1)));
        assert_eq!(
            (runs.past.len(), runs.run_id(), runs.knows(998), runs.knows(3)),
            (MAX_PAST_RUNS, Some(999), true, false)
        );
    }

    fn sent(share: Share, frames: &[(u64, u32)]) -> Vec<u64> {
        let mut thinning = Thinning::of(share, 1000);
        let header = |(tick, state)| FrameHeader { tick, state, ..FrameHeader::default() };
        frames.iter().filter(|&&frame| thinning.takes(&header(frame))).map(|frame| frame.0).collect()
    }

    #[test]
    fn one_frame_of_every_n_is_sent_and_every_change_of_the_state() {
        let frames: Vec<_> = (0..12).map(|tick| (tick, u32::from(tick == 7))).collect();
        assert_eq!(sent(Share::OneOf(5), &frames), [0, 5, 7, 8, 10]);
        assert_eq!(sent(Share::OneOf(1), &frames).len(), frames.len());
    }

    #[test]
    fn a_rate_is_never_exceeded() {
        assert_eq!(Thinning::of(Share::RateHz(60), 1000).every, 17);
        assert_eq!(Thinning::of(Share::RateHz(1000), 1000).every, 1);
        assert_eq!(Thinning::of(Share::RateHz(2000), 1000).every, 1);
        assert_eq!(Thinning::of(Share::RateHz(60), 0).every, 1, "unknown rate: a run of another version");
    }

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn the_smallest_whole_factor_that_keeps_the_rate_is_chosen(wanted_hz in 1..=FASTEST_HZ, rate_hz in 1..=FASTEST_HZ) {
            let every = Thinning::of(Share::RateHz(wanted_hz), rate_hz).every;
            prop_assert!(u64::from(rate_hz) <= every * u64::from(wanted_hz));
            prop_assert!(every == 1 || u64::from(rate_hz) > (every - 1) * u64::from(wanted_hz));
        }
    }
}

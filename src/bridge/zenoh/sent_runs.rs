//! Of which runs frames are sent, and how many. Pure.
//!
//! The bus keeps frames for a reader that lags, but of the descriptions only the last one: so after a restart, frames of a run
//! may come when the next one has been described already. They are of no use to anyone any more.

use std::collections::VecDeque;

use bench_dragon_ipc::FrameHeader;

/// Runs that are remembered to be over: more than a reader's buffer ever holds frames of.
const MAX_PAST_RUNS: usize = 64;

/// The runs of a bus, in their order.
#[derive(Debug, Default)]
pub(super) struct SentRuns {
    described: Option<SentRun>,
    /// One that has no description, and frames of which come nevertheless.
    nameless: Option<SentRun>,
    past: VecDeque<u64>,
}

#[derive(Debug)]
struct SentRun {
    run_id: u64,
    thinning: Thinning,
    has_begun: bool,
}

/// Whether a frame is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FrameDisposition {
    /// It is one of those that are sent.
    Sent,
    /// It is one of those between them.
    LeftOut,
    /// It comes too late: another run has followed its own.
    Past,
}

impl SentRuns {
    /// Begins another run, which has been described.
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

    /// The run that has been described last.
    pub(super) fn run_id(&self) -> Option<u64> {
        self.described.as_ref().map(|run| run.run_id)
    }

    /// Whether a run is one of those that are known, be it as one that is over.
    pub(super) fn knows(&self, run_id: u64) -> bool {
        let mut going_on = self.described.iter().chain(&self.nameless);
        going_on.any(|run| run.run_id == run_id) || self.past.contains(&run_id)
    }

    /// Takes note of a run that is not described, though there has been time for it. Where the one that is has had no frame yet,
    /// this one came before it, and is over. Returns whether its frames are sent nevertheless, all of them.
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

    /// What becomes of a frame of a run that is known.
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

/// How many of the frames are sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Share {
    /// One of so many, at least 1.
    OneOf(u64),
    /// As many a second as come nearest to this from below, at least 1.
    RateHz(u32),
}

/// The choice for one run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thinning {
    /// Of the frames, those are sent whose tick is a multiple of this, and those that change the state.
    pub(super) every: u64,
    state: Option<u32>,
}

impl Thinning {
    /// The choice for a run whose frames come at a rate, or at one that is not known where it is 0: then all are sent,
    /// unless it was said how many.
    pub(super) fn of(share: Share, rate_hz: u32) -> Self {
        let every = match share {
            Share::OneOf(every) => every.max(1),
            Share::RateHz(wanted_hz) => u64::from(rate_hz.div_ceil(wanted_hz.max(1)).max(1)),
        };
        Self { every, state: None }
    }

    /// Whether to send this frame. A change of the state is never left out: it may be the last thing that is said.
    pub(super) fn takes(&mut self, header: &FrameHeader) -> bool {
        let is_change = self.state.is_some_and(|state| state != header.state);
        self.state = Some(header.state);
        is_change || header.tick.is_multiple_of(self.every)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::source::replay::FASTEST_HZ;

    fn one_of(every: u64) -> Thinning {
        Thinning::of(Share::OneOf(every), 1_000)
    }

    fn dispositions(runs: &mut SentRuns, run_id: u64, ticks: std::ops::Range<u64>) -> Vec<FrameDisposition> {
        ticks.map(|tick| runs.disposition(&FrameHeader { run_id, tick, ..FrameHeader::default() })).collect()
    }

    #[test]
    fn frames_of_a_run_that_another_one_has_followed_come_too_late_and_change_nothing() {
        let mut runs = SentRuns::default();
        runs.describe(1, one_of(50));
        assert_eq!(dispositions(&mut runs, 1, 50..52), [FrameDisposition::Sent, FrameDisposition::LeftOut]);
        runs.describe(2, one_of(50));
        assert!(runs.knows(1), "so that nobody waits for its description");
        assert_eq!(dispositions(&mut runs, 1, 52..54), [FrameDisposition::Past, FrameDisposition::Past]);
        assert_eq!(dispositions(&mut runs, 2, 0..2), [FrameDisposition::Sent, FrameDisposition::LeftOut]);
    }

    #[test]
    fn a_run_between_two_that_are_described_is_over_when_the_later_one_is_known() {
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
        assert!(runs.do_without_description(2), "the one that is described has had frames, so this one follows it");
        assert_eq!(dispositions(&mut runs, 2, 1..2), [FrameDisposition::Sent]);
    }

    #[test]
    fn what_is_remembered_is_bounded() {
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
    fn one_of_so_many_is_sent_and_every_change_of_the_state() {
        let frames: Vec<_> = (0..12).map(|tick| (tick, u32::from(tick == 7))).collect();
        assert_eq!(sent(Share::OneOf(5), &frames), [0, 5, 7, 8, 10]);
        assert_eq!(sent(Share::OneOf(1), &frames).len(), frames.len());
    }

    #[test]
    fn a_rate_is_never_exceeded() {
        assert_eq!(Thinning::of(Share::RateHz(60), 1000).every, 17);
        assert_eq!(Thinning::of(Share::RateHz(1000), 1000).every, 1);
        assert_eq!(Thinning::of(Share::RateHz(2000), 1000).every, 1);
        assert_eq!(Thinning::of(Share::RateHz(60), 0).every, 1, "a run of another version");
    }

    proptest! {
        #[test]
        fn what_is_sent_is_as_near_to_the_rate_as_a_whole_step_comes(wanted_hz in 1..=FASTEST_HZ, rate_hz in 1..=FASTEST_HZ) {
            let every = Thinning::of(Share::RateHz(wanted_hz), rate_hz).every;
            prop_assert!(u64::from(rate_hz) <= every * u64::from(wanted_hz));
            prop_assert!(every == 1 || u64::from(rate_hz) > (every - 1) * u64::from(wanted_hz));
        }
    }
}

//! Of which runs frames are sent, and how many. Pure.
//!
//! The bus keeps frames for a reader that lags, but of the descriptions only the last one: so after a restart, frames of a run
//! may come when the next one has been described already. They are of no use to anyone any more.

use std::collections::VecDeque;

use bench_dragon_ipc::FrameHeader;

use super::thinning::{Share, Thinning};

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
pub(super) enum Fate {
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
    pub(super) fn fate(&mut self, header: &FrameHeader) -> Fate {
        let mut going_on = self.described.iter_mut().chain(&mut self.nameless);
        let Some(run) = going_on.find(|run| run.run_id == header.run_id) else { return Fate::Past };
        run.has_begun = true;
        if run.thinning.takes(header) { Fate::Sent } else { Fate::LeftOut }
    }

    fn end(&mut self, run_id: u64) {
        if self.past.len() == MAX_PAST_RUNS {
            self.past.pop_front();
        }
        self.past.push_back(run_id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one_of(every: u64) -> Thinning {
        Thinning::of(Share::OneOf(every), 1_000)
    }

    fn fates(runs: &mut SentRuns, run_id: u64, ticks: std::ops::Range<u64>) -> Vec<Fate> {
        ticks.map(|tick| runs.fate(&FrameHeader { run_id, tick, ..FrameHeader::default() })).collect()
    }

    #[test]
    fn frames_of_a_run_that_another_one_has_followed_come_too_late_and_change_nothing() {
        let mut runs = SentRuns::default();
        runs.describe(1, one_of(50));
        assert_eq!(fates(&mut runs, 1, 50..52), [Fate::Sent, Fate::LeftOut]);
        runs.describe(2, one_of(50));
        assert!(runs.knows(1), "so that nobody waits for its description");
        assert_eq!(fates(&mut runs, 1, 52..54), [Fate::Past, Fate::Past]);
        assert_eq!(fates(&mut runs, 2, 0..2), [Fate::Sent, Fate::LeftOut]);
    }

    #[test]
    fn a_run_between_two_that_are_described_is_over_when_the_later_one_is_known() {
        let mut runs = SentRuns::default();
        runs.describe(1, one_of(50));
        assert_eq!(fates(&mut runs, 1, 0..1), [Fate::Sent]);
        runs.describe(3, one_of(50));
        assert!(!runs.knows(2));
        assert!(!runs.do_without_description(2));
        assert_eq!((runs.knows(2), fates(&mut runs, 2, 0..1)), (true, vec![Fate::Past]));
        assert_eq!(fates(&mut runs, 3, 0..2), [Fate::Sent, Fate::LeftOut]);
    }

    #[test]
    fn all_frames_of_a_run_without_a_description_are_sent_until_one_comes() {
        let mut runs = SentRuns::default();
        assert!(!runs.knows(1));
        assert!(runs.do_without_description(1));
        assert_eq!(fates(&mut runs, 1, 0..2), [Fate::Sent, Fate::Sent]);
        runs.describe(1, one_of(2));
        assert_eq!(fates(&mut runs, 1, 2..4), [Fate::Sent, Fate::LeftOut]);
        assert!(runs.do_without_description(2), "the one that is described has had frames, so this one follows it");
        assert_eq!(fates(&mut runs, 2, 1..2), [Fate::Sent]);
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
}

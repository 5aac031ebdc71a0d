//! What is known of the runs of other hosts: which have been described, and which are over.
//!
//! Pure: the time is handed to it. Whoever reaches the bridge may describe as many runs as he likes; what is kept of them, and how
//! often one is heard of, is bounded.

use super::rate_limit::RateLimit;
use super::wire::Described;
use crate::source::described_bench_count;

/// Descriptions that are kept: of runs that may follow.
const MAX_DESCRIPTIONS: usize = 4;
/// Descriptions a second, and at once.
const DESCRIPTION_RATE: (u64, u64) = (5, 8);
/// Runs that are remembered to be over, so that two sources under one key do not take turns.
const MAX_PAST_RUNS: usize = 64;
/// New runs a second, and at once: each takes services of its own.
const RUN_RATE: (u64, u64) = (1, 4);

pub(super) type Description = (Described, String);

#[derive(Debug)]
pub(super) struct KnownRuns {
    descriptions: Vec<Description>,
    past_runs: Vec<u64>,
    description_limit: RateLimit,
    run_limit: RateLimit,
}

/// What is to be done about a frame of a run that is not received.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum RunDecision {
    /// The run is to be received, being described so.
    Next(Described, String),
    /// Nobody has described it.
    Unknown,
    /// It is over, or comes too soon after another.
    Barred,
    /// The frame has not as many benches as the run is described with.
    OtherDragon,
}

impl KnownRuns {
    pub(super) fn new() -> Self {
        Self {
            descriptions: Vec::with_capacity(MAX_DESCRIPTIONS),
            past_runs: Vec::with_capacity(MAX_PAST_RUNS),
            description_limit: RateLimit::new(DESCRIPTION_RATE.0, DESCRIPTION_RATE.1),
            run_limit: RateLimit::new(RUN_RATE.0, RUN_RATE.1),
        }
    }

    /// Whether one more description may be heard now.
    pub(super) fn hears(&mut self, now_ns: u64) -> bool {
        self.description_limit.allows(now_ns)
    }

    /// Keeps a description. Returns whether the run is a new one.
    pub(super) fn describe(&mut self, described: Described, toml: String) -> bool {
        if self.past_runs.contains(&described.run_id) {
            return false;
        }
        if let Some(known) = self.descriptions.iter_mut().find(|(known, _)| known.run_id == described.run_id) {
            *known = (described, toml);
            return false;
        }
        if self.descriptions.len() == MAX_DESCRIPTIONS {
            self.descriptions.remove(0);
        }
        self.descriptions.push((described, toml));
        true
    }

    /// What is to be done about a frame of this run. One that is to be received is known no longer.
    pub(super) fn decide(&mut self, run_id: u64, bench_count: u32, now_ns: u64) -> RunDecision {
        if self.past_runs.contains(&run_id) {
            return RunDecision::Barred;
        }
        let Some(index) = self.descriptions.iter().position(|(described, _)| described.run_id == run_id) else {
            return RunDecision::Unknown;
        };
        if described_bench_count(&self.descriptions[index].1) != Some(bench_count) {
            return RunDecision::OtherDragon;
        }
        if !self.run_limit.allows(now_ns) {
            return RunDecision::Barred;
        }
        let (described, toml) = self.descriptions.swap_remove(index);
        RunDecision::Next(described, toml)
    }

    /// Takes note that a run is over: it does not come back.
    pub(super) fn end(&mut self, run_id: u64) {
        if self.past_runs.len() == MAX_PAST_RUNS {
            self.past_runs.remove(0);
        }
        self.past_runs.push(run_id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND_NS: u64 = 1_000_000_000;
    const TOML: &str = "[dragon]\nbenches = 5\n";

    fn described(run_id: u64) -> Described {
        Described { run_id, every: 1, rate_hz: 50 }
    }

    fn knowing(runs: impl IntoIterator<Item = u64>) -> KnownRuns {
        let mut known = KnownRuns::new();
        for run_id in runs {
            assert!(known.describe(described(run_id), TOML.to_owned()), "{run_id}");
        }
        known
    }

    #[test]
    fn a_run_begins_with_a_frame_of_the_dragon_that_it_is_described_with() {
        let mut known = knowing([7]);
        assert_eq!(known.decide(8, 5, SECOND_NS), RunDecision::Unknown);
        assert_eq!(known.decide(7, 100_000, SECOND_NS), RunDecision::OtherDragon);
        assert_eq!(known.decide(7, 5, SECOND_NS), RunDecision::Next(described(7), TOML.to_owned()));
        for toml in ["", "[dragon]\n", "[dragon]\nbenches = -5\n", "[dragon"] {
            assert!(known.describe(described(9), toml.to_owned()));
            assert_eq!(known.decide(9, 5, SECOND_NS), RunDecision::OtherDragon, "{toml}");
            known = KnownRuns::new();
        }
    }

    #[test]
    fn a_run_that_is_over_does_not_come_back() {
        let mut known = knowing([7]);
        known.end(7);
        assert!(!known.describe(described(7), TOML.to_owned()));
        assert_eq!(known.decide(7, 5, SECOND_NS), RunDecision::Barred);
    }

    #[test]
    fn runs_and_descriptions_that_come_too_often_have_to_wait() {
        let now_ns = 10 * SECOND_NS;
        let mut known = knowing(0..4);
        let begun = (0..4).filter(|&run_id| known.decide(run_id, 5, now_ns) != RunDecision::Barred).count();
        assert_eq!(begun, RUN_RATE.1 as usize);
        assert!(known.describe(described(4), TOML.to_owned()));
        assert_eq!(known.decide(4, 5, now_ns), RunDecision::Barred);
        assert_eq!(known.decide(4, 5, now_ns + SECOND_NS), RunDecision::Next(described(4), TOML.to_owned()));
        let heard = (0..100).filter(|_| known.hears(now_ns)).count();
        assert_eq!(heard, DESCRIPTION_RATE.1 as usize);
    }

    #[test]
    fn of_many_descriptions_the_last_ones_are_kept() {
        let mut known = knowing(0..1_000);
        assert_eq!((known.descriptions.len(), known.descriptions[0].0.run_id), (MAX_DESCRIPTIONS, 996));
        (0..1_000).for_each(|run_id| known.end(run_id));
        assert_eq!((known.past_runs.len(), known.past_runs[0]), (MAX_PAST_RUNS, 936));
    }
}

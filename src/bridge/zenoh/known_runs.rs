//! The known runs of other hosts: described runs and ended runs.
//!
//! Pure: the time is an argument. Any host that reaches the bridge can describe any number of runs, so both the number and the
//! rate of accepted descriptions are bounded.

use super::wire::Described;
use crate::bridge::rate_limit::RateLimit;
use crate::source::described_bench_count;

/// Most descriptions that are stored, of runs that may follow.
const MAX_DESCRIPTIONS: usize = 4;
/// Limit of descriptions: per second, and burst.
const DESCRIPTION_RATE: (u64, u64) = (5, 8);
/// Most ended runs that are remembered. This prevents two sources under one key from alternating.
const MAX_PAST_RUNS: usize = 64;
/// Limit of new runs: per second, and burst. Each run needs its own services.
const RUN_RATE: (u64, u64) = (1, 4);

pub(super) type Description = (Described, String);

#[derive(Debug)]
pub(super) struct KnownRuns {
    descriptions: Vec<Description>,
    past_runs: Vec<u64>,
    description_limit: RateLimit,
    run_limit: RateLimit,
}

/// Decision about a frame of a run that the bridge does not receive.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum RunDecision {
    /// Receive the run, which has this description.
    Next(Described, String),
    /// No description of the run has arrived.
    Unknown,
    /// The run is over, or begins too soon after another run.
    Barred,
    /// The frame's number of benches differs from the run's description.
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

    /// Returns whether the rate limit allows one more description now. Counts an allowed one.
    pub(super) fn hears(&mut self, now_ns: u64) -> bool {
        self.description_limit.allows(now_ns)
    }

    /// Stores a description. Returns whether the run is new.
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

    /// Decides about a frame of this run. Removes the description of a run that is to be received.
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

    /// Marks a run as over. It is not received again.
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
    fn a_run_begins_with_a_frame_that_matches_its_description() {
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
    fn a_run_that_is_over_is_not_received_again() {
        let mut known = knowing([7]);
        known.end(7);
        assert!(!known.describe(described(7), TOML.to_owned()));
        assert_eq!(known.decide(7, 5, SECOND_NS), RunDecision::Barred);
    }

    #[test]
    fn the_rates_of_runs_and_descriptions_are_limited() {
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
    fn the_last_descriptions_are_kept() {
        let mut known = knowing(0..1_000);
        assert_eq!((known.descriptions.len(), known.descriptions[0].0.run_id), (MAX_DESCRIPTIONS, 996));
        (0..1_000).for_each(|run_id| known.end(run_id));
        assert_eq!((known.past_runs.len(), known.past_runs[0]), (MAX_PAST_RUNS, 936));
    }
}

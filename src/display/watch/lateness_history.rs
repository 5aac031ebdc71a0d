//! How late the server's ticks were, second by second.

use std::collections::VecDeque;
use std::sync::Arc;

use bench_dragon_ipc::{Status, TimeHistogram};

/// Seconds that are kept: as many as the widest chart has columns.
const KEPT: usize = 120;
/// The share of a second's ticks that is no later than what is kept of it.
const SHARE: f64 = 0.99;

/// The 99th percentile of each second's lateness, worked out of a distribution that only grows.
#[derive(Clone, Debug, Default)]
pub(super) struct LatenessHistory {
    seconds_ns: VecDeque<u64>,
    /// The status with which the second in progress began.
    begun: Option<Arc<Status>>,
}

impl LatenessHistory {
    /// Takes note of a status. A second is as many ticks as the server makes in one.
    pub(super) fn note(&mut self, status: &Arc<Status>) {
        let same_run = self.begun.as_ref().filter(|begun| begun.run_id == status.run_id && begun.tick <= status.tick);
        let Some(begun) = same_run else {
            self.begun = Some(Arc::clone(status));
            return;
        };
        if status.tick - begun.tick < u64::from(status.rate_hz.max(1)) {
            return;
        }
        let late_ns = since(&begun.lateness, &status.lateness).quantile_ns(SHARE);
        if self.seconds_ns.len() == KEPT {
            self.seconds_ns.pop_front();
        }
        self.seconds_ns.push_back(late_ns);
        self.begun = Some(Arc::clone(status));
    }

    /// The latest so many seconds, oldest first, in nanoseconds.
    pub(super) fn latest(&self, count: usize) -> impl Iterator<Item = u64> {
        let skipped = self.seconds_ns.len().saturating_sub(count);
        self.seconds_ns.iter().skip(skipped).copied()
    }
}

/// What a distribution has gained.
fn since(before: &TimeHistogram, after: &TimeHistogram) -> TimeHistogram {
    let mut gained = TimeHistogram { max_ns: after.max_ns, ..TimeHistogram::default() };
    for (gained, (before, after)) in gained.counts.iter_mut().zip(before.counts.iter().zip(&after.counts)) {
        *gained = after.saturating_sub(*before);
    }
    gained
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(run_id: u64, tick: u64, lateness: &TimeHistogram) -> Arc<Status> {
        Arc::new(Status { run_id, tick, rate_hz: 10, lateness: *lateness, ..Status::default() })
    }

    #[test]
    fn each_second_has_its_own_lateness_though_the_servers_is_of_the_whole_run() {
        let (mut history, mut all) = (LatenessHistory::default(), TimeHistogram::default());
        history.note(&status(1, 0, &all));
        for (tick, late_ns) in [(5, 40), (10, 40), (15, 20), (20, 20)] {
            (0..5).for_each(|_| all.record(late_ns));
            history.note(&status(1, tick, &all));
        }
        assert_eq!(history.latest(9).collect::<Vec<_>>(), [40, 20]);
        assert_eq!(history.latest(1).collect::<Vec<_>>(), [20]);
    }

    #[test]
    fn a_restart_begins_a_second_anew_and_keeps_those_before() {
        let (mut history, mut all) = (LatenessHistory::default(), TimeHistogram::default());
        history.note(&status(1, 0, &all));
        (0..10).for_each(|_| all.record(30));
        history.note(&status(1, 10, &all));
        history.note(&status(2, 3, &TimeHistogram::default()));
        let mut again = TimeHistogram::default();
        (0..10).for_each(|_| again.record(50));
        history.note(&status(2, 13, &again));
        assert_eq!(history.latest(9).collect::<Vec<_>>(), [30, 50]);
    }

    #[test]
    fn no_more_than_two_minutes_are_kept() {
        let (mut history, mut all) = (LatenessHistory::default(), TimeHistogram::default());
        for second in 0..=KEPT as u64 + 5 {
            history.note(&status(1, second * 10, &all));
            all.record(second);
        }
        assert_eq!(history.latest(usize::MAX).count(), KEPT);
    }
}

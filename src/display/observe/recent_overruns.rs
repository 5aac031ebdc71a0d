//! The overruns of the last minute. A count since the start of the run does not distinguish a bad night from a bad minute.

use std::collections::VecDeque;

use bench_dragon_ipc::Status;

/// Time for which an overrun is recent, in nanoseconds.
const RECENT_NS: u64 = 60_000_000_000;
/// Least time between two kept counts, in nanoseconds. So at most 60 counts are kept.
const STEP_NS: u64 = 1_000_000_000;

/// Overruns and periods of the last minute, as far as the observer knows the run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RecentOverruns {
    /// Periods that were missed.
    pub missed: u64,
    /// All periods, met and missed.
    pub periods: u64,
}

/// Keeps the counts of the statuses of the last minute.
#[derive(Debug, Default)]
pub(super) struct OverrunLog {
    run_id: u64,
    /// Counts and the instants at which they were received, oldest first.
    counts: VecDeque<(u64, RecentOverruns)>,
}

impl OverrunLog {
    /// Records a status that was received at an instant of `CLOCK_MONOTONIC`, in nanoseconds.
    pub(super) fn note(&mut self, status: &Status, now_ns: u64) {
        let total = RecentOverruns { missed: status.overruns, periods: status.tick.saturating_add(status.overruns) };
        if self.run_id != status.run_id || self.counts.is_empty() {
            self.run_id = status.run_id;
            // All overruns of a run that is younger than a minute are recent.
            let age_ns = total.periods.saturating_mul(1_000_000_000).checked_div(status.rate_hz.into());
            let before =
                if age_ns.is_some_and(|age_ns| age_ns < RECENT_NS) { RecentOverruns::default() } else { total };
            self.counts.clear();
            self.counts.push_back((now_ns, before));
        }
        if self.counts.back().is_none_or(|(at_ns, _)| now_ns.saturating_sub(*at_ns) >= STEP_NS) {
            self.counts.push_back((now_ns, total));
        }
        // The oldest kept count is the last one that is at least a minute old.
        while self.counts.get(1).is_some_and(|(at_ns, _)| now_ns.saturating_sub(*at_ns) >= RECENT_NS) {
            self.counts.pop_front();
        }
    }

    /// The overruns up to a status since the oldest kept count. None for a status of another run.
    pub(super) fn recent(&self, status: &Status) -> RecentOverruns {
        let Some((_, before)) = self.counts.front().filter(|_| self.run_id == status.run_id) else {
            return RecentOverruns::default();
        };
        let periods = status.tick.saturating_add(status.overruns);
        RecentOverruns {
            missed: status.overruns.saturating_sub(before.missed),
            periods: periods.saturating_sub(before.periods),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn status(tick: u64, overruns: u64) -> Status {
        Status { run_id: 1, tick, overruns, rate_hz: 10, ..Status::default() }
    }

    /// Notes a status each second from `from_s` on, at 10 Hz, and returns the recent overruns after the last one.
    fn after(log: &mut OverrunLog, seconds: std::ops::RangeInclusive<u64>, overruns: u64) -> u64 {
        let mut missed = 0;
        for second in seconds {
            let status = status(second * 10 - overruns, overruns);
            log.note(&status, second * STEP_NS);
            missed = log.recent(&status).missed;
        }
        missed
    }

    #[test]
    fn overruns_are_recent_for_a_minute() {
        let mut log = OverrunLog::default();
        assert_eq!(after(&mut log, 100..=200, 7), 0, "they happened before the observer began");
        assert_eq!(after(&mut log, 201..=259, 20), 13);
        assert_eq!(after(&mut log, 260..=270, 20), 0);
        assert!(log.counts.len() <= 61, "{}", log.counts.len());
    }

    #[test]
    fn all_overruns_of_a_young_run_are_recent() {
        let mut log = OverrunLog::default();
        assert_eq!(after(&mut log, 5..=5, 7), 7);
        assert_eq!(after(&mut log, 6..=64, 7), 7);
        assert_eq!(after(&mut log, 65..=70, 7), 0);
    }

    #[test]
    fn another_run_begins_anew() {
        let mut log = OverrunLog::default();
        after(&mut log, 5..=5, 7);
        let next = Status { run_id: 2, ..status(3, 2) };
        assert_eq!(log.recent(&next), RecentOverruns::default());
        log.note(&next, 6 * STEP_NS);
        assert_eq!(log.recent(&next), RecentOverruns { missed: 2, periods: 5 });
    }
}

//! How often a child is started again, and how soon.

use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// How often one child is started again within a window before the show goes on without it, or without a server ends.
pub(super) const MAX_RESTARTS: usize = 5;
/// The window: what was longer ago is forgotten, so that a show of many hours outlives now and then a crash.
pub(super) const WINDOW: Duration = Duration::from_mins(5);
/// How long the show waits before it starts a child again for the first time; twice as long each further time.
const FIRST_BACKOFF: Duration = Duration::from_millis(50);

/// The patience with one child.
#[derive(Debug, Default)]
pub(super) struct Patience {
    /// When it was started again within the window, oldest first.
    restarts: VecDeque<Instant>,
}

impl Patience {
    /// Takes note of an end at `now`, and says how long to wait before the child is started again; `None` where it has ended
    /// too often.
    pub(super) fn after_end(&mut self, now: Instant) -> Option<Duration> {
        while self.restarts.front().is_some_and(|&at| now.duration_since(at) > WINDOW) {
            self.restarts.pop_front();
        }
        if self.restarts.len() >= MAX_RESTARTS {
            return None;
        }
        let backoff = FIRST_BACKOFF * (1 << self.restarts.len());
        self.restarts.push_back(now);
        Some(backoff)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_child_that_keeps_ending_is_started_again_ever_later_and_then_no_more() {
        let (mut patience, now) = (Patience::default(), Instant::now());
        let waits_ms: Vec<u128> =
            (0..MAX_RESTARTS).map(|_| patience.after_end(now).expect("its first ends").as_millis()).collect();
        assert_eq!(waits_ms, [50, 100, 200, 400, 800]);
        assert_eq!(patience.after_end(now + WINDOW), None);
    }

    #[test]
    fn what_happened_long_ago_is_forgotten() {
        let (mut patience, mut now) = (Patience::default(), Instant::now());
        for _ in 0..100 {
            assert_eq!(patience.after_end(now), Some(FIRST_BACKOFF));
            now += WINDOW + Duration::from_nanos(1);
        }
    }

    #[test]
    fn an_end_falls_out_of_the_window_by_itself() {
        let (mut patience, now) = (Patience::default(), Instant::now());
        let ends = [0, 100, 200, 299, 300].map(|second| now + Duration::from_secs(second));
        for end in ends {
            assert!(patience.after_end(end).is_some());
        }
        assert_eq!(patience.after_end(ends[4]), None);
        assert_eq!(patience.after_end(now + Duration::from_secs(301)), Some(FIRST_BACKOFF * 16));
    }
}

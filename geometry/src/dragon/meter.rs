//! Meters count work in steps, not in time. So a search reaches its limit at the same parameter on every machine.
//!
//! A step is one route point evaluated for a link, about 50 ns. Other work counts as the number of steps that take about as
//! long.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use thiserror::Error;

use super::question::Question;

/// Limit of steps for finding the end of a dragon's feasible travel: some seconds of work.
const MAX_PLACING_STEPS: u64 = 100_000_000;

/// A limit of work, and the work done under it. Clones share one count.
///
/// ```
/// use bench_dragon_geometry::dragon::Meter;
///
/// let meter = Meter::of(10);
/// meter.add(9);
/// assert!(!meter.is_spent() && meter.left() == 1);
/// meter.add(1);
/// assert!(meter.is_spent() && !Meter::unlimited().is_spent());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Meter(Option<Arc<Count>>);

#[derive(Debug)]
struct Count {
    most: u64,
    done: AtomicU64,
    question: Question,
}

/// Error: a search has reached its limit of work before its end, or its question was cancelled.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("{}", reason(*.most, *.is_cancelled))]
pub struct Spent {
    /// The limit.
    pub most: u64,
    /// Travel of the head up to which the search is finished.
    pub reached_m: f64,
    /// Whether the question was cancelled.
    pub is_cancelled: bool,
}

fn reason(most: u64, is_cancelled: bool) -> String {
    if is_cancelled { "cancelled".to_owned() } else { format!("the limit of {most} steps of work is reached") }
}

/// A meter without a limit.
pub(crate) static UNLIMITED: Meter = Meter(None);

impl Meter {
    /// A meter without a limit. It counts nothing.
    pub fn unlimited() -> Self {
        Self(None)
    }

    /// A meter with a limit of `most` steps.
    pub fn of(most: u64) -> Self {
        Self::of_question(Question::default(), most)
    }

    /// A meter of a question: no work is left once the question is cancelled.
    pub(super) fn of_question(question: Question, most: u64) -> Self {
        Self(Some(Arc::new(Count { most, done: AtomicU64::new(0), question })))
    }

    /// A separate meter of the same question, with a limit of its own.
    pub(crate) fn part(&self, most: u64) -> Self {
        self.0.as_ref().map_or_else(|| Self::of(most), |count| count.question.meter(most))
    }

    /// Whether the question was cancelled.
    pub(crate) fn is_cancelled(&self) -> bool {
        self.0.as_ref().is_some_and(|count| count.question.is_cancelled())
    }

    /// Whether there is a limit.
    pub fn is_limited(&self) -> bool {
        self.0.is_some()
    }

    /// Adds `steps` to the count.
    pub fn add(&self, steps: u64) {
        if let Some(count) = &self.0 {
            count.done.fetch_add(steps, Ordering::Relaxed);
        }
    }

    /// Resets the count to 0.
    pub fn restart(&self) {
        if let Some(count) = &self.0 {
            count.done.store(0, Ordering::Relaxed);
        }
    }

    /// Whether the count has reached the limit.
    pub fn is_spent(&self) -> bool {
        self.left() == 0
    }

    /// Whether the count has reached the limit, whether or not the question was cancelled.
    pub(crate) fn is_over(&self) -> bool {
        self.0.as_ref().is_some_and(|count| count.done.load(Ordering::Relaxed) >= count.most)
    }

    /// Steps counted so far; 0 without a limit.
    pub fn done(&self) -> u64 {
        self.0.as_ref().map_or(0, |count| count.done.load(Ordering::Relaxed))
    }

    /// Steps left up to the limit; `u64::MAX` without a limit.
    pub fn left(&self) -> u64 {
        let Some(count) = &self.0 else { return u64::MAX };
        if count.question.is_cancelled() {
            return 0;
        }
        count.most.saturating_sub(count.done.load(Ordering::Relaxed))
    }

    /// The error of a search that ended early and is finished up to this travel.
    pub fn spent(&self, reached_m: f64) -> Spent {
        let most = self.0.as_ref().map_or(u64::MAX, |count| count.most);
        Spent { most, reached_m, is_cancelled: self.is_cancelled() }
    }

    /// Returns an error if the limit is reached. The search is finished up to `reached_m`.
    pub(crate) fn check(&self, reached_m: f64) -> Result<(), Spent> {
        if self.is_spent() { Err(self.spent(reached_m)) } else { Ok(()) }
    }

    /// A separate meter whose limit is half of the remaining steps.
    pub(crate) fn half(&self) -> Self {
        if self.is_limited() { self.part(self.left() / 2) } else { Self::unlimited() }
    }

    /// Uses up the remaining steps, because the missing work would exceed the limit.
    pub(crate) fn exhaust(&self) {
        if self.0.is_some() {
            self.add(self.left());
        }
    }

    /// The meter for finding the end of a dragon's feasible travel: this one, or one with a limit if this one has none.
    pub(crate) fn for_placing(&self) -> Self {
        if self.0.is_some() { self.clone() } else { Self::of(MAX_PLACING_STEPS) }
    }
}

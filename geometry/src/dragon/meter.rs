//! Work, counted in steps and not in time, so that a search that reaches its limit does so at the same parameter on every machine.
//!
//! A step is one point of the route that is looked at for a link, some 50 ns. Work of another kind counts as the steps that
//! take about as long.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use thiserror::Error;

/// Steps that finding out how far a dragon can walk may take, some seconds' work.
const MAX_PLACING_STEPS: u64 = 100_000_000;

/// A limit of work, and the work that has been done under it. Clones count together.
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
}

/// A search has reached its limit of work before its end.
#[derive(Clone, Copy, Debug, Error, PartialEq)]
#[error("it takes more than {most} steps of work")]
pub struct Spent {
    /// The limit.
    pub most: u64,
    /// Travel of the head up to which the search is finished.
    pub reached_m: f64,
}

/// Counts without a limit.
pub(crate) static UNLIMITED: Meter = Meter(None);

impl Meter {
    /// No limit: nothing is counted.
    pub fn unlimited() -> Self {
        Self(None)
    }

    /// A limit of so many steps.
    pub fn of(most: u64) -> Self {
        Self(Some(Arc::new(Count { most, done: AtomicU64::new(0) })))
    }

    /// Whether there is a limit.
    pub fn is_limited(&self) -> bool {
        self.0.is_some()
    }

    /// Counts this many steps.
    pub fn add(&self, steps: u64) {
        if let Some(count) = &self.0 {
            count.done.fetch_add(steps, Ordering::Relaxed);
        }
    }

    /// Counts from 0 again.
    pub fn restart(&self) {
        if let Some(count) = &self.0 {
            count.done.store(0, Ordering::Relaxed);
        }
    }

    /// Whether the limit is reached.
    pub fn is_spent(&self) -> bool {
        self.left() == 0
    }

    /// Steps that were counted.
    pub fn done(&self) -> u64 {
        self.0.as_ref().map_or(0, |count| count.done.load(Ordering::Relaxed))
    }

    /// Steps that are left; without a limit as many as can be counted.
    pub fn left(&self) -> u64 {
        self.0.as_ref().map_or(u64::MAX, |count| count.most.saturating_sub(count.done.load(Ordering::Relaxed)))
    }

    /// The limit is reached by a search that is finished up to this travel.
    pub fn spent(&self, reached_m: f64) -> Spent {
        Spent { most: self.0.as_ref().map_or(u64::MAX, |count| count.most), reached_m }
    }

    /// Ends a search that is finished up to this travel where the limit is reached.
    pub(crate) fn check(&self, reached_m: f64) -> Result<(), Spent> {
        if self.is_spent() { Err(self.spent(reached_m)) } else { Ok(()) }
    }

    /// A meter of its own with half of what is left.
    pub(crate) fn half(&self) -> Self {
        if self.is_limited() { Self::of(self.left() / 2) } else { Self::unlimited() }
    }

    /// Leaves nothing: what is missing would exceed the limit.
    pub(crate) fn exhaust(&self) {
        if self.0.is_some() {
            self.add(self.left());
        }
    }

    /// The meter for finding out how far a dragon can walk: this one, or one with a limit of its own.
    pub(crate) fn for_placing(&self) -> Self {
        if self.0.is_some() { self.clone() } else { Self::of(MAX_PLACING_STEPS) }
    }
}

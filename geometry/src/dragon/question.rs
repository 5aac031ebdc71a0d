//! A question while it is answered, and its end before the answer.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use super::meter::Meter;

/// A question that one thread answers and that others may cancel. Clones are the same question.
///
/// Its searches count their work with meters of this question. When it is cancelled, they end within a millisecond or two, as at
/// their limit of work, with what they have found so far.
///
/// ```
/// use bench_dragon_geometry::dragon::Question;
///
/// let question = Question::default();
/// let meter = question.meter(1_000);
/// assert_eq!(meter.left(), 1_000);
/// question.cancel();
/// assert!(meter.is_spent() && question.meter(1_000).is_spent());
/// ```
#[derive(Clone, Debug, Default)]
pub struct Question(Arc<AtomicBool>);

impl Question {
    /// A meter for one search, with a limit of `most` steps of its own.
    pub fn meter(&self, most: u64) -> Meter {
        Meter::of_question(self.clone(), most)
    }

    /// Ends all searches of this question.
    pub fn cancel(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether the question was cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// The flag that cancels the question once it is true, for a signal handler.
    pub fn flag(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.0)
    }
}

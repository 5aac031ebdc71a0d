//! Work on all cores.

use std::cell::Cell;
use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

thread_local! {
    /// Whether this thread is one of those that work.
    static WORKS: Cell<bool> = const { Cell::new(false) };
}

/// The results of `work` on each of `count` items, in order; on all cores, each of which takes the next item when it has
/// done with one. Work within work stays on its core, so that there are never more threads than cores.
pub(super) fn on_all_cores<Answer: Send>(count: usize, work: impl Fn(usize) -> Answer + Sync) -> Vec<Answer> {
    if WORKS.get() {
        return (0..count).map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let threads = thread::available_parallelism().map_or(1, NonZero::get).min(count);
    let take = || {
        WORKS.set(true);
        let items = std::iter::from_fn(|| Some(next.fetch_add(1, Ordering::Relaxed)).filter(|&item| item < count));
        items.map(|item| (item, work(item))).collect::<Vec<_>>()
    };
    let mut answers: Vec<(usize, Answer)> = thread::scope(|scope| {
        let threads: Vec<_> = (0..threads).map(|_| scope.spawn(take)).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("the work does not panic")).collect()
    });
    answers.sort_unstable_by_key(|&(item, _)| item);
    answers.into_iter().map(|(_, answer)| answer).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_within_work_stays_on_its_core() {
        let is_alone = |outer| on_all_cores(10, |inner| (outer * inner, thread::current().id()));
        for answers in on_all_cores(10, |item| (thread::current().id(), is_alone(item))) {
            assert!(answers.1.iter().all(|(_, thread)| *thread == answers.0));
        }
    }

    #[test]
    fn answers_come_in_order() {
        assert_eq!(on_all_cores(100, |item| item * item), (0..100).map(|item| item * item).collect::<Vec<_>>());
        assert!(on_all_cores(0, |item| item).is_empty());
    }
}

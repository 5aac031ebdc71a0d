//! Work on all cores.

use std::num::NonZero;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// The results of `work` on each of `count` items, in order; on all cores, each of which takes the next item when it has
/// done with one.
pub(super) fn on_all_cores<Answer: Send>(count: usize, work: impl Fn(usize) -> Answer + Sync) -> Vec<Answer> {
    let next = AtomicUsize::new(0);
    let threads = thread::available_parallelism().map_or(1, NonZero::get).min(count);
    let take = || {
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
    fn answers_come_in_order() {
        assert_eq!(on_all_cores(100, |item| item * item), (0..100).map(|item| item * item).collect::<Vec<_>>());
        assert!(on_all_cores(0, |item| item).is_empty());
    }
}

//! What has come and has not been taken yet: bounded, without a lock, the oldest given up first.

use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};

use crossbeam::queue::ArrayQueue;

/// A queue between a thread of zenoh's, which never waits, and the one of the bus.
///
/// Full is: so many entries, or so many bytes. Then the oldest are dropped, and counted.
#[derive(Debug)]
pub(super) struct Backlog<Entry> {
    entries: ArrayQueue<(usize, Entry)>,
    bytes: AtomicUsize,
    max_bytes: usize,
    dropped: AtomicU64,
}

impl<Entry> Backlog<Entry> {
    /// An empty one.
    pub(super) fn new(max_entries: usize, max_bytes: usize) -> Self {
        Self {
            entries: ArrayQueue::new(max_entries),
            bytes: AtomicUsize::new(0),
            max_bytes,
            dropped: AtomicU64::new(0),
        }
    }

    /// Adds an entry that holds so many bytes.
    pub(super) fn push(&self, bytes: usize, entry: Entry) {
        let mut held = self.bytes.fetch_add(bytes, Ordering::Relaxed) + bytes;
        while held > self.max_bytes && self.pop().is_some() {
            self.dropped.fetch_add(1, Ordering::Relaxed);
            held = self.bytes.load(Ordering::Relaxed);
        }
        if let Some((bytes, _)) = self.entries.force_push((bytes, entry)) {
            self.bytes.fetch_sub(bytes, Ordering::Relaxed);
            self.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// The oldest entry.
    pub(super) fn pop(&self) -> Option<Entry> {
        let (bytes, entry) = self.entries.pop()?;
        self.bytes.fetch_sub(bytes, Ordering::Relaxed);
        Some(entry)
    }

    /// Entries that were given up.
    pub(super) fn dropped(&self) -> u64 {
        self.dropped.load(Ordering::Relaxed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rest(backlog: &Backlog<u32>) -> Vec<u32> {
        std::iter::from_fn(|| backlog.pop()).collect()
    }

    #[test]
    fn too_many_entries_cost_the_oldest() {
        let backlog = Backlog::new(3, usize::MAX);
        (0..5).for_each(|entry| backlog.push(10, entry));
        assert_eq!((rest(&backlog), backlog.dropped()), (vec![2, 3, 4], 2));
    }

    #[test]
    fn too_many_bytes_cost_the_oldest() {
        let backlog = Backlog::new(100, 25);
        (0..5).for_each(|entry| backlog.push(10, entry));
        assert_eq!((rest(&backlog), backlog.dropped()), (vec![3, 4], 3));
        assert_eq!(backlog.bytes.load(Ordering::Relaxed), 0);
    }

    #[test]
    fn whatever_two_threads_do_every_entry_is_taken_or_counted() {
        const ENTRIES: u64 = 20_000;
        let backlog = Backlog::new(8, 700);
        let taken = std::thread::scope(|scope| {
            let pushing = scope.spawn(|| (0..ENTRIES).for_each(|entry| backlog.push(100, entry)));
            let mut taken = Vec::new();
            while !pushing.is_finished() {
                taken.extend(backlog.pop());
            }
            taken.extend(std::iter::from_fn(|| backlog.pop()));
            taken
        });
        assert!(taken.is_sorted(), "in the order in which they came");
        assert_eq!(taken.len() as u64 + backlog.dropped(), ENTRIES);
        assert_eq!(backlog.bytes.load(Ordering::Relaxed), 0);
    }
}

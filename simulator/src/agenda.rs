//! The agenda: what happens when, in the order of the simulated clock.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// Events in the order of their instants; those of one instant in the order in which they were added.
#[derive(Debug)]
pub(crate) struct Agenda<E> {
    events: BinaryHeap<Reverse<Entry<E>>>,
    added: u64,
}

#[derive(Debug)]
struct Entry<E> {
    at: (u64, u64),
    event: E,
}

impl<E> Agenda<E> {
    pub(crate) fn new() -> Self {
        Self { events: BinaryHeap::new(), added: 0 }
    }

    pub(crate) fn add(&mut self, at_ns: u64, event: E) {
        self.events.push(Reverse(Entry { at: (at_ns, self.added), event }));
        self.added += 1;
    }

    /// Takes the next event, with its instant.
    pub(crate) fn next(&mut self) -> Option<(u64, E)> {
        self.events.pop().map(|Reverse(Entry { at, event })| (at.0, event))
    }
}

impl<E> PartialEq for Entry<E> {
    fn eq(&self, other: &Self) -> bool {
        self.at == other.at
    }
}

impl<E> Eq for Entry<E> {}

impl<E> PartialOrd for Entry<E> {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl<E> Ord for Entry<E> {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.at.cmp(&other.at)
    }
}

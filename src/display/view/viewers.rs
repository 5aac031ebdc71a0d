//! The open streams. At the limit, a page with the token takes the place of the longest open one without.

use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

/// Greatest number of simultaneous streams.
pub const MAX_VIEWERS: usize = 32;

/// The open streams of a view.
#[derive(Clone, Debug, Default)]
pub(in crate::display) struct Viewers(Arc<Mutex<OpenStreams>>);

#[derive(Debug, Default)]
struct OpenStreams {
    /// In the order in which they were opened.
    streams: Vec<OpenStream>,
    next_id: u64,
}

#[derive(Debug)]
struct OpenStream {
    id: u64,
    has_token: bool,
    /// Dropped to end the stream.
    _held: oneshot::Sender<()>,
}

/// The place of an open stream. It counts until this is dropped.
#[derive(Debug)]
pub(in crate::display) struct Place {
    viewers: Viewers,
    id: u64,
    lost: oneshot::Receiver<()>,
}

impl Viewers {
    /// Takes a place. `None` if there is none for a page with or without the token.
    pub(in crate::display) fn take(&self, has_token: bool) -> Option<Place> {
        let mut open = self.open();
        if open.streams.len() >= MAX_VIEWERS {
            let replaced = open.replaceable(has_token)?;
            open.streams.remove(replaced);
        }
        let (held, lost) = oneshot::channel();
        let id = open.next_id;
        open.next_id += 1;
        open.streams.push(OpenStream { id, has_token, _held: held });
        Some(Place { viewers: self.clone(), id, lost })
    }

    /// Number of open streams.
    pub(in crate::display) fn count(&self) -> usize {
        self.open().streams.len()
    }

    /// Whether there is no place for a page with or without the token.
    pub(in crate::display) fn is_full(&self, has_token: bool) -> bool {
        let open = self.open();
        open.streams.len() >= MAX_VIEWERS && open.replaceable(has_token).is_none()
    }

    /// Ignores a poisoned lock: the values are consistent even after a panic.
    fn open(&self) -> MutexGuard<'_, OpenStreams> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl OpenStreams {
    /// Index of the longest open stream that a page may replace.
    fn replaceable(&self, has_token: bool) -> Option<usize> {
        has_token.then(|| self.streams.iter().position(|stream| !stream.has_token))?
    }
}

impl Place {
    /// Returns when a page with the token has taken this place.
    pub(in crate::display) async fn lost(&mut self) {
        // No value is ever sent: the wait ends when the sender is dropped with the stream's entry.
        let _ = (&mut self.lost).await;
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.viewers.open().streams.retain(|stream| stream.id != self.id);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn take(viewers: &Viewers, has_token: bool, count: usize) -> Vec<Place> {
        (0..count).map_while(|_| viewers.take(has_token)).collect()
    }

    fn is_lost(place: &mut Place) -> bool {
        place.lost.try_recv() == Err(oneshot::error::TryRecvError::Closed)
    }

    #[test]
    fn a_page_with_the_token_takes_the_place_of_the_longest_open_one_without() {
        let viewers = Viewers::default();
        let mut operators = take(&viewers, true, 1);
        let mut others = take(&viewers, false, 2 * MAX_VIEWERS);
        assert_eq!((others.len(), viewers.count()), (MAX_VIEWERS - 1, MAX_VIEWERS));
        assert!(viewers.is_full(false) && !viewers.is_full(true));
        operators.extend(take(&viewers, true, 2));
        assert_eq!(operators.len(), 3);
        assert_eq!(others.iter_mut().map(is_lost).collect::<Vec<_>>()[..3], [true, true, false]);
        assert!(viewers.count() == MAX_VIEWERS && !operators.iter_mut().any(is_lost));
        // A stream that has lost its place has none to give back.
        others.truncate(2);
        drop(others);
        assert_eq!(viewers.count(), 3);
    }

    #[test]
    fn pages_with_the_token_do_not_replace_each_other() {
        let viewers = Viewers::default();
        let operators = take(&viewers, true, MAX_VIEWERS);
        assert!(viewers.is_full(true) && viewers.take(true).is_none() && viewers.take(false).is_none());
        drop(operators);
        assert!(viewers.count() == 0 && viewers.take(false).is_some());
    }
}

//! Places for connections: so many in all, and fewer from another machine, so that one machine cannot keep all others out.
//!
//! Where all places are taken, a new connection takes that of the one that has been idle the longest: a connection is idle
//! while no request of it is being answered. One that has shown what it takes to steer keeps its place.

use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

/// Connections at a time.
pub const MAX_CONNECTIONS: usize = 128;
/// Connections at a time from one address; from this machine, where a proxy may stand for many, as many as there are.
pub const MAX_FROM_ADDRESS: usize = 48;

/// The places, some of them taken.
#[derive(Clone, Debug, Default)]
pub(super) struct Seats(Arc<Mutex<Taken>>);

#[derive(Debug, Default)]
struct Taken {
    /// In the order in which they were last idle, or taken.
    places: Vec<Place>,
    next_id: u64,
}

#[derive(Debug)]
struct Place {
    id: u64,
    address: IpAddr,
    /// Requests that are being answered.
    requests: u32,
    is_kept: bool,
    /// Dropped when the place is taken away.
    _held: oneshot::Sender<()>,
}

/// A place; free again when it is dropped.
#[derive(Debug)]
pub(super) struct Seat {
    connection: Connection,
    lost: oneshot::Receiver<()>,
}

/// The connection that a request came by, among the request's extensions.
#[derive(Clone, Debug)]
pub struct Connection {
    seats: Seats,
    id: u64,
}

/// A request that is being answered, until it is dropped.
#[derive(Debug)]
pub(super) struct Answering(Connection);

impl Seats {
    /// Takes a place for a connection from an address, if there is one for it, or one of an idle connection.
    pub(super) fn take(&self, address: IpAddr) -> Option<Seat> {
        let mut taken = self.taken();
        let most = if address.to_canonical().is_loopback() { MAX_CONNECTIONS } else { MAX_FROM_ADDRESS };
        let from_here = taken.places.iter().filter(|place| place.address == address).count();
        if from_here >= most {
            taken.take_away(|place| place.address == address)?;
        } else if taken.places.len() >= MAX_CONNECTIONS {
            taken.take_away(|_| true)?;
        }
        let (held, lost) = oneshot::channel();
        let id = taken.next_id;
        taken.next_id += 1;
        taken.places.push(Place { id, address, requests: 0, is_kept: false, _held: held });
        Some(Seat { connection: Connection { seats: self.clone(), id }, lost })
    }

    /// A thread that panicked meanwhile has left whole places all the same.
    fn taken(&self) -> MutexGuard<'_, Taken> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Taken {
    /// Takes the place of the one of these that has been idle the longest away, if one is idle.
    fn take_away(&mut self, of: impl Fn(&Place) -> bool) -> Option<()> {
        let idle = |place: &Place| place.requests == 0 && !place.is_kept && of(place);
        let oldest = self.places.iter().position(idle)?;
        self.places.remove(oldest);
        Some(())
    }
}

impl Seat {
    /// The connection that has it.
    pub(super) fn connection(&self) -> Connection {
        self.connection.clone()
    }

    /// Returns when the place is taken away.
    pub(super) async fn lost(&mut self) {
        // Nothing is ever sent: its sender goes with the place.
        let _ = (&mut self.lost).await;
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let id = self.connection.id;
        self.connection.seats.taken().places.retain(|place| place.id != id);
    }
}

impl Connection {
    /// Keeps its place for as long as it lasts, whoever else comes.
    pub fn keep(&self) {
        self.change(|place| place.is_kept = true);
    }

    /// A request of it is being answered.
    pub(super) fn answering(&self) -> Answering {
        self.change(|place| place.requests += 1);
        Answering(self.clone())
    }

    fn change(&self, change: impl FnOnce(&mut Place)) {
        if let Some(place) = self.seats.taken().places.iter_mut().find(|place| place.id == self.id) {
            change(place);
        }
    }
}

impl Drop for Answering {
    /// From now on it is idle, for less time than all others.
    fn drop(&mut self) {
        let mut taken = self.0.seats.taken();
        if let Some(index) = taken.places.iter().position(|place| place.id == self.0.id) {
            let mut place = taken.places.remove(index);
            place.requests -= 1;
            taken.places.push(place);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(address: &str) -> IpAddr {
        address.parse().expect("an address")
    }

    fn take(seats: &Seats, from: &str, count: usize) -> Vec<Seat> {
        (0..count).map_while(|_| seats.take(address(from))).collect()
    }

    fn is_lost(seat: &mut Seat) -> bool {
        seat.lost.try_recv() == Err(oneshot::error::TryRecvError::Closed)
    }

    #[test]
    fn one_machine_does_not_take_all_places_and_what_is_left_is_free_again() {
        let seats = Seats::default();
        let mut greedy = take(&seats, "10.0.0.66", 200);
        assert_eq!(seats.taken().places.len(), MAX_FROM_ADDRESS);
        assert_eq!(greedy.iter_mut().map(is_lost).filter(|lost| *lost).count(), 200 - MAX_FROM_ADDRESS);
        assert_eq!(take(&seats, "10.0.0.7", 1).len(), 1);
        drop(greedy);
        assert!(seats.taken().places.is_empty());
    }

    #[test]
    fn idle_connections_lose_their_places_the_oldest_first_and_kept_and_busy_ones_never() {
        let seats = Seats::default();
        let mut here = take(&seats, "127.0.0.1", MAX_CONNECTIONS);
        here[0].connection().keep();
        let busy = here[1].connection().answering();
        let newcomer = seats.take(address("10.0.0.7")).expect("a place");
        assert_eq!([0, 1, 2, 3].map(|i| is_lost(&mut here[i])), [false, false, true, false]);
        // What was busy is idle for less time than all others.
        drop(busy);
        let mut others = take(&seats, "::1", MAX_CONNECTIONS - 3);
        assert!(!is_lost(&mut here[1]) && here[3..].iter_mut().all(is_lost));
        others.extend(take(&seats, "::1", 2));
        assert!(is_lost(&mut here[1]) && !is_lost(&mut here[0]));
        drop(newcomer);
    }

    #[test]
    fn a_place_is_not_taken_from_who_is_being_answered() {
        let seats = Seats::default();
        let here = take(&seats, "127.0.0.1", MAX_CONNECTIONS);
        let _busy: Vec<Answering> = here.iter().map(|seat| seat.connection().answering()).collect();
        assert!(seats.take(address("::1")).is_none() && seats.take(address("10.0.0.7")).is_none());
        assert_eq!(seats.taken().places.len(), MAX_CONNECTIONS);
    }
}

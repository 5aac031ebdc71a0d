//! Places for connections: so many in all, and fewer from one address, so that one machine cannot keep all others out.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Connections at a time; further ones are closed at once.
pub const MAX_CONNECTIONS: usize = 128;
/// Connections at a time from one address; from this machine, where a proxy may stand for many, as many as there are.
pub const MAX_FROM_ADDRESS: usize = 48;

/// The places, some of them taken.
#[derive(Clone, Debug, Default)]
pub(super) struct Seats(Arc<Mutex<HashMap<IpAddr, usize>>>);

/// A place; free again when it is dropped.
#[derive(Debug)]
pub(super) struct Seat {
    seats: Seats,
    address: IpAddr,
}

impl Seats {
    /// Takes a place for a connection from an address, if there is one for it.
    pub(super) fn take(&self, address: IpAddr) -> Option<Seat> {
        let mut taken = self.taken();
        let in_all: usize = taken.values().sum();
        let from_here = taken.get(&address).copied().unwrap_or_default();
        let most = if address.to_canonical().is_loopback() { MAX_CONNECTIONS } else { MAX_FROM_ADDRESS };
        if in_all >= MAX_CONNECTIONS || from_here >= most {
            return None;
        }
        taken.insert(address, from_here + 1);
        Some(Seat { seats: self.clone(), address })
    }

    /// A thread that panicked while it counted has left whole numbers all the same.
    fn taken(&self) -> MutexGuard<'_, HashMap<IpAddr, usize>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let mut taken = self.seats.taken();
        let left = taken.remove(&self.address).unwrap_or_default().saturating_sub(1);
        if left > 0 {
            taken.insert(self.address, left);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn take(seats: &Seats, address: &str, count: usize) -> Vec<Seat> {
        let address = address.parse().expect("an address");
        (0..count).map_while(|_| seats.take(address)).collect()
    }

    #[test]
    fn one_machine_does_not_take_all_places_and_what_is_left_is_free_again() {
        let seats = Seats::default();
        let greedy = take(&seats, "10.0.0.66", 200);
        assert_eq!(greedy.len(), MAX_FROM_ADDRESS);
        assert_eq!(take(&seats, "10.0.0.7", 1).len(), 1);
        drop(greedy);
        assert!(seats.taken().is_empty());
    }

    #[test]
    fn this_machine_may_take_all_places_and_no_more() {
        let seats = Seats::default();
        let here = take(&seats, "127.0.0.1", 200);
        assert_eq!(here.len(), MAX_CONNECTIONS);
        assert!(take(&seats, "10.0.0.7", 1).is_empty() && take(&seats, "::1", 1).is_empty());
    }
}

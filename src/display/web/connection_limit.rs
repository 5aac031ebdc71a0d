//! The limit of connections: one in total, and a smaller one for each other machine, so that one machine cannot exclude all
//! others.
//!
//! At the limit, a new connection replaces the one that has been idle the longest. A connection is idle while none of its
//! requests is in progress. A connection that has shown the token is not replaced.

use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

/// Greatest number of simultaneous connections.
pub const MAX_CONNECTIONS: usize = 128;
/// Greatest number of simultaneous connections from one address. This machine may have all [`MAX_CONNECTIONS`], since a proxy
/// on it can serve many clients.
pub const MAX_FROM_ADDRESS: usize = 48;

/// The open connections of a site.
#[derive(Clone, Debug, Default)]
pub(super) struct ConnectionLimit(Arc<Mutex<OpenConnections>>);

#[derive(Debug, Default)]
struct OpenConnections {
    /// In the order in which they were opened or last became idle.
    connections: Vec<OpenConnection>,
    next_id: u64,
}

#[derive(Debug)]
struct OpenConnection {
    id: u64,
    address: IpAddr,
    /// Number of requests in progress.
    requests: u32,
    is_kept: bool,
    /// Dropped to close the connection.
    _held: oneshot::Sender<()>,
}

/// An admitted connection. It counts until this is dropped.
#[derive(Debug)]
pub(super) struct Permit {
    pub(super) connection: Connection,
    closed: oneshot::Receiver<()>,
}

/// The connection of a request, stored in the request's extensions.
#[derive(Clone, Debug)]
pub struct Connection {
    limit: ConnectionLimit,
    id: u64,
    address: IpAddr,
}

/// A request in progress, until this is dropped.
#[derive(Debug)]
pub(super) struct RequestInProgress(Connection);

impl ConnectionLimit {
    /// Admits a connection from an address. At the limit it closes an idle connection first; it returns `None` if none is idle.
    pub(super) fn take(&self, address: IpAddr) -> Option<Permit> {
        let mut open = self.open();
        let most = if address.to_canonical().is_loopback() { MAX_CONNECTIONS } else { MAX_FROM_ADDRESS };
        let from_here = open.connections.iter().filter(|connection| connection.address == address).count();
        if from_here >= most {
            open.close_idle(|connection| connection.address == address)?;
        } else if open.connections.len() >= MAX_CONNECTIONS {
            open.close_idle(|_| true)?;
        }
        let (held, closed) = oneshot::channel();
        let id = open.next_id;
        open.next_id += 1;
        open.connections.push(OpenConnection { id, address, requests: 0, is_kept: false, _held: held });
        Some(Permit { connection: Connection { limit: self.clone(), id, address }, closed })
    }

    /// Ignores a poisoned lock: the values are consistent even after a panic.
    fn open(&self) -> MutexGuard<'_, OpenConnections> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl OpenConnections {
    /// Closes the matching connection that has been idle the longest. Returns `None` if no matching connection is idle.
    fn close_idle(&mut self, of: impl Fn(&OpenConnection) -> bool) -> Option<()> {
        let idle = |connection: &OpenConnection| connection.requests == 0 && !connection.is_kept && of(connection);
        let oldest = self.connections.iter().position(idle)?;
        self.connections.remove(oldest);
        Some(())
    }
}

impl Permit {
    /// Returns when this connection must close in favour of another one.
    pub(super) async fn closed(&mut self) {
        // No value is ever sent: the wait ends when the sender is dropped with the connection.
        let _ = (&mut self.closed).await;
    }
}

impl Drop for Permit {
    fn drop(&mut self) {
        let id = self.connection.id;
        self.connection.limit.open().connections.retain(|connection| connection.id != id);
    }
}

impl Connection {
    /// Address of the other end. Behind a proxy, it is that of the proxy.
    pub fn address(&self) -> IpAddr {
        self.address
    }

    /// Protects this connection from being replaced by others.
    pub fn keep(&self) {
        self.change(|connection| connection.is_kept = true);
    }

    /// Whether this connection is protected from being replaced.
    pub fn is_kept(&self) -> bool {
        self.limit.open().connections.iter().any(|connection| connection.id == self.id && connection.is_kept)
    }

    /// Counts a request of this connection as in progress until the result is dropped.
    pub(super) fn begin_request(&self) -> RequestInProgress {
        self.change(|connection| connection.requests += 1);
        RequestInProgress(self.clone())
    }

    fn change(&self, change: impl FnOnce(&mut OpenConnection)) {
        if let Some(connection) = self.limit.open().connections.iter_mut().find(|connection| connection.id == self.id) {
            change(connection);
        }
    }
}

impl Drop for RequestInProgress {
    /// Moves the connection to the end of the order: it has been idle for the shortest time.
    fn drop(&mut self) {
        let mut open = self.0.limit.open();
        if let Some(index) = open.connections.iter().position(|connection| connection.id == self.0.id) {
            let mut connection = open.connections.remove(index);
            connection.requests -= 1;
            open.connections.push(connection);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn address(address: &str) -> IpAddr {
        address.parse().expect("an address")
    }

    fn take(limit: &ConnectionLimit, from: &str, count: usize) -> Vec<Permit> {
        (0..count).map_while(|_| limit.take(address(from))).collect()
    }

    fn is_closed(permit: &mut Permit) -> bool {
        permit.closed.try_recv() == Err(oneshot::error::TryRecvError::Closed)
    }

    #[test]
    fn one_machine_cannot_take_all_connections_and_dropped_ones_are_free_again() {
        let limit = ConnectionLimit::default();
        let mut greedy = take(&limit, "10.0.0.66", 200);
        assert_eq!(limit.open().connections.len(), MAX_FROM_ADDRESS);
        assert_eq!(greedy.iter_mut().map(is_closed).filter(|closed| *closed).count(), 200 - MAX_FROM_ADDRESS);
        assert_eq!(take(&limit, "10.0.0.7", 1).len(), 1);
        drop(greedy);
        assert!(limit.open().connections.is_empty());
    }

    #[test]
    fn only_idle_connections_are_closed_the_longest_idle_first() {
        let limit = ConnectionLimit::default();
        let mut here = take(&limit, "127.0.0.1", MAX_CONNECTIONS);
        here[0].connection.keep();
        let busy = here[1].connection.begin_request();
        let newcomer = limit.take(address("10.0.0.7")).expect("a connection");
        assert_eq!([0, 1, 2, 3].map(|i| is_closed(&mut here[i])), [false, false, true, false]);
        // The connection that was busy has now been idle for the shortest time.
        drop(busy);
        let mut others = take(&limit, "::1", MAX_CONNECTIONS - 3);
        assert!(!is_closed(&mut here[1]) && here[3..].iter_mut().all(is_closed));
        others.extend(take(&limit, "::1", 2));
        assert!(is_closed(&mut here[1]) && !is_closed(&mut here[0]));
        drop(newcomer);
    }

    #[test]
    fn a_connection_with_a_request_in_progress_is_not_closed() {
        let limit = ConnectionLimit::default();
        let here = take(&limit, "127.0.0.1", MAX_CONNECTIONS);
        let _busy: Vec<RequestInProgress> = here.iter().map(|permit| permit.connection.begin_request()).collect();
        assert!(limit.take(address("::1")).is_none() && limit.take(address("10.0.0.7")).is_none());
        assert_eq!(limit.open().connections.len(), MAX_CONNECTIONS);
    }
}

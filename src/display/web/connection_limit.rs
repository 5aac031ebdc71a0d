//! The limit of connections: so many in all, and fewer from another machine, so that one machine cannot keep all others out.
//!
//! At the limit, a new connection replaces the one that has been idle the longest: a connection is idle while no request of it is
//! being answered. A connection that has shown the token is not replaced.

use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use tokio::sync::oneshot;

/// Connections at a time.
pub const MAX_CONNECTIONS: usize = 128;
/// Connections at a time from one address; from this machine, where a proxy may stand for many, as many as there are.
pub const MAX_FROM_ADDRESS: usize = 48;

/// The open connections of a site.
#[derive(Clone, Debug, Default)]
pub(super) struct ConnectionLimit(Arc<Mutex<OpenConnections>>);

#[derive(Debug, Default)]
struct OpenConnections {
    /// In the order in which they were opened, or were last busy.
    connections: Vec<OpenConnection>,
    next_id: u64,
}

#[derive(Debug)]
struct OpenConnection {
    id: u64,
    address: IpAddr,
    /// Requests that are being answered.
    requests: u32,
    is_kept: bool,
    /// Dropped to close the connection.
    _held: oneshot::Sender<()>,
}

/// One of the connections under the limit, until it is dropped.
#[derive(Debug)]
pub(super) struct Permit {
    pub(super) connection: Connection,
    closed: oneshot::Receiver<()>,
}

/// The connection that a request came by, among the request's extensions.
#[derive(Clone, Debug)]
pub struct Connection {
    limit: ConnectionLimit,
    id: u64,
}

/// A request that is being answered, until it is dropped.
#[derive(Debug)]
pub(super) struct RequestInProgress(Connection);

impl ConnectionLimit {
    /// Admits a connection from an address. At the limit it closes an idle one first; `None` where none is idle.
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
        Some(Permit { connection: Connection { limit: self.clone(), id }, closed })
    }

    /// A thread that panicked meanwhile has left whole values all the same.
    fn open(&self) -> MutexGuard<'_, OpenConnections> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl OpenConnections {
    /// Closes that one of these that has been idle the longest, if one is idle.
    fn close_idle(&mut self, of: impl Fn(&OpenConnection) -> bool) -> Option<()> {
        let idle = |connection: &OpenConnection| connection.requests == 0 && !connection.is_kept && of(connection);
        let oldest = self.connections.iter().position(idle)?;
        self.connections.remove(oldest);
        Some(())
    }
}

impl Permit {
    /// Returns when the connection is to close for another one.
    pub(super) async fn closed(&mut self) {
        // Nothing is ever sent: its sender goes with the connection.
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
    /// Keeps it open for as long as it lasts, whoever else comes.
    pub fn keep(&self) {
        self.change(|connection| connection.is_kept = true);
    }

    /// A request of it is being answered.
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
    /// From now on it is idle, for less time than all others.
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
    fn one_machine_does_not_take_all_connections_and_what_is_left_is_free_again() {
        let limit = ConnectionLimit::default();
        let mut greedy = take(&limit, "10.0.0.66", 200);
        assert_eq!(limit.open().connections.len(), MAX_FROM_ADDRESS);
        assert_eq!(greedy.iter_mut().map(is_closed).filter(|closed| *closed).count(), 200 - MAX_FROM_ADDRESS);
        assert_eq!(take(&limit, "10.0.0.7", 1).len(), 1);
        drop(greedy);
        assert!(limit.open().connections.is_empty());
    }

    #[test]
    fn idle_connections_are_closed_the_oldest_first_and_kept_and_busy_ones_never() {
        let limit = ConnectionLimit::default();
        let mut here = take(&limit, "127.0.0.1", MAX_CONNECTIONS);
        here[0].connection.keep();
        let busy = here[1].connection.begin_request();
        let newcomer = limit.take(address("10.0.0.7")).expect("a connection");
        assert_eq!([0, 1, 2, 3].map(|i| is_closed(&mut here[i])), [false, false, true, false]);
        // What was busy is idle for less time than all others.
        drop(busy);
        let mut others = take(&limit, "::1", MAX_CONNECTIONS - 3);
        assert!(!is_closed(&mut here[1]) && here[3..].iter_mut().all(is_closed));
        others.extend(take(&limit, "::1", 2));
        assert!(is_closed(&mut here[1]) && !is_closed(&mut here[0]));
        drop(newcomer);
    }

    #[test]
    fn a_connection_that_is_being_answered_is_not_closed() {
        let limit = ConnectionLimit::default();
        let here = take(&limit, "127.0.0.1", MAX_CONNECTIONS);
        let _busy: Vec<RequestInProgress> = here.iter().map(|permit| permit.connection.begin_request()).collect();
        assert!(limit.take(address("::1")).is_none() && limit.take(address("10.0.0.7")).is_none());
        assert_eq!(limit.open().connections.len(), MAX_CONNECTIONS);
    }
}

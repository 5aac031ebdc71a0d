//! HTTP/1.1 for people and scrapers: what all our pages have in common.
//!
//! - *Where:* one address, loopback by default.
//! - *Who:* a request has to name this machine by a name that it has ([`Hosts`]), so that a foreign page cannot reach it by a
//!   name that it has bent to this address (DNS rebinding). Where a browser reports the page of origin, that has to be one of ours.
//! - *How much:* a [limit](MAX_CONNECTIONS) of connections, a smaller one for each other machine. The first line and the headers
//!   have a bounded length, and come within seconds. At the limit, a new connection replaces the one idle the longest.

mod connection_limit;
mod same_site;
mod site;

pub use connection_limit::{Connection, MAX_CONNECTIONS, MAX_FROM_ADDRESS};
pub use same_site::Hosts;
pub use site::{Site, closed, json_reply, refuse, text};

//! Serving people and scrapers over HTTP/1.1: what every page of ours has in common.
//!
//! - *Where:* one address, loopback unless told otherwise.
//! - *Who:* a request has to call this machine by a name that it has ([`Hosts`]), so that a page of elsewhere cannot reach it
//!   by a name that it has bent to this address (DNS rebinding); and where a browser says from which page it comes, that has
//!   to be one of ours.
//! - *How much:* so many connections at a time, fewer from another machine, each with its first line and headers within seconds, of a bounded
//!   length. Where all places are taken, the connection that has been idle the longest makes room for a new one.

mod hosts;
mod reply;
mod same_site;
mod seats;
mod site;

pub use hosts::Hosts;
pub use reply::{json, refuse, text};
pub use seats::{Connection, MAX_CONNECTIONS, MAX_FROM_ADDRESS};
pub use site::{Site, closed};

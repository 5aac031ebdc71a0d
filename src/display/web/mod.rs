//! HTTP/1.1 for browsers and scrapers: the server that all pages share.
//!
//! - *Address:* one address, loopback by default.
//! - *Requests:* a request must name this machine by one of its names ([`Hosts`]). So a foreign page cannot reach it through a
//!   name that resolves to this address (DNS rebinding). If a browser reports the page of origin, that page must be ours, unless the
//!   router judges other pages by their token.
//! - *Limits:* a [limit](MAX_CONNECTIONS) of connections, and a smaller one for each other machine. The first line and the
//!   headers have a greatest length and a timeout. At the limit, a new connection replaces the one that has been idle the
//!   longest.
//! - *Token:* changes need the site's token; off loopback, viewing needs it too (`gate`).

mod access;
mod closing;
mod connection_limit;
mod gate;
mod guesses;
mod page_file;
mod same_site;
mod site;

pub use access::{Token, TokenError};
pub use connection_limit::{Connection, MAX_CONNECTIONS, MAX_FROM_ADDRESS};
pub use same_site::Hosts;
pub use site::{JSON, Site, closed, json_reply, refuse, text};

pub(super) use access::Rights;
pub(super) use closing::close;
pub(super) use gate::{Gate, is_json, judge_token};
pub(super) use page_file::add_page_file;
pub(super) use same_site::ForeignPage;

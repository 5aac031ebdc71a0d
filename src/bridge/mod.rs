//! Bridges: poses in the words of show control, for desks and media servers.
//!
//! A bridge is a reader of the bus like any other. At each release of a rate of its own it takes the newest frame, so that
//! the server neither wakes it nor waits for it, and says it again in packets: [`psn`], [`osc`]. The encoders know neither
//! clocks nor sockets. An [`Outlet`] takes their packets to a receiver; it sends and never reads.
//!
//! Speeds are in wall time: a frame's speeds, which are per show second, times its time scale. A frame that is too old
//! to be believed ([`freshness()`]) is sent again with every speed 0, so that nobody walks on where the server is gone.

pub mod osc;
pub mod psn;
#[cfg(feature = "zenoh")]
pub mod zenoh;

mod latest_frame;
mod osc_address;
mod outlet;
mod slip_sender;
mod udp_sender;

pub use latest_frame::{Freshness, LatestFrame, freshness, freshness_limit};
pub use outlet::{Delivery, MAX_PACKET_LEN, Outage, OutageChange, Outlet, Packets};
pub use udp_sender::{UdpSender, UdpTarget};

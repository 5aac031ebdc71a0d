//! Bridges: they send poses to lighting desks, media servers and other machines, in protocols of show control.
//!
//! A bridge is an ordinary reader of the bus. It polls the newest frame at its own rate, so the server neither wakes it nor
//! waits for it. It encodes the frame as packets of PosiStageNet ([`psn`]) or Open Sound Control ([`osc`]). The encoders use
//! neither clocks nor sockets. An [`Outlet`] sends the packets to a receiver and never reads.
//!
//! The packets contain speeds per wall-clock second: a frame's speeds, which are per show second, times its time scale. A
//! stale frame ([`freshness()`]) is repeated with all speeds 0, so that receivers do not extrapolate while the server is
//! silent.

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

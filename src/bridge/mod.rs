//! Bridges: they send poses to lighting desks, media servers and other machines, in protocols of show control.
//!
//! A bridge is an ordinary reader of the bus. It polls the newest frame at its own rate, so the server neither wakes it nor
//! waits for it. It encodes the frame as packets of PosiStageNet ([`psn`]) or Open Sound Control ([`osc`]). The encoders use
//! neither clocks nor sockets. An [`Outlet`] sends the packets to a receiver and never reads. Only [`osc_steering`] reads: commands
//! to the server.
//!
//! A [`BenchSelection`] chooses the benches, and a [`StageTransform`] places them in the coordinate system of a desk.
//! [`desk_settings`] describes all that an operator enters there.
//!
//! The packets contain speeds per wall-clock second: a frame's speeds, which are per show second, times its time scale. A
//! stale frame ([`freshness()`]) is repeated with all speeds 0, so that receivers do not extrapolate while the server is
//! silent.

pub mod desk_settings;
pub mod osc;
pub mod osc_steering;
pub mod psn;
pub mod stage_transform;
pub mod timecode;
#[cfg(feature = "zenoh")]
pub mod zenoh;

mod axis_order;
mod bench_selection;
mod latest_frame;
mod osc_address;
mod outlet;
mod psn_names;
mod rate_limit;
mod slip_sender;
mod source_pace;
mod udp_sender;

pub use axis_order::{AxisOrder, AxisOrderError};
pub use bench_selection::{BenchSelection, BenchSelectionError};
pub use latest_frame::{Freshness, LatestFrame, StaleAfter, StaleAfterError, freshness};
pub use outlet::{Delivery, MAX_PACKET_LEN, Outage, OutageChange, Outlet, Packets};
pub use source_pace::SourcePace;
pub use stage_transform::StageTransform;
pub use udp_sender::{UdpSender, UdpTarget};

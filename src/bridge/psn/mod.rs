//! PosiStageNet 2.03, the protocol by which lighting desks and media servers follow what moves on a stage.
//!
//! Words: a *tracker* is something followed, here a bench; a *packet* is a datagram; a *frame* is the packets that tell of
//! all trackers at once, under one number and each with their count. DATA packets tell where trackers are, INFO packets what
//! they are called. A packet is a tree of *chunks*.
//!
//! Source: PosiStageNet protocol, version 2.03 of 2019-09-09 (VYV Corporation, MA Lighting), posistage.net.

mod chunk;
mod encoder;
mod system_name;
mod tracker;

pub use encoder::{MAX_BENCHES, PsnEncoder, TooManyBenches};
pub use system_name::{SystemName, SystemNameError};
pub use tracker::Tracker;

use std::net::{Ipv4Addr, SocketAddrV4};

/// Where PosiStageNet is sent where nothing else was agreed on.
pub const DEFAULT_TARGET: SocketAddrV4 = SocketAddrV4::new(Ipv4Addr::new(236, 10, 10, 10), 56_565);

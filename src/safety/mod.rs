//! Safety: the monitor measures and reports clearances, and the guard grants the head only proven travel.
//!
//! In the server, the head's [`motion`](crate::source::server::motion) obeys the grants. It stops at the end of a grant, even
//! without a running guard. The commands of monitor and guard own the clocks and the bus.

pub mod alerts;
pub mod forecast;
pub mod guard;
pub mod monitor;

mod source_motion;
mod stage_watch;

//! What keeps benches apart: the monitor measures and reports, the guard grants the head no travel that is not proven free.
//!
//! The server's end of the guard's grants is the head's [`motion`](crate::source::server::motion), which stops at the end of what
//! it was granted also where no guard is left. Clocks and the bus of both are their commands'.

pub mod alerts;
pub mod forecast;
pub mod guard;
pub mod monitor;

mod source_motion;

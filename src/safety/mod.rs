//! What keeps benches apart: the monitor measures and reports, the guard grants the head no travel that is not proven free.

pub mod guard;
pub mod monitor;

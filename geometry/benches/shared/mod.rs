//! Code that the benches share: routes, fair timing of all contestants, and output of the figures.
#![allow(dead_code, unreachable_pub, clippy::print_stdout, reason = "each bench uses a part of this, and prints")]

mod arguments;
mod figures;
mod handle_state;
mod routes;
mod timing;

#[allow(unused_imports, reason = "each bench uses a part of this")]
pub use self::{
    arguments::{require_no_arguments, seconds_or},
    figures::Figures,
    handle_state::HandleState,
    routes::{mixed, on_hills, through_a_square, winding},
    timing::{interleaved, median, nanoseconds_a_call, quantile},
};

//! Code that the benches share: that of the geometry's benches, and the product's own processes.
#![allow(dead_code, unreachable_pub, reason = "each bench uses a part of this")]

#[path = "../../geometry/benches/shared/mod.rs"]
mod of_geometry;
mod program;

#[allow(unused_imports, reason = "each bench uses a part of this")]
pub use self::{
    of_geometry::{Figures, interleaved, median, nanoseconds_a_call, quantile, require_no_arguments, seconds_or},
    program::{Program, domain, program},
};

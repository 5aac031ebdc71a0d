//! Searches for roots and maxima, intervals, and sines for vector loops.

mod bisection;
mod interval;
mod newton;
mod peak;
mod sine;

pub(crate) use bisection::{crossing, try_turning_point, turning_point};
pub(crate) use interval::Interval;
pub(crate) use newton::{Slope, rising_root};
pub(crate) use peak::{GOLDEN, Peak, higher, peak};
pub(crate) use sine::{multiply_add, sine_and_cosine_anywhere, small_sine_and_versine};

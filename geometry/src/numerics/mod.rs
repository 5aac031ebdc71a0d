//! Searches for roots and maxima, and sines for vector loops.

mod bisection;
mod newton;
mod peak;
mod sine;

pub(crate) use bisection::{try_turning_point, turning_point};
pub(crate) use newton::{Slope, rising_root};
pub(crate) use peak::{GOLDEN, peak};
pub(crate) use sine::{multiply_add, sine_and_cosine_anywhere, small_sine_and_versine};

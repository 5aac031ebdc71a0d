//! Searches for roots and minima.

mod bisection;
mod newton;
mod peak;
mod sine;

pub(crate) use bisection::turning_point;
pub(crate) use newton::{Slope, rising_root};
pub(crate) use peak::peak;
pub(crate) use sine::{multiply_add, sine_and_cosine, small_sine_and_versine};

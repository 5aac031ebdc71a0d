//! Searches for roots and minima.

mod bisection;
mod newton;

pub(crate) use bisection::turning_point;
pub(crate) use newton::{Slope, rising_root};

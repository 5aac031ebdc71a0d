//! Bisection: finds the argument at which a condition begins to hold.

use std::convert::Infallible;

/// Returns the ends of an interval over which `holds` changes from false to true. The interval is at most `tolerance` wide, or
/// one unit of rounding.
///
/// Bisection takes `holds` as false at `low` and true at `high`, and never calls it there. If `holds` changes more than once,
/// the result is one of its changes to true. It makes at most log₂((high − low) ÷ the width) calls.
pub(crate) fn turning_point(low: f64, high: f64, tolerance: f64, mut holds: impl FnMut(f64) -> bool) -> (f64, f64) {
    let found = try_turning_point(low, high, tolerance, |middle| Ok::<_, Infallible>(holds(middle)));
    found.unwrap_or_else(|never| match never {})
}

/// The same for a condition that can fail.
///
/// # Errors
/// Returns the first failure.
pub(crate) fn try_turning_point<E>(
    mut low: f64,
    mut high: f64,
    tolerance: f64,
    mut holds: impl FnMut(f64) -> Result<bool, E>,
) -> Result<(f64, f64), E> {
    while high - low > tolerance {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle)? {
            high = middle;
        } else {
            low = middle;
        }
    }
    Ok((low, high))
}

//! Where a condition begins to hold.

use std::convert::Infallible;

/// The ends of an interval at most `tolerance` wide, or one unit of rounding, over which `holds` turns from false to
/// true.
///
/// Bisection: `holds` is taken to be false at `low` and true at `high`, and is never asked there. If it turns more than
/// once, the answer is one of its turns to true. At most log₂((high − low) ÷ the width) questions are asked.
pub(crate) fn turning_point(low: f64, high: f64, tolerance: f64, mut holds: impl FnMut(f64) -> bool) -> (f64, f64) {
    let found = try_turning_point(low, high, tolerance, |middle| Ok::<_, Infallible>(holds(middle)));
    found.unwrap_or_else(|never| match never {})
}

/// The same with a condition that may fail.
///
/// # Errors
/// The first failure.
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

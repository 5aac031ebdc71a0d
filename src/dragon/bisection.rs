//! Where a condition that holds from some point on begins to hold.

/// The end of an interval at most `tolerance` wide (or one unit of rounding) within which `holds` turns true.
///
/// Bisection: `holds` is taken to be false at `low` and true at `high`, and is never asked there. The answer is a point
/// at which it is true. If it turns true, false and true again, the answer is one of its turns to true. The interval halves with
/// each question, so there are at most 64 + log₂((high − low) ÷ tolerance) of them.
pub(super) fn first_true(low: f64, high: f64, tolerance: f64, mut holds: impl FnMut(f64) -> bool) -> f64 {
    let (mut low, mut high) = (low, high);
    while high - low > tolerance {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

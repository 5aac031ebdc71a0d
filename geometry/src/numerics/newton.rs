//! Newton's method: finds the zero of an increasing function.

use std::ops::RangeInclusive;

/// Bound on steps. A smooth function takes about five, a function for which only bisection works about a hundred.
const MAX_STEPS: usize = 200;

/// Value and derivative of a function at one parameter.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slope {
    /// Below 0 before the root, above 0 behind it.
    pub(crate) value: f64,
    /// Derivative, above 0.
    pub(crate) growth: f64,
}

/// Finds the zero of an increasing function within `bracket`. Without a zero, the result approaches the nearer end of the
/// bracket.
///
/// Newton's method starts at `guess`, clamped to the bracket (rtsafe: Press and others, Numerical Recipes, 9.4). If a step
/// would leave the bracket, or is longer than half of the step before, the bracket is bisected instead. The search ends when
/// the function is within `tolerance` of 0, or at rounding.
pub(crate) fn rising_root(
    bracket: RangeInclusive<f64>,
    guess: f64,
    tolerance: f64,
    mut function: impl FnMut(f64) -> Slope,
) -> f64 {
    let (mut low, mut high) = bracket.into_inner();
    let mut at = guess.clamp(low, high);
    let mut last_step = high - low;
    for _ in 0..MAX_STEPS {
        let Slope { value, growth } = function(at);
        if value.abs() <= tolerance {
            break;
        }
        if value < 0.0 {
            low = at;
        } else {
            high = at;
        }
        let newton = at - value / growth;
        let brisk = newton > low && newton < high && 2.0 * (newton - at).abs() <= last_step;
        let next = if brisk { newton } else { 0.5 * (low + high) };
        last_step = (next - at).abs();
        if last_step == 0.0 || next <= low || next >= high {
            break;
        }
        at = next;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_root_is_found_to_the_tolerance() {
        let cube = |x: f64| Slope { value: x * x * x - 2.0, growth: 3.0 * x * x };
        let root = rising_root(0.0..=10.0, 9.0, 1e-14, cube);
        assert!((root - 2.0_f64.cbrt()).abs() < 1e-14, "{root}");
    }

    #[test]
    fn the_search_converges_at_a_kink_where_newtons_method_would_cycle() {
        let kinked = |x: f64| {
            if x < 0.0 { Slope { value: 4.0 * x, growth: 4.0 } } else { Slope { value: x - 1e-3, growth: 0.3 } }
        };
        let root = rising_root(-5.0..=7.0, -5.0, 1e-13, kinked);
        assert!((root - 1e-3).abs() < 1e-12, "{root}");
    }

    #[test]
    fn without_a_root_the_search_approaches_the_nearer_end() {
        let root = rising_root(0.0..=1.0, 0.2, 0.0, |x| Slope { value: x - 3.0, growth: 1.0 });
        assert!((root - 1.0).abs() < 1e-12, "{root}");
    }
}

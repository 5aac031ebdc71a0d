//! Maximum of a function of one variable.

/// Part of an interval that a golden-section step excludes: 1 − 1/φ.
pub(crate) const GOLDEN: f64 = 0.381_966_011_250_105_1;

/// Factor by which an interval is shortened to the part at its higher end, if the function falls from that end.
const SHORTENING: f64 = 64.0;

/// Bound on evaluations. Golden section alone reduces an interval by a factor of 10¹⁰ in 48.
const MAX_EVALUATIONS: usize = 100;

/// A largest value and its argument.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Peak {
    pub(crate) at: f64,
    pub(crate) value: f64,
}

/// Finds the maximum of a function with one peak on an interval, ends included.
///
/// Brent's method (Brent 1973, Algorithms for Minimization without Derivatives, chapter 5): a parabola through the best three
/// points, or golden section where the parabola does not help. Golden section takes longest towards a peak at an end. So the
/// interval is first shortened to the part at its higher end, as long as the function falls from there. The argument is exact to
/// `tolerance`, or to the square root of rounding at a smooth peak. The value is then exact to rounding. For a function with
/// several peaks, the result is one of them, and at least the value at either end.
pub(crate) fn peak(low: f64, high: f64, tolerance: f64, mut function: impl FnMut(f64) -> f64) -> Peak {
    let mut evaluate = |at| Peak { at, value: function(at) };
    let ends = [evaluate(low), evaluate(high)];
    let [low, high] = at_higher_end(ends, tolerance, &mut evaluate);
    let inner = within(low, high, tolerance, &mut evaluate);
    ends.into_iter().fold(inner, higher)
}

/// The higher of two peaks; the first if they are equal.
pub(crate) fn higher(first: Peak, second: Peak) -> Peak {
    if second.value > first.value { second } else { first }
}

/// The part of the interval between two ends that contains the peak: at the higher end, if the function falls from there.
fn at_higher_end(ends: [Peak; 2], tolerance: f64, evaluate: &mut impl FnMut(f64) -> Peak) -> [f64; 2] {
    let top = higher(ends[0], ends[1]);
    let mut reach = (ends[0].at - top.at) + (ends[1].at - top.at);
    while reach.abs() > tolerance && evaluate(top.at + reach / SHORTENING).value < top.value {
        reach /= SHORTENING;
    }
    [top.at + reach.min(0.0), top.at + reach.max(0.0)]
}

fn within(low: f64, high: f64, tolerance: f64, evaluate: &mut impl FnMut(f64) -> Peak) -> Peak {
    let (mut low, mut high) = (low, high);
    let mut best = evaluate(low + GOLDEN * (high - low));
    let (mut second, mut third) = (best, best);
    let (mut step, mut step_before) = (0.0_f64, 0.0_f64);
    for _ in 0..MAX_EVALUATIONS {
        let middle = 0.5 * (low + high);
        let finest = tolerance + 2.0 * f64::EPSILON * best.at.abs();
        if (best.at - middle).abs() <= 2.0 * finest - 0.5 * (high - low) {
            break;
        }
        let parabolic = parabola_step(best, second, third).filter(|parabolic| {
            let at = best.at + parabolic;
            at > low && at < high && parabolic.abs() < 0.5 * step_before.abs()
        });
        step_before = step;
        step = parabolic.unwrap_or_else(|| {
            step_before = if best.at < middle { high - best.at } else { low - best.at };
            GOLDEN * step_before
        });
        let toward = if parabolic.is_some() && (best.at + step - low).min(high - best.at - step) < 2.0 * finest {
            finest.copysign(middle - best.at)
        } else if step.abs() < finest {
            finest.copysign(step)
        } else {
            step
        };
        step = toward;
        let trial = evaluate(best.at + step);
        if trial.value >= best.value {
            if trial.at < best.at {
                high = best.at;
            } else {
                low = best.at;
            }
            (third, second, best) = (second, best, trial);
        } else {
            if trial.at < best.at {
                low = trial.at;
            } else {
                high = trial.at;
            }
            if trial.value >= second.value || second.at == best.at {
                (third, second) = (second, trial);
            } else if trial.value >= third.value || third.at == best.at || third.at == second.at {
                third = trial;
            }
        }
    }
    best
}

/// The step from `best` to the vertex of the parabola through three points.
fn parabola_step(best: Peak, second: Peak, third: Peak) -> Option<f64> {
    let to_second = (best.at - second.at) * (best.value - third.value);
    let to_third = (best.at - third.at) * (best.value - second.value);
    let numerator = (best.at - third.at) * to_third - (best.at - second.at) * to_second;
    let step = -0.5 * numerator / (to_third - to_second);
    step.is_finite().then_some(step)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_smooth_peak_is_exact_to_rounding() {
        let Peak { at, value } = peak(0.0, 4.0, 1e-10, |x| -(x - 1.234_567).powi(4) - (x - 1.234_567).powi(2) + 3.0);
        assert!((at - 1.234_567).abs() < 1e-7 && (value - 3.0).abs() < 1e-15, "{value} at {at}");
    }

    #[test]
    fn a_kink_is_found_to_the_tolerance() {
        let Peak { at, .. } = peak(-1.0, 2.0, 1e-12, |x| if x < 0.3 { x } else { 0.3 - 5.0 * (x - 0.3) });
        assert!((at - 0.3).abs() < 1e-11, "{at}");
    }

    #[test]
    fn a_peak_at_an_end_is_exact() {
        assert_eq!(peak(2.0, 5.0, 1e-9, |x| x).at, 5.0);
        assert_eq!(peak(2.0, 5.0, 1e-9, |x| -x).at, 2.0);
    }

    #[test]
    fn a_peak_at_an_end_or_beside_it_takes_few_evaluations() {
        let count = |at: f64| {
            let mut count = 0;
            let found = peak(2.0, 5.0, 1e-11, |x| {
                count += 1;
                -(x - at).abs()
            });
            assert!((found.at - at).abs() < 2e-11, "{found:?}");
            count
        };
        assert!(count(5.0) < 12 && count(2.0) < 12, "{}, {}", count(5.0), count(2.0));
        assert!(count(5.0 - 1e-6) < 45, "{}", count(5.0 - 1e-6));
    }
}

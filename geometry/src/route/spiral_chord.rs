//! Chords of the spiral r = θ.

/// The angle δ of a chord of this length from θ = `angle` to θ ± δ, with the sign of `sense`, which is ±1. The relative error is at
/// most 10⁻⁹ for δ up to ½ and θ from 30 on; towards the centre it grows to some percent.
///
/// By the law of cosines, the square of the length is δ² + 2·θ·(θ ± δ)·(1 − cos δ). One step of Newton's method begins at the first
/// terms of the inverse of its series, and two more of that of a circle.
#[inline]
pub(super) fn chord_angle(angle: f64, sense: f64, length: f64) -> f64 {
    let speed2 = 1.0 + angle * angle;
    let (first, drift) = (length / speed2.sqrt(), 0.5 * sense * angle / speed2);
    let squared = first * first;
    let bend = 2.5 * drift * drift + angle * angle / (24.0 * speed2);
    let circle = squared * squared * (3.0 / 640.0 + squared * (5.0 / 7168.0));
    let start = first * (1.0 - drift * first + squared * (bend - drift * first / 6.0) + circle);
    let (far, squared) = (angle + sense * start, start * start);
    // 2·(1 − cos δ) and its derivative.
    let versine =
        squared * (1.0 - squared / 12.0 * (1.0 - squared / 30.0 * (1.0 - squared / 56.0 * (1.0 - squared / 90.0))));
    let sine = 2.0 * start * (1.0 - squared / 6.0 * (1.0 - squared / 20.0));
    let excess = squared + angle * far * versine - length * length;
    start - excess / (2.0 * start + angle * (sense * versine + far * sine))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::*;

    proptest! {
        #![proptest_config(random_cases(2000))]

        #[test]
        fn the_angle_of_a_chord_is_known_from_its_length(angle in 30.0..1e4_f64, step in 1e-6..0.5_f64, is_outer in any::<bool>()) {
            let sense = if is_outer { 1.0 } else { -1.0 };
            let length = step.hypot(2.0 * (angle * (angle + sense * step)).sqrt() * (0.5 * step).sin());
            let found = chord_angle(angle, sense, length);
            prop_assert!((found - step).abs() <= 1e-9 * step, "{found}, {step}");
        }
    }
}

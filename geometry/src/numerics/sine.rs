//! Sine and cosine as plain arithmetic without a branch, so that a loop over many angles compiles to vector instructions.

#![allow(clippy::inline_always, reason = "a function that is not inlined loses the vector instructions of its caller")]

use std::f64::consts::{FRAC_2_PI, FRAC_PI_2};

/// a·b + c, with a single rounding if `FUSED`.
#[inline(always)]
pub(crate) fn multiply_add<const FUSED: bool>(a: f64, b: f64, c: f64) -> f64 {
    if FUSED { a.mul_add(b, c) } else { a * b + c }
}

/// Largest |angle| for which the error bound of [`sine_and_cosine`] holds.
const ANGLE_LIMIT: f64 = 1e6;

/// Sine and cosine of any angle in radians, with an error of at most 4·10⁻¹⁶. Faster than the standard library because it is
/// inlined.
#[inline(always)]
pub(crate) fn sine_and_cosine_anywhere(angle: f64) -> (f64, f64) {
    if angle.abs() <= ANGLE_LIMIT { sine_and_cosine::<false>(angle) } else { angle.sin_cos() }
}

/// Sine and cosine of an angle in radians, with an error of at most 4·10⁻¹⁶ for |angle| up to 10⁶.
///
/// The nearest multiple of π/2 is subtracted in parts (Cody and Waite, Software Manual for the Elementary Functions, 1980). The
/// polynomials of fdlibm's `k_sin` and `k_cos` (Sun Microsystems, 1993) then evaluate the remainder.
#[inline(always)]
pub(crate) fn sine_and_cosine<const FUSED: bool>(angle: f64) -> (f64, f64) {
    // Adding 1.5·2^52 to a small number rounds it to an integer, which the lowest bits of the sum contain.
    const ROUNDER: f64 = 6_755_399_441_055_744.0;
    let quarters = multiply_add::<FUSED>(angle, FRAC_2_PI, ROUNDER);
    let quadrant = quarters.to_bits();
    let rest = less_quarters::<FUSED>(angle, quarters - ROUNDER);
    let (sine, cosine) = (near_sine::<FUSED>(rest), near_cosine::<FUSED>(rest));
    let odd = (quadrant & 1).wrapping_neg();
    let exchange = (sine.to_bits() ^ cosine.to_bits()) & odd;
    let sine_sign = (quadrant & 2) << 62;
    let cosine_sign = (quadrant.wrapping_add(1) & 2) << 62;
    (f64::from_bits(sine.to_bits() ^ exchange ^ sine_sign), f64::from_bits(cosine.to_bits() ^ exchange ^ cosine_sign))
}

/// sin x and cos x − 1 for |x| <= 1/64, exact to rounding: the next term of each series is below 10⁻¹⁶.
#[inline(always)]
pub(crate) fn small_sine_and_versine<const FUSED: bool>(x: f64) -> (f64, f64) {
    let square = x * x;
    let sine = multiply_add::<FUSED>(square, multiply_add::<FUSED>(square, 1.0 / 120.0, -1.0 / 6.0), 1.0);
    let cosine = multiply_add::<FUSED>(square, multiply_add::<FUSED>(square, -1.0 / 720.0, 1.0 / 24.0), -0.5);
    (x * sine, square * cosine)
}

/// `angle` − `quarters`·π/2. Without a fused product, the parts of π/2 must be short enough to make each product exact.
#[inline(always)]
fn less_quarters<const FUSED: bool>(angle: f64, quarters: f64) -> f64 {
    const FRAC_PI_2_REST: f64 = 6.123_233_995_736_766e-17;
    const PARTS: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];
    if FUSED {
        (-quarters).mul_add(FRAC_PI_2_REST, (-quarters).mul_add(FRAC_PI_2, angle))
    } else {
        angle - quarters * PARTS[0] - quarters * PARTS[1] - quarters * PARTS[2]
    }
}

/// sin x for |x| <= π/4.
#[inline(always)]
fn near_sine<const FUSED: bool>(x: f64) -> f64 {
    let square = x * x;
    let series = polynomial::<FUSED, 6>(
        square,
        [
            -1.666_666_666_666_663_2e-1,
            8.333_333_333_322_49e-3,
            -1.984_126_982_985_795e-4,
            2.755_731_370_707_006_8e-6,
            -2.505_076_025_340_686_3e-8,
            1.589_690_995_211_55e-10,
        ],
    );
    multiply_add::<FUSED>(x * square, series, x)
}

/// cos x for |x| <= π/4.
#[inline(always)]
fn near_cosine<const FUSED: bool>(x: f64) -> f64 {
    let square = x * x;
    let series = polynomial::<FUSED, 6>(
        square,
        [
            4.166_666_666_666_66e-2,
            -1.388_888_888_887_411e-3,
            2.480_158_728_947_673e-5,
            -2.755_731_435_139_066_3e-7,
            2.087_572_321_298_175e-9,
            -1.135_964_755_778_819_5e-11,
        ],
    );
    multiply_add::<FUSED>(square * square, series, multiply_add::<FUSED>(square, -0.5, 1.0))
}

/// Evaluates a polynomial by Horner's rule. `terms` begins with the constant term.
#[inline(always)]
fn polynomial<const FUSED: bool, const N: usize>(x: f64, terms: [f64; N]) -> f64 {
    let mut value = terms[N - 1];
    for &term in terms[..N - 1].iter().rev() {
        value = multiply_add::<FUSED>(value, x, term);
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_near(ours: (f64, f64), angle: f64) {
        let (sine, cosine) = angle.sin_cos();
        let error = (ours.0 - sine).abs().max((ours.1 - cosine).abs());
        assert!(error <= 4e-16, "{ours:?} for {angle}, off by {error:e}");
    }

    #[test]
    fn sine_and_cosine_equal_those_of_the_standard_library() {
        for step in -400_000..400_000 {
            let angle = f64::from(step) * 0.173 + 1e-3 / f64::from(step).abs().max(1.0);
            assert_near(sine_and_cosine::<true>(angle), angle);
            assert_near(sine_and_cosine::<false>(angle), angle);
        }
    }

    #[test]
    fn multiples_of_a_quarter_turn_are_as_exact_as_the_angle() {
        for quarters in -100_000..100_000 {
            let angle = f64::from(quarters) * FRAC_PI_2;
            assert_near(sine_and_cosine::<true>(angle), angle);
            assert_near(sine_and_cosine::<false>(angle), angle);
        }
    }

    #[test]
    fn small_angles_are_exact_to_rounding_up_to_their_limit() {
        for step in -1000..=1000 {
            let angle = f64::from(step) / 64_000.0;
            let (sine, versine) = small_sine_and_versine::<true>(angle);
            assert_near((sine, 1.0 + versine), angle);
        }
    }
}

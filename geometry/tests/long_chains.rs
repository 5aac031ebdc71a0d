//! Long dragons: the error that each link adds to the chain behind it.

use std::sync::Arc;

use bench_dragon_geometry::dragon::{Dimensions, Dragon, Handle};
use bench_dragon_geometry::route::Route;
use glam::DVec2;
use proptest::prelude::*;
use test_support::dragons::handles_at;
use test_support::property::random_cases;

const BENCHES: usize = 400;

fn dragon(benches: usize, [head_m, body_m, width_m]: [f64; 3], pitch_m: f64, turns: f64) -> Option<Dragon> {
    let dimensions = Dimensions::new(benches, head_m, body_m, width_m, 0.1).ok()?;
    Dragon::new(dimensions, Arc::new(Route::spiral(pitch_m, turns).ok()?)).ok()
}

/// Long dragons on spirals of many sizes.
fn dragons() -> impl Strategy<Value = Dragon> {
    let benches = (BENCHES..2000, 0.5..4.0_f64, 0.5..4.0_f64, 0.05..0.5_f64);
    let spirals = (1.02..20.0_f64, 10.0..200.0_f64);
    (benches, spirals).prop_filter_map("cannot stand", |((count, head_m, body_m, width_m), (pitch, turns))| {
        dragon(count, [head_m, body_m, width_m], pitch * width_m, turns)
    })
}

/// Standard deviation of the sum of all links' rounding errors, in metres.
///
/// The error of a parameter is up to half a unit in its last digit. The error of a link's length also includes the rounding of
/// the positions at its ends. Values spread evenly over a width have a standard deviation of 1/√12 of the width. The squares of
/// standard deviations add up.
fn deviation_m(dragon: &Dragon, handles: &[Handle]) -> f64 {
    let route = dragon.route();
    let variances = handles[1..].iter().map(|handle| {
        let place_m = route.rounding_m(handle.parameter, route.point(handle.parameter).speed_m_per_unit);
        (place_m + 2.0 * f64::EPSILON * handle.position.length()).powi(2) / 12.0
    });
    variances.sum::<f64>().sqrt()
}

proptest! {
    #![proptest_config(random_cases(256))]

    /// The sum of errors of random sign reaches six times its standard deviation once in 10⁹ cases. The sum of errors of the
    /// same sign grows with the number of links, not with its square root.
    #[test]
    fn errors_of_links_have_no_bias(dragon in dragons(), part in 0.0..=1.0_f64) {
        let handles = handles_at(&dragon, part * dragon.end_travel_m());
        let errors_m = handles.windows(2).enumerate().map(|(bench, ends)| {
            ends[0].position.distance(ends[1].position) - dragon.dimensions().link_m(bench)
        });
        let (sum_m, deviation_m) = (errors_m.sum::<f64>(), deviation_m(&dragon, &handles));
        prop_assert!(sum_m.abs() <= 6.0 * deviation_m, "{sum_m} m, {} deviations", sum_m / deviation_m);
    }
}

/// Positions of the tail at t = 0, from the chain rule with forty digits (mpmath 1.3).
#[test]
fn the_tail_of_four_hundred_benches_equals_a_result_in_forty_digits() {
    let spirals = [
        ([4.04, 2.69, 0.05], 1.174, 59.6, DVec2::new(33.793_186_136_492_32, -64.238_623_424_564_72)),
        ([1.29, 0.86, 0.05], 4.537, 11.5, DVec2::new(-10.469_463_037_904_298, 54.722_241_505_718_39)),
        ([1.92, 1.28, 0.05], 1.395, 21.5, DVec2::new(-13.151_626_261_113_417, -30.310_063_366_486_356)),
    ];
    for (lengths_m, pitch_m, turns, exact) in spirals {
        let dragon = dragon(BENCHES, lengths_m, pitch_m, turns).expect("the dragon stands");
        let handles = handles_at(&dragon, 0.0);
        let (off_m, deviation_m) = (handles[BENCHES].position.distance(exact), deviation_m(&dragon, &handles));
        assert!(off_m <= 6.0 * deviation_m, "pitch {pitch_m} m: off by {off_m} m, {} deviations", off_m / deviation_m);
    }
}

//! Ground that is not flat.

use bench_dragon_geometry::ground::{Ground, HeightMap};
use glam::DVec2;

/// Half of the width of the maps, in metres.
const REACH_M: f64 = 30.0;

/// A plane with these slopes in x and y.
pub fn plane(rise_x: f64, rise_y: f64) -> Ground {
    Ground::plane(DVec2::new(rise_x, rise_y)).expect("a slope that can be walked")
}

/// A hilly map of heights every half metre about the origin, with some waves of about a metre in 10 m.
pub fn hills(phases: [f64; 3], height_m: f64) -> HeightMap {
    hills_every(0.5, phases, height_m)
}

/// The same with heights every `spacing_m`, which divides 30 m.
pub fn hills_every(spacing_m: f64, phases: [f64; 3], height_m: f64) -> HeightMap {
    let columns = (2.0 * REACH_M / spacing_m).round() as usize + 1;
    let at = |i: usize| -REACH_M + spacing_m * i as f64;
    let height = |k: usize| {
        let (x, y) = (at(k % columns), at(k / columns));
        height_m * ((0.6 * x + phases[0]).sin() + (0.5 * y + phases[1]).cos() + 0.5 * (0.4 * (x + y) + phases[2]).sin())
    };
    let heights_m = (0..columns * columns).map(height).collect();
    HeightMap::new([columns; 2], DVec2::splat(-REACH_M), DVec2::splat(spacing_m), heights_m).expect("a valid map")
}

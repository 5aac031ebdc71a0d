//! How far the play of the hinges lets a board reach from its place without play, at one place of its front pole.
//!
//! Let c be the play, d the distance of the holes, P the front pole, Q an allowed rear pole, and Q₀ that without play. ρ is the distance
//! of the corners from the middle of the board, and K bounds the route's curvature.
//!
//! 1. Q lies on the route between the nearest points behind P at d + 2c and d − 2c, and so does Q₀ (see `dragon::loose`). On the way
//!    from one to the other, the distance from P changes by cos σ per metre of arc, where σ is the angle between the line from P and the tangent.
//!    If K·(d + 2c) < 2, then |sin σ| ≤ K·(d + 2c)/2 (see `link_motion`). So |QQ₀| ≤ s = 2c/√(1 − K²·(d + 2c)²/4).
//! 2. If s < d, the line from P to Q has an angle of at most asin(s/d) with that to Q₀. The board has its middle in that of the poles. So
//!    no point of it is off by more than s/2 + ρ·asin(s/d).
//! 3. With its poles at P and Q, the play moves a board in a direction n by at most (c/2)·(|n + λ·ŷ| + |n − λ·ŷ|) with |λ| ≤ 2ρ/d (see
//!    `board_range`). The squares of the two lengths add up to 2 + 2λ². So their sum is at most 2·√(1 + λ²), and the board reaches at most
//!    c·√(1 + 4ρ²/d²) further in any direction. Boards are convex, so they lie within this distance of the board of step 2.

use crate::dragon::Dragon;

/// Greatest distance in metres of a point of a bench's board, in any pose that the play allows, from the board without play that has its
/// front pole at the same place. 0 without play. `None` on ground, and where the run has a bend that is too tight for the bound.
pub fn play_reach_m(dragon: &Dragon, bench: usize) -> Option<f64> {
    let Some(loose) = dragon.loose() else { return Some(0.0) };
    let (route, dimensions) = (dragon.route(), dragon.dimensions());
    if route.is_on_ground() {
        return None;
    }
    let start = loose.taut().chain(loose.taut().start_travel_m()).ok()?;
    let last = start.last()?.parameter;
    let curvature = route.curvature_bound(last, route.parameter(dragon.end_travel_m()));
    let (play_m, link_m) = (dimensions.play_m(), dimensions.link_m(bench));
    let sine = 0.5 * curvature * (link_m + 2.0 * play_m);
    if sine >= 1.0 {
        return None;
    }
    let slip_m = 2.0 * play_m / (1.0 - sine * sine).sqrt();
    if slip_m >= link_m {
        return None;
    }
    let radius_m = dragon.board_radius_m(bench);
    let moved_m = 0.5 * slip_m + radius_m * (slip_m / link_m).asin();
    Some(moved_m + play_m * (2.0 * radius_m / link_m).hypot(1.0))
}

/// The greatest of these distances of all benches; 0 where there is no bound.
pub fn most_play_reach_m(dragon: &Dragon) -> f64 {
    let benches = 0..dragon.dimensions().benches().min(2);
    benches.filter_map(|bench| play_reach_m(dragon, bench)).fold(0.0, f64::max)
}

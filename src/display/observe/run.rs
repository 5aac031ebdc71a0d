//! A run as it was described: what is drawn around the dragon.

use bench_dragon_geometry::route::Route;
use glam::DVec2;

use crate::config::Config;

/// How far the drawn line may lie beside the route, in metres.
const SAGITTA_M: f64 = 0.002;
/// Greatest distance between two points of it, in metres.
const LONGEST_STEP_M: f64 = 1.0;
/// Most points of it; a longer route gets them further apart.
const MAX_POINTS: usize = 20_000;

/// A run's number, its configuration, and the curve that its head follows.
#[derive(Clone, Debug)]
pub struct Run {
    /// The run's number.
    pub run_id: u64,
    /// The configuration.
    pub config: Config,
    /// The route from point to point, from as far behind the start as the dragon is long, to its end, in metres.
    pub route: Vec<DVec2>,
}

impl Run {
    /// The run of this number, with this configuration.
    pub fn new(run_id: u64, config: Config) -> Self {
        let route = points(&config);
        Self { run_id, config, route }
    }
}

fn points(config: &Config) -> Vec<DVec2> {
    let dragon = config.dragon();
    let dimensions = dragon.dimensions();
    let length_m: f64 = (0..dimensions.benches()).map(|bench| dimensions.link_m(bench)).sum();
    let route: &Route = dragon.route();
    let to_m = route.end_travel_m();
    let mut travel_m = dragon.start_travel_m() - length_m;
    let least_step_m = (to_m - travel_m) / (MAX_POINTS - 1) as f64;
    let mut points = Vec::new();
    while travel_m < to_m {
        let parameter = route.parameter(travel_m);
        points.push(route.point(parameter).position);
        // A chord of an arc with curvature k lies k s² / 8 beside it.
        let step_m = (8.0 * SAGITTA_M / route.curvature_bound(parameter, parameter)).sqrt();
        travel_m += step_m.min(LONGEST_STEP_M).max(least_step_m);
    }
    points.push(route.point(route.parameter(to_m)).position);
    points
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::config::Overrides;

    #[test]
    fn the_drawn_route_leads_from_behind_the_tail_through_the_start_to_the_end() {
        let config = Config::load(None, Overrides::default()).expect("the paper's");
        let run = Run::new(7, config);
        let nearest_m = |point: DVec2| run.route.iter().map(|at| at.distance(point)).fold(f64::INFINITY, f64::min);
        assert!(nearest_m(DVec2::new(8.8, 0.0)) < 0.5, "the head starts on it");
        assert!(run.route.len() <= MAX_POINTS);
        let middles = run.route.windows(2).map(|ends| (ends[0] + ends[1]) / 2.0);
        // In the innermost turn a difference of radii is no distance from the curve.
        for middle in middles.filter(|middle| middle.length() > 0.55) {
            // On the spiral r = b θ the turn is told by the angle, the radius by the turn.
            let turns = (middle.length() / 0.55 - middle.to_angle() / TAU).round();
            let beside_m = middle.length() - 0.55 * (turns + middle.to_angle() / TAU);
            assert!(beside_m.abs() < 2.0 * SAGITTA_M, "{beside_m} m beside the route at {middle}");
        }
    }
}

//! A run as it was described: what is drawn around the dragon.

use glam::DVec2;

use crate::config::Config;
use crate::route::Route;

/// Greatest distance between two points of the drawn route, in metres.
const STEP_M: f64 = 0.1;
/// Most points of a drawn route; a longer one gets them further apart.
const MAX_POINTS: usize = 6_000;

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
    let route: &dyn Route = dragon.route();
    let from_m = dragon.start_travel_m() - length_m;
    let to_m = route.end_travel_m();
    let steps = (((to_m - from_m) / STEP_M).ceil() as usize).clamp(1, MAX_POINTS - 1);
    (0..=steps)
        .map(|step| {
            let travel_m = from_m + (to_m - from_m) * step as f64 / steps as f64;
            route.point(route.place(travel_m)).position
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Overrides;

    #[test]
    fn the_drawn_route_leads_from_behind_the_tail_through_the_start_to_the_end() {
        let config = Config::load(None, Overrides::default()).expect("the paper's");
        let run = Run::new(7, config);
        let nearest_m = |point: DVec2| run.route.iter().map(|at| at.distance(point)).fold(f64::INFINITY, f64::min);
        assert!(nearest_m(DVec2::new(8.8, 0.0)) < STEP_M, "the head starts on it");
        assert!(run.route.len() <= MAX_POINTS);
        let steps = run.route.windows(2).map(|ends| ends[0].distance(ends[1]));
        assert!(steps.fold(0.0, f64::max) < 2.0 * STEP_M, "points lie {STEP_M} m apart");
    }
}

//! The part of the plane that a picture shows.

use glam::DVec2;

/// Room around the points that must be in view, as a share of their extent, in which other points enlarge the view.
const REACH_SHARE: f64 = 0.1;
/// Least such room, in metres.
const LEAST_REACH_M: f64 = 5.0;

/// Low and high corner of the box that contains all `core` points, and those of the `rest` that are not far from them. `None`
/// without a core point.
///
/// A dragon on a long straight run-up would make its route tiny. So the far part of the run-up is not in view.
///
/// ```
/// use bench_dragon::output::visible_box;
/// use glam::DVec2;
///
/// let (route, run_up) = ([DVec2::ZERO, DVec2::new(40.0, 10.0)], [DVec2::new(-4.0, 0.0), DVec2::new(-370.0, 0.0)]);
/// assert_eq!(visible_box(route, run_up), Some([DVec2::new(-4.0, 0.0), DVec2::new(40.0, 10.0)]));
/// ```
pub fn visible_box(core: impl IntoIterator<Item = DVec2>, rest: impl IntoIterator<Item = DVec2>) -> Option<[DVec2; 2]> {
    let around = |[low, high]: [DVec2; 2], point: DVec2| [low.min(point), high.max(point)];
    let [low, high] = core.into_iter().map(|point| [point, point]).reduce(|all, [point, _]| around(all, point))?;
    let reach_m = LEAST_REACH_M.max(REACH_SHARE * (high - low).max_element());
    let is_near = |point: &DVec2| point.cmpge(low - reach_m).all() && point.cmple(high + reach_m).all();
    Some(rest.into_iter().filter(is_near).fold([low, high], around))
}

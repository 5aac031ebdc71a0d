//! The area that the boards of all dragons sweep over their whole runs.
//!
//! *Method.* All body benches are alike, and each walks over the places of the bench before it. So the body boards sweep what one board
//! sweeps whose front handle walks from where that of the last bench stands at the start to where that of bench 1 ends. The head's board
//! is followed by itself. A board is followed stride by stride. On each stride, the convex hull of the board at both ends, with its sides
//! moved out by the bulge of its corners (see `coverage`), covers the board. The area is the union of all hulls.
//!
//! *Guarantee.* The area has every point that a board covers, up to rounding, about 10⁻⁹ m. No point of the area is further than the
//! tolerance from a point that a board covers: the strides are that short.
//!
//! Unions are those of the crate `i_overlay`, on a grid of 64-bit integers.

use glam::DVec2;
use i_overlay::core::fill_rule::FillRule;
use i_overlay::float::simplify::SimplifyShape as _;
use i_overlay::i_shape::base::data::Shapes;

use super::border_search::parameters;
use super::coverage::BoardCoverage;
use super::pose::BenchPose;
use crate::dragon::{Dragon, Handle, Spent};
use crate::formation::Formation;

/// Longest stride, in lengths of the bench's link.
const STRIDE_LINKS: f64 = 1.0;
/// Shortest stride, in metres: below, the hull is taken as it is. No board has a bound that needs it.
const SHORTEST_M: f64 = 1e-6;
/// Number of hulls that are united at once.
const CHUNK: usize = 4;
/// Work for a stride, and for its share of the unions, in steps.
const STEPS_PER_STRIDE: u64 = 16;
const STEPS_PER_HULL: u64 = 600;

/// An area with its borders.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SweptArea {
    /// The parts of the area, each with its outer border, and then those of its holes. Outer borders run counter-clockwise, those of holes
    /// clockwise.
    pub parts: Vec<Vec<Vec<DVec2>>>,
}

impl SweptArea {
    /// The area that all boards of a formation sweep, larger than the true one by at most `tolerance_m` at any place.
    ///
    /// # Errors
    /// The meter of the dragons is spent.
    ///
    /// # Panics
    /// Panics for a tolerance that is not above 0.
    pub fn of(formation: &Formation, tolerance_m: f64) -> Result<Self, Spent> {
        assert!(tolerance_m > 0.0, "a tolerance");
        let mut union = Union::default();
        for planned in formation.dragons() {
            let dragon = &*planned.dragon;
            let [start, end] =
                [dragon.start_travel_m(), dragon.end_travel_m()].map(|travel_m| parameters(dragon, travel_m));
            let last = dragon.dimensions().benches() - 1;
            let walks = [(0, start[0], end[0]), (1, start[last], end[1])];
            for (bench, from, to) in walks.into_iter().take(last + 1) {
                sweep(dragon, bench, [from, to], tolerance_m, &mut union);
                if dragon.meter().is_spent() {
                    return Err(dragon.meter().spent(dragon.start_travel_m()));
                }
            }
        }
        Ok(Self { parts: union.finish() })
    }

    /// Size of the area in m².
    pub fn area_m2(&self) -> f64 {
        self.parts.iter().flatten().map(|border| signed_area_m2(border)).sum()
    }

    /// The lowest and the highest coordinates of the area.
    ///
    /// # Panics
    /// Panics for an area without parts.
    pub fn bounds(&self) -> [DVec2; 2] {
        let points = || self.parts.iter().flatten().flatten().copied();
        let low = points().reduce(DVec2::min).expect("boards sweep an area");
        [low, points().fold(low, DVec2::max)]
    }
}

fn signed_area_m2(border: &[DVec2]) -> f64 {
    let origin = border[0];
    let next = border.iter().cycle().skip(1);
    0.5 * border.iter().zip(next).map(|(from, to)| (from - origin).perp_dot(to - origin)).sum::<f64>()
}

/// Adds the hulls of a bench whose front handle walks between two parameters.
fn sweep(dragon: &Dragon, bench: usize, [from, to]: [f64; 2], tolerance_m: f64, union: &mut Union) {
    let (route, longest_m) = (dragon.route(), STRIDE_LINKS * dragon.dimensions().link_m(bench));
    let Some(mut earlier) = pose(dragon, bench, from) else { return };
    let mut stride_m = longest_m;
    loop {
        dragon.meter().add(STEPS_PER_STRIDE);
        if dragon.meter().is_spent() {
            return;
        }
        let next = route.parameter_near(earlier.front_travel_m + stride_m, earlier.front.parameter);
        let is_last = next >= to || next <= earlier.front.parameter;
        let Some(later) = pose(dragon, bench, if is_last { to } else { next }) else { return };
        let coverage = BoardCoverage::new(dragon, bench, &earlier, &later);
        if coverage.hull_excess_m() > tolerance_m && stride_m > SHORTEST_M {
            stride_m = 0.5 * stride_m.min(later.front_travel_m - earlier.front_travel_m);
            continue;
        }
        dragon.meter().add(STEPS_PER_HULL);
        union.add(convex_hull(coverage.covering_corners()));
        if is_last {
            return;
        }
        earlier = later;
        stride_m = (2.0 * stride_m).min(longest_m);
    }
}

fn pose(dragon: &Dragon, bench: usize, parameter: f64) -> Option<BenchPose> {
    let rear = dragon.rear(bench, parameter)?;
    let front = Handle::new(parameter, dragon.route().point(parameter), 1.0);
    let rear = Handle::new(rear.parameter, rear.point, rear.speed_ratio());
    Some(BenchPose::new(dragon, bench, front, rear))
}

/// The corners of the convex hull of some points, counter-clockwise (Andrew 1979, Information Processing Letters 9).
fn convex_hull(mut points: [DVec2; 8]) -> Vec<DVec2> {
    points.sort_by(|one, other| one.x.total_cmp(&other.x).then(one.y.total_cmp(&other.y)));
    let half = |points: &mut dyn Iterator<Item = DVec2>| {
        let mut chain: Vec<DVec2> = Vec::new();
        for point in points {
            while let [.., first, second] = chain[..]
                && (second - first).perp_dot(point - second) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.into_iter());
    hull.extend(half(&mut points.into_iter().rev()));
    hull
}

/// The union of many hulls. Unions of equally many hulls are united, so that none has many more borders than it needs.
#[derive(Default)]
struct Union {
    hulls: Vec<Vec<[f64; 2]>>,
    /// Unions of [`CHUNK`] · 2ⁱ hulls.
    levels: Vec<Option<Shapes<[f64; 2]>>>,
}

impl Union {
    fn add(&mut self, hull: Vec<DVec2>) {
        self.hulls.push(hull.into_iter().map(DVec2::into).collect());
        if self.hulls.len() == CHUNK {
            self.close();
        }
    }

    /// Unites the hulls that have come since.
    fn close(&mut self) {
        let mut united = unite(&vec![std::mem::take(&mut self.hulls)]);
        for level in &mut self.levels {
            let Some(other) = level.take() else {
                *level = Some(united);
                return;
            };
            united = unite(&[other, united].concat());
        }
        self.levels.push(Some(united));
    }

    fn finish(mut self) -> Vec<Vec<Vec<DVec2>>> {
        self.close();
        let all: Shapes<[f64; 2]> = self.levels.into_iter().flatten().flatten().collect();
        let points = |border: Vec<[f64; 2]>| border.into_iter().map(DVec2::from).collect();
        unite(&all).into_iter().map(|part| part.into_iter().map(points).collect()).collect()
    }
}

/// The union of shapes whose outer borders run counter-clockwise.
fn unite(shapes: &Shapes<[f64; 2]>) -> Shapes<[f64; 2]> {
    shapes.simplify_shape_as::<i64>(FillRule::NonZero)
}

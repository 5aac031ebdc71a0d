//! Known mistakes of tables, and what each of them makes of the dragon.
//!
//! A mistake is found where its own numbers are much nearer to the table than the exact ones. So the searches need no threshold
//! for how precisely a table was computed.

use std::sync::Arc;

use bench_dragon_geometry::clearance::first_within;
use bench_dragon_geometry::dragon::{ChainSolver, Dimensions, Dragon, Handle};
use bench_dragon_geometry::route::{Placement, Route, RouteShape, TurnaroundSpec};
use glam::DVec2;
use serde::Serialize;

use super::given::GivenPose;
use crate::cli::solve::WorkArgs;
use crate::cli::solve::contest::Quantity;
use crate::config::Config;
use crate::output::poses::travel_m;

/// A known mistake.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Mistake {
    ArcForChord,
    ChainAhead,
    CounterClockwise,
    ExitNotTurned,
    ArcsSwapped,
    SpeedsFromDifferences,
    NarrowBoards,
    NeighboursTouch,
}

impl Mistake {
    /// The mistakes that show in positions.
    const OF_POSITIONS: [Self; 5] =
        [Self::ArcForChord, Self::ChainAhead, Self::CounterClockwise, Self::ExitNotTurned, Self::ArcsSwapped];

    pub(super) fn words(self) -> &'static str {
        match self {
            Self::ArcForChord => {
                "arc for chord: handles are a link apart along the route; links are straight, so their ends are nearer"
            }
            Self::ChainAhead => {
                "wrong direction of the chain: handles are ahead of the head; each one follows the one before it"
            }
            Self::CounterClockwise => {
                "counter-clockwise: the head walks the mirrored spiral; the paper's is walked clockwise"
            }
            Self::ExitNotTurned => {
                "exit spiral not turned by π: handles beyond the S are on the opposite side of the centre"
            }
            Self::ArcsSwapped => "S reversed: the small arc is walked first; the entry arc has the large radius",
            Self::SpeedsFromDifferences => {
                "speeds from differences: they are distances between the positions of the table ÷ time; speeds follow from the links"
            }
            Self::NarrowBoards => {
                "boards of 0.29 m: the last time is the first contact of boards that are 1 cm narrower"
            }
            Self::NeighboursTouch => {
                "neighbours not left out: the last time is the start; boards on one hinge always overlap, and are no pair"
            }
        }
    }
}

/// A mistake's distances from a table ÷ those of the exact numbers, up to which it is the table's.
const MOST_RATIO: f64 = 0.05;
/// Root of the mean square of distances from the exact numbers from which a mistake is looked for, in metres or metres per second.
const LEAST_ERROR: f64 = 2e-6;
/// Least numbers that a mistake must explain.
const LEAST_COUNT: usize = 5;
/// Greatest number of times at which mistakes are computed.
const MOST_TIMES: usize = 64;

/// Sums of squared distances of a table, from a mistake's numbers and from the exact ones.
#[derive(Clone, Copy, Default)]
struct Errors {
    mistaken: f64,
    exact: f64,
    count: usize,
}

impl Errors {
    fn add(&mut self, mistaken: f64, exact: f64) {
        self.mistaken += mistaken * mistaken;
        self.exact += exact * exact;
        self.count += 1;
    }

    fn show_the_mistake(&self) -> bool {
        let root = |sum: f64| (sum / self.count as f64).sqrt();
        self.count >= LEAST_COUNT
            && root(self.exact) > LEAST_ERROR
            && root(self.mistaken) < MOST_RATIO * root(self.exact)
    }
}

/// The mistakes that the positions of a table show.
pub(super) fn of_positions(poses: &[(f64, &GivenPose)], config: &Config) -> Vec<Mistake> {
    let step = poses.len().div_ceil(MOST_TIMES).max(1);
    let shown = |mistake: &Mistake| {
        let Some(mut mistaken) = Rule::of(*mistake, config) else { return false };
        let mut exact = Rule::new(None, config.clone());
        let mut errors = Errors::default();
        for &(time_s, pose) in poses.iter().step_by(step) {
            let (mistaken, exact) = (mistaken.places(time_s), exact.places(time_s));
            for ((given, mistaken), exact) in pose.handles.iter().zip(mistaken).zip(exact) {
                if let (&[Some(x), Some(y), _], Some(mistaken), Some(exact)) = (given, mistaken, exact) {
                    let given = DVec2::new(x, y);
                    errors.add(given.distance(mistaken), given.distance(exact));
                }
            }
        }
        errors.show_the_mistake()
    };
    Mistake::OF_POSITIONS.into_iter().filter(shown).collect()
}

/// A rule for the places of handles: the exact one, or a mistaken one.
struct Rule {
    mistake: Option<Mistake>,
    config: Config,
    solver: ChainSolver,
}

impl Rule {
    fn new(mistake: Option<Mistake>, config: Config) -> Self {
        Self { mistake, solver: ChainSolver::new(config.lead()), config }
    }

    /// The rule of a mistake; `None` for one that is not possible on this route.
    fn of(mistake: Mistake, config: &Config) -> Option<Self> {
        let turnaround = config.route().as_turnaround();
        let config = match mistake {
            Mistake::ArcsSwapped => {
                let spec = turnaround.filter(|spec| spec.radius_ratio != 1.0)?;
                let swapped = TurnaroundSpec { radius_ratio: 1.0 / spec.radius_ratio, ..spec };
                config.with_shape(&RouteShape::Turnaround(swapped)).ok()?
            }
            Mistake::ExitNotTurned if turnaround.is_none() => return None,
            Mistake::CounterClockwise if config.route().placement != Placement::default() => return None,
            _ => config.clone(),
        };
        Some(Self::new(Some(mistake), config))
    }

    /// The places of all handles; none for handles to which the rule gives no place.
    fn places(&mut self, time_s: f64) -> Vec<Option<DVec2>> {
        let travel_m = travel_m(time_s, &self.config);
        let dragon = self.config.lead();
        match self.mistake {
            Some(Mistake::ArcForChord) => return along(dragon, travel_m),
            Some(Mistake::ChainAhead) => return ahead(dragon, travel_m),
            _ => {}
        }
        let centre = self.config.route().placement.position;
        let exit = dragon.route().seams().last().copied().unwrap_or(f64::INFINITY);
        let handles = self.solver.solve(dragon, travel_m).expect("the travel is in the run").iter();
        let place = |handle: &Handle| match self.mistake {
            Some(Mistake::CounterClockwise) => DVec2::new(handle.position.x, -handle.position.y),
            Some(Mistake::ExitNotTurned) if handle.parameter > exit => 2.0 * centre - handle.position,
            _ => handle.position,
        };
        handles.map(|handle| Some(place(handle))).collect()
    }
}

/// Handles behind the head with the lengths of the links along the route.
fn along(dragon: &Dragon, head_m: f64) -> Vec<Option<DVec2>> {
    let mut travel_m = head_m;
    let mut place = |handle: usize| {
        travel_m -= if handle == 0 { 0.0 } else { dragon.dimensions().link_m(handle - 1) };
        Some(at(dragon.route(), travel_m))
    };
    (0..dragon.dimensions().handles()).map(&mut place).collect()
}

/// Handles ahead of the head, each on the nearest point of the route at the distance of its link, as far as the route reaches.
fn ahead(dragon: &Dragon, head_m: f64) -> Vec<Option<DVec2>> {
    let route = dragon.route();
    let mut last = Some(head_m);
    let mut places = vec![Some(at(route, head_m))];
    for bench in 0..dragon.dimensions().benches() {
        last = last.and_then(|travel_m| next_ahead(route, travel_m, dragon.dimensions().link_m(bench)));
        places.push(last.map(|travel_m| at(route, travel_m)));
    }
    places
}

/// Travel of the nearest point of the route ahead at a distance, to 10⁻¹² m. It is found in steps of a sixteenth of the distance, and
/// then by bisection.
fn next_ahead(route: &Route, from_m: f64, distance_m: f64) -> Option<f64> {
    let from = at(route, from_m);
    let is_beyond = |travel_m: f64| at(route, travel_m).distance(from) >= distance_m;
    // The arc is at least as long as its chord, so the point is not nearer.
    let mut low_m = from_m + distance_m * (1.0 - 1e-9);
    let high_m = loop {
        let high_m = low_m + distance_m / 16.0;
        if high_m > route.end_travel_m() || high_m > from_m + 4.0 * distance_m {
            return None;
        }
        if is_beyond(high_m) {
            break high_m;
        }
        low_m = high_m;
    };
    let mut ends = [low_m, high_m];
    while ends[1] - ends[0] > 1e-12 * ends[1].abs().max(1.0) {
        let middle_m = ends[0].midpoint(ends[1]);
        ends[usize::from(is_beyond(middle_m))] = middle_m;
    }
    Some(ends[1])
}

pub(super) fn at(route: &Route, travel_m: f64) -> DVec2 {
    route.point(route.parameter(travel_m)).position
}

/// Whether the speeds of a table are differences of its positions: from the time before, to the time after, or both.
pub(super) fn has_differences(poses: &[(f64, &GivenPose)], config: &Config) -> bool {
    let mut solver = ChainSolver::new(config.lead());
    let mut ways = [Errors::default(); 3];
    let step = (poses.len().saturating_sub(2)).div_ceil(MOST_TIMES).max(1);
    for three in poses.windows(3).step_by(step) {
        let [(before_s, before), (time_s, now), (after_s, after)] = [three[0], three[1], three[2]];
        let Ok(handles) = solver.solve(config.lead(), travel_m(time_s, config)) else { continue };
        let head_mps = config.timetable().speed_mps(time_s);
        for (index, handle) in handles.iter().enumerate() {
            let Some(given_mps) = now.handles[index][Quantity::Speed as usize] else { continue };
            let places = [before, now, after].map(|pose| place(pose, index));
            let [Some(first), Some(middle), Some(last)] = places else { continue };
            let differences = [
                middle.distance(first) / (time_s - before_s),
                last.distance(middle) / (after_s - time_s),
                last.distance(first) / (after_s - before_s),
            ];
            for (errors, speed_mps) in ways.iter_mut().zip(differences) {
                errors.add(given_mps - speed_mps, given_mps - handle.speed_ratio * head_mps);
            }
        }
    }
    ways.iter().any(Errors::show_the_mistake)
}

fn place(pose: &GivenPose, handle: usize) -> Option<DVec2> {
    let [x, y, _] = pose.handles[handle];
    Some(DVec2::new(x?, y?))
}

/// The mistake that makes a first contact of this time.
pub(super) fn of_contact(time_s: f64, config: &Config, work: WorkArgs) -> Option<Mistake> {
    if time_s - config.start_s() <= FIRST_STEP_S {
        return Some(Mistake::NeighboursTouch);
    }
    let narrow_s = contact_s(config, work, NARROWER_M)?;
    ((time_s - narrow_s).abs() <= CONTACT_TOLERANCE_S).then_some(Mistake::NarrowBoards)
}

/// The first step of a search for a contact in steps, in seconds.
const FIRST_STEP_S: f64 = 1.0;
/// By how much boards are narrower by mistake, in metres.
const NARROWER_M: f64 = 0.01;
/// Difference of times of a contact that a search in steps makes, in seconds.
pub(super) const CONTACT_TOLERANCE_S: f64 = 0.02;

/// Time of the first contact of boards that are narrower than configured.
pub(super) fn contact_s(config: &Config, work: WorkArgs, narrower_m: f64) -> Option<f64> {
    let dragon = config.lead();
    let [head_m, body_m, width_m, hole_m] = {
        let dimensions = dragon.dimensions();
        [dimensions.head_length_m(), dimensions.body_length_m(), dimensions.width_m(), dimensions.hole_offset_m()]
    };
    let dimensions =
        Dimensions::new(dragon.dimensions().benches(), head_m, body_m, width_m - narrower_m, hole_m).ok()?;
    let dragon = Dragon::with_meter(dimensions, Arc::new(dragon.route().clone()), work.meter()).ok()?;
    let contact = first_within(&dragon, 0.0, dragon.start_travel_m(), dragon.end_travel_m()).ok()??;
    Some(config.timetable().time_s(contact.travel_m))
}

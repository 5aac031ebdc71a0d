//! The largest speed of any handle.
//!
//! *Method.* Speeds are proportional to the head's. So the search maximises speed ÷ head speed over all handles and the whole
//! run. The body behind handle 1 stands on an orbit of the route (see `dragon::orbit`). The same orbit serves every travel at
//! which handle 1 is at one of its stations. Let C be the running product of the links' speed ratios along the orbit. Let r be
//! the speed of handle 1, at station m, divided by the head's. Then handle j is r·C(m + j − 1)/C(m) times as fast as the head.
//! So one orbit, as long as the whole run, contains the speeds of all handles at one travel per link length. One pass finds the
//! fastest handle behind each station.
//!
//! 1. The run is surveyed. [`SURVEYED_PER_LINK`] such orbits give the speed of the fastest handle for a few thousand parameters
//!    of the head. Often a bound on r is enough for the head; otherwise the head is solved. A handle may be the fastest between two
//!    parameters at which others are. So the orbits beside one give the *outlook* of each handle, its ratio if it goes on to change
//!    as it does from or to them.
//! 2. Some stretches between two of those parameters may contain the largest ratio. The search examines them with the dragon
//!    itself, up to the last handle that may be the fastest in between. It splits a stretch wherever a handle crosses a seam of
//!    the route: there the curvature jumps, and with it the slope of the ratio. It also splits the stretch evenly, into pieces
//!    as short as those of the search for faults.
//! 3. In the pieces next to the largest of these ratios, Brent's method refines it.
//!
//! *Precondition.* The dragon walks its whole route.
//!
//! *Guarantee.* The result is the ratio of a handle at a travel, to rounding. No sample of the survey or of the pieces exceeds
//! it. A maximum at a kink is exact, because kinks are samples. That no ratio between samples is larger depends on their
//! density. Within a piece the ratio is smooth. A stretch is skipped only if each handle is well below the largest ratio at its
//! ends: further than the ratio of that handle changes between samples around the stretch. A higher peak is narrower. The run
//! treats peaks narrower than a piece as jumps, and ends there.
//!
//! *First excess.* The first travel at which a handle exceeds a given ratio is found in the same way, from the beginning of the
//! run. The first piece with a sample or a refined maximum over the ratio contains it. There the ratio of the fastest handle is
//! continuous, because the route has a continuous tangent. So bisection finds the travel at which it exceeds the ratio.

use std::collections::{BTreeMap, VecDeque};

use super::cores::on_all_cores;
use super::infeasible::Infeasible;
use crate::dragon::{ARC_PER_CHORD, Chain, Dragon, FeasibleEnd, Spent, Station};
use crate::numerics::{Slope, peak, rising_root, turning_point};

/// Number of orbits in the survey, evenly spaced over the last link's length that handle 1 walks.
const SURVEYED_PER_LINK: usize = 16;

/// Smallest number of pieces in a stretch of the survey, which gives 64 pieces a link.
const PIECES_PER_STRETCH: u32 = 4;

/// A ratio that no walking handle reaches. At a jump of a handle, its speed is unbounded. A jump too short for the samples of
/// the run appears as a peak that rounding cuts off at about 10⁷. On a curvature of κ, a walking handle could keep a ratio of R
/// for less than 1/(κ·R²) of travel, here some micrometres.
const JUMP_RATIO: f64 = 1000.0;

/// Work for a station of the survey besides its link, in steps. So the limit of work bounds the number of stored stations, each
/// of about a hundred bytes.
const STEPS_PER_STATION: u64 = 16;

/// Tolerance of kinks and maxima, in metres of travel. The ratio is then exact to rounding.
const TOLERANCE_M: f64 = 1e-11;

/// The largest speed ratio of a run, with its travel and its handle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LargestRatio {
    /// Speed of the handle divided by the head's speed.
    pub ratio: f64,
    /// Travel of the head.
    pub travel_m: f64,
    /// Index of the handle; the lowest one if several are equally fast.
    pub handle: usize,
}

/// Finds the largest ratio of any handle's speed to the head's over the whole run of a dragon. It is at least 1, the head's own
/// ratio.
///
/// # Errors
/// A fault ends the run before the route's end, a handle has a jump that was too short to end the run, or the dragon's meter is
/// spent.
pub fn largest_speed_ratio(dragon: &Dragon) -> Result<LargestRatio, Infeasible> {
    Infeasible::check(dragon)?;
    let survey = Survey { dragon };
    let mut spots = survey.spots();
    survey.check_meter()?;
    let mut largest = LargestRatio { ratio: 1.0, travel_m: dragon.start_travel_m(), handle: 0 };
    let most_promising = (0..spots.len()).max_by(|&a, &b| spots[a].ratio.total_cmp(&spots[b].ratio));
    for i in most_promising.into_iter().chain(0..spots.len()) {
        if spots[i].ratio > largest.ratio {
            survey.solve(&mut spots[i]);
            largest = faster(largest, spots[i].fastest());
            survey.check_meter()?;
        }
    }
    let mut chains = Chains::new();
    for ahead in 0..spots.len() - 1 {
        if let Some(handles) = survey.candidates(&mut spots, ahead, largest.ratio, &mut chains) {
            let found = survey.look_through(&spots, ahead, handles);
            largest = found.into_iter().fold(largest, faster);
        }
        survey.check_meter()?;
    }
    let LargestRatio { ratio, travel_m, handle } = survey.lowest_as_fast(largest);
    if ratio > JUMP_RATIO {
        return Err(Infeasible::Fault { travel_m, end: FeasibleEnd::HandleJumps { handle } });
    }
    Ok(LargestRatio { ratio, travel_m, handle })
}

/// Finds the first travel of a run at which a handle is more than `ratio` times as fast as the head, with that handle. `ratio`
/// is 1 or more. The run may end with a fault. Returns `None` if no handle exceeds the ratio, up to rounding.
///
/// # Errors
/// The dragon's meter is spent.
pub fn first_faster(dragon: &Dragon, ratio: f64) -> Result<Option<LargestRatio>, Spent> {
    let survey = Survey { dragon };
    let (start_m, handles) = (dragon.start_travel_m(), dragon.dimensions().handles());
    let limit = ratio * (1.0 + rounding(handles));
    let mut spots = survey.spots();
    dragon.meter().check(start_m)?;
    let start = survey.fastest_at(start_m, handles);
    if start.ratio > limit {
        return Ok(Some(survey.lowest_as_fast(start)));
    }
    let mut chains = Chains::new();
    for ahead in (0..spots.len() - 1).rev() {
        let handles = survey.candidates(&mut spots, ahead, limit, &mut chains);
        let found = handles.and_then(|handles| survey.first_over(&spots, ahead, handles, limit));
        dragon.meter().check(start_m)?;
        if let Some(found) = found {
            return Ok(Some(survey.lowest_as_fast(found)));
        }
    }
    Ok(None)
}

/// Bound on the relative rounding of the speed ratios of the first `handles` handles.
fn rounding(handles: usize) -> f64 {
    8.0 * f64::EPSILON * handles as f64
}

/// The faster of two; the first if they are equal.
fn faster(first: LargestRatio, second: LargestRatio) -> LargestRatio {
    if second.ratio > first.ratio { second } else { first }
}

/// Whether the ratio between a spot and the next may exceed `largest`. It may if the better outlook of the two is below `largest`
/// by no more than the ratio changes from spot to spot around them.
fn may_exceed(spots: &[Spot], ahead: usize, largest: f64) -> bool {
    spots[ahead].outlook().max(spots[ahead + 1].outlook()) + change_around(spots, ahead) > largest
}

/// The most by which the ratio changes from spot to spot around a spot and the next.
fn change_around(spots: &[Spot], ahead: usize) -> f64 {
    let around = &spots[ahead.saturating_sub(1)..spots.len().min(ahead + 3)];
    around.windows(2).map(|ends| (ends[0].ratio - ends[1].ratio).abs()).fold(0.0, f64::max)
}

/// The fastest handle, with handle 1 at one parameter.
#[derive(Clone, Copy, Debug)]
struct Spot {
    /// Parameter of handle 1.
    parameter: f64,
    /// Index of the fastest handle.
    handle: usize,
    /// Speed of that handle divided by the speed of handle 1.
    behind: f64,
    /// Speed of that handle divided by the head's; an upper bound until the head is solved.
    ratio: f64,
    /// The largest outlook of a handle, divided by the speed of the fastest handle: 1 or more.
    lift: f64,
    travel_m: Option<f64>,
}

impl Spot {
    /// The largest ratio that a handle has beside the spot if it goes on to change as on the other side.
    fn outlook(&self) -> f64 {
        self.ratio * self.lift
    }

    fn fastest(&self) -> LargestRatio {
        let travel_m = self.travel_m.expect("the spot is solved");
        LargestRatio { ratio: self.ratio, travel_m, handle: self.handle }
    }
}

/// The speed ratios of all handles at the last few spots, by their index.
type Chains = BTreeMap<usize, Vec<f64>>;

struct Survey<'a> {
    dragon: &'a Dragon,
}

impl Survey<'_> {
    /// Returns an error if the meter is spent.
    fn check_meter(&self) -> Result<(), Infeasible> {
        Ok(self.dragon.meter().check(self.dragon.start_travel_m())?)
    }

    /// The spots of the whole run. The first has the head at the end of the run, the last at its beginning.
    fn spots(&self) -> Vec<Spot> {
        let dragon = self.dragon;
        let route = dragon.route();
        let [begin_parameter, end_parameter] = [dragon.start_travel_m(), dragon.end_travel_m()].map(|travel_m| {
            dragon.rear(0, route.parameter(travel_m)).expect("handle 1 has a position throughout the run").parameter
        });
        let benches = dragon.dimensions().benches();
        let mut beyond = 0;
        let last_orbit = dragon.orbit(end_parameter).take_while(|station| {
            dragon.meter().add(SURVEYED_PER_LINK as u64 * STEPS_PER_STATION);
            beyond += usize::from(station.parameter < begin_parameter);
            beyond < benches && !dragon.meter().is_spent()
        });
        let last_orbit: Vec<Station> = last_orbit.collect();
        let length = last_orbit.len();
        let link_behind = last_orbit.get(1).map_or(begin_parameter, |station| station.parameter);
        let [low_m, high_m] = [link_behind, end_parameter].map(|parameter| route.travel(parameter));
        let others = on_all_cores(dragon.meter(), SURVEYED_PER_LINK - 1, |i, meter| {
            let share = (SURVEYED_PER_LINK - 1 - i) as f64 / SURVEYED_PER_LINK as f64;
            dragon.metered(meter).orbit(route.parameter(low_m + (high_m - low_m) * share)).take(length).collect()
        });
        let orbits: Vec<Vec<Station>> = std::iter::once(last_orbit).chain(others).collect();
        let phases = on_all_cores(dragon.meter(), orbits.len(), |phase, _| self.spots_of_phase(&orbits, phase));
        let walked = |spot: &&Spot| spot.parameter > begin_parameter;
        let mut spots: Vec<Spot> = (0..length)
            .flat_map(|m| phases.iter().filter_map(move |phase| phase.get(m)))
            .take_while(walked)
            .copied()
            .collect();
        let last: Vec<Station> = dragon.orbit(begin_parameter).take(benches).collect();
        spots.extend(self.spots_of_phase(&[last], 0).first());
        spots
    }

    /// The spots with handle 1 at the stations of an orbit. Each of these orbits begins behind the one before, all within a link.
    fn spots_of_phase(&self, orbits: &[Vec<Station>], phase: usize) -> Vec<Spot> {
        let dragon = self.dragon;
        let stations = &orbits[phase];
        let dimensions = dragon.dimensions();
        let bench = 1.min(dimensions.benches() - 1);
        let stations_ahead = (ARC_PER_CHORD * dimensions.link_m(0) / dimensions.link_m(bench)).ceil() as usize;
        let end_parameter = dragon.end_parameter;
        let speeds: Vec<f64> = stations.iter().map(|station| station.speed_ratio).collect();
        let lifts = lifts(orbits, phase, dimensions.benches());
        let spot = |(m, rear): (usize, usize)| {
            let behind = speeds[rear] / speeds[m];
            let head_parameter = m.checked_sub(stations_ahead).map_or(end_parameter, |ahead| stations[ahead].parameter);
            let ratio = behind * self.head_bound(stations[m].parameter, head_parameter);
            let lift = (lifts[m] / speeds[rear]).max(1.0);
            Spot { parameter: stations[m].parameter, handle: rear - m + 1, behind, ratio, lift, travel_m: None }
        };
        fastest_behind(&speeds, dimensions.benches()).into_iter().enumerate().map(spot).collect()
    }

    /// An upper bound on the speed of handle 1 at `parameter` divided by the head's: at most 1 / cos of the link's angle at
    /// handle 1. `head_parameter` is not behind the head.
    ///
    /// A curve with |κ| ≤ K first reaches a distance of d after an arc of at most π·d/2, if K·d < 2. On that arc the angle
    /// between chord and tangent has a sine of at most K·d/2 (Schwarz's theorem on curves of bounded curvature). Seen from that
    /// point, the start is the first point behind it at this distance. So that point is the head's. Two neighbouring stations
    /// are at least a link's length of arc apart.
    fn head_bound(&self, parameter: f64, head_parameter: f64) -> f64 {
        let curvature = self.dragon.route().curvature_bound(parameter, head_parameter);
        let sine = 0.5 * curvature * self.dragon.dimensions().link_m(0);
        if sine < 1.0 { (1.0 - sine * sine).sqrt().recip() } else { f64::INFINITY }
    }

    /// Solves the head's travel and the ratio of a spot.
    fn solve(&self, spot: &mut Spot) {
        if spot.travel_m.is_none() {
            let (head_parameter, speed_ratio) = self.dragon.head_before(spot.parameter);
            let travel_m = self.dragon.route().travel(head_parameter);
            spot.travel_m = Some(travel_m.clamp(self.dragon.start_travel_m(), self.dragon.end_travel_m()));
            spot.ratio = speed_ratio * spot.behind;
        }
    }

    /// The largest ratios of the first `handles` handles between a solved spot and the next.
    fn look_through(&self, spots: &[Spot], ahead: usize, handles: usize) -> Vec<LargestRatio> {
        let samples = self.samples(spots, ahead, handles);
        let peaks = (0..samples.len() - 1).flat_map(|piece| self.peaks(&samples, piece));
        samples.iter().copied().chain(peaks).collect()
    }

    /// The first travel between a solved spot and the next at which one of the first `handles` handles exceeds a ratio. At the spot
    /// behind, none does.
    fn first_over(&self, spots: &[Spot], ahead: usize, handles: usize, limit: f64) -> Option<LargestRatio> {
        let samples = self.samples(spots, ahead, handles);
        let over = samples.windows(2).enumerate().find_map(|(piece, ends)| {
            let peaks = self.peaks(&samples, piece);
            let over = peaks.into_iter().chain([ends[1]]).find(|at| at.ratio > limit);
            over.map(|over| [ends[0].travel_m, over.travel_m])
        });
        let [low_m, high_m] = over?;
        let is_over = |travel_m| self.fastest_at(travel_m, handles).ratio > limit;
        Some(self.fastest_at(turning_point(low_m, high_m, TOLERANCE_M, is_over).1, handles))
    }

    /// Number of handles to evaluate between a spot and the next, whose heads it solves. `None` if no handle may exceed `largest`
    /// there.
    fn candidates(&self, spots: &mut [Spot], ahead: usize, largest: f64, chains: &mut Chains) -> Option<usize> {
        if !may_exceed(spots, ahead, largest) {
            return None;
        }
        spots[ahead..=ahead + 1].iter_mut().for_each(|spot| self.solve(spot));
        if may_exceed(spots, ahead, largest) { self.handles_between(spots, ahead, largest, chains) } else { None }
    }

    /// Number of handles to evaluate between a spot and the next: up to the last one that may exceed `largest` there. It may if it is
    /// below `largest` at both by no more than its ratio changes from spot to spot around them.
    fn handles_between(&self, spots: &mut [Spot], ahead: usize, largest: f64, chains: &mut Chains) -> Option<usize> {
        let around = ahead.saturating_sub(1)..spots.len().min(ahead + 3);
        chains.retain(|index, _| around.contains(index));
        for index in around {
            self.solve(&mut spots[index]);
            let chain = || self.chain(spots[index].fastest().travel_m).map(|handle| handle.speed_ratio).collect();
            chains.entry(index).or_insert_with(chain);
        }
        let ratios: Vec<&Vec<f64>> = chains.values().collect();
        let may_exceed = |&handle: &usize| {
            let changes = ratios.windows(2).map(|ends| (ends[0][handle] - ends[1][handle]).abs());
            chains[&ahead][handle].max(chains[&(ahead + 1)][handle]) + changes.fold(0.0, f64::max) > largest
        };
        (0..self.dragon.dimensions().handles()).rev().find(may_exceed).map(|last| last + 1)
    }

    /// The fastest of the first `handles` handles, at the ends of the pieces between a solved spot and the next.
    fn samples(&self, spots: &[Spot], ahead: usize, handles: usize) -> Vec<LargestRatio> {
        let cuts_m = self.cuts(spots[ahead + 1].fastest().travel_m, spots[ahead].fastest().travel_m, handles);
        cuts_m.iter().map(|&travel_m| self.fastest_at(travel_m, handles)).collect()
    }

    /// The maxima in the piece from one sample to the next. It has none if a neighbouring sample is higher than both.
    fn peaks(&self, samples: &[LargestRatio], piece: usize) -> Vec<LargestRatio> {
        let ends = [samples[piece], samples[piece + 1]];
        let before = piece.checked_sub(1).map_or(0.0, |before| samples[before].ratio);
        let after = samples.get(piece + 2).map_or(0.0, |after| after.ratio);
        if before.max(after) > ends[0].ratio.max(ends[1].ratio) {
            return Vec::new();
        }
        let mut handles = ends.map(|end| end.handle).to_vec();
        handles.dedup();
        let of_handle = |handle| {
            let peak = peak(ends[0].travel_m, ends[1].travel_m, TOLERANCE_M, |travel_m| self.ratio(travel_m, handle));
            LargestRatio { ratio: peak.value, travel_m: peak.at, handle }
        };
        handles.into_iter().map(of_handle).collect()
    }

    /// Travels that split a stretch into pieces: evenly, and where one of the handles crosses a seam.
    fn cuts(&self, low_m: f64, high_m: f64, handles: usize) -> Vec<f64> {
        let parameters_at =
            |travel_m| -> Vec<f64> { self.chain(travel_m).take(handles).map(|state| state.parameter).collect() };
        let (low_parameters, high_parameters) = (parameters_at(low_m), parameters_at(high_m));
        let even = |i| low_m + (high_m - low_m) * f64::from(i) / f64::from(PIECES_PER_STRETCH);
        let mut cuts_m: Vec<f64> = (0..=PIECES_PER_STRETCH).map(even).collect();
        for &seam in self.dragon.route().seams() {
            let crosses = |&handle: &usize| low_parameters[handle] < seam && seam < high_parameters[handle];
            cuts_m.extend((0..handles).filter(crosses).map(|handle| {
                rising_root(low_m..=high_m, 0.5 * (low_m + high_m), TOLERANCE_M, |travel_m| {
                    let state = self.chain(travel_m).nth(handle).expect("the chain has this handle");
                    let value = (state.parameter - seam) * self.dragon.route().point(state.parameter).speed_m_per_unit;
                    Slope { value, growth: state.speed_ratio }
                })
            }));
        }
        cuts_m.sort_unstable_by(f64::total_cmp);
        cuts_m
    }

    /// The fastest of the first `handles` handles at one travel.
    fn fastest_at(&self, travel_m: f64, handles: usize) -> LargestRatio {
        let states = self.chain(travel_m).take(handles).enumerate();
        let ratios = states.map(|(handle, state)| LargestRatio { ratio: state.speed_ratio, travel_m, handle });
        ratios.reduce(faster).expect("a chain has a head")
    }

    fn ratio(&self, travel_m: f64, handle: usize) -> f64 {
        self.chain(travel_m).nth(handle).expect("the chain has this handle").speed_ratio
    }

    /// The same, with the lowest handle that is equally fast up to rounding. On an arc all handles are equally fast.
    fn lowest_as_fast(&self, largest: LargestRatio) -> LargestRatio {
        let rounding = rounding(largest.handle + 1);
        let as_fast = |ratio: f64| ratio >= largest.ratio * (1.0 - rounding);
        let handle = self.chain(largest.travel_m).position(|state| as_fast(state.speed_ratio));
        LargestRatio { handle: handle.unwrap_or(largest.handle), ..largest }
    }

    fn chain(&self, travel_m: f64) -> Chain<'_> {
        self.dragon.chain(travel_m).expect("the travel lies within the run")
    }
}

/// For every station m of a phase, the largest outlook of the `count` stations n that begin with it, from the orbits before and
/// after. It is a speed divided by that at the first station, as those of the stations are.
///
/// Relative to handle 1, a handle is C(n)/C(m) times as fast here, and C′(n)/C′(m) times on the other orbit. If its ratio goes on to
/// change by this factor, it is C(n)²/C′(n) · C′(m)/C(m)² times as fast.
fn lifts(orbits: &[Vec<Station>], phase: usize, count: usize) -> Vec<f64> {
    let stations = &orbits[phase];
    let mut lifts = vec![0.0_f64; stations.len()];
    let last = orbits.len() - 1;
    // Behind the last orbit is the first, one station on.
    let before = if phase == 0 { (last, -1) } else { (phase - 1, 0) };
    let after = if phase == last { (0, 1) } else { (phase + 1, 0) };
    for (other, shift) in [before, after].into_iter().filter(|(other, _)| *other != phase) {
        let beside = |n: usize| n.checked_add_signed(shift).and_then(|n| orbits[other].get(n)).map(|at| at.speed_ratio);
        let outlook =
            |(n, station): (usize, &Station)| beside(n).map_or(0.0, |beside| station.speed_ratio.powi(2) / beside);
        let outlooks: Vec<f64> = stations.iter().enumerate().map(outlook).collect();
        for (m, rear) in fastest_behind(&outlooks, count).into_iter().enumerate() {
            let lift = beside(m).map_or(0.0, |beside| outlooks[rear] * beside / stations[m].speed_ratio);
            lifts[m] = lifts[m].max(lift);
        }
    }
    lifts
}

/// For every station, the fastest of the `count` stations that begin with it; the first if several are equal.
fn fastest_behind(speeds: &[f64], count: usize) -> Vec<usize> {
    let mut fastest = vec![0; speeds.len()];
    // The stations behind that are faster than all stations between. The fastest is at the front end.
    let mut falling: VecDeque<usize> = VecDeque::new();
    for m in (0..speeds.len()).rev() {
        while falling.back().is_some_and(|&rear| speeds[rear] <= speeds[m]) {
            falling.pop_back();
        }
        falling.push_back(m);
        while falling.front().is_some_and(|&rear| rear >= m + count) {
            falling.pop_front();
        }
        fastest[m] = falling[0];
    }
    fastest
}

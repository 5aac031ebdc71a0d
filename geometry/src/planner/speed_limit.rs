//! How fast a handle ever is.
//!
//! *Method.* Speeds are proportional to the head's, so the question is where speed ÷ head speed is largest, over all
//! handles and all of the run. The body behind handle 1 stands on an orbit of the route (see `dragon::orbit`), and the
//! same orbit serves every travel at which handle 1 stands on one of its stations. With C the running product of the
//! links' speed ratios along the orbit, and r the ratio of handle 1, on station m, to the head, handle j is
//! r·C(m + j − 1)/C(m) times as fast as the head. So one orbit, the length of the whole run, holds the speeds of all
//! handles at one travel in every link's length, and the fastest behind each station is found in one pass.
//!
//! 1. The run is surveyed: [`SURVEYED_PER_LINK`] such orbits say how fast the fastest handle is, with the head in a few
//!    thousand parameters. A bound on r often tells enough about the head; where it does not, the head is solved for.
//! 2. The stretches between two of those parameters that may hold the largest ratio are looked through, with the dragon
//!    itself. They are cut wherever a handle crosses a seam of the route, where the curvature jumps and with it the
//!    slope of the ratio, and so often that the pieces are as short as those in which the run was looked through for
//!    faults.
//! 3. In pieces beside the largest of these ratios, Brent's method refines it.
//!
//! *Precondition.* The dragon walks its whole route.
//!
//! *Guarantee.* The result is the ratio of a handle at a travel, to rounding, and no sample exceeds it: neither those of
//! the survey nor those of the pieces. A maximum at a kink is exact, for kinks are samples. That no ratio between
//! samples is larger rests on their density: within a piece the ratio is smooth, and a stretch is passed over only if
//! the samples at its ends lie further under the largest ratio than the ratio changes from sample to sample around it. A
//! peak is the narrower the higher it is; those that would be narrower than a piece the run takes for jumps, and ends
//! there.

use std::collections::VecDeque;

use super::passage::{ARC_PER_CHORD, Infeasible};
use crate::dragon::{Chain, Dragon, RunEnd, Station};
use crate::numerics::{Slope, peak, rising_root};

/// Orbits that the survey takes, evenly over the last link's length that handle 1 walks.
const SURVEYED_PER_LINK: usize = 16;

/// Pieces that a stretch of the survey is cut into at least, so that there are 64 a link.
const PIECES_PER_STRETCH: u32 = 4;

/// A ratio that no handle has: where a handle would jump its speed has no bound, and such a jump, if it is too short for
/// the run's looks, shows as a peak cut off by rounding at some 10⁷. A handle that walked on, at a ratio of R, over a
/// curvature of κ would be so fast for less than 1/(κ·R²) of travel only, here some micrometres.
const JUMP_RATIO: f64 = 1000.0;

/// What a station of the survey takes besides its link, in steps of work: so a limit of work bounds how many are kept, each
/// in some hundred bytes.
const STEPS_PER_STATION: u64 = 16;

/// Travel to which kinks and maxima are found, in metres; the ratio is then right to rounding.
const TOLERANCE_M: f64 = 1e-11;

/// Where a handle is fastest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LargestRatio {
    /// Speed ÷ head speed.
    pub ratio: f64,
    /// Travel of the head.
    pub travel_m: f64,
    /// Index of the handle; the lowest of those as fast.
    pub handle: usize,
}

/// The largest ratio of any handle's speed to the head's, over the whole run of a dragon: 1 at least, the head's own.
///
/// # Errors
/// The fault that ends the run before the route's end, or a handle's jump that was too short to end it; or the dragon's
/// meter is spent.
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
    for ahead in 0..spots.len() - 1 {
        if !may_exceed(&spots, ahead, largest.ratio) {
            continue;
        }
        let stretch = &mut spots[ahead..=ahead + 1];
        for spot in stretch {
            survey.solve(spot);
        }
        if may_exceed(&spots, ahead, largest.ratio) {
            let found = survey.look_through(&spots[ahead + 1], &spots[ahead]);
            survey.check_meter()?;
            largest = found.into_iter().fold(largest, faster);
        }
    }
    let LargestRatio { ratio, travel_m, handle } = survey.lowest_as_fast(largest);
    if ratio > JUMP_RATIO {
        return Err(Infeasible::Fault { travel_m, end: RunEnd::HandleJumps { handle } });
    }
    Ok(LargestRatio { ratio, travel_m, handle })
}

/// The faster of two, the first where they are as fast.
fn faster(first: LargestRatio, second: LargestRatio) -> LargestRatio {
    if second.ratio > first.ratio { second } else { first }
}

/// Whether the ratio between a spot and the next may exceed `largest`: the faster one lies under it by no more than the
/// ratio changes from spot to spot around them.
fn may_exceed(spots: &[Spot], ahead: usize, largest: f64) -> bool {
    let around = &spots[ahead.saturating_sub(1)..spots.len().min(ahead + 3)];
    let change = around.windows(2).map(|ends| (ends[0].ratio - ends[1].ratio).abs()).fold(0.0, f64::max);
    spots[ahead].ratio.max(spots[ahead + 1].ratio) + change > largest
}

/// The fastest handle behind the head, with handle 1 at one parameter.
#[derive(Clone, Copy, Debug)]
struct Spot {
    /// Of handle 1.
    parameter: f64,
    /// Index of the fastest handle.
    handle: usize,
    /// Its speed ÷ that of handle 1.
    behind: f64,
    /// Its speed ÷ that of the head; a bound while the head's travel is not known.
    ratio: f64,
    travel_m: Option<f64>,
}

impl Spot {
    fn fastest(&self) -> LargestRatio {
        let travel_m = self.travel_m.expect("the spot is solved");
        LargestRatio { ratio: self.ratio, travel_m, handle: self.handle }
    }
}

struct Survey<'a> {
    dragon: &'a Dragon,
}

impl Survey<'_> {
    /// Ends the work where the meter is spent.
    fn check_meter(&self) -> Result<(), Infeasible> {
        Ok(self.dragon.meter().check(self.dragon.start_travel_m())?)
    }

    /// Spots all through the run, the head at its end first and at its beginning last.
    fn spots(&self) -> Vec<Spot> {
        let dragon = self.dragon;
        let route = dragon.route();
        let [begin_parameter, end_parameter] = [dragon.start_travel_m(), dragon.end_travel_m()].map(|travel_m| {
            dragon.rear(0, route.parameter(travel_m)).expect("handle 1 stands all through the run").parameter
        });
        let benches = dragon.dimensions().benches();
        let mut beyond = 0;
        let last_orbit = dragon.orbit(end_parameter).take_while(|station| {
            dragon.meter().add(SURVEYED_PER_LINK as u64 * STEPS_PER_STATION);
            beyond += usize::from(station.parameter < begin_parameter);
            beyond < benches && !dragon.meter().is_spent()
        });
        let length = last_orbit.count();
        let link_behind = dragon.orbit(end_parameter).nth(1).map_or(begin_parameter, |station| station.parameter);
        let [low_m, high_m] = [link_behind, end_parameter].map(|parameter| route.travel(parameter));
        let phases = (1..=SURVEYED_PER_LINK).rev().map(|i| {
            let share = i as f64 / SURVEYED_PER_LINK as f64;
            let parameter =
                if i == SURVEYED_PER_LINK { end_parameter } else { route.parameter(low_m + (high_m - low_m) * share) };
            self.spots_of_phase(parameter, length)
        });
        let phases: Vec<Vec<Spot>> = phases.take_while(|_| !dragon.meter().is_spent()).collect();
        let walked = |spot: &&Spot| spot.parameter > begin_parameter;
        let mut spots: Vec<Spot> = (0..length)
            .flat_map(|m| phases.iter().filter_map(move |phase| phase.get(m)))
            .take_while(walked)
            .copied()
            .collect();
        spots.extend(self.spots_of_phase(begin_parameter, benches).first());
        spots
    }

    /// Spots with handle 1 on the stations of one orbit.
    fn spots_of_phase(&self, parameter: f64, length: usize) -> Vec<Spot> {
        let dragon = self.dragon;
        let stations: Vec<Station> = dragon.orbit(parameter).take(length).collect();
        let dimensions = dragon.dimensions();
        let bench = 1.min(dimensions.benches() - 1);
        let stations_ahead = (ARC_PER_CHORD * dimensions.link_m(0) / dimensions.link_m(bench)).ceil() as usize;
        let end_parameter = dragon.end_parameter;
        let spot = |(m, rear): (usize, usize)| {
            let behind = stations[rear].speed_ratio / stations[m].speed_ratio;
            let head_parameter = m.checked_sub(stations_ahead).map_or(end_parameter, |ahead| stations[ahead].parameter);
            let ratio = behind * self.head_bound(stations[m].parameter, head_parameter);
            Spot { parameter: stations[m].parameter, handle: rear - m + 1, behind, ratio, travel_m: None }
        };
        fastest_behind(&stations, dimensions.benches()).into_iter().enumerate().map(spot).collect()
    }

    /// A bound on the ratio of handle 1 at `parameter` to the head: 1 / cos of the link's angle at handle 1, at most.
    /// `head_parameter` is surely not behind the head.
    ///
    /// A curve with |κ| ≤ K first comes to a distance of d after an arc of at most π·d/2, if K·d < 2, and on that arc
    /// the angle between chord and tangent has a sine of at most K·d/2 (Schwarz's theorem on curves of bounded
    /// curvature). Seen from there the same point is the first behind, so it is the head that stands there. A station
    /// is at least a link's length of arc from the next.
    fn head_bound(&self, parameter: f64, head_parameter: f64) -> f64 {
        let curvature = self.dragon.route().curvature_bound(parameter, head_parameter);
        let sine = 0.5 * curvature * self.dragon.dimensions().link_m(0);
        if sine < 1.0 { (1.0 - sine * sine).sqrt().recip() } else { f64::INFINITY }
    }

    /// Solves for the head.
    fn solve(&self, spot: &mut Spot) {
        if spot.travel_m.is_none() {
            let (head_parameter, speed_ratio) = self.dragon.head_before(spot.parameter);
            let travel_m = self.dragon.route().travel(head_parameter);
            spot.travel_m = Some(travel_m.clamp(self.dragon.start_travel_m(), self.dragon.end_travel_m()));
            spot.ratio = speed_ratio * spot.behind;
        }
    }

    /// The largest ratios between two solved spots, of the handles up to the fastest of both and the next.
    fn look_through(&self, behind: &Spot, ahead: &Spot) -> Vec<LargestRatio> {
        let handles = (behind.handle.max(ahead.handle) + 2).min(self.dragon.dimensions().handles());
        let cuts_m = self.cuts(behind.fastest().travel_m, ahead.fastest().travel_m, handles);
        let samples: Vec<LargestRatio> = cuts_m.iter().map(|&travel_m| self.fastest_at(travel_m, handles)).collect();
        let mut found = samples.clone();
        for (i, ends) in samples.windows(2).enumerate() {
            let before = i.checked_sub(1).map_or(0.0, |before| samples[before].ratio);
            let after = samples.get(i + 2).map_or(0.0, |after| after.ratio);
            // Nothing peaks between two samples of which the higher is exceeded by the one beyond it.
            if before.max(after) <= ends[0].ratio.max(ends[1].ratio) {
                found.extend([ends[0].handle, ends[1].handle].map(|handle| {
                    let ratio = |travel_m| self.ratio(travel_m, handle);
                    let peak = peak(ends[0].travel_m, ends[1].travel_m, TOLERANCE_M, ratio);
                    LargestRatio { ratio: peak.value, travel_m: peak.at, handle }
                }));
            }
        }
        found
    }

    /// Travels that cut a stretch into pieces: evenly, and where one of the handles crosses a seam.
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

    /// The fastest of the foremost handles at one travel.
    fn fastest_at(&self, travel_m: f64, handles: usize) -> LargestRatio {
        let states = self.chain(travel_m).take(handles).enumerate();
        let ratios = states.map(|(handle, state)| LargestRatio { ratio: state.speed_ratio, travel_m, handle });
        ratios.reduce(faster).expect("a chain has a head")
    }

    fn ratio(&self, travel_m: f64, handle: usize) -> f64 {
        self.chain(travel_m).nth(handle).expect("the chain has this handle").speed_ratio
    }

    /// The same with the lowest handle that is as fast but for rounding: on an arc all of them are.
    fn lowest_as_fast(&self, largest: LargestRatio) -> LargestRatio {
        let rounding = 8.0 * f64::EPSILON * (largest.handle + 1) as f64;
        let as_fast = |ratio: f64| ratio >= largest.ratio * (1.0 - rounding);
        let handle = self.chain(largest.travel_m).position(|state| as_fast(state.speed_ratio));
        LargestRatio { handle: handle.unwrap_or(largest.handle), ..largest }
    }

    fn chain(&self, travel_m: f64) -> Chain<'_> {
        self.dragon.chain(travel_m).expect("the travel lies within the run")
    }
}

/// For every station the fastest of the `count` that begin with it, of equal ones the first.
fn fastest_behind(stations: &[Station], count: usize) -> Vec<usize> {
    let mut fastest = vec![0; stations.len()];
    // Of the stations behind, each that is faster than all between: the fastest at the front end.
    let mut falling: VecDeque<usize> = VecDeque::new();
    for m in (0..stations.len()).rev() {
        while falling.back().is_some_and(|&rear| stations[rear].speed_ratio <= stations[m].speed_ratio) {
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

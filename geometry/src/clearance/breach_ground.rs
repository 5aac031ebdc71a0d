//! The ground on which boards are beyond a border or too near to it, and when benches come there and leave it.
//!
//! The pose of a bench depends only on the parameter of its front handle, and all body benches are alike. So there are two lists of
//! intervals of parameters on which a board does not keep clear: one for the head's board, and one for all others. They are found
//! once for a run, as in [`bench_search`](super::bench_search). Where a front handle passes an end of an interval, its board comes too
//! near, or is clear again. So no passage between two travels is missed, however short, except that a board that is clear for less than a
//! look, a 64th of a link, may count as too near throughout.

use glam::DVec2;

use super::bench_search::{BenchSearch, Moment, Stride};
use super::border_search::parameters;
use crate::dragon::{Dragon, Spent};
use crate::numerics::turning_point;
use crate::stage::Border;

/// Tolerance of a parameter at which a board is clear again, as a share of a look.
const END_SHARE: f64 = 1e-9;

/// The intervals of a dragon with respect to borders of one kind.
#[derive(Clone, Debug)]
pub struct BreachGround {
    borders: Vec<Border>,
    clear_m: f64,
    /// Intervals of the parameter of a front handle: of the head's bench, and of any other.
    intervals: [Vec<[f64; 2]>; 2],
}

/// A board that comes too near to a border, or is clear of it again.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passage {
    /// Travel of the head.
    pub travel_m: f64,
    /// Index of the bench.
    pub bench: usize,
    /// The point of the board as of a [`Breach`](super::Breach); for a board that is clear again, its point nearest to the border.
    pub point: DVec2,
    /// Distance of the board from the border.
    pub distance_m: f64,
    /// Whether the board comes too near. Otherwise it is clear again.
    pub begins: bool,
}

/// Where the handles of a dragon are at a travel of its head.
#[derive(Clone, Debug)]
pub struct HandlePlaces {
    travel_m: f64,
    parameters: Vec<f64>,
}

impl HandlePlaces {
    /// The places at a travel of the run.
    ///
    /// # Panics
    /// Panics for a travel that is not feasible.
    pub fn of(dragon: &Dragon, travel_m: f64) -> Self {
        Self { travel_m, parameters: parameters(dragon, travel_m) }
    }

    /// Travel of the head.
    pub fn travel_m(&self) -> f64 {
        self.travel_m
    }
}

impl BreachGround {
    /// The ground of a dragon, over its whole run, on which a board is beyond one of these borders, or nearer than `clear_m`.
    ///
    /// # Errors
    /// The dragon's meter is spent.
    pub fn of(dragon: &Dragon, borders: &[Border], clear_m: f64) -> Result<Self, Spent> {
        let [start, end] = [dragon.start_travel_m(), dragon.end_travel_m()].map(|at_m| parameters(dragon, at_m));
        let last = dragon.dimensions().benches() - 1;
        let mut intervals = [Vec::new(), Vec::new()];
        for (bench, from, to) in [(0, start[0], end[0]), (1, start[last], end[1])].into_iter().take(last + 1) {
            let search = BenchSearch { dragon, borders, clear_m, bench };
            intervals[bench] =
                breaches(&search, from, to).ok_or_else(|| dragon.meter().spent(dragon.start_travel_m()))?;
        }
        Ok(Self { borders: borders.to_vec(), clear_m, intervals })
    }

    /// Whether all boards keep clear over the whole run.
    pub fn is_empty(&self) -> bool {
        self.intervals.iter().all(Vec::is_empty)
    }

    /// Adds the passages of all benches between two travels to `passages`, those of one bench in order.
    pub fn add_passages(&self, dragon: &Dragon, from: &HandlePlaces, to: &HandlePlaces, passages: &mut Vec<Passage>) {
        for bench in 0..dragon.dimensions().benches() {
            let (low, high) = (from.parameters[bench], to.parameters[bench]);
            for &[begin, end] in &self.intervals[bench.min(1)] {
                for (parameter, begins) in [(begin, true), (end, false)] {
                    if low < parameter && parameter <= high {
                        let ends_m = [from.travel_m, to.travel_m];
                        passages.extend(self.passage(dragon, bench, parameter, begins, ends_m));
                    }
                }
            }
        }
    }

    fn passage(
        &self,
        dragon: &Dragon,
        bench: usize,
        parameter: f64,
        begins: bool,
        ends_m: [f64; 2],
    ) -> Option<Passage> {
        let search = BenchSearch { dragon, borders: &self.borders, clear_m: self.clear_m, bench };
        let moment = search.at(parameter)?;
        let distance_m = |border: &&Border| border.distance_m(moment.board());
        let nearest = self.borders.iter().min_by(|one, other| distance_m(one).total_cmp(&distance_m(other)))?;
        let breach = moment.breach.filter(|_| begins).map(|(_, point)| point);
        let [_, travel_m] = search.head_travels_m(parameter, ends_m);
        Some(Passage {
            travel_m,
            bench,
            point: breach.unwrap_or_else(|| nearest.nearest_point(moment.board())),
            distance_m: distance_m(&nearest),
            begins,
        })
    }
}

/// The intervals of the front handle's parameter, between two of them, on which a board does not keep clear. `None` if the meter is spent.
fn breaches(search: &BenchSearch<'_>, from: f64, to: f64) -> Option<Vec<[f64; 2]>> {
    let mut intervals = Vec::new();
    let mut moment = search.at(from)?;
    let mut begin = moment.breach.map(|_| f64::NEG_INFINITY);
    while moment.parameter() < to {
        let Some(begun) = begin else {
            match search.stride(&moment, to) {
                Stride::Clear(later) => moment = later,
                Stride::Breach([_, later]) => (begin, moment) = (Some(later.parameter()), later),
                Stride::Spent => return None,
            }
            continue;
        };
        let later = search.next_look(&moment, to)?;
        if later.breach.is_none() {
            let [low, high] = [&moment, &later].map(Moment::parameter);
            let is_clear = |parameter| search.at(parameter).is_none_or(|moment| moment.breach.is_none());
            let (_, end) = turning_point(low, high, END_SHARE * (high - low), is_clear);
            intervals.push([begun, end]);
            begin = None;
            moment = search.at(end)?;
        } else {
            moment = later;
        }
    }
    intervals.extend(begin.map(|begun| [begun, f64::INFINITY]));
    Some(intervals)
}

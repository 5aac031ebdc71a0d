//! When each dragon of a formation may leave, so that no two come within a clearance of each other.
//!
//! For each two dragons, [`DragonPair`] finds all delays at which they meet, whenever they leave. So all plans are known at once:
//! a plan keeps the clearance exactly if no difference of two starts is such a delay.

use rayon::prelude::*;
use thiserror::Error;

use crate::clearance::{DragonPair, MeetingZone, Nearest};
use crate::formation::{DelaySet, Formation};

/// Most dragons of which all orders are tried.
pub const MOST_IN_ALL_ORDERS: usize = 6;

/// Starts are whole multiples of this time, in parts of a second, where they may be.
const PARTS_PER_SECOND: f64 = 1000.0;

/// Two dragons of a formation, and where they could meet.
#[derive(Clone, Debug)]
pub struct Conflict {
    /// Indices of the dragons, the lower one first.
    pub dragons: [usize; 2],
    /// The dragons with their own times.
    pub pair: DragonPair,
    /// The zones in which they could meet, in the order of the first dragon's way.
    pub zones: Vec<MeetingZone>,
    /// Delays of the second dragon after the first one at which they meet.
    pub delays: DelaySet,
}

/// A crossing of two dragons in a plan.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Passing {
    /// Indices of the dragons, the lower one first.
    pub dragons: [usize; 2],
    /// The dragon that passes first; `None` if they meet.
    pub first: Option<usize>,
    /// Plan time from which the first dragon is out of the other one's way, in seconds.
    pub passes_s: Option<f64>,
    /// Plan time at which the other dragon gets there. If it left earlier by the slack, it would just keep the clearance.
    pub arrives_s: Option<f64>,
    /// By how much the delay of the dragons may change until they meet here. Below 0: by how much it must change until they do not.
    pub slack_s: f64,
    /// Plan times of each dragon, from and to, at which it is in the way of the other one.
    pub spans_s: [[f64; 2]; 2],
    /// The nearest boards while one of the dragons is in the zone. Its own times begin when each dragon leaves.
    pub nearest: Nearest,
    /// Plan time of the nearest boards.
    pub nearest_s: f64,
}

/// Why dragons cannot be scheduled.
#[derive(Clone, Debug, PartialEq)]
pub enum Blocked {
    /// Two dragons meet, whenever they leave.
    Always([usize; 2]),
    /// Each dragon has to leave before the next one, and the last one before the first.
    Cycle(Vec<usize>),
    /// A dragon cannot leave after those before it in the order.
    InOrder {
        /// The dragon.
        dragon: usize,
        /// The dragon that is in its way.
        by: usize,
        /// Latest start of the dragon after that of the other one, in seconds; below 0 if it has to leave before.
        latest_s: f64,
    },
}

/// Error: the work of a dragon's meter does not suffice to find out whether two dragons meet.
#[derive(Clone, Copy, Debug, Error, PartialEq, Eq)]
#[error("whether dragons {} and {} meet is unknown", .dragons[0], .dragons[1])]
pub struct Undecided {
    /// Indices of the dragons, the lower one first.
    pub dragons: [usize; 2],
}

/// All plans of a formation.
#[derive(Clone, Debug)]
pub struct Schedule {
    /// The earliest start of each dragon.
    earliest_s: Vec<f64>,
    ends_s: Vec<f64>,
    /// Every two dragons.
    conflicts: Vec<Conflict>,
}

/// What a plan costs: dragons that cannot leave, then the plan time at which the last dragon ends, then the sum of the starts.
type Cost = (usize, f64, f64);

impl Schedule {
    /// Finds where the dragons of a formation could come within a clearance of each other. No dragon shall leave before its own
    /// start.
    ///
    /// # Errors
    /// The first two dragons that are not decided.
    ///
    /// # Panics
    /// Panics for a clearance that is negative or not finite.
    pub fn new(formation: &Formation, clearance_m: f64) -> Result<Self, Undecided> {
        let dragons = formation.dragons();
        let pairs = (0..dragons.len()).flat_map(|one| (one + 1..dragons.len()).map(move |other| [one, other]));
        let pairs: Vec<[usize; 2]> = pairs.collect();
        let conflict = |indices: &[usize; 2]| {
            let pair = DragonPair::new(indices.map(|index| &dragons[index]), clearance_m);
            let mut zones = pair.zones().ok_or(Undecided { dragons: *indices })?;
            zones.sort_by(|one, other| one.times_s[0][0].total_cmp(&other.times_s[0][0]));
            let mut delays = DelaySet::default();
            for zone in &zones {
                delays.extend(&zone.delays);
            }
            Ok(Conflict { dragons: *indices, pair, zones, delays })
        };
        let conflicts: Vec<Result<Conflict, Undecided>> = pairs.par_iter().map(conflict).collect();
        Ok(Self {
            earliest_s: dragons.iter().map(|planned| planned.timetable.start_s()).collect(),
            ends_s: dragons.iter().map(|planned| planned.leaving_at(0.0).timetable.end_s()).collect(),
            conflicts: conflicts.into_iter().collect::<Result<_, _>>()?,
        })
    }

    /// Every two dragons.
    pub fn conflicts(&self) -> &[Conflict] {
        &self.conflicts
    }

    /// The earliest start of each dragon.
    pub fn earliest_s(&self) -> &[f64] {
        &self.earliest_s
    }

    /// The earliest starts of all dragons that keep the clearance, in an order: each dragon leaves as early as those before it
    /// allow. A start that is not the earliest one is rounded up to a millisecond, where that keeps the clearance.
    ///
    /// # Errors
    /// The dragon that cannot leave.
    pub fn in_order(&self, order: &[usize]) -> Result<Vec<f64>, Blocked> {
        let mut starts_s = vec![0.0; order.len()];
        for (number, &dragon) in order.iter().enumerate() {
            starts_s[dragon] = self.start_s(dragon, &order[..number], &starts_s)?;
        }
        Ok(starts_s)
    }

    /// The earliest start of a dragon after those before it.
    fn start_s(&self, dragon: usize, before: &[usize], starts_s: &[f64]) -> Result<f64, Blocked> {
        let mut start_s = self.earliest_s[dragon];
        loop {
            let next_s = self.next_start_s(dragon, before, starts_s, start_s)?;
            if next_s <= start_s {
                break;
            }
            start_s = next_s;
        }
        let rounded_s = (start_s * PARTS_PER_SECOND).ceil() / PARTS_PER_SECOND;
        let is_kept = start_s > self.earliest_s[dragon]
            && self.next_start_s(dragon, before, starts_s, rounded_s).is_ok_and(|next_s| next_s <= rounded_s);
        Ok(if is_kept { rounded_s } else { start_s })
    }

    /// A start from `start_s` on before which the dragon meets one of those before it.
    fn next_start_s(&self, dragon: usize, before: &[usize], starts_s: &[f64], start_s: f64) -> Result<f64, Blocked> {
        before.iter().try_fold(start_s, |start_s, &other| {
            let delays = self.delays(other, dragon);
            let next_s = delays.next_outside(start_s - starts_s[other]);
            if next_s == f64::INFINITY {
                let latest_s = delays.intervals().last().map_or(f64::INFINITY, |interval| interval[0]);
                return Err(self.blocked(Blocked::InOrder { dragon, by: other, latest_s }));
            }
            Ok(start_s.max(starts_s[other] + next_s))
        })
    }

    /// The reason that holds for all orders, if there is one, or else this one.
    fn blocked(&self, in_order: Blocked) -> Blocked {
        let always = self.conflicts.iter().find(|conflict| conflict.delays.is_all());
        let always = always.map(|conflict| Blocked::Always(conflict.dragons));
        always.or_else(|| self.cycle().map(Blocked::Cycle)).unwrap_or(in_order)
    }

    /// The delays of `other` after `dragon` at which the two meet.
    fn delays(&self, dragon: usize, other: usize) -> DelaySet {
        let indices = [dragon.min(other), dragon.max(other)];
        let conflict = self.conflicts.iter().find(|conflict| conflict.dragons == indices).expect("two dragons");
        if dragon < other { conflict.delays.clone() } else { conflict.delays.reversed() }
    }

    /// The order in which the last dragon ends first, and of equal ones that with the least sum of starts; and the starts. Up to
    /// [`MOST_IN_ALL_ORDERS`] dragons, it is the best of all orders. Of more, the order of the list is improved: as long as it
    /// helps, one dragon moves to another place.
    ///
    /// # Errors
    /// No tried order lets all dragons leave: the reason for the one that comes furthest.
    pub fn best_order(&self) -> Result<(Vec<usize>, Vec<f64>), Blocked> {
        let listed: Vec<usize> = (0..self.earliest_s.len()).collect();
        let order = if listed.len() <= MOST_IN_ALL_ORDERS { self.best_of_all(listed) } else { self.improved(listed) };
        self.in_order(&order).map(|starts_s| (order, starts_s))
    }

    fn best_of_all(&self, mut order: Vec<usize>) -> Vec<usize> {
        let (mut best, mut best_cost) = (order.clone(), self.cost(&order));
        while next_permutation(&mut order) {
            let cost = self.cost(&order);
            if cost < best_cost {
                (best, best_cost) = (order.clone(), cost);
            }
        }
        best
    }

    fn improved(&self, mut order: Vec<usize>) -> Vec<usize> {
        let mut cost = self.cost(&order);
        loop {
            let count = order.len();
            let places = (0..count).flat_map(|from| (0..count).map(move |to| (from, to)));
            let moved = places.filter(|(from, to)| from != to).map(|(from, to)| {
                let mut moved = order.clone();
                let dragon = moved.remove(from);
                moved.insert(to, dragon);
                (self.cost(&moved), moved)
            });
            let best = moved.min_by(|one, other| one.0.partial_cmp(&other.0).expect("costs are numbers"));
            match best {
                Some((lower, moved)) if lower < cost => (cost, order) = (lower, moved),
                _ => return order,
            }
        }
    }

    fn cost(&self, order: &[usize]) -> Cost {
        let mut starts_s = vec![0.0; order.len()];
        for (number, &dragon) in order.iter().enumerate() {
            match self.start_s(dragon, &order[..number], &starts_s) {
                Ok(start_s) => starts_s[dragon] = start_s,
                Err(_) => return (order.len() - number, f64::INFINITY, f64::INFINITY),
            }
        }
        (0, self.end_s(&starts_s), starts_s.iter().sum())
    }

    /// Plan time at which the last dragon ends.
    pub fn end_s(&self, starts_s: &[f64]) -> f64 {
        (0..starts_s.len()).map(|dragon| self.dragon_end_s(dragon, starts_s)).fold(f64::NEG_INFINITY, f64::max)
    }

    /// Plan time at which a dragon ends.
    pub fn dragon_end_s(&self, dragon: usize, starts_s: &[f64]) -> f64 {
        starts_s[dragon] + self.ends_s[dragon]
    }

    /// Dragons of which each has to leave before the next one, and the last one before the first. Dragons that stand in the way
    /// at their ends, or at their starts, limit the difference of two starts from above. Such limits contradict each other exactly
    /// if their sum around a cycle is below 0 (Bellman and Ford).
    fn cycle(&self) -> Option<Vec<usize>> {
        // Limits (from, to, most): the start of `to` is at most `most` after that of `from`.
        let limits: Vec<(usize, usize, f64)> = self
            .conflicts
            .iter()
            .flat_map(|conflict| {
                let ([one, other], intervals) = (conflict.dragons, conflict.delays.intervals());
                let above = intervals
                    .last()
                    .filter(|interval| interval[1] == f64::INFINITY)
                    .map(|interval| (one, other, interval[0]));
                let below = intervals
                    .first()
                    .filter(|interval| interval[0] == f64::NEG_INFINITY)
                    .map(|interval| (other, one, -interval[1]));
                [above, below]
            })
            .flatten()
            .collect();
        let count = self.earliest_s.len();
        let (mut latest_s, mut reason) = (vec![0.0; count], vec![usize::MAX; count]);
        let mut changed = None;
        for _ in 0..count {
            changed = None;
            for &(from, to, most_s) in &limits {
                if latest_s[from] + most_s < latest_s[to] - 1e-9 {
                    (latest_s[to], reason[to]) = (latest_s[from] + most_s, from);
                    changed = Some(to);
                }
            }
        }
        // After as many steps back as there are dragons, a dragon of the cycle is reached.
        let on_cycle = (0..count).fold(changed?, |dragon, _| reason[dragon]);
        let mut cycle = vec![on_cycle];
        while reason[*cycle.last()?] != on_cycle {
            cycle.push(reason[*cycle.last()?]);
        }
        Some(cycle)
    }

    /// All crossings of a plan, in the order of the plan times at which they are passed.
    pub fn passings(&self, starts_s: &[f64]) -> Vec<Passing> {
        let passings_of = |conflict: Conflict| -> Vec<Passing> {
            conflict.zones.iter().map(|zone| passing(&conflict, zone, starts_s)).collect()
        };
        // Each copy of two dragons keeps poses of its own, so that cores share none.
        let conflicts = self.conflicts.clone().into_par_iter();
        let mut passings: Vec<Passing> = conflicts.flat_map_iter(passings_of).collect();
        let begin_s = |passing: &Passing| passing.passes_s.unwrap_or(passing.nearest_s);
        passings.sort_by(|one, other| begin_s(one).total_cmp(&begin_s(other)));
        passings
    }

    /// By how much a dragon may leave earlier and later, while all others leave as planned; infinite if it does not matter. `None`
    /// if it meets another one as planned.
    pub fn slack_s(&self, dragon: usize, starts_s: &[f64]) -> Option<[f64; 2]> {
        let others = (0..starts_s.len()).filter(|&other| other != dragon);
        others
            .map(|other| {
                let (delays, delay_s) = (self.delays(other, dragon), starts_s[dragon] - starts_s[other]);
                // A start right at a meeting is a sum, so the difference may round into the meeting.
                let rounding_s = 2.0 * f64::EPSILON * (starts_s[dragon].abs() + starts_s[other].abs());
                let outside_s = delays.next_outside(delay_s - rounding_s);
                let [low_s, high_s] = delays.gap_around(outside_s);
                let is_free = outside_s <= delay_s + rounding_s;
                is_free.then_some([(delay_s - low_s).max(0.0), (high_s - delay_s).max(0.0)])
            })
            .try_fold([starts_s[dragon].max(0.0), f64::INFINITY], |slack, one| {
                one.map(|one| [slack[0].min(one[0]), slack[1].min(one[1])])
            })
    }

    /// The two dragons that come nearest to each other in a plan, their boards, and the plan time; `None` for one dragon. The
    /// clearance is exact as that of [`DragonPair::least_clearance`].
    pub fn nearest(&self, starts_s: &[f64]) -> Option<([usize; 2], Nearest, f64)> {
        let nearest = |conflict: &Conflict| {
            let [one_s, other_s] = conflict.dragons.map(|dragon| starts_s[dragon]);
            let (delay_s, ends_s) = (other_s - one_s, conflict.pair.ends_s());
            let least = conflict.pair.least_clearance(delay_s, [delay_s.min(0.0), ends_s[0].max(delay_s + ends_s[1])]);
            (conflict.dragons, least, one_s + least.times_s[0])
        };
        // Dragons whose ways come near come first: most others need no search.
        let gaps = self.conflicts.iter().map(|conflict| (conflict, conflict.ways_gap_m()));
        let mut conflicts: Vec<(&Conflict, f64)> = gaps.collect();
        conflicts.sort_by(|one, other| one.1.total_cmp(&other.1));
        conflicts.into_iter().fold(None, |least: Option<([usize; 2], Nearest, f64)>, (conflict, gap_m)| {
            if least.is_some_and(|(_, least, _)| least.approach.clearance_m <= gap_m) {
                return least;
            }
            let found = nearest(conflict);
            least.filter(|(_, least, _)| least.approach.clearance_m <= found.1.approach.clearance_m).or(Some(found))
        })
    }
}

impl Conflict {
    /// A lower bound on the clearance of both dragons in any plan, if it is above 0.
    fn ways_gap_m(&self) -> f64 {
        self.pair.ways_gap_m(0.0)
    }
}

/// How two dragons pass in a zone.
fn passing(conflict: &Conflict, zone: &MeetingZone, starts_s: &[f64]) -> Passing {
    let [one_s, other_s] = conflict.dragons.map(|dragon| starts_s[dragon]);
    let delay_s = other_s - one_s;
    let (nearest, nearest_s) = nearest_in(conflict, zone, delay_s, one_s);
    let unordered = Passing {
        dragons: conflict.dragons,
        first: None,
        passes_s: None,
        arrives_s: None,
        slack_s: 0.0,
        spans_s: [zone.times_s[0].map(|time_s| one_s + time_s), zone.times_s[1].map(|time_s| other_s + time_s)],
        nearest,
        nearest_s,
    };
    let inside = zone.delays.around(delay_s).filter(|interval| interval[0] < delay_s && delay_s < interval[1]);
    if let Some([low_s, high_s]) = inside {
        return Passing { slack_s: -(delay_s - low_s).min(high_s - delay_s), ..unordered };
    }
    let [low_s, high_s] = zone.delays.gap_around(delay_s);
    // The end of the gap that is nearer: below, the second dragon would be too early.
    let is_below = delay_s - low_s <= high_s - delay_s;
    let (first, tip) = if is_below { (0, zone.tips[1]) } else { (1, zone.tips[0]) };
    let is_outermost = if is_below { high_s == f64::INFINITY } else { low_s == f64::NEG_INFINITY };
    let times_s = tip.filter(|_| is_outermost).map(|tip| [one_s + tip.times_s[0], other_s + tip.times_s[1]]);
    Passing {
        first: Some(conflict.dragons[first]),
        passes_s: times_s.map(|times_s| times_s[first]),
        arrives_s: times_s.map(|times_s| times_s[1 - first]),
        slack_s: (delay_s - low_s).min(high_s - delay_s),
        ..unordered
    }
}

/// The nearest boards while one of the dragons is in the zone, and the plan time.
fn nearest_in(conflict: &Conflict, zone: &MeetingZone, delay_s: f64, start_s: f64) -> (Nearest, f64) {
    let spans_s = [zone.times_s[0], zone.times_s[1].map(|time_s| time_s + delay_s)];
    let least = spans_s.map(|span_s| conflict.pair.least_clearance(delay_s, span_s));
    let nearer = usize::from(least[1].approach.clearance_m < least[0].approach.clearance_m);
    (least[nearer], start_s + least[nearer].times_s[0])
}

/// The next order in the order of the dictionary; false after the last one.
fn next_permutation(order: &mut [usize]) -> bool {
    let Some(pivot) = order.windows(2).rposition(|two| two[0] < two[1]) else { return false };
    let swapped = order.iter().rposition(|&dragon| dragon > order[pivot]).expect("the next one is greater");
    order.swap(pivot, swapped);
    order[pivot + 1..].reverse();
    true
}

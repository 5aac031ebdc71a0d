//! Proofs that no two benches touch, whatever the play of the hinges allows.
//!
//! **Pairs.** The poles behind a pole depend on its place alone, and all body links are alike. So three facts determine a pair of
//! benches: the place x of its front pole, whether its front bench is the head's, and the number of benches in between. The
//! head's pole is at the head's travel. Pole 1 is the first body pole at each place. So one walk of the head's pole and one of a
//! body pole examine all pairs, each place once.
//!
//! **Cells.** The search divides each walk into intervals of x, the cells. In a cell, the chains of the longest and of the
//! shortest links bracket all poles behind (see `dragon::loose`), and [`BoardRange`] bounds the boards. If the bounds do not
//! prove a pair apart, the search divides the bracket of the rear bench. If that is not enough, it halves the cell, down to
//! [`RESOLUTION_M`].
//!
//! **Coils.** On outer turns of a spiral the bounds of the coil (see `coil_reach`) rule out all touches at once: cells there are
//! skipped. Further in, they state how many turns outward a bench reaches, and the bracket is followed only that far.
//!
//! **Guarantee.** No pose that the play allows has a clearance up to the searched one before the travel that is found, up to the
//! rounding of the poses, about 10⁻¹² m. The bound lets each bench use its play at its own poles and the play of all links before
//! it at once, so it is too early, in a narrow gap by seconds: see `tests/play.rs`.

mod board_range;
mod board_reach;
mod pole_range;
mod witness;

use std::ops::RangeInclusive;

use board_range::BoardRange;
pub use board_reach::{most_play_reach_m, play_reach_m};
use pole_range::PoleRange;
pub use witness::{TouchingPose, first_touching_pose};

use super::coil_reach::CoilReach;
use crate::dragon::loose::Loose;
use crate::dragon::meter::Spent;
use crate::dragon::{Dimensions, Dragon};
use crate::numerics::turning_point;

/// Longest cell, in lengths of the shorter link.
const STRIDE_LINKS: f64 = 0.25;

/// Steps of work that take as long as the range of a board and its gaps to another one.
const STEPS_PER_RANGE: u64 = 20;
/// Offsets of a cell that the search examines in the time of one step.
const OFFSETS_PER_STEP: u64 = 8;

/// Shortest interval of the front pole of a rear bench in a fine search, in lengths of the play.
const FINEST_PER_PLAY: f64 = 0.5;
/// Shortest cell, in metres.
const RESOLUTION_M: f64 = 1e-3;

/// The first travel at which the bounds do not rule out that two benches touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PossibleTouch {
    /// Travel of the head, in metres.
    pub travel_m: f64,
    /// Indices of the benches, the lower one first.
    pub benches: [usize; 2],
}

/// Where the proof about loose hinges ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlayEnd {
    /// Travel of the head, in metres. No pose that the play allows touches before.
    pub travel_m: f64,
    /// The benches that may touch there; `None` if a pole of some pose might stop or jump, so that nothing is known.
    pub benches: Option<[usize; 2]>,
}

/// Finds where, between two travels of the run, the proof ends that no pose of loose hinges has a clearance up to `clearance_m`.
/// `None` if it holds throughout, and for hinges without play.
///
/// # Errors
/// The dragon's meter is spent. No benches touch up to the travel in the error.
///
/// # Panics
/// Panics for a clearance that is negative or not finite.
pub fn first_possible_touch(
    dragon: &Dragon,
    clearance_m: f64,
    from_travel_m: f64,
    to_travel_m: f64,
) -> Result<Option<PlayEnd>, Spent> {
    let Some(mut search) = PlaySearch::at(dragon, clearance_m, from_travel_m)? else { return Ok(None) };
    let touch = match search.touch_here() {
        Some(touch) => Some(touch),
        None => search.advance(to_travel_m)?,
    };
    Ok(search.play_end(touch, to_travel_m))
}

/// Where the proof ends that benches 0 and 1 touch no bench behind, between two travels of the run; `None` if it holds throughout, and
/// for hinges without play. A body bench behind may touch on ground that bench 1 has passed before. The search is coarse.
///
/// # Errors
/// The dragon's meter is spent.
pub(crate) fn first_leading_touch(
    dragon: &Dragon,
    clearance_m: f64,
    [from_m, to_m]: [f64; 2],
) -> Result<Option<PlayEnd>, Spent> {
    let Some(loose) = dragon.loose() else { return Ok(None) };
    let mut search = PlaySearch::unplaced(dragon, clearance_m, from_m);
    let mut touch = None;
    if search.is_known_here() {
        search.body = loose.bracket(from_m, 1)[1];
        search.is_fine = false;
        touch = search.advance(to_m)?;
    }
    Ok(search.play_end(touch, to_m))
}

impl PossibleTouch {
    fn earlier(self, other: Option<Self>) -> Self {
        other.filter(|other| other.travel_m <= self.travel_m).unwrap_or(self)
    }
}

/// A search of the travel ahead of a dragon with loose hinges. *Touch* means a clearance of at most that of the search.
#[derive(Clone, Debug)]
pub struct PlaySearch {
    dragon: Dragon,
    clearance_m: f64,
    /// Bounds for all poses on the coil of the route.
    reach: Option<CoilReach>,
    /// Parameters up to which the head's bench and a body bench, with their front pole anywhere up to there, touch no bench behind.
    clear_to: [f64; 2],
    /// Travel of the head up to which its own pairs are settled.
    head_m: f64,
    /// Parameter up to which the pairs of body benches are settled.
    body: f64,
    /// The first touch of benches whose front pole has a place behind `body`.
    behind: Option<PossibleTouch>,
    /// Whether bounds are searched that keep the length of a board, which takes several times as long.
    is_fine: bool,
}

/// The front bench of pairs: its index, and the number of benches behind it.
#[derive(Clone, Copy)]
struct Front {
    bench: usize,
    followers: usize,
}

impl PlaySearch {
    /// A search with the head at a travel of the run. `None` for a dragon without play. At a travel beyond [`end_m`](Self::end_m)
    /// nothing can be proved: the search finds nothing there, and does not advance.
    ///
    /// # Errors
    /// The dragon's meter is spent.
    ///
    /// # Panics
    /// Panics for a clearance that is negative or not finite.
    pub fn at(dragon: &Dragon, clearance_m: f64, travel_m: f64) -> Result<Option<Self>, Spent> {
        assert!(clearance_m >= 0.0 && clearance_m.is_finite(), "a search for a clearance of {clearance_m} m");
        let Some(loose) = dragon.loose() else { return Ok(None) };
        let mut search = Self::unplaced(dragon, clearance_m, travel_m);
        if search.is_known_here() {
            search.body = loose.bracket(travel_m, 1)[1];
            search.behind = search.first_behind(loose, travel_m)?;
        }
        Ok(Some(search))
    }

    /// A search that does not know which body benches touch.
    fn unplaced(dragon: &Dragon, clearance_m: f64, head_m: f64) -> Self {
        let reach = CoilReach::of_loose(dragon, clearance_m);
        let start = dragon.route().parameter(dragon.start_travel_m());
        let clear_to = [0, 1].map(|bench| {
            let parameter = reach.and_then(|reach| reach.bench_is_clear_to(bench, start));
            parameter.unwrap_or(f64::NEG_INFINITY)
        });
        Self {
            dragon: dragon.clone(),
            clearance_m,
            reach,
            clear_to,
            head_m,
            body: f64::NAN,
            behind: None,
            is_fine: true,
        }
    }

    /// Whether the poses at the present travel of the head are known: it is not beyond [`end_m`](Self::end_m).
    pub fn is_known_here(&self) -> bool {
        self.head_m <= self.end_m()
    }

    /// A touch at the present travel of the head, if the bounds do not rule it out. None is found where the poses are not known.
    pub fn touch_here(&self) -> Option<PossibleTouch> {
        if !self.is_known_here() {
            return None;
        }
        let (travel_m, benches) = (self.head_m, self.dragon.dimensions().benches());
        let behind = self.behind.filter(|touch| touch.travel_m <= travel_m);
        behind.or_else(|| {
            let parameter = self.dragon.route().parameter(travel_m);
            let cell = PoleRange::new(&self.dragon, parameter, parameter);
            let offsets: Vec<usize> = (2..benches).collect();
            let head = Front { bench: 0, followers: benches - 1 };
            let (_, offset) = self.first_in_cell(head, &self.poles(head, cell, *offsets.last()?), &offsets)?;
            Some(PossibleTouch { travel_m, benches: [0, offset] })
        })
    }

    /// Travel beyond which nothing can be proved, because a pole of some allowed pose might stop or jump there.
    pub fn end_m(&self) -> f64 {
        self.dragon.loose().map_or(self.head_m, Loose::end_travel_m)
    }

    /// Where a search up to `to_m` ends that has found this touch.
    fn play_end(&self, touch: Option<PossibleTouch>, to_m: f64) -> Option<PlayEnd> {
        let unknown = PlayEnd { travel_m: self.end_m().max(self.head_m), benches: None };
        let touch = touch.map(|touch| PlayEnd { travel_m: touch.travel_m, benches: Some(touch.benches) });
        touch.or_else(|| (self.end_m() < to_m).then_some(unknown))
    }

    /// Searches on, up to `to_m` or [`end_m`](Self::end_m). Returns the first possible touch. A later call goes on behind it.
    ///
    /// # Errors
    /// The dragon's meter is spent. No benches touch up to the travel in the error.
    pub fn advance(&mut self, to_m: f64) -> Result<Option<PossibleTouch>, Spent> {
        let dragon = self.dragon.clone();
        let Some(loose) = dragon.loose() else { return Ok(None) };
        let benches = dragon.dimensions().benches();
        let route = dragon.route();
        let to_m = to_m.min(loose.end_travel_m());
        while self.head_m < to_m {
            let next_m = to_m.min(self.head_m + stride_m(&dragon));
            let head = Front { bench: 0, followers: benches - 1 };
            let own = self.first_in(head, route.parameter(self.head_m), route.parameter(next_m))?;
            let mut found = self.behind.filter(|touch| touch.travel_m <= next_m);
            if let Some((parameter, offset)) = own {
                found = Some(PossibleTouch { travel_m: route.travel(parameter), benches: [0, offset] }.earlier(found));
            }
            let front = loose.bracket(next_m, 1)[1];
            let body = Front { bench: 1, followers: benches.saturating_sub(2) };
            if let Some((parameter, offset)) = self.first_in(body, self.body, front)? {
                let travel_m = route.travel(loose.compact().head_before(parameter).0);
                found = Some(PossibleTouch { travel_m, benches: [1, 1 + offset] }.earlier(found));
            }
            if found.is_some() {
                return Ok(found);
            }
            (self.head_m, self.body) = (next_m, front);
        }
        Ok(None)
    }

    /// Whether the bounds do not rule out that two benches touch in some pose with the head between two travels.
    fn may_touch(&self, [first, second]: [usize; 2], span_m: [f64; 2]) -> bool {
        let Some(loose) = self.dragon.loose() else { return false };
        let [[rear, _], [_, front]] = span_m.map(|travel_m| loose.bracket(travel_m, first));
        let offset = second - first;
        let found = self.first_of(Front { bench: first, followers: offset }, offset..=offset, [rear, front]);
        found.map_or(true, |touch| touch.is_some())
    }

    /// The first touch of two body benches whose front pole, now or when it first gets there, is at a place that some body pole
    /// has or passes before pole 1 walks on new ground.
    fn first_behind(&self, loose: &Loose, travel_m: f64) -> Result<Option<PossibleTouch>, Spent> {
        let benches = self.dragon.dimensions().benches();
        let chains = [loose.taut(), loose.compact()].map(|chain| {
            let handles = chain.chain(travel_m).expect("the travel lies within the run");
            handles.map(|handle| handle.parameter).collect::<Vec<_>>()
        });
        let mut first: Option<PossibleTouch> = None;
        for bench in 1..benches {
            let [rear, front] = [0, 1].map(|chain: usize| chains[chain][bench]);
            let to = if bench == 1 { front } else { chains[0][bench - 1] };
            let pairs = Front { bench, followers: benches - 1 - bench };
            if let Some((parameter, offset)) = self.first_in(pairs, rear, to)? {
                let arrived = |travel_m| loose.bracket(travel_m, bench)[1] >= parameter;
                let at_m = if parameter <= front {
                    travel_m
                } else {
                    turning_point(travel_m, loose.end_travel_m(), RESOLUTION_M, arrived).0
                };
                first = Some(PossibleTouch { travel_m: at_m, benches: [bench, bench + offset] }.earlier(first));
            }
        }
        Ok(first)
    }

    /// The first place of a front pole between two parameters at which its bench may touch a bench behind, and how many benches
    /// behind that one is.
    fn first_in(&self, front: Front, from: f64, to: f64) -> Result<Option<(f64, usize)>, Spent> {
        self.first_of(front, 2..=front.followers, [from, to])
    }

    /// The same for the benches at these offsets only.
    fn first_of(
        &self,
        front: Front,
        offsets: RangeInclusive<usize>,
        [from, to]: [f64; 2],
    ) -> Result<Option<(f64, usize)>, Spent> {
        if offsets.is_empty() {
            return Ok(None);
        }
        let route = self.dragon.route();
        let mut begin = from;
        while begin < to {
            let end = to.min(route.parameter(route.travel(begin) + stride_m(&self.dragon)));
            let end = if end > begin { end } else { to };
            if end <= self.clear_to[front.bench.min(1)] {
                self.dragon.meter().add(1);
                self.dragon.meter().check(self.head_m)?;
                begin = end;
                continue;
            }
            let cell = PoleRange::new(&self.dragon, begin, end);
            let poles = self.poles(front, cell, *offsets.end());
            let found = self.first_in_cell(front, &poles, &offsets.clone().collect::<Vec<_>>());
            self.dragon.meter().check(self.head_m)?;
            if found.is_some() {
                return Ok(found);
            }
            begin = end;
        }
        Ok(None)
    }

    /// The same in a cell, for the benches at these offsets. `poles` are the intervals of the front pole and of those behind.
    fn first_in_cell(&self, front: Front, poles: &[PoleRange], offsets: &[usize]) -> Option<(f64, usize)> {
        self.dragon.meter().add(offsets.len() as u64 / OFFSETS_PER_STEP);
        let cell_m = poles[0].length_m;
        let board = BoardRange::new(&self.dragon, front.bench, &poles[0], poles.get(1)?);
        let is_near = |&offset: &usize| {
            let bench = front.bench + offset;
            self.may_meet(front.bench, [&poles[0], &poles[1]], bench, [&poles[offset], &poles[offset + 1]])
                && !self.stays_clear(&board, bench, &poles[offset..=offset + 1], cell_m)
        };
        let placed = offsets.iter().copied().take_while(|offset| offset + 1 < poles.len());
        let near: Vec<usize> = placed.filter(is_near).collect();
        let (&first, &last) = (near.first()?, near.last()?);
        if cell_m <= RESOLUTION_M || self.dragon.meter().is_spent() {
            return Some((poles[0].rear, first));
        }
        let halves = PoleRange::halves(&poles[..=last + 1], &self.dragon, front.bench)?;
        halves.iter().find_map(|poles| self.first_in_cell(front, poles, &near))
    }

    /// The brackets of the poles from a front pole to the rear pole of the bench at an offset, as far as they matter: on a coil,
    /// benches further behind are out of reach.
    fn poles(&self, front: Front, cell: PoleRange, offset: usize) -> Vec<PoleRange> {
        let mut poles = vec![cell];
        let mut reached_to = None;
        for bench in front.bench..=front.bench + offset {
            let last = poles.last().expect("the front pole is one");
            if reached_to.is_some_and(|parameter| last.front < parameter) || self.is_out_of_reach(&poles[0], last) {
                break;
            }
            let Some(next) = last.behind(&self.dragon, bench) else { break };
            if bench == front.bench {
                reached_to = self.reach.and_then(|reach| reach.reached_to(front.bench.min(1), cell.front, next.rear));
            }
            poles.push(next);
        }
        poles
    }

    /// Whether all benches whose front pole is behind a pole on the way in are further from the centre of the coil than the bench
    /// at `front`.
    fn is_out_of_reach(&self, front: &PoleRange, pole: &PoleRange) -> bool {
        let Some(coil) = self.dragon.route().coil() else { return false };
        let Some(angle) = coil.angle(pole.front) else { return false };
        let dimensions = self.dragon.dimensions();
        let furthest_m = front.middle().distance(coil.centre) + 0.5 * front.length_m;
        let reach_m =
            (0..dimensions.benches().min(2)).map(|bench| self.dragon.board_radius_m(bench)).fold(0.0, f64::max);
        coil.radius_per_radian_m * angle - furthest_m > self.clearance_m + 4.0 * reach_m + 2.0 * dimensions.play_m()
    }

    /// Whether the circles around all places of two boards come within the clearance.
    fn may_meet(&self, one: usize, ours: [&PoleRange; 2], other: usize, theirs: [&PoleRange; 2]) -> bool {
        let circle = |bench: usize, [front, rear]: [&PoleRange; 2]| {
            let centre = 0.5 * (front.middle() + rear.middle());
            let spread_m = 0.25 * (front.length_m + rear.length_m);
            (centre, self.dragon.board_radius_m(bench) + self.dragon.dimensions().play_m() + spread_m)
        };
        let ((centre, radius_m), (other_centre, other_radius_m)) = (circle(one, ours), circle(other, theirs));
        let reach_m = self.clearance_m + radius_m + other_radius_m;
        centre.distance_squared(other_centre) <= reach_m * reach_m
    }

    /// Whether no place of a front bench's board comes within the clearance of a bench with its two poles in these intervals. The
    /// interval of its front pole is halved down to the length of the cell of the front bench, or to the play; in a fine search to half
    /// of it.
    fn stays_clear(&self, front: &BoardRange, bench: usize, poles: &[PoleRange], cell_m: f64) -> bool {
        self.dragon.meter().add(STEPS_PER_RANGE);
        let [pole, next] = poles else { return false };
        let tension = self.is_fine.then(|| self.dragon.meter());
        if front.is_beyond(&BoardRange::new(&self.dragon, bench, pole, next), self.clearance_m, tension) {
            return true;
        }
        let finest_m = self.dragon.dimensions().play_m() * if self.is_fine { FINEST_PER_PLAY } else { 1.0 };
        if pole.length_m <= cell_m.max(finest_m) || self.dragon.meter().is_spent() {
            return false;
        }
        let halves = PoleRange::halves(poles, &self.dragon, bench);
        halves.is_some_and(|halves| halves.iter().all(|poles| self.stays_clear(front, bench, poles, cell_m)))
    }
}

fn stride_m(dragon: &Dragon) -> f64 {
    let dimensions: &Dimensions = dragon.dimensions();
    STRIDE_LINKS * dimensions.link_m(0).min(dimensions.link_m(1))
}

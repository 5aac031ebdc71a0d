//! The first contact between the dragons of a formation, over any time.
//!
//! Most of the time, most dragons are far from each other. So a search of all boards at every stride is limited to spans of plan time
//! and to dragons that may meet in them:
//!
//! 1. Two dragons never meet if their *ways* are apart. The way of a dragon is the part of its route on which any of its handles is
//!    between both times, and all points that are no further from it than a point of a board from a handle.
//! 2. Two dragons do not meet between two times if the mean of their clearances at both exceeds the limit by more than half of the
//!    displacements of their boards (see `coverage`). Else the span is halved, down to a few strides.
//! 3. In what is left, [`BetweenSearch`] searches the dragons that may meet. Spans that follow each other are searched as one, if no
//!    other dragons may meet.

use std::ops::ControlFlow;
use std::sync::Arc;

use glam::DVec2;

use super::board_tree::BoardTree;
use super::formation_search::{BetweenSearch, Meeting, Unfinished};
use super::own_time::{Posed, drift_m, met_between};
use super::pair_motion::GRAZE_M;
use crate::dragon::board::Board;
use crate::formation::{Formation, Planned};

/// Walk of a head in the shortest spans, in lengths of the shorter link.
const SPAN_LINKS: f64 = 2.0;

/// Longest span that is searched as one, in shortest spans.
const MOST_JOINED: f64 = 32.0;

/// Most squares that cover a way.
const MOST_SQUARES: f64 = 2000.0;

/// The dragons of a formation at one plan time, as far as they are placed.
type Poses = Vec<Option<Arc<Posed>>>;

/// Finds the first contact of two dragons between two plan times, at the first of which no two dragons touch. Here, they touch if they
/// are within a clearance.
pub(super) fn first_near(
    formation: &Formation,
    clearance_m: f64,
    [from_s, to_s]: [f64; 2],
) -> Result<Option<Meeting>, Unfinished> {
    let count = formation.dragons().len();
    if count < 2 || from_s > to_s {
        return Ok(None);
    }
    let ways: Vec<BoardTree> = formation.dragons().iter().map(|planned| way(planned, [from_s, to_s])).collect();
    let pairs = (0..count).flat_map(|one| (one + 1..count).map(move |other| [one, other]));
    let may_meet = |pair: &[usize; 2]| {
        let limit_m = clearance_m + GRAZE_M;
        ways[pair[0]].comes_within(&ways[pair[1]], limit_m)
    };
    let pairs: Vec<[usize; 2]> = pairs.filter(may_meet).collect();
    let span_s = |Planned { dragon, timetable }: &Planned| {
        SPAN_LINKS * dragon.dimensions().link_m(0).min(dragon.dimensions().link_m(1)) / timetable.most_speed_mps()
    };
    let shortest_s = formation.dragons().iter().map(span_s).fold(f64::INFINITY, f64::min);
    let open = Span { times_s: [from_s; 2], members: Vec::new() };
    let mut search = NearSpans { formation, clearance_m, shortest_s, open, found: Ok(None) };
    let ends = [from_s, to_s].map(|time_s| search.poses(&pairs, time_s));
    if search.walk([from_s, to_s], &ends, &pairs).is_continue() {
        let _ = search.close();
    }
    search.found
}

/// Squares that cover the way of a dragon between two plan times.
pub(super) fn way(planned: &Planned, times_s: [f64; 2]) -> BoardTree {
    let (dragon, route) = (&planned.dragon, planned.dragon.route());
    let end_m = planned.travel_m(times_s[1]);
    let tail = planned.chain_at(times_s[0]).last().expect("a dragon has handles");
    let tail_m = route.travel(tail.parameter);
    let dimensions = dragon.dimensions();
    let along_m = 0.5 * dimensions.link_m(0).max(dimensions.link_m(1));
    let reach_m = DVec2::new(along_m.max(dimensions.overhang_m()), 0.5 * dimensions.width_m()).length();
    let squares = ((end_m - tail_m) / along_m).clamp(1.0, MOST_SQUARES).ceil();
    let half_m = 0.5 * (end_m - tail_m) / squares + reach_m;
    dragon.meter().add(squares as u64);
    let square = |number: u32| {
        let travel_m = tail_m + (end_m - tail_m) * (f64::from(number) + 0.5) / squares;
        let centre = route.point(route.parameter(travel_m)).position;
        Board { centre, heading: DVec2::X, half_length: half_m, half_width: half_m }
    };
    BoardTree::new(&(0..squares as u32).map(square).collect::<Vec<Board>>())
}

struct NearSpans<'a> {
    formation: &'a Formation,
    clearance_m: f64,
    /// Longest span that is not halved.
    shortest_s: f64,
    /// The last span, which is not searched yet.
    open: Span,
    found: Result<Option<Meeting>, Unfinished>,
}

/// A span of plan time.
struct Span {
    times_s: [f64; 2],
    /// The dragons that may meet in it, in order.
    members: Vec<usize>,
}

impl NearSpans<'_> {
    /// The dragons of these pairs at a plan time.
    fn poses(&self, pairs: &[[usize; 2]], time_s: f64) -> Poses {
        let mut poses = vec![None; self.formation.dragons().len()];
        for &dragon in pairs.iter().flatten() {
            let planned = &self.formation.dragons()[dragon];
            poses[dragon].get_or_insert_with(|| Posed::of(&planned.dragon, planned.travel_m(time_s)));
        }
        poses
    }

    /// Searches a span of plan time, at both ends of which these pairs are placed. Breaks as soon as the search has ended.
    fn walk(&mut self, [from_s, to_s]: [f64; 2], ends: &[Poses; 2], pairs: &[[usize; 2]]) -> ControlFlow<()> {
        let near: Vec<[usize; 2]> = pairs.iter().filter(|pair| self.may_meet(pair, ends)).copied().collect();
        if near.is_empty() {
            return ControlFlow::Continue(());
        }
        let middle_s = 0.5 * (from_s + to_s);
        if to_s - from_s <= self.shortest_s
            || self.formation.lead().meter().is_spent()
            || middle_s <= from_s
            || middle_s >= to_s
        {
            return self.add([from_s, to_s], &near);
        }
        let middle = self.poses(&near, middle_s);
        let halves = [[ends[0].clone(), middle.clone()], [middle, ends[1].clone()]];
        self.walk([from_s, middle_s], &halves[0], &near)?;
        self.walk([middle_s, to_s], &halves[1], &near)
    }

    fn may_meet(&self, pair: &[usize; 2], ends: &[Poses; 2]) -> bool {
        let posed =
            [0, 1].map(|end: usize| pair.map(|dragon| &**ends[end][dragon].as_ref().expect("the pair is placed")));
        let drifts_m = [0, 1].map(|i| drift_m(&self.formation.dragons()[pair[i]].dragon, posed[0][i], posed[1][i]));
        met_between(posed, drifts_m, self.clearance_m + GRAZE_M).is_some()
    }

    /// Adds a span to the open one, or searches that one and opens another.
    fn add(&mut self, [from_s, to_s]: [f64; 2], pairs: &[[usize; 2]]) -> ControlFlow<()> {
        let mut members: Vec<usize> = pairs.concat();
        members.sort_unstable();
        members.dedup();
        let [open_s, end_s] = self.open.times_s;
        let is_same = self.open.members == members && end_s == from_s;
        if is_same && to_s - open_s <= MOST_JOINED * self.shortest_s {
            self.open.times_s[1] = to_s;
            return ControlFlow::Continue(());
        }
        self.close()?;
        self.open = Span { times_s: [from_s, to_s], members };
        ControlFlow::Continue(())
    }

    /// Searches the open span with all boards of its dragons. Breaks as soon as the search has ended.
    fn close(&mut self) -> ControlFlow<()> {
        let Span { times_s: [from_s, to_s], members } = &self.open;
        if members.is_empty() {
            return ControlFlow::Continue(());
        }
        let part = Formation::new(members.iter().map(|&dragon| self.formation.dragons()[dragon].clone()).collect());
        let layout = self.formation.layout();
        let bench = |bench: usize| {
            let (member, index) = part.layout().place(bench);
            layout.benches_of(members[member]).start + index
        };
        let found = BetweenSearch::new(&part, self.clearance_m).first(*from_s, *to_s);
        self.found = found.map(|met| met.map(|met| Meeting { benches: met.benches.map(bench), ..met }));
        if matches!(self.found, Ok(None)) { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }
}

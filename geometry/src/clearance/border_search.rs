//! The first board that passes a border of a stage, or comes too near, and the least distance of all boards from a border.
//!
//! A dragon that comes onto the stage has boards that stand outside its outline. A board counts there from the first look at which it
//! keeps clear of the outline. There are 64 looks per link. Other borders count throughout.
//!
//! *Method.* The pose of a bench depends only on the parameter of its front handle, and all body benches are alike. So a bench
//! behind bench 1 repeats the poses of the bench before it, once its front handle has reached the parameter at which that
//! bench began. Before that it is on ground of its own. The search follows each bench over its own ground, benches 0 and 1 up
//! to the end of the run. A bench is followed at most up to the earliest breach found so far.
//!
//! [`BenchSearch`] follows a bench.

use glam::DVec2;

use super::bench_search::{BenchSearch, Nearest};
use crate::dragon::{Dragon, Spent};
use crate::formation::Formation;
use crate::stage::{BorderKind, Stage};

/// A board that passes a border, or comes too near.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breach {
    /// Travel of the head.
    pub travel_m: f64,
    /// Index of the bench.
    pub bench: usize,
    /// Index of the border on its stage.
    pub border: usize,
    /// The corner of the board that is beyond, the point of the border that is in the board, or the point of the board that is
    /// nearest to the border.
    pub point: DVec2,
}

/// The board that comes nearest to a border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastDistance {
    /// The distance in metres; 0 for a board that touches or passes the border.
    pub distance_m: f64,
    /// Travel of the head.
    pub travel_m: f64,
    /// Index of the bench.
    pub bench: usize,
    /// Index of the border on its stage.
    pub border: usize,
    /// The point of the board that is nearest to the border.
    pub point: DVec2,
}

/// A board that stands beyond a border, or nearer to it than allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing {
    /// Index of the bench, numbered on from dragon to dragon.
    pub bench: usize,
    /// Index of the border on its stage.
    pub border: usize,
    /// Distance of the board from it.
    pub distance_m: f64,
}

/// The boards that are beyond a border of a kind, or nearer to it than `clear_m`, where a formation stands at a place of its course.
///
/// # Panics
/// Panics for a place that is not on the course.
pub fn standing_at(
    formation: &Formation,
    stage: &Stage,
    kind: BorderKind,
    clear_m: f64,
    course_m: f64,
) -> Vec<Standing> {
    let (first, borders) = (stage.first_of(kind), stage.of_kind(kind));
    let boards = if borders.is_empty() { Vec::new() } else { formation.boards_at(course_m) };
    let standing = boards.iter().enumerate().filter_map(|(bench, board)| {
        let border = borders.iter().position(|border| border.breach(board, clear_m).is_some())?;
        Some(Standing { bench, border: first + border, distance_m: borders[border].distance_m(board) })
    });
    standing.collect()
}

/// The board that keeps the greatest distance of all that are within `near_m` of a border, where a formation stands at a place of its
/// course. A board that comes in may be nearer.
///
/// # Panics
/// Panics for a place that is not on the course.
pub fn nearest_to_borders(formation: &Formation, stage: &Stage, course_m: f64, near_m: f64) -> Option<Standing> {
    let kinds = BorderKind::ALL.into_iter();
    let standing = kinds.flat_map(|kind| standing_at(formation, stage, kind, near_m, course_m));
    standing.reduce(|nearest, other| if other.distance_m > nearest.distance_m { other } else { nearest })
}

/// Finds the first time during the whole run at which a board of the dragon is beyond a border of a stage, or nearer to it than
/// `clear_m`.
///
/// # Errors
/// The dragon's meter is spent. The search is then not finished at any travel.
pub fn first_breach(dragon: &Dragon, stage: &Stage, clear_m: f64) -> Result<Option<Breach>, Spent> {
    let (beginning, mut limits) = (parameters(dragon, dragon.start_travel_m()), end_parameters(dragon));
    let mut first: Option<Breach> = None;
    for kind in BorderKind::ALL.into_iter().filter(|&kind| !stage.of_kind(kind).is_empty()) {
        for bench in 0..dragon.dimensions().benches() {
            let search = BenchSearch { dragon, borders: stage.of_kind(kind), clear_m, bench };
            let found = search.first(beginning[bench], limits[bench].min(own_ground(&beginning, bench)));
            dragon.meter().check(dragon.start_travel_m())?;
            let Some([_, later]) = found else { continue };
            let end_m = first.map_or(dragon.end_travel_m(), |first| first.travel_m);
            let travels_m = search.head_travels_m(later.parameter(), [dragon.start_travel_m(), end_m]);
            let (border, point) = later.breach.expect("the board is beyond a border");
            if first.is_none_or(|first| travels_m[1] < first.travel_m) {
                first = Some(Breach { travel_m: travels_m[1], bench, border: stage.first_of(kind) + border, point });
                limits = parameters(dragon, travels_m[1]);
            }
        }
    }
    Ok(first)
}

/// Finds the least distance of a board of the dragon from the borders of a kind during the whole run, and the first bench and travel at
/// which it occurs. `None` without such a border, and if no board counts.
///
/// # Errors
/// The dragon's meter is spent.
pub fn least_distance(dragon: &Dragon, stage: &Stage, kind: BorderKind) -> Result<Option<LeastDistance>, Spent> {
    let borders = stage.of_kind(kind);
    if borders.is_empty() {
        return Ok(None);
    }
    let (start_m, end_m) = (dragon.start_travel_m(), dragon.end_travel_m());
    let (beginning, limits) = (parameters(dragon, start_m), end_parameters(dragon));
    let mut least: Option<Nearest> = None;
    for bench in 0..dragon.dimensions().benches() {
        let search = BenchSearch { dragon, borders, clear_m: 0.0, bench };
        search.approach(beginning[bench], limits[bench].min(own_ground(&beginning, bench)), &mut least);
        dragon.meter().check(start_m)?;
    }
    let Some(nearest) = least else { return Ok(None) };
    let bench = nearest.bench;
    if nearest.distance_m == 0.0 {
        let only = Stage::new(borders.to_vec(), 0.0);
        if let Some(Breach { travel_m, bench, border, point }) = first_breach(dragon, &only, 0.0)? {
            let border = stage.first_of(kind) + border;
            return Ok(Some(LeastDistance { distance_m: 0.0, travel_m, bench, border, point }));
        }
    }
    let search = BenchSearch { dragon, borders, clear_m: 0.0, bench };
    let [_, travel_m] = search.head_travels_m(nearest.parameter, [start_m, end_m]);
    let point = borders[nearest.border].nearest_point(&nearest.board);
    let border = stage.first_of(kind) + nearest.border;
    Ok(Some(LeastDistance { distance_m: nearest.distance_m, travel_m, bench, border, point }))
}

/// Parameters of all handles at a travel of the head.
pub(super) fn parameters(dragon: &Dragon, travel_m: f64) -> Vec<f64> {
    dragon.chain(travel_m).expect("within the run").map(|handle| handle.parameter).collect()
}

fn end_parameters(dragon: &Dragon) -> Vec<f64> {
    parameters(dragon, dragon.end_travel_m())
}

/// The parameter up to which a bench does not repeat the poses of the bench before it.
pub(super) fn own_ground(beginning: &[f64], bench: usize) -> f64 {
    if bench < 2 { f64::INFINITY } else { beginning[bench - 1] }
}

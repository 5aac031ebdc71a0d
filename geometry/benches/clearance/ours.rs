//! The monitor's search.

use bench_dragon_geometry::clearance::ClearanceSearch;
use bench_dragon_geometry::dragon::{Board, Dragon};
use glam::DVec3;

use super::contestant::{Contestant, Found, Near};
use crate::shared::HandleState;

pub(crate) struct Ours<'a> {
    dragon: &'a Dragon,
    reach_m: f64,
    boards: Vec<Board>,
    search: ClearanceSearch,
    within: Vec<Near>,
}

impl<'a> Ours<'a> {
    pub(crate) fn new(dragon: &'a Dragon, reach_m: f64) -> Self {
        Self { dragon, reach_m, boards: Vec::new(), search: ClearanceSearch::default(), within: Vec::new() }
    }
}

impl Contestant for Ours<'_> {
    fn measure(&mut self, handles: &[HandleState]) -> Found<'_> {
        let Self { dragon, reach_m, boards, search, within } = self;
        let position = |handle: &HandleState| DVec3::from(handle.position_m);
        dragon.place_boards_at(handles, position, boards);
        let found = search.nearest_and_within(boards, *reach_m);
        let near = found.iter().map(|pair| Near { benches: pair.benches, clearance_m: pair.clearance_m });
        within.clear();
        within.extend(near.clone().filter(|near| near.clearance_m <= *reach_m));
        Found { nearest: near.clone().next().expect("the dragon has pairs"), within }
    }
}

//! Witness: a pair of boards that overlap with the head at one radius.
//!
//! The head stays at that radius. Handle k has the radius r and the angle φ behind the front handle of the pair's first bench.
//! As the pitch grows, r only grows and φ only falls (see `pitch`). Take a handle at (r, φ) at one pitch and at (r', φ') at a
//! greater pitch. At all pitches between, it is within |(r' − r, √(r·r')·(φ − φ'))| of its first position. Links keep their
//! length d. Let o be the distance from a handle to the corners around it. If a board's handles move by at most η and η', none
//! of its points moves by more than max(η, η') + o·(η + η')/d. A clearance changes by at most the sum of its two boards'
//! displacements. So boards that overlap deeper than that sum also overlap at all pitches between.

use std::f64::consts::{PI, TAU};

use super::{LeadIn, MAX_PITCH_M};
use crate::clearance::{ClearanceSearch, Contact};
use crate::dragon::{Board, Handle};
use crate::numerics::{Peak, higher, peak};

/// Target of a step, as a share of the step that the depth appears to allow, so that most steps are proved at the first
/// attempt.
const STEP_SAFETY: f64 = 0.9;

/// Share of the depth at which a deeper overlap of the same pair is searched for nearby.
const DEPTH_LEFT: f64 = 0.1;

/// Half of the interval of that search, and its tolerance, in depths. Since the last search, the radius of the deepest overlap has
/// moved by some depths.
const FIRST_LOOK: f64 = 16.0;
const LAST_LOOK: f64 = 1e-3;

/// Factor by which the interval is widened while the deepest overlap is at its end.
const WIDENING: f64 = 4.0;

/// Number of poses evaluated before the circle, over the arc of a body link. Beyond that arc, poses recur with the next bench.
const POSES: u32 = 16;

/// Number of turns behind the head that are evaluated in those poses.
const TURNS: f64 = 3.0;

/// Two benches, and a radius of the head at which they overlap.
#[derive(Clone, Copy, Debug)]
pub(super) struct Overlap {
    pub(super) benches: [usize; 2],
    pub(super) radius_m: f64,
}

/// The pair at one pitch.
struct Stand {
    /// Radius and angle of the front and the rear handle of each bench.
    handles: [[(f64, f64); 2]; 2],
    boards: [Board; 2],
    /// Depth of the boards within the clearance; for a clearance of 0, the depth of their overlap. Negative if they are
    /// outside.
    depth_m: f64,
    benches: [usize; 2],
}

impl Overlap {
    /// The deepest overlap in some poses just before the circle, if there is one. There the turns are tightest.
    pub(super) fn near_circle(lead_in: &LeadIn<'_>, pitch_m: f64) -> Option<Self> {
        let mut search = ClearanceSearch::default();
        let poses = (0..POSES).take_while(|_| !lead_in.meter.is_spent()).filter_map(|pose| {
            let arc_m = lead_in.dimensions.link_m(1) * f64::from(pose) / f64::from(POSES);
            let radius_m =
                (lead_in.circle_radius_m.powi(2) + pitch_m / PI * arc_m).sqrt().min(lead_in.start_radius_m(pitch_m));
            let nearest = search.nearest(&nearest_turns(lead_in, pitch_m, radius_m));
            lead_in.meter.add(search.take_steps());
            let nearest = nearest?;
            let overlap = Self { benches: nearest.benches, radius_m };
            overlap.stand(lead_in, pitch_m).map(|stand| (stand.depth_m, overlap))
        });
        let (depth_m, overlap) = poses.max_by(|(ours_m, _), (theirs_m, _)| ours_m.total_cmp(theirs_m))?;
        (depth_m > 0.0).then_some(overlap)
    }

    /// Returns a pitch up to which this pair proves all pitches infeasible, and an overlap at that pitch. At `pitch_m` the pair
    /// touches.
    pub(super) fn proves_up_to(&self, lead_in: &LeadIn<'_>, pitch_m: f64) -> (f64, Self) {
        let (mut proved_m, mut overlap) = (pitch_m, *self);
        loop {
            overlap = overlap.deepest_nearby(lead_in, proved_m);
            let next_m = overlap.proves_at_its_radius(lead_in, proved_m);
            if next_m - proved_m < lead_in.tolerance_m(pitch_m) || lead_in.meter.is_spent() {
                return (next_m, overlap);
            }
            proved_m = next_m;
        }
    }

    /// The contact with the head at this radius.
    pub(super) fn contact(&self, lead_in: &LeadIn<'_>, pitch_m: f64) -> Contact {
        let travel_m =
            lead_in.spiral(pitch_m).expect("a pitch within range").travel(LeadIn::parameter(pitch_m, self.radius_m));
        let [first, second] = self.stand(lead_in, pitch_m).expect("a pair that touches stands").boards;
        Contact { travel_m, benches: self.benches, point: first.approach(&second).point }
    }

    /// Steps to greater pitches until little of the depth is left.
    fn proves_at_its_radius(&self, lead_in: &LeadIn<'_>, pitch_m: f64) -> f64 {
        let Some(mut here) = self.stand(lead_in, pitch_m) else { return pitch_m };
        let (mut proved_m, enough_m) = (pitch_m, DEPTH_LEFT * here.depth_m);
        let mut step_m = here.depth_m;
        while here.depth_m > enough_m && proved_m + step_m > proved_m && !lead_in.meter.is_spent() {
            step_m = step_m.min(MAX_PITCH_M - proved_m);
            let Some(there) = self.stand(lead_in, proved_m + step_m) else { return proved_m };
            let moved_m = here.moved_m(&there, lead_in);
            if moved_m < here.depth_m {
                proved_m += step_m;
                here = there;
            }
            step_m *= (STEP_SAFETY * here.depth_m / moved_m).min(2.0);
        }
        proved_m
    }

    /// Finds the radius nearby, between circle and start, at which the pair overlaps most. The interval that is searched is widened
    /// while that is at its end.
    fn deepest_nearby(&self, lead_in: &LeadIn<'_>, pitch_m: f64) -> Self {
        let [lowest_m, highest_m] = [lead_in.circle_radius_m, lead_in.start_radius_m(pitch_m)];
        let depth_m = |radius_m| {
            let stand = Self { radius_m, ..*self }.stand(lead_in, pitch_m);
            stand.map_or(f64::NEG_INFINITY, |stand| stand.depth_m)
        };
        let mut deepest = Peak { at: self.radius_m, value: depth_m(self.radius_m) };
        let mut look_m = (FIRST_LOOK * deepest.value.abs()).min(0.25 * lead_in.dimensions.link_m(1));
        loop {
            let [low_m, high_m] = [-look_m, look_m].map(|side_m| (deepest.at + side_m).clamp(lowest_m, highest_m));
            let tolerance_m = LAST_LOOK * deepest.value.abs();
            // Each side has its own search, because boards may overlap on a small part of the interval alone.
            let sides = [[low_m, deepest.at], [deepest.at, high_m]];
            let sides = sides.map(|[low_m, high_m]| peak(low_m, high_m, tolerance_m, depth_m));
            deepest = sides.into_iter().fold(deepest, higher);
            let is_inner = |limit_m: f64, end_m: f64| deepest.at != end_m || end_m == limit_m;
            if is_inner(lowest_m, low_m) && is_inner(highest_m, high_m) || lead_in.meter.is_spent() {
                return Self { radius_m: deepest.at, ..*self };
            }
            look_m *= WIDENING;
        }
    }

    /// The pair at a pitch; `None` if the chain ends before the pair, or if the head's link could not have walked there.
    fn stand(&self, lead_in: &LeadIn<'_>, pitch_m: f64) -> Option<Stand> {
        let spiral = lead_in.spiral(pitch_m)?;
        let parameter = LeadIn::parameter(pitch_m, self.radius_m);
        let mut chain = lead_in.chain(&spiral, parameter);
        if parameter - chain.clone().nth(1)?.parameter >= PI {
            return None;
        }
        let [first, second] = self.benches;
        let ahead = [chain.nth(first)?, chain.next()?];
        let behind = [chain.nth(second - first - 2)?, chain.next()?];
        let polar =
            |handle: &Handle| (LeadIn::radius_m(pitch_m, handle.parameter), ahead[0].parameter - handle.parameter);
        let boards = [board(lead_in, first, &ahead[0], &ahead[1]), board(lead_in, second, &behind[0], &behind[1])];
        Some(Stand {
            handles: [ahead, behind].map(|handles| handles.each_ref().map(polar)),
            boards,
            benches: self.benches,
            depth_m: depth_m(&boards, lead_in.clearance_m),
        })
    }
}

/// Depth of two boards within a clearance.
fn depth_m([first, second]: &[Board; 2], clearance_m: f64) -> f64 {
    if clearance_m == 0.0 { -first.separation(second).0 } else { clearance_m - first.clearance(second) }
}

/// The boards of the turns nearest to the head, with the head at a radius.
fn nearest_turns(lead_in: &LeadIn<'_>, pitch_m: f64, radius_m: f64) -> Vec<Board> {
    let spiral = lead_in.spiral(pitch_m).expect("a pitch within range");
    let parameter = LeadIn::parameter(pitch_m, radius_m);
    let chain = lead_in.chain(&spiral, parameter);
    let handles: Vec<Handle> = chain.take_while(|handle| parameter - handle.parameter < TURNS * TAU).collect();
    handles.windows(2).enumerate().map(|(bench, ends)| board(lead_in, bench, &ends[0], &ends[1])).collect()
}

fn board(lead_in: &LeadIn<'_>, bench: usize, front: &Handle, rear: &Handle) -> Board {
    let length_m = lead_in.dimensions.length_m(bench);
    Board::from_handles(front.position, rear.position, length_m, lead_in.dimensions.width_m())
}

impl Stand {
    /// Upper bound on the sum of both boards' displacements up to a greater pitch.
    fn moved_m(&self, greater: &Self, lead_in: &LeadIn<'_>) -> f64 {
        let moved = |(radius_m, angle): (f64, f64), (new_radius_m, new_angle): (f64, f64)| {
            (new_radius_m - radius_m).hypot((radius_m * new_radius_m).sqrt() * (angle - new_angle))
        };
        (0..2)
            .map(|i| {
                let [front_m, rear_m] = [0, 1].map(|end| moved(self.handles[i][end], greater.handles[i][end]));
                let turn = (front_m + rear_m) / lead_in.dimensions.link_m(self.benches[i]);
                front_m.max(rear_m) + lead_in.dimensions.overhang_m() * turn
            })
            .sum()
    }
}

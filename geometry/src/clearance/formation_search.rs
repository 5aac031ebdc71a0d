//! The first contact of a formation: within each dragon, and between dragons.
//!
//! Within a dragon, [`ContactSearch`] searches the travel that its timetable gives. Between dragons, the formation advances by
//! strides of plan time. A stride ends at the latest where the speed of a dragon changes at once. The near pairs at its beginning,
//! up to the reach of the boards on the stride, are tracked by [`PairTracker`]. So the work grows with the number of benches, and
//! no contact is missed, however short. The rules by which the pairs of one dragon repeat do not hold between dragons.

use std::ops::ControlFlow;

use glam::DVec2;

use super::contact::PairEvent;
use super::contact_search::ContactSearch;
use super::near_spans::first_near;
use super::pair::{Member, Members, Pair, PairPose};
use super::pair_tracker::PairTracker;
use super::pose::{Pose, PoseWalk};
use super::search::ClearanceSearch;
use crate::dragon::board::Board;
use crate::dragon::meter::Spent;
use crate::formation::{Formation, Layout};

/// Longest walk of a head on one stride, in lengths of the shorter link.
const STRIDE_LINKS: f64 = 0.25;

/// The first contact of a formation: two boards touch, or come within the clearance of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Plan time in seconds.
    pub time_s: f64,
    /// Indices of two benches, the lower one first, numbered on from dragon to dragon.
    pub benches: [usize; 2],
    /// Point of contact; the midpoint between the nearest points if the boards are apart.
    pub point: DVec2,
}

/// Error: a search has ended before its end.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{spent}")]
pub struct Unfinished {
    /// The reason. Its travel is that of one dragon.
    pub spent: Spent,
    /// Plan time in seconds up to which there is no contact.
    pub reached_s: f64,
}

/// Finds the first plan time between two plan times at which the clearance of some pair falls to `clearance_m`.
///
/// At the beginning the result is the nearest pair, and of equal ones that with the lowest indices.
///
/// # Errors
/// A meter of a dragon is spent before the search is finished, or too many pairs are near each other.
///
/// # Panics
/// Panics for a clearance that is negative or not finite.
pub fn first_meeting(
    formation: &Formation,
    clearance_m: f64,
    from_s: f64,
    to_s: f64,
) -> Result<Option<Meeting>, Unfinished> {
    if let Some(meeting) = meeting_at(formation, clearance_m, from_s) {
        return Ok(Some(meeting));
    }
    let mut first: Option<Meeting> = None;
    for dragon in 0..formation.layout().dragons() {
        let end_s = first.map_or(to_s, |first| first.time_s);
        // Nothing is known yet about the other dragons, and between them.
        let found = within_dragon(formation, dragon, clearance_m, from_s, end_s)
            .map_err(|spent| Unfinished { spent, reached_s: from_s })?;
        first = found.filter(|found| first.is_none_or(|first| found.time_s < first.time_s)).or(first);
    }
    let end_s = first.map_or(to_s, |first| first.time_s);
    let between = first_near(formation, clearance_m, [from_s, end_s])?;
    Ok(between.filter(|between| first.is_none_or(|first| between.time_s < first.time_s)).or(first))
}

/// The same as [`first_meeting`] for the pairs of two dragons alone.
///
/// # Errors
/// The errors of [`first_meeting`].
///
/// # Panics
/// Panics for a clearance that is negative or not finite.
pub fn first_between(
    formation: &Formation,
    clearance_m: f64,
    from_s: f64,
    to_s: f64,
) -> Result<Option<Meeting>, Unfinished> {
    match meeting_in(formation, &formation.layout().between_dragons(), clearance_m, from_s) {
        Some(meeting) => Ok(Some(meeting)),
        None => first_near(formation, clearance_m, [from_s, to_s]),
    }
}

/// Two benches of different dragons that touch or overlap where the dragons stand at the beginning of the plan.
pub fn standing_in_each_other(formation: &Formation) -> Option<[usize; 2]> {
    meeting_in(formation, &formation.layout().between_dragons(), 0.0, 0.0).map(|meeting| meeting.benches)
}

/// The nearest pair of the formation at a plan time, if it is within the clearance.
pub(super) fn meeting_at(formation: &Formation, clearance_m: f64, time_s: f64) -> Option<Meeting> {
    meeting_in(formation, formation.layout(), clearance_m, time_s)
}

/// The nearest pair of a layout at a plan time, if it is within the clearance.
fn meeting_in(formation: &Formation, layout: &Layout, clearance_m: f64, time_s: f64) -> Option<Meeting> {
    let mut pose = FormationPose::default();
    pose.place(formation, time_s);
    let mut near = ClearanceSearch::of(layout);
    let nearest = near.nearest(&pose.boards).filter(|nearest| nearest.clearance_m <= clearance_m);
    nearest.map(|pair| Meeting { time_s, benches: pair.benches, point: pair.point })
}

/// The first contact within one dragon.
fn within_dragon(
    formation: &Formation,
    dragon: usize,
    clearance_m: f64,
    from_s: f64,
    to_s: f64,
) -> Result<Option<Meeting>, Spent> {
    let planned = &formation.dragons()[dragon];
    let [from_m, to_m] = [from_s, to_s].map(|time_s| planned.travel_m(time_s));
    let time_s = |travel_m: f64| if travel_m == from_m { from_s } else { planned.timetable.time_s(travel_m) };
    let contact = ContactSearch::within(&planned.dragon, clearance_m).first(from_m, to_m)?;
    let begin = formation.layout().benches_of(dragon).start;
    Ok(contact.map(|contact| Meeting {
        time_s: time_s(contact.travel_m),
        benches: contact.benches.map(|bench| begin + bench),
        point: contact.point,
    }))
}

/// The poses of all dragons at one plan time, in reused buffers.
#[derive(Clone, Debug, Default)]
struct FormationPose {
    time_s: f64,
    poses: Vec<Pose>,
    /// The boards of all benches.
    boards: Vec<Board>,
}

impl FormationPose {
    fn place(&mut self, formation: &Formation, time_s: f64) {
        self.place_each(formation, time_s, |number, pose, travel_m| {
            pose.place_head(&formation.dragons()[number].dragon, travel_m);
        });
    }

    /// The same, where `place` places a dragon, at least its head, at a travel.
    fn place_each(&mut self, formation: &Formation, time_s: f64, mut place: impl FnMut(usize, &mut Pose, f64)) {
        self.time_s = time_s;
        self.poses.resize(formation.dragons().len(), Pose::default());
        self.boards.clear();
        for (number, (pose, planned)) in self.poses.iter_mut().zip(formation.dragons()).enumerate() {
            let travel_m = planned.travel_m(time_s);
            if !pose.is_at(travel_m) {
                place(number, pose, travel_m);
            }
            pose.extend_to(&planned.dragon, usize::MAX);
            self.boards.extend_from_slice(&pose.boards);
        }
    }

    fn pair(&self, members: [(usize, usize); 2]) -> PairPose {
        let benches = members.map(|(dragon, bench)| self.poses[dragon].bench_pose(bench));
        PairPose { parameter: self.time_s, benches }
    }
}

/// Searches plan time for contacts between the dragons of a formation.
#[derive(Clone, Debug)]
pub(super) struct BetweenSearch {
    formation: Formation,
    clearance_m: f64,
    earlier: FormationPose,
    later: FormationPose,
    /// The poses of each dragon, one after the other.
    walks: Vec<PoseWalk>,
    near: ClearanceSearch,
}

impl BetweenSearch {
    pub(super) fn new(formation: &Formation, clearance_m: f64) -> Self {
        Self {
            formation: formation.clone(),
            clearance_m,
            earlier: FormationPose::default(),
            later: FormationPose::default(),
            walks: vec![PoseWalk::default(); formation.dragons().len()],
            near: ClearanceSearch::of(&formation.layout().between_dragons()),
        }
    }

    /// Whether there are two dragons or more.
    fn has_pairs(&self) -> bool {
        self.formation.dragons().len() > 1
    }

    /// The first contact between two plan times, at the first of which no boards touch.
    pub(super) fn first(&mut self, from_s: f64, to_s: f64) -> Result<Option<Meeting>, Unfinished> {
        if !self.has_pairs() || from_s > to_s {
            return Ok(None);
        }
        self.earlier.place(&self.formation, from_s);
        while self.earlier.time_s < to_s {
            self.stride(to_s, |_| None);
            let near = self.near_pairs();
            let touch = near.as_ref().and_then(|near| self.touch_on_stride(near));
            let meter = self.formation.lead().meter();
            if near.is_none() || meter.is_spent() {
                return Err(Unfinished { spent: meter.spent(0.0), reached_s: self.earlier.time_s });
            }
            if touch.is_some() {
                return Ok(touch);
            }
            std::mem::swap(&mut self.earlier, &mut self.later);
        }
        Ok(None)
    }

    /// Adds all beginnings and ends of contacts between two plan times to `events`, whose travels are then plan times. Returns the
    /// plan time up to which they are complete. `known` are poses of the dragons, some of which may be needed.
    pub(super) fn sweep<'a>(
        &mut self,
        from_s: f64,
        to_s: f64,
        known: impl Fn(usize) -> Option<&'a Pose>,
        events: &mut Vec<PairEvent>,
    ) -> f64 {
        if !self.has_pairs() {
            return to_s;
        }
        self.earlier.place(&self.formation, from_s);
        while self.earlier.time_s < to_s {
            self.stride(to_s, &known);
            let begin = events.len();
            let near = self.near_pairs();
            for &benches in near.iter().flatten() {
                let _ = self.track(benches, &mut |event| {
                    events.push(event);
                    ControlFlow::Continue(())
                });
            }
            if near.is_none() || self.formation.lead().meter().is_spent() {
                events.truncate(begin);
                return self.earlier.time_s;
            }
            std::mem::swap(&mut self.earlier, &mut self.later);
        }
        to_s
    }

    /// Places `later` at the end of the next stride, at most at `to_s`. The pose of a dragon may be known.
    fn stride<'a>(&mut self, to_s: f64, known: impl Fn(usize) -> Option<&'a Pose>) {
        let Self { formation, earlier, later, walks, .. } = self;
        let next_s = formation.stride_end_s(earlier.time_s, STRIDE_LINKS).min(to_s);
        later.place_each(formation, next_s, |number, pose, travel_m| {
            match known(number).filter(|known| known.is_at(travel_m)) {
                Some(known) => pose.copy_from(known),
                None => walks[number].place(pose, &formation.dragons()[number].dragon, travel_m),
            }
        });
    }

    /// The first contact of these pairs on the stride from the earlier pose to the later one.
    fn touch_on_stride(&self, near: &[[usize; 2]]) -> Option<Meeting> {
        let meter = self.formation.lead().meter();
        let touches = near
            .iter()
            .take_while(|_| !meter.is_spent())
            .filter_map(|&benches| self.track(benches, &mut ControlFlow::Break).break_value());
        touches.min_by(PairEvent::order).map(|event| {
            let contact = *event.contact();
            Meeting { time_s: contact.travel_m, benches: contact.benches, point: contact.point }
        })
    }

    /// The pairs that may touch on the stride; `None` if there are too many.
    fn near_pairs(&mut self) -> Option<Vec<[usize; 2]>> {
        let reach_m = self.clearance_m + 2.0 * self.furthest_m();
        let near = self.near.all_within(&self.earlier.boards, reach_m);
        let near = near.map(|near| near.iter().map(|pair| pair.benches).collect());
        self.formation.lead().meter().add(self.near.take_steps());
        near
    }

    /// Passes the events of a pair on the stride to `sink`.
    fn track(
        &self,
        benches: [usize; 2],
        sink: &mut impl FnMut(PairEvent) -> ControlFlow<PairEvent>,
    ) -> ControlFlow<PairEvent> {
        let places = benches.map(|bench| self.formation.layout().place(bench));
        let members = places.map(|(dragon, bench)| Member {
            planned: &self.formation.dragons()[dragon],
            bench,
            walk: &self.walks[dragon],
        });
        let pair = Pair { members: Members::TwoDragons(members), benches };
        let ends = [self.earlier.pair(places), self.later.pair(places)];
        PairTracker::track_between(pair, self.clearance_m, ends, sink)
    }

    /// Bound on the displacement of any board on the stride.
    fn furthest_m(&self) -> f64 {
        let poses = self.earlier.poses.iter().zip(&self.later.poses).zip(self.formation.dragons());
        let drifts_m = poses.flat_map(|((earlier, later), planned)| {
            (0..earlier.boards.len()).map(move |bench| earlier.drift_m(later, &planned.dragon, bench))
        });
        drifts_m.fold(0.0, f64::max)
    }
}

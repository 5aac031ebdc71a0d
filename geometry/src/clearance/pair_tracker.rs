//! Tracks one pair of benches over an interval, and finds when it comes within a clearance and when it leaves it.
//! Here, a pair *touches* if it is within the clearance, which may be 0.
//!
//! The pair's poses at both ends of an interval are known, and the areas that its boards may cover in between. If they prove
//! that the pair stays apart, or keeps touching, the interval is done. Otherwise it is bisected. So no contact is missed,
//! however short, and a near miss costs a few bisections. Intervals too short to matter remain. The pair begins or ceases to
//! touch on those whose two ends differ.
//!
//! The search ends even where boards slide along each other, because `pair_motion` settles intervals of about 10⁻⁶ m. Its
//! bounds are of second order, and it ignores bounds below rounding. A pair on one line or arc moves as a rigid body: its
//! clearance is constant up to rounding, and the interval is settled by its ends.

use std::ops::ControlFlow;

use glam::DVec2;

use super::contact::{Contact, PairEvent};
use super::pair::{Members, Pair, PairPose};
use super::pair_motion::{GRAZE_M, PairMotion};
use super::pose::Pose;
use crate::dragon::Dragon;
use crate::dragon::board::{Approach, Board};

/// Length of the interval on which a contact begins or ends, in the unit of the pair's parameter. At its end the gap is exact to [`GRAZE_M`]. If
/// the gap changes at a rate r, the parameter is exact to this plus [`GRAZE_M`] / r.
const RESOLUTION: f64 = 1e-11;

/// Share of an interval at which the bounds on the pair's motion are first calculated, and at which they are calculated again
/// for a part. They apply off a spiral and cost as much as many evaluations. So only a pair still unsettled after ten bisections
/// is worth them.
const RENEWAL: f64 = 1.0 / 1024.0;

/// Tracks one pair.
pub(super) struct PairTracker<'a> {
    pair: Pair<'a>,
    clearance_m: f64,
    /// Length of the interval, in the unit of the pair's parameter.
    length: f64,
    /// Bounds on the motion on the interval and all parts of it, if they were calculated.
    motion: Option<PairMotion>,
}

/// The pair at one value of its parameter.
struct Moment {
    pose: PairPose,
    /// Distance of the boards minus the clearance, below 0 if they are nearer. For a clearance of 0 it is the largest gap
    /// across an edge, whose sign is the same.
    gap_m: f64,
}

impl Moment {
    #[inline]
    fn new(pose: PairPose, clearance_m: f64) -> Self {
        let [first, second] = &pose.benches;
        let gap_m = if clearance_m == 0.0 {
            first.board.separation(&second.board).0
        } else {
            first.board.clearance(&second.board) - clearance_m
        };
        Self { pose, gap_m }
    }

    fn is_touching(&self) -> bool {
        self.gap_m <= GRAZE_M
    }

    fn approach(&self) -> Approach {
        self.pose.benches[0].board.approach(&self.pose.benches[1].board)
    }

    /// The direction in which the clearance is measured, from each board to the other. Its components are along and across that
    /// board.
    fn directions(&self) -> [DVec2; 2] {
        let direction = self.approach().direction;
        let seen_from =
            |board: &Board, direction: DVec2| direction.rotate(DVec2::new(board.heading.x, -board.heading.y));
        let [first, second] = &self.pose.benches;
        [seen_from(&first.board, direction), seen_from(&second.board, -direction)]
    }
}

impl<'a> PairTracker<'a> {
    /// Passes the events of two benches of a dragon between two poses to `sink`, in order. It stops if `sink` breaks or the
    /// dragon's meter is spent. An event is where the pair comes within the clearance, which is not negative, or leaves it.
    pub(super) fn track(
        dragon: &'a Dragon,
        benches: [usize; 2],
        clearance_m: f64,
        earlier: &Pose,
        later: &Pose,
        sink: &mut impl FnMut(PairEvent) -> ControlFlow<PairEvent>,
    ) -> ControlFlow<PairEvent> {
        let pair = Pair::of(dragon, benches);
        let ends = [earlier, later].map(|pose| Moment::new(pair.at(pose), clearance_m));
        Self::walk_between(pair, clearance_m, on_spiral(dragon, benches, earlier, later), ends, sink)
    }

    /// The first touch of two benches of a dragon between two poses: at the first one, if they touch there. `None` also if the dragon's
    /// meter is spent.
    pub(super) fn first_touch(
        dragon: &'a Dragon,
        benches: [usize; 2],
        clearance_m: f64,
        earlier: &Pose,
        later: &Pose,
    ) -> Option<Contact> {
        let pair = Pair::of(dragon, benches);
        let ends = [earlier, later].map(|pose| Moment::new(pair.at(pose), clearance_m));
        if ends[0].is_touching() {
            return Some(Contact { travel_m: earlier.travel_m, benches, point: ends[0].approach().point });
        }
        let motion = on_spiral(dragon, benches, earlier, later);
        let first = Self::walk_between(pair, clearance_m, motion, ends, &mut ControlFlow::Break);
        first.break_value().map(|event| *event.contact())
    }

    /// The same for two benches of two dragons, whose timetables have no change of speed at once between the poses.
    pub(super) fn track_between(
        pair: Pair<'a>,
        clearance_m: f64,
        ends: [PairPose; 2],
        sink: &mut impl FnMut(PairEvent) -> ControlFlow<PairEvent>,
    ) -> ControlFlow<PairEvent> {
        Self::walk_between(pair, clearance_m, || None, ends.map(|pose| Moment::new(pose, clearance_m)), sink)
    }

    /// A parameter, from one pose to a later one, at which two benches of two dragons touch. `None` if they are proved to touch nowhere,
    /// or if the meter is spent. Timetables have no change of speed at once between the poses.
    pub(super) fn touch_between(pair: Pair<'a>, clearance_m: f64, ends: [PairPose; 2]) -> Option<f64> {
        let [earlier, later] = ends.map(|pose| Moment::new(pose, clearance_m));
        let length = later.pose.parameter - earlier.pose.parameter;
        if let Some(touching) = [&earlier, &later].into_iter().find(|moment| moment.is_touching()) {
            return Some(touching.pose.parameter);
        }
        Self { pair, clearance_m, length, motion: None }.touch(&earlier, &later)
    }

    /// The same between two moments at which the pair does not touch. The first touch that is found ends the search.
    fn touch(&self, earlier: &Moment, later: &Moment) -> Option<f64> {
        if !self.pair.may_look() || self.is_settled(earlier, later) {
            return None;
        }
        let (from, to) = (earlier.pose.parameter, later.pose.parameter);
        if self.is_worth_renewal(to - from) {
            return self.renewed(earlier, later).touch(earlier, later);
        }
        let at = 0.5 * (from + to);
        if to - from <= RESOLUTION || at <= from || at >= to {
            return None;
        }
        let middle = Moment::new(self.pair.solve(at), self.clearance_m);
        if middle.is_touching() {
            return Some(at);
        }
        self.touch(earlier, &middle).or_else(|| self.touch(&middle, later))
    }

    /// Whether new bounds on the motion are worth their cost for a part of this length.
    fn is_worth_renewal(&self, length: f64) -> bool {
        length <= RENEWAL * self.length && !self.motion.is_some_and(|motion| motion.parameter.is_angle())
    }

    /// Walks over the whole interval. The bounds on the motion are calculated only if the ends do not settle it.
    fn walk_between(
        pair: Pair<'a>,
        clearance_m: f64,
        motion: impl FnOnce() -> Option<PairMotion>,
        [earlier, later]: [Moment; 2],
        sink: &mut impl FnMut(PairEvent) -> ControlFlow<PairEvent>,
    ) -> ControlFlow<PairEvent> {
        let tracker = Self { pair, clearance_m, length: later.pose.parameter - earlier.pose.parameter, motion: None };
        if !pair.may_look() || tracker.is_settled(&earlier, &later) {
            return ControlFlow::Continue(());
        }
        Self { motion: motion(), ..tracker }.walk(&earlier, &later, sink)
    }

    /// A tracker for a part of the interval, with bounds for that part.
    fn renewed(&self, earlier: &Moment, later: &Moment) -> Self {
        let ends = [earlier.pose.parameter, later.pose.parameter];
        let motion = match self.pair.members {
            Members::OneDragon(dragon) => {
                let [from, to] = ends.map(|travel_m| Pose::of(dragon, travel_m, self.pair.benches[1] + 1));
                PairMotion::along_curve(dragon, self.pair.benches, &from, &to)
            }
            Members::TwoDragons(members) => PairMotion::over_plan_time(members, ends),
        };
        Self { length: ends[1] - ends[0], motion: Some(motion), ..*self }
    }

    fn walk(
        &self,
        earlier: &Moment,
        later: &Moment,
        sink: &mut impl FnMut(PairEvent) -> ControlFlow<PairEvent>,
    ) -> ControlFlow<PairEvent> {
        if !self.pair.may_look() || self.is_settled(earlier, later) {
            return ControlFlow::Continue(());
        }
        let (from, to) = (earlier.pose.parameter, later.pose.parameter);
        if self.is_worth_renewal(to - from) {
            return self.renewed(earlier, later).walk(earlier, later, sink);
        }
        let at = 0.5 * (from + to);
        if to - from <= RESOLUTION || at <= from || at >= to {
            return self.change(earlier, later).map_or(ControlFlow::Continue(()), sink);
        }
        let middle = Moment::new(self.pair.solve(at), self.clearance_m);
        self.walk(earlier, &middle, sink)?;
        self.walk(&middle, later, sink)
    }

    /// Whether the pair provably stays apart, or keeps touching, on the whole interval.
    fn is_settled(&self, earlier: &Moment, later: &Moment) -> bool {
        if earlier.is_touching() != later.is_touching() {
            return false;
        }
        let is_settled = self.motion.is_some_and(|motion| {
            let encounter = motion.between(&earlier.pose, &later.pose);
            if earlier.is_touching() {
                return encounter.stays_touching(self.clearance_m);
            }
            // Boards that are apart by a clearance may be nearest at two corners. No edge separates such boards.
            let corners_stay_apart =
                |moment: &Moment| encounter.stays_apart_along(moment.directions(), self.clearance_m);
            encounter.stays_apart(self.clearance_m)
                || (self.clearance_m > 0.0 && [earlier, later].into_iter().any(corners_stay_apart))
        });
        is_settled || self.is_settled_separately(earlier, later) || self.pair.is_rigid(&earlier.pose, &later.pose)
    }

    /// The same, from the areas that the two boards may cover independently of each other.
    fn is_settled_separately(&self, earlier: &Moment, later: &Moment) -> bool {
        let [first, second] = self.pair.coverages(&earlier.pose, &later.pose);
        if earlier.is_touching() {
            return first.stays_touching(&second, -earlier.gap_m.min(later.gap_m));
        }
        if first.least_between_m(&second, [earlier.gap_m, later.gap_m]) > 0.0 {
            return true;
        }
        [earlier, later].into_iter().any(|moment| {
            let (_, axis) = moment.pose.benches[0].board.separation(&moment.pose.benches[1].board);
            [axis, moment.approach().direction]
                .into_iter()
                .any(|direction| first.gap_m(&second, direction) > self.clearance_m)
        })
    }

    fn change(&self, earlier: &Moment, later: &Moment) -> Option<PairEvent> {
        let contact = |moment: &Moment| Contact {
            travel_m: later.pose.parameter,
            benches: self.pair.benches,
            point: moment.approach().point,
        };
        match (earlier.is_touching(), later.is_touching()) {
            (false, true) => Some(PairEvent::Touch(contact(later))),
            (true, false) => Some(PairEvent::Part(contact(earlier))),
            _ => None,
        }
    }
}

/// The motion of two benches of a dragon from one pose to a later one, if the pair stays on a spiral.
fn on_spiral<'p>(
    dragon: &'p Dragon,
    benches: [usize; 2],
    earlier: &'p Pose,
    later: &'p Pose,
) -> impl FnOnce() -> Option<PairMotion> + 'p {
    move || {
        dragon.meter().add((benches[1] - benches[0]) as u64);
        PairMotion::on_spiral(dragon, benches, earlier, later)
    }
}

//! Poses that the play of the hinges allows, and that touch. The truth about the first touch lies between the proof and these.
//!
//! [`Share`]s of its freedom determine a pose of two benches: how long the links before and between them are, how far apart the
//! two poles of each bench are, and how each board lies on its poles. Every choice of shares is an allowed pose by construction. A
//! pattern search (Hooke and Jeeves 1961, Journal of the ACM 8) looks for the shares with the least clearance, in one interval of
//! travel after the other. It leaves out pairs that the proof rules out there. It finds a touch or finds none: it proves nothing.

use std::f64::consts::PI;

use glam::DVec2;

use super::PlaySearch;
use crate::clearance::near_pairs::NearPairs;
use crate::clearance::pose::Pose;
use crate::dragon::Dragon;
use crate::dragon::board::Board;
use crate::dragon::link::{Link, RearEnd};
use crate::dragon::meter::Spent;
use crate::numerics::turning_point;
use crate::route::RoutePoint;

/// Number of intervals of travel that are searched, and the longest one in lengths of the shorter link.
const INTERVALS: f64 = 48.0;
const LONGEST_LINKS: f64 = 0.25;
/// Most intervals.
const MAX_INTERVALS: f64 = 2_000.0;
/// Most pairs of an interval that are searched: those that are nearest without play.
const MAX_PAIRS: usize = 12;
/// First and last step of a search, as a share of the freedom.
const FIRST_STEP: f64 = 0.5;
const LAST_STEP: f64 = 2e-3;
/// Tolerance of the travel of a touch, in metres.
const TOLERANCE_M: f64 = 1e-4;
/// Evaluations of a board that take as long as one step of work.
const STEPS_PER_POSE: u64 = 8;

/// A pose that the play allows, in which two benches touch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TouchingPose {
    /// Travel of the head, in metres.
    pub travel_m: f64,
    /// Indices of the benches, the lower one first.
    pub benches: [usize; 2],
}

/// Finds an early pose that the play allows and that has a clearance up to `clearance_m`, between two travels of the run. `None`
/// if the search finds none, for hinges without play, and on ground.
///
/// # Errors
/// The dragon's meter is spent.
pub fn first_touching_pose(
    dragon: &Dragon,
    clearance_m: f64,
    from_travel_m: f64,
    to_travel_m: f64,
) -> Result<Option<TouchingPose>, Spent> {
    let Some(loose) = dragon.loose().filter(|_| !dragon.route().is_on_ground()) else { return Ok(None) };
    let (from_m, to_m) = (from_travel_m.max(dragon.start_travel_m()), to_travel_m.min(loose.end_travel_m()));
    let longest_m = LONGEST_LINKS * dragon.dimensions().link_m(0).min(dragon.dimensions().link_m(1));
    let count = INTERVALS.max(((to_m - from_m) / longest_m).ceil()).min(MAX_INTERVALS);
    let proof = PlaySearch::unplaced(dragon, clearance_m, from_m);
    for number in 0..count as usize {
        let [begin_m, end_m] = [number, number + 1].map(|at| from_m + (to_m - from_m) * at as f64 / count);
        if end_m <= begin_m {
            break;
        }
        let search = Search { dragon, clearance_m, begin_m, end_m };
        let open = search.near_pairs().into_iter().filter(|&benches| proof.may_touch(benches, [begin_m, end_m]));
        let found = open.filter_map(|benches| search.first_touch(benches));
        let first = found.min_by(|one, other| one.travel_m.total_cmp(&other.travel_m));
        dragon.meter().check(begin_m)?;
        if first.is_some() {
            return Ok(first);
        }
    }
    Ok(None)
}

/// Shares of the freedom of a pose, each from −1 to 1.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    /// Links before the first bench.
    before: f64,
    /// Distance of the two poles of each bench.
    own: [f64; 2],
    /// Links between the two benches.
    between: f64,
    /// Turn of each board on its poles.
    turn: [f64; 2],
    /// Direction in which each board lies off its poles, from −π to π about the one towards the other board.
    off: [f64; 2],
    /// Travel of the head in its interval.
    travel: f64,
}

impl Share {
    fn values(&mut self) -> [&mut f64; 9] {
        let [own, other_own] = &mut self.own;
        let [turn, other_turn] = &mut self.turn;
        let [off, other_off] = &mut self.off;
        [&mut self.before, own, other_own, &mut self.between, turn, other_turn, off, other_off, &mut self.travel]
    }
}

/// A search in an interval of the head's travel.
struct Search<'a> {
    dragon: &'a Dragon,
    clearance_m: f64,
    begin_m: f64,
    end_m: f64,
}

/// A pole on the route.
#[derive(Clone, Copy)]
struct Pole {
    parameter: f64,
    point: RoutePoint,
}

impl Search<'_> {
    /// The pairs that are nearest without play in the middle of the interval, and near enough for the play.
    fn near_pairs(&self) -> Vec<[usize; 2]> {
        let (dragon, dimensions) = (self.dragon, self.dragon.dimensions());
        let pose = Pose::of(dragon, 0.5 * (self.begin_m + self.end_m), dimensions.benches());
        // A hole leaves its pole by the play, a corner by more, and the poles turn the link.
        let lever = dimensions.length_m(0).max(dimensions.length_m(1)) / dimensions.link_m(0).min(dimensions.link_m(1));
        let reach_m = self.clearance_m + 8.0 * lever * dimensions.play_m() + (self.end_m - self.begin_m);
        let mut near = NearPairs::default().with_room(MAX_PAIRS);
        near.renew(&pose.boards, reach_m);
        dragon.meter().add(near.take_steps());
        let mut pairs: Vec<(f64, [usize; 2])> = near.list().iter().map(|pair| (pair.gap_m, pair.benches())).collect();
        pairs.sort_by(|one, other| one.0.total_cmp(&other.0).then(one.1.cmp(&other.1)));
        pairs.into_iter().take(MAX_PAIRS).map(|(_, benches)| benches).collect()
    }

    /// The first touch of two benches that is found in the interval.
    fn first_touch(&self, benches: [usize; 2]) -> Option<TouchingPose> {
        let mut best: Option<(Share, f64)> = None;
        for between in [0.0, 1.0, -1.0] {
            let share = Share { between, before: between, own: [between; 2], ..Share::default() };
            let (share, clearance_m) = self.least(benches, share, true);
            if best.is_none_or(|(_, least_m)| clearance_m < least_m) {
                best = Some((share, clearance_m));
            }
        }
        let (share, _) = best.filter(|&(_, clearance_m)| clearance_m <= self.clearance_m)?;
        let touches = |travel: f64| {
            let (_, clearance_m) = self.least(benches, Share { travel, ..share }, false);
            clearance_m <= self.clearance_m && !self.dragon.meter().is_spent()
        };
        let tolerance = 2.0 * TOLERANCE_M / (self.end_m - self.begin_m);
        let travel = if touches(-1.0) { -1.0 } else { turning_point(-1.0, share.travel, tolerance, touches).1 };
        Some(TouchingPose { travel_m: self.travel_m(travel), benches })
    }

    fn travel_m(&self, share: f64) -> f64 {
        let middle_m = 0.5 * (self.begin_m + self.end_m);
        (middle_m + 0.5 * share * (self.end_m - self.begin_m)).clamp(self.begin_m, self.end_m)
    }

    /// The least clearance that a pattern search finds from these shares, and its shares. The travel of the head may be fixed.
    fn least(&self, benches: [usize; 2], mut share: Share, moves_head: bool) -> (Share, f64) {
        let mut least_m = self.clearance_of(benches, &share);
        let mut step = FIRST_STEP;
        while step >= LAST_STEP && !self.dragon.meter().is_spent() {
            let mut has_improved = false;
            for number in 0..share.values().len() - usize::from(!moves_head) {
                for moved in [step, -step] {
                    let mut trial = share;
                    let values = trial.values();
                    *values[number] = (*values[number] + moved).clamp(-1.0, 1.0);
                    let clearance_m = self.clearance_of(benches, &trial);
                    if clearance_m < least_m {
                        (share, least_m, has_improved) = (trial, clearance_m, true);
                        break;
                    }
                }
            }
            if !has_improved {
                step *= 0.5;
            }
        }
        (share, least_m)
    }

    /// The clearance of two benches in a pose; infinite where a link does not walk.
    fn clearance_of(&self, benches: [usize; 2], share: &Share) -> f64 {
        self.boards(benches, share).map_or(f64::INFINITY, |[one, other]| one.clearance(&other))
    }

    fn boards(&self, [first, second]: [usize; 2], share: &Share) -> Option<[Board; 2]> {
        let route = self.dragon.route();
        let parameter = route.parameter(self.travel_m(share.travel));
        let mut pole = Pole { parameter, point: route.point(parameter) };
        for bench in 0..first {
            pole = self.behind(bench, pole, share.before)?;
        }
        let ours = [pole, self.behind(first, pole, share.own[0])?];
        pole = ours[1];
        for bench in first + 1..second {
            pole = self.behind(bench, pole, share.between)?;
        }
        let theirs = [pole, self.behind(second, pole, share.own[1])?];
        self.dragon.meter().add(2 * STEPS_PER_POSE);
        let middle = |[front, rear]: [Pole; 2]| 0.5 * (front.point.position + rear.point.position);
        let towards = (middle(theirs) - middle(ours)).try_normalize()?;
        let off = |towards: DVec2, share: f64| towards.rotate(DVec2::from_angle(share * PI));
        Some([
            self.board(first, ours, share.turn[0], off(towards, share.off[0]))?,
            self.board(second, theirs, share.turn[1], off(-towards, share.off[1]))?,
        ])
    }

    /// The pole behind another one, over the link of a bench with a share of its play.
    fn behind(&self, bench: usize, front: Pole, share: f64) -> Option<Pole> {
        let dimensions = self.dragon.dimensions();
        let length_m = dimensions.link_m(bench) + 2.0 * share * dimensions.play_m();
        let link = Link { route: self.dragon.route(), front: front.point, length_m, meter: self.dragon.meter() };
        let rear = link.rear(front.parameter).filter(RearEnd::walks)?;
        Some(Pole { parameter: rear.parameter, point: rear.point })
    }

    /// The board of a bench on its poles, turned by a share of what their distance leaves, and as far off in a direction as its
    /// holes allow.
    ///
    /// In the frame of the line of the poles, D apart, the holes are at m ± (d/2)·u, with u the heading. So they are m ± δ off
    /// their poles, with δ = (d·u − D·x̂)/2. |m ± δ| ≤ c holds for m = s·n up to s = √((n·δ)² + c² − δ²) − |n·δ|.
    fn board(&self, bench: usize, [front, rear]: [Pole; 2], turn_share: f64, direction: DVec2) -> Option<Board> {
        let dimensions = self.dragon.dimensions();
        let (link_m, play_m) = (dimensions.link_m(bench), dimensions.play_m());
        let line = (front.point.position - rear.point.position).try_normalize()?;
        let apart_m = front.point.position.distance(rear.point.position);
        // |δ|² = (d² + D² − 2·d·D·cos)/4 is at most c².
        let least_cosine = (link_m * link_m + apart_m * apart_m - 4.0 * play_m * play_m) / (2.0 * link_m * apart_m);
        let turn = turn_share * least_cosine.clamp(-1.0, 1.0).acos();
        let heading = line.rotate(DVec2::from_angle(turn));
        let delta = 0.5 * (link_m * heading - apart_m * line);
        let along_m = direction.dot(delta);
        let room_m = along_m * along_m + play_m * play_m - delta.length_squared();
        let off_m = room_m.max(0.0).sqrt() - along_m.abs();
        let middle = 0.5 * (front.point.position + rear.point.position) + off_m.max(0.0) * direction;
        let half = 0.5 * link_m * heading;
        Some(Board::from_handles(middle + half, middle - half, dimensions.length_m(bench), dimensions.width_m()))
    }
}

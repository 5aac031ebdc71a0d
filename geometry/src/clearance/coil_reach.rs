//! Bounds on the turns of a coil that a bench reaches. They rule out contacts of benches.
//!
//! **Terms.** The coil is the spiral r = b·θ with pitch p = 2π·b about its own centre, from which all distances are measured.
//! The *excess* of a point x near a bench is e = |x| − b·φ: its distance outside the bench's own turn. Here φ is the polar
//! angle of x, counted continuously from the angles of the bench's handles. A bench has the link d, holes h from its ends and
//! the width w. o is the distance from a hole to the corners around it. The front handle A is at the angle θ and the radius r,
//! or further out; the rear handle is B. K is the curvature at θ, and K·d < 2. The perpendicular from the centre onto the link
//! has the length q. Seen from its foot, A lies τ ahead and B τ' behind.
//!
//! 1. If two benches have a common point, its two angles differ by a whole number m of turns. So its two excesses differ by
//!    m·p.
//! 2. The link's arc s is at least d and at most (2/K)·asin(K·d/2): see `dragon::feasible`.
//! 3. τ + τ' = d. τ'² − τ² = |B|² − |A|² = 2b·∫ θ/√(1 + θ²) ds, which is between 2b·d·θ/√(1 + θ²) and 2b·s. This bounds τ and
//!    τ', and with q² = |A|² − τ² also q.
//! 4. If (q − w/2)² ≥ 2b·(τ' + h), e grows across the board, away from the centre, and e is convex along the board. Proof: in
//!    the direction ψ from the perpendicular, its first derivative across is cos ψ ± (b/|x|)·sin ψ, and its second derivative
//!    along is (cos² ψ ± (2b/|x|)·cos ψ·sin ψ)/|x|.
//! 5. So e is greatest at an outer corner. Because e = 0 at the handles, it is there at most D(q, τ) + b·asin(o/r) or D(q, τ'),
//!    with D(q, τ) = |(q + w/2, τ + h)| − |(q, τ)|. D falls with q, grows with τ if h·q ≥ τ·w/2, and never exceeds o.
//! 6. e is least on the inner edge: (q − w/2)/cos ψ − b·ψ − |A| − b·atan(τ/q) ≥ −(w/2 + (|A| − q) + b·atan(τ/q) + b²/(2q − w)).
//! 7. The angles of a board are at most asin(o/r) outside the angles of its handles, on either side.
//! 8. A link turns by at least d/√(b² + |B|²). A body bench whose link turns by more than 2·asin(o/r) keeps the benches before
//!    and behind it apart: the bench behind has the larger angles (7), so m ≥ 1 (1).
//! 9. So a bench behind that touches is at the radius r + p − b·(s/r + 2·asin(o/r)), or further out.
//! 10. Bounds 2 to 9 that hold at one radius of the front handle also hold at every larger radius.
//! 11. On a way out, A is the rear handle and B the front handle, and 2 to 10 hold. Angles there are counted from the way out's
//!     own axis, half a turn from that of the coil. At a common point, a bench there and a bench on the way in have angles that
//!     differ by an odd number of half turns. So their excesses differ by p/2 or more, in either direction.
//! 12. All other benches have at least a part of their link's arc between the two ways, within the circle of radius R. If
//!     K·d < 2 there, both their handles have |x|² ≤ R² + p·d/2, as in 3. In any case they have |x| ≤ R + 2·d. No point of
//!     these benches is further out than that bound plus o.
//! 13. Boards within a clearance c of each other have a common point once each is grown by c/2 on every side. So the same
//!     bounds rule out clearances up to c, with h + c/2 and w + c in place of h and w.
//! 14. With play c, the poles of a bench are D apart, with D from d − 2c to d + 2c, and no corner of its board is further than
//!     g = c·√(1 + 4ρ²/d²) from its place with the middle of the holes in that of the poles, where ρ is half of the diagonal (see
//!     `play::board_reach`). So the board lies in one with the link D that is longer by c + g at each end than h, and wider by 2g.
//!     Bounds 2 to 8 hold for every D between two lengths if each uses the length that makes it weaker.

use std::f64::consts::TAU;

use crate::dragon::Dragon;
use crate::dragon::dimensions::Dimensions;
use crate::numerics::turning_point;
use crate::route::Coil;

/// Tolerance of [`CoilReach::clear_from`], in radians: less than 1 mm on most spirals.
const ANGLE_TOLERANCE: f64 = 1e-4;

/// Bounds for the benches of a dragon on the coil of its route.
#[derive(Clone, Copy, Debug)]
pub(super) struct CoilReach {
    pub(super) coil: Coil,
    /// Dimensions of the boards, grown by half of the clearance, and by what the play allows, on every side (13, 14).
    dimensions: Dimensions,
    /// Greatest difference of the distance of two poles from the length of their link (14).
    slack_m: f64,
    /// A bound on |curvature| between the way in and the way out.
    turn_curvature: f64,
}

impl CoilReach {
    /// The bounds for a dragon whose route has a coil. In all that follows, benches *touch* if they are within `clearance_m` of
    /// each other.
    pub(super) fn of(dragon: &Dragon, clearance_m: f64) -> Option<Self> {
        Self::grown(dragon, clearance_m, 0.0)
    }

    /// The same for all poses that the play of the hinges allows (14).
    pub(super) fn of_loose(dragon: &Dragon, clearance_m: f64) -> Option<Self> {
        let dimensions = dragon.dimensions();
        let play_m = dimensions.play_m();
        let grown_m = |bench: usize| {
            let lever = 2.0 * dragon.board_radius_m(bench) / dimensions.link_m(bench);
            play_m * (1.0 + lever.hypot(1.0))
        };
        Self::grown(dragon, clearance_m + 2.0 * grown_m(0).max(grown_m(1)), 2.0 * play_m)
    }

    fn grown(dragon: &Dragon, by_m: f64, slack_m: f64) -> Option<Self> {
        dragon.route().coil().map(|coil| {
            let turn_end = coil.way_out.map_or(coil.end, |way_out| way_out.begin);
            let turn_curvature = dragon.route().curvature_bound(coil.end, turn_end);
            Self { coil, dimensions: dragon.dimensions().grown(by_m), slack_m, turn_curvature }
        })
    }

    /// The largest number of turns between `bench`, with its front handle at `angle` or further out, and a bench behind that it
    /// may touch. `None` if the bounds do not hold. Zero rules out all of these contacts (1, 8, 9).
    pub(super) fn turns(&self, bench: usize, angle: f64) -> Option<f64> {
        let b = self.coil.radius_per_radian_m;
        let ahead = self.stand(bench, angle)?;
        let body = self.stand(1, angle)?;
        let overhang_angle = self.overhang_angle(angle);
        let angle_behind = angle + TAU - 2.0 * overhang_angle - body.turn;
        let behind = self.stand(1, angle_behind.max(angle))?;
        let reach_m = ahead.outward_m + behind.inward_m;
        self.keeps_apart(angle).then(|| (reach_m / (TAU * b)).floor())
    }

    /// Bound on the angle by which a board extends beyond its handles at `angle` or further out (7).
    pub(super) fn overhang_angle(&self, angle: f64) -> f64 {
        (self.dimensions.overhang_m() / (self.coil.radius_per_radian_m * angle)).min(1.0).asin()
    }

    /// An angle, at most `highest`, such that no two benches touch with the head there or further out; `None` if the bounds
    /// prove none.
    ///
    /// It is the smallest such angle that the bounds prove, to [`ANGLE_TOLERANCE`].
    pub(super) fn clear_from(&self, highest: f64) -> Option<f64> {
        let clear = |angle| [0, 1].iter().all(|&bench| self.turns(bench, angle) == Some(0.0));
        clear(highest).then(|| turning_point(self.coil.end_angle, highest, ANGLE_TOLERANCE, clear).1)
    }

    /// The parameter up to which `bench`, with its front handle anywhere up to there, touches no bench behind it; `None` if the
    /// bounds do not prove it at the parameter `from`.
    pub(super) fn bench_is_clear_to(&self, bench: usize, from: f64) -> Option<f64> {
        let clear = |angle| self.turns(bench, angle) == Some(0.0);
        let highest = self.coil.angle(from).filter(|&angle| clear(angle))?;
        let (_, angle) = turning_point(self.coil.end_angle, highest, ANGLE_TOLERANCE, clear);
        Some(self.coil.parameter(angle))
    }

    /// A parameter such that `bench` touches no bench whose front handle is behind it. `bench` has its front handle at `front` or
    /// behind, and its rear handle at `rear` or ahead of it. `None` if the bounds prove none.
    pub(super) fn reached_to(&self, bench: usize, front: f64, rear: f64) -> Option<f64> {
        let front_angle = self.coil.angle(front)?;
        let turns = self.turns(bench, front_angle)?;
        let rear_angle = self.coil.angle(rear)?;
        Some(self.coil.parameter(rear_angle + TAU * turns + 2.0 * self.overhang_angle(front_angle)))
    }

    /// A parameter on the way out, at most `highest`; `None` if the bounds prove none. No bench with its rear handle there or
    /// further on touches a bench behind it. The search is that of [`clear_from`](Self::clear_from).
    pub(super) fn clear_out_from(&self, highest: f64) -> Option<f64> {
        let way_out = self.coil.way_out?;
        let clear = |angle| [0, 1].iter().all(|&bench| self.is_clear_out(bench, angle) == Some(true));
        let highest_angle = self.coil.angle_out(highest).filter(|&angle| clear(angle))?;
        let (_, angle) = turning_point(self.coil.end_angle, highest_angle, ANGLE_TOLERANCE, clear);
        Some(way_out.begin + (angle - self.coil.end_angle))
    }

    /// Whether `bench`, with its rear handle at `angle` on the way out, touches no bench behind it (11, 12).
    fn is_clear_out(&self, bench: usize, angle: f64) -> Option<bool> {
        let (b, end_angle) = (self.coil.radius_per_radian_m, self.coil.end_angle);
        let (ours, theirs) = (self.stand(bench, angle)?, self.stand(1, end_angle)?);
        let same_way_m = theirs.outward_m + ours.inward_m;
        let other_way_m = same_way_m.max(ours.outward_m + theirs.inward_m);
        let inmost_m = b * (angle - self.overhang_angle(angle)) - ours.inward_m;
        let passes_turn = inmost_m > self.turn_reach_m()? && self.keeps_apart(end_angle);
        Some(passes_turn && same_way_m < TAU * b && other_way_m < 0.5 * TAU * b)
    }

    /// Bound on the distance from the centre to any point of a bench whose handles are not both on the same way (12); `None`
    /// without a way out.
    fn turn_reach_m(&self) -> Option<f64> {
        let b = self.coil.radius_per_radian_m;
        let (radius_m, link_m) = (self.coil.way_out?.turn_radius_m, self.dimensions.link_m(1));
        let is_slight = self.turn_curvature * link_m < 2.0;
        let furthest_m =
            if is_slight { radius_m.hypot((0.5 * TAU * b * link_m).sqrt()) } else { radius_m + 2.0 * link_m };
        Some(furthest_m + self.dimensions.overhang_m())
    }

    /// A parameter on the way in such that all benches behind it stay further than `distance_m` from the centre.
    pub(super) fn beyond(&self, distance_m: f64) -> Option<f64> {
        let body = self.stand(1, self.coil.end_angle)?;
        let angle = (distance_m + body.inward_m) / self.coil.radius_per_radian_m;
        Some(self.coil.parameter(angle.max(self.coil.end_angle) + self.overhang_angle(self.coil.end_angle)))
    }

    /// Bounds for a bench with its front handle at `angle` or further out; `None` if they do not hold (2 to 6).
    fn stand(&self, bench: usize, angle: f64) -> Option<Stand> {
        let b = self.coil.radius_per_radian_m;
        let hole_m = self.dimensions.hole_offset_m();
        let [shortest_m, longest_m] = self.links_m(bench);
        let half_width_m = 0.5 * self.dimensions.width_m();
        let squared = 1.0 + angle * angle;
        let half_bend = 0.5 * longest_m * (1.0 + squared) / (b * squared * squared.sqrt());
        if half_bend >= 1.0 {
            return None;
        }
        // 2, 3
        let stretch = half_bend.asin() / half_bend;
        let ahead_m = (0.5 * longest_m - b * angle / squared.sqrt()).max(b * stretch - 0.5 * shortest_m);
        let behind_m = 0.5 * longest_m + b * stretch;
        let foot_m = ((b * angle).powi(2) - ahead_m * ahead_m).max(0.0).sqrt();
        // 4
        let edge_m = foot_m - half_width_m;
        if edge_m <= 0.0 || edge_m * edge_m < 2.0 * b * (behind_m + hole_m) {
            return None;
        }
        // 5, and 6 for `inward_m`
        let corner_m = |along_m: f64| {
            if hole_m * foot_m >= along_m * half_width_m {
                (foot_m + half_width_m).hypot(along_m + hole_m) - foot_m.hypot(along_m)
            } else {
                self.dimensions.overhang_m()
            }
        };
        Some(Stand {
            turn: longest_m * stretch / (b * angle),
            outward_m: corner_m(behind_m).max(corner_m(ahead_m) + b * self.overhang_angle(angle)),
            inward_m: half_width_m
                + (foot_m.hypot(ahead_m) - foot_m)
                + b * (ahead_m / foot_m).atan()
                + 0.5 * b * b / edge_m,
        })
    }

    /// The shortest and the longest distance of a bench's poles (14).
    fn links_m(&self, bench: usize) -> [f64; 2] {
        let link_m = self.dimensions.link_m(bench);
        [link_m - self.slack_m, link_m + self.slack_m]
    }

    /// Whether two benches with one between them have no common angle, with the front handle of the rear bench at `angle` or
    /// further out (8). It also checks that the angles of a board's corners grow with those of its handles. They do where θ +
    /// asin(o/(b·θ)) grows.
    fn keeps_apart(&self, angle: f64) -> bool {
        let b = self.coil.radius_per_radian_m;
        let [shortest_m, longest_m] = self.links_m(1);
        let overhang_m = self.dimensions.overhang_m();
        let radius_m = b * angle;
        let tangent_m = (radius_m * radius_m - overhang_m * overhang_m).max(0.0).sqrt();
        let turn = shortest_m / (b * b + radius_m * radius_m + 0.5 * TAU * b * longest_m).sqrt();
        radius_m * tangent_m > overhang_m * b && turn > 2.0 * self.overhang_angle(angle)
    }
}

/// Bounds for a bench on the coil.
struct Stand {
    /// Upper bound on the angle between the handles.
    turn: f64,
    /// Upper bound on the excess of the board.
    outward_m: f64,
    /// Upper bound on the negative excess of the board.
    inward_m: f64,
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::DVec2;
    use proptest::collection::vec;
    use proptest::prelude::*;
    use test_support::property::random_cases;

    use super::*;
    use crate::dragon::link::Link;
    use crate::dragon::{Board, ChainSolver, Handle};
    use crate::route::{Route, Turnaround};

    const BENCHES: usize = 40;

    /// A dragon on a spiral, and its handles at a travel of its run.
    fn standing_dragons() -> impl Strategy<Value = (Dragon, Vec<Handle>)> {
        let benches = (1.0..4.0_f64, 1.0..3.0_f64, 0.05..0.5_f64, 0.0..0.45_f64);
        let spirals = (1.05..6.0_f64, 1.0..12.0_f64);
        let any = (benches, spirals, 0.0..1.0_f64);
        any.prop_filter_map("cannot stand", |((head_m, body_m, width_m, hole_m), (pitch, turns), part)| {
            let dimensions = Dimensions::new(BENCHES, head_m, body_m, width_m, hole_m).ok()?;
            let dragon = Dragon::new(dimensions, Arc::new(Route::spiral(pitch * width_m, turns).ok()?)).ok()?;
            let travel_m = part * dragon.end_travel_m();
            let handles = ChainSolver::new(&dragon).solve(&dragon, travel_m).ok()?.to_vec();
            Some((dragon, handles))
        })
    }

    /// Points along all edges of a board.
    fn edge(board: &Board) -> impl Iterator<Item = DVec2> {
        let corners = board.corners();
        let side = move |k: usize| (0..=50).map(move |i| corners[k].lerp(corners[(k + 1) % 4], f64::from(i) / 50.0));
        (0..4).flat_map(side)
    }

    /// Polar angle of a point, counted continuously from the angle of a handle.
    fn angle_at(handle: &Handle, point: DVec2) -> f64 {
        handle.position.angle_to(point) - handle.parameter
    }

    proptest! {
        #![proptest_config(random_cases(256))]

        #[test]
        fn boards_stay_within_the_bounds_on_their_excess((dragon, handles) in standing_dragons()) {
            let reach = CoilReach::of(&dragon, 0.0).expect("a spiral is a coil");
            for bench in 0..BENCHES {
                let (front, rear) = (&handles[bench], &handles[bench + 1]);
                let Some(stand) = reach.stand(bench, -handles[bench.min(1)].parameter) else { continue };
                prop_assert!(front.parameter - rear.parameter <= stand.turn, "link {bench} turns by more than {}", stand.turn);
                for point in edge(&dragon.board(bench, front, rear)) {
                    let excess_m = point.length() - reach.coil.radius_per_radian_m * angle_at(front, point);
                    let bounds = -stand.inward_m - 1e-12..=stand.outward_m + 1e-12;
                    prop_assert!(bounds.contains(&excess_m), "bench {bench}: {excess_m} m is not in {bounds:?}");
                }
            }
        }

        #[test]
        fn loose_boards_stay_within_the_bounds_on_their_excess(
            (dragon, handles) in standing_dragons(),
            play_m in 0.001..0.01_f64,
            lies in vec((-1.0..=1.0_f64, -1.0..=1.0_f64, 0.0..TAU, 0.0..=1.0_f64), 16),
        ) {
            let Ok(dimensions) = dragon.dimensions().with_poles(0.055, 0.055 - 2.0 * play_m) else { return Ok(()) };
            let Ok(loose) = Dragon::new(dimensions, Arc::new(dragon.route().clone())) else { return Ok(()) };
            let reach = CoilReach::of_loose(&loose, 0.0).expect("a spiral is a coil");
            let tries = (0..8).flat_map(|bench| lies.iter().map(move |&lie| (bench, lie)));
            for (bench, (longer, turn, towards, share)) in tries {
                let (handle, link_m) = (&handles[bench], dimensions.link_m(bench));
                let Some(stand) = reach.stand(bench, -handle.parameter) else { continue };
                let front = loose.route().point(handle.parameter);
                let length_m = link_m + 2.0 * longer * play_m;
                let link = Link { route: loose.route(), front, length_m, meter: loose.meter() };
                let Some(rear) = link.rear(handle.parameter) else { continue };
                let poles = [front.position, rear.point.position];
                let heading = (poles[0] - poles[1]).normalize().rotate(DVec2::from_angle(turn * 2.0 * play_m / link_m));
                let middle = 0.5 * (poles[0] + poles[1]) + share * play_m * DVec2::from_angle(towards);
                let holes = [middle + 0.5 * link_m * heading, middle - 0.5 * link_m * heading];
                if holes.iter().zip(poles).any(|(hole, pole)| hole.distance(pole) > play_m) {
                    continue;
                }
                let board = Board::from_handles(holes[0], holes[1], dimensions.length_m(bench), dimensions.width_m());
                for point in edge(&board) {
                    let excess_m = point.length() - reach.coil.radius_per_radian_m * angle_at(handle, point);
                    let bounds = -stand.inward_m - 1e-12..=stand.outward_m + 1e-12;
                    prop_assert!(bounds.contains(&excess_m), "bench {bench}: {excess_m} m is not in {bounds:?}");
                }
            }
        }

        #[test]
        fn benches_on_the_way_out_do_not_touch_where_the_bounds_rule_it_out(
            lengths in (1.0..3.0_f64, 1.0..3.0_f64, 0.1..0.4_f64, 0.0..0.3_f64),
            turn in (0.6..2.5_f64, 3.0..9.0_f64, 0.5..2.0_f64, prop_oneof![Just(0.0), 0.0..0.9_f64]),
            part in 0.0..1.0_f64,
        ) {
            let ((head_m, body_m, width_m, hole_m), (pitch_m, diameter_m, ratio, line)) = (lengths, turn);
            let dimensions = Dimensions::new(BENCHES, head_m, body_m, width_m, hole_m).expect("valid benches");
            let turnaround = Turnaround::with_line(pitch_m, diameter_m, ratio, line * diameter_m).expect("a valid turn");
            let turnaround = turnaround.between(-1.0, 200.0).expect("a valid span");
            let route = turnaround.route();
            let Ok(dragon) = Dragon::new(dimensions, Arc::new(route.clone())) else { return Ok(()) };
            let reach = CoilReach::of(&dragon, 0.0).expect("the way in is a coil");
            let Some(clear_from) = reach.clear_out_from(dragon.end_parameter) else { return Ok(()) };
            let from_m = route.travel(clear_from);
            let travel_m = from_m + part * part * (dragon.end_travel_m() - from_m);
            let mut solver = ChainSolver::new(&dragon);
            let handles = solver.solve(&dragon, travel_m).expect("within the run");
            let mut boards = Vec::new();
            dragon.place_boards(handles, &mut boards);
            for first in (0..2).filter(|bench| handles[bench + 1].parameter >= clear_from) {
                for second in first + 2..BENCHES {
                    prop_assert!(!boards[first].overlaps(&boards[second]), "{first} and {second} at {travel_m} m");
                }
            }
        }

        #[test]
        fn benches_with_one_between_them_have_no_common_angle((dragon, handles) in standing_dragons()) {
            let reach = CoilReach::of(&dragon, 0.0).expect("a spiral is a coil");
            prop_assume!(reach.keeps_apart(-handles[0].parameter));
            let angles = |bench: usize| {
                let board = dragon.board(bench, &handles[bench], &handles[bench + 1]);
                edge(&board).map(|point| angle_at(&handles[bench], point)).collect::<Vec<_>>()
            };
            for bench in 2..BENCHES {
                let last = angles(bench - 2).into_iter().fold(0.0, f64::max);
                let first = angles(bench).into_iter().fold(f64::INFINITY, f64::min);
                prop_assert!(last < first, "bench {} ends at {last}, bench {bench} begins at {first}", bench - 2);
            }
        }
    }
}

//! List of the pairs of boards that may be near, kept from one pose to the next.
//!
//! The list contains all pairs up to a gap somewhat larger than requested. It stays valid until the boards have moved by more
//! than half of that surplus (Verlet 1967, Physical Review 159), whatever they did in between. The surplus only affects how
//! long a list lasts, never the result.
//!
//! A list is reduced to the [`MAX_PAIRS`] pairs with the smallest gaps once it has more than twice as many. Its horizon then
//! reports that it does not reach the requested gap.

use std::cmp::Ordering;
use std::ops::ControlFlow;

use super::grid::{Disc, Grid};
use crate::dragon::board::Board;
use crate::formation::Layout;

/// Number of poses for which a list is made, if the boards move on as before. More poses make lists longer, fewer make them
/// more frequent.
const POSES_PER_LIST: f64 = 24.0;

/// Bound on the rounding of gaps, in units in the last place of the coordinates.
const ROUNDING_ULPS: f64 = 64.0;

/// Pairs to which a list is reduced: about twenty for each bench of the longest dragon, in 32 MB.
pub(super) const MAX_PAIRS: usize = 1 << 21;

/// Discs evaluated in the time of one step of work.
const DISCS_PER_STEP: u64 = 16;
/// Pairs added to a list in the time of one step of work.
const PAIRS_PER_STEP: u64 = 4;

/// Two boards that are not neighbours.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NearPair {
    /// Indices of the benches, the lower one first.
    benches: [u32; 2],
    /// Gap between the projections of the boards when the list was made.
    pub(super) gap_m: f64,
}

impl NearPair {
    fn order(&self, other: &Self) -> Ordering {
        self.gap_m.total_cmp(&other.gap_m).then(self.benches.cmp(&other.benches))
    }

    pub(super) fn benches(&self) -> [usize; 2] {
        self.benches.map(|bench| bench as usize)
    }
}

/// The list, and the boards from which it was made.
#[derive(Clone, Debug, Default)]
pub(super) struct NearPairs {
    /// Layout of the formation whose first benches the boards are.
    layout: Layout,
    stood: Vec<Board>,
    pairs: Vec<NearPair>,
    /// Lower bound on the gap of every pair that is not in the list.
    horizon_m: f64,
    /// Bound on the rounding of gaps and clearances.
    rounding_m: f64,
    /// Bound on the displacement of any point of any board since the list was made.
    drift_m: f64,
    /// Poses since the list was made.
    poses: u32,
    discs: Vec<Disc>,
    grid: Grid,
    /// Number of pairs to which the list is reduced, if not [`MAX_PAIRS`].
    room: Option<usize>,
    /// Work done and not yet counted, in steps.
    steps: u64,
}

impl NearPairs {
    /// A list for the boards of the first benches of a formation.
    pub(super) fn of(layout: &Layout) -> Self {
        Self { layout: layout.clone(), ..Self::default() }
    }

    /// The layout of the formation.
    pub(super) fn layout(&self) -> &Layout {
        &self.layout
    }

    /// The same list, which is reduced to this number of pairs once it has more than twice as many.
    pub(super) fn with_room(self, pairs: usize) -> Self {
        Self { room: Some(pairs), ..self }
    }

    /// Returns the steps of work since the last call.
    pub(super) fn take_steps(&mut self) -> u64 {
        std::mem::take(&mut self.steps)
    }

    /// Records how far the boards have moved since the list was made.
    pub(super) fn note(&mut self, boards: &[Board]) {
        self.steps += boards.len() as u64 / DISCS_PER_STEP;
        self.drift_m = drift_m(&self.stood, boards);
        self.poses = self.poses.saturating_add(1);
    }

    /// Whether the list contains all pairs with a clearance of at most `limit_m`.
    pub(super) fn reaches(&self, limit_m: f64) -> bool {
        limit_m + self.slack_m() <= self.horizon_m
    }

    /// Largest amount by which the clearance of a pair may be below its gap in the list.
    pub(super) fn slack_m(&self) -> f64 {
        2.0 * self.drift_m + self.rounding_m
    }

    /// Bound on the rounding of clearances.
    pub(super) fn rounding_m(&self) -> f64 {
        self.rounding_m
    }

    /// The pairs of the list, unordered.
    pub(super) fn list(&self) -> &[NearPair] {
        &self.pairs
    }

    /// Makes a new list. It contains all pairs up to a clearance of `limit_m`, now and for the expected life of the list.
    pub(super) fn renew(&mut self, boards: &[Board], limit_m: f64) {
        let slack_m = 2.0 * POSES_PER_LIST * self.drift_m / f64::from(self.poses);
        // If boards move so fast that the list would contain whole further turns, the list is made for the present pose only.
        let slack_m = if slack_m <= boards[0].half_width { slack_m } else { 0.0 };
        self.stood.clear();
        self.stood.extend_from_slice(boards);
        self.poses = 0;
        self.drift_m = 0.0;
        let scale_m =
            boards.iter().map(|board| board.centre.abs().max_element() + board.radius_m()).fold(0.0, f64::max);
        self.rounding_m = ROUNDING_ULPS * f64::EPSILON * scale_m;
        self.horizon_m = limit_m + slack_m + self.rounding_m;
        self.gather(boards);
    }

    fn gather(&mut self, boards: &[Board]) {
        let discs = boards.iter().zip(0..).map(|(board, index)| Disc {
            centre: board.centre,
            radius_m: board.radius_m(),
            index,
        });
        self.discs.clear();
        self.discs.extend(discs);
        // Each round has less than half the reach of the round before. After reach 0, at which only overlaps remain, no round
        // follows.
        while self.gather_round(boards).is_break() {}
    }

    /// Gathers all pairs up to the horizon. If there are so many that another round with a smaller horizon is faster, it
    /// reduces the horizon and breaks.
    fn gather_round(&mut self, boards: &[Board]) -> ControlFlow<()> {
        let Self { layout, discs, grid, pairs, horizon_m, steps, room, .. } = self;
        let most = room.unwrap_or(MAX_PAIRS);
        let reach_m = horizon_m.max(0.0);
        grid.fill(discs, reach_m);
        let mut count = 0;
        let mut round = ControlFlow::Continue(());
        let looked_at = grid.for_each_neighbourhood(|first, others| {
            let board = &boards[first as usize];
            // Without a branch, because the nearness of a pair is hard to predict.
            if pairs.len() < count + others.len() {
                pairs.resize(count + others.len(), NearPair::default());
            }
            for &second in others {
                let gap_m = board.gap_m(&boards[second as usize]);
                pairs[count] = NearPair { benches: [first.min(second), first.max(second)], gap_m };
                count += usize::from(layout.is_pair(first as usize, second as usize) && gap_m <= *horizon_m);
            }
            if count > 2 * most {
                let (_, last, _) = pairs[..count].select_nth_unstable_by(most - 1, NearPair::order);
                // Other pairs with exactly this gap may be left out, so the horizon is below it.
                *horizon_m = last.gap_m.next_down();
                count = most;
                if horizon_m.max(0.0) < 0.5 * reach_m {
                    round = ControlFlow::Break(());
                }
            }
            round
        });
        *steps += looked_at / DISCS_PER_STEP + count as u64 / PAIRS_PER_STEP;
        pairs.truncate(count);
        round
    }
}

/// Bound on the displacement of any point of any board; infinite if the boards are not the same ones.
fn drift_m(before: &[Board], now: &[Board]) -> f64 {
    if before.len() != now.len() {
        return f64::INFINITY;
    }
    let furthest_squared = before.iter().zip(now).fold(0.0, |furthest, (before, now)| {
        // A board on ground is seen shorter or longer as it is pitched.
        let grown_squared =
            (now.half_length - before.half_length).powi(2) + (now.half_width - before.half_width).powi(2);
        let radius_squared = now.half_length * now.half_length + now.half_width * now.half_width;
        let turned_squared = radius_squared * before.heading.distance_squared(now.heading);
        // (a + b)² <= 2 (a² + b²), and the same for three numbers.
        let moved_squared = before.centre.distance_squared(now.centre) + turned_squared;
        let squared = if grown_squared == 0.0 { 2.0 * moved_squared } else { 3.0 * (moved_squared + grown_squared) };
        // A board with a position that is not finite counts as moved.
        f64::max(furthest, if squared.is_finite() { squared } else { f64::INFINITY })
    });
    furthest_squared.sqrt()
}

//! Which pairs of boards may be near, kept from one pose to the next.
//!
//! The list holds all pairs up to a gap that is somewhat larger than asked for. It holds as long as the boards have not
//! moved by more than half of what was added (Verlet 1967, Physical Review 159), wherever they have been meanwhile: what
//! is added only decides how long a list lasts, never what is found.
//!
//! A list holds at most [`MAX_PAIRS`] pairs. Where more are as near as was asked for, it holds those with the smallest gaps,
//! and says so: it does not reach that far.

use std::cmp::Ordering;
use std::ops::ControlFlow;

use super::grid::{Disc, Grid};
use crate::dragon::Dimensions;
use crate::dragon::board::Board;

/// A list is made for this many poses, moving on as they did before: more make it longer, fewer make it more often.
const POSES_PER_LIST: f64 = 24.0;

/// Rounding of gaps, in units in the last place of the coordinates.
const ROUNDING_ULPS: f64 = 64.0;

/// Most pairs of a list: twenty for each bench of the longest dragon, in 32 MB.
pub(super) const MAX_PAIRS: usize = 1 << 21;

/// Discs that are looked at in the time of one step of work.
const DISCS_PER_STEP: u64 = 16;
/// Pairs that are put into a list in that time.
const PAIRS_PER_STEP: u64 = 4;

/// Two boards that are not neighbours.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct NearPair {
    /// Lower index first.
    benches: [u32; 2],
    /// The gap between their shadows when the list was made.
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

/// The list, and the boards that it was made of.
#[derive(Clone, Debug, Default)]
pub(super) struct NearPairs {
    stood: Vec<Board>,
    pairs: Vec<NearPair>,
    /// Every pair that is not in the list had a larger gap.
    horizon_m: f64,
    /// What gaps and clearances may be wrong by.
    rounding_m: f64,
    /// A bound on how far any point of any board has moved since the list was made.
    drift_m: f64,
    /// Poses that were looked at since the list was made.
    poses: u32,
    discs: Vec<Disc>,
    grid: Grid,
    /// Most pairs, where that is not [`MAX_PAIRS`].
    room: Option<usize>,
    /// Work that was done and not yet counted, in steps.
    steps: u64,
}

impl NearPairs {
    /// A list of so many pairs, or twice as many.
    pub(super) fn with_room(pairs: usize) -> Self {
        Self { room: Some(pairs), ..Self::default() }
    }

    /// The steps of work since the last time that this was asked.
    pub(super) fn take_steps(&mut self) -> u64 {
        std::mem::take(&mut self.steps)
    }

    /// Takes note of how far the boards have moved since the list was made.
    pub(super) fn follow(&mut self, boards: &[Board]) {
        self.steps += boards.len() as u64 / DISCS_PER_STEP;
        self.drift_m = drift_m(&self.stood, boards);
        self.poses = self.poses.saturating_add(1);
    }

    /// Whether the list has all pairs with a clearance of at most `limit_m`.
    pub(super) fn reaches(&self, limit_m: f64) -> bool {
        limit_m + self.slack_m() <= self.horizon_m
    }

    /// By how much the clearance of a pair may be under its gap in the list.
    pub(super) fn slack_m(&self) -> f64 {
        2.0 * self.drift_m + self.rounding_m
    }

    /// What clearances may be wrong by.
    pub(super) fn rounding_m(&self) -> f64 {
        self.rounding_m
    }

    /// The list, in no order.
    pub(super) fn list(&self) -> &[NearPair] {
        &self.pairs
    }

    /// Makes a new list, with all pairs up to a clearance of `limit_m` now and for as many poses as a list is to last.
    pub(super) fn renew(&mut self, boards: &[Board], limit_m: f64) {
        let slack_m = 2.0 * POSES_PER_LIST * self.drift_m / f64::from(self.poses);
        // Where boards move so fast that the list would hold whole turns more, it is made for the present pose alone.
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
        // Each round has at most half the reach of the one before, and the last one overlaps alone.
        while self.gather_round(boards).is_break() {}
    }

    /// Gathers all pairs up to the horizon, or breaks with a nearer horizon where there are so many that another round
    /// up to there is the quicker way.
    fn gather_round(&mut self, boards: &[Board]) -> ControlFlow<()> {
        let Self { discs, grid, pairs, horizon_m, steps, room, .. } = self;
        let most = room.unwrap_or(MAX_PAIRS);
        let reach_m = horizon_m.max(0.0);
        grid.fill(discs, reach_m);
        let mut count = 0;
        let mut round = ControlFlow::Continue(());
        let looked_at = grid.for_each_neighbourhood(|first, others| {
            let board = &boards[first as usize];
            // Without a branch, for which of the pairs are near is hard to predict.
            if pairs.len() < count + others.len() {
                pairs.resize(count + others.len(), NearPair::default());
            }
            for &second in others {
                let gap_m = board.gap_m(&boards[second as usize]);
                pairs[count] = NearPair { benches: [first.min(second), first.max(second)], gap_m };
                count += usize::from(Dimensions::is_pair(first as usize, second as usize) && gap_m <= *horizon_m);
            }
            if count > 2 * most {
                let (_, last, _) = pairs[..count].select_nth_unstable_by(most - 1, NearPair::order);
                // Of those that are as near as the last one some are left out.
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

/// A bound on how far any point of any board has moved; infinite if they are other boards.
fn drift_m(before: &[Board], now: &[Board]) -> f64 {
    if before.len() != now.len() {
        return f64::INFINITY;
    }
    let furthest_squared = before.iter().zip(now).fold(0.0, |furthest, (before, now)| {
        let same_size = before.half_length == now.half_length && before.half_width == now.half_width;
        let radius_squared = now.half_length * now.half_length + now.half_width * now.half_width;
        let turned_squared = radius_squared * before.heading.distance_squared(now.heading);
        // (a + b)² <= 2 (a² + b²)
        let squared = 2.0 * (before.centre.distance_squared(now.centre) + turned_squared);
        // A board that is or was nowhere has moved too.
        f64::max(furthest, if same_size && squared.is_finite() { squared } else { f64::INFINITY })
    });
    furthest_squared.sqrt()
}

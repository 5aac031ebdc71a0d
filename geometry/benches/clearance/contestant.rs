//! Common interface of the contestants.

use super::frames::Frames;
use crate::shared::HandleState;

/// Largest difference of clearances that count as equal, in metres.
const TOLERANCE_M: f64 = 1e-9;

/// Two benches, the lower index first, and their distance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Near {
    pub(crate) benches: [usize; 2],
    pub(crate) clearance_m: f64,
}

/// Result for one frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Found<'a> {
    pub(crate) nearest: Near,
    /// Every pair within reach, unordered.
    pub(crate) within: &'a [Near],
}

/// An implementation that finds near pairs.
pub(crate) trait Contestant {
    fn measure(&mut self, handles: &[HandleState]) -> Found<'_>;
}

/// Checks that all contestants find the same pairs in every frame.
pub(crate) fn assert_same(frames: &Frames, contestants: &mut [&mut dyn Contestant]) {
    for frame in frames.iter() {
        let mut answers = contestants.iter_mut().map(|contestant| contestant.measure(frame));
        let (first, first_within) = answers.next().map(sorted).expect("there are contestants");
        for (nearest, within) in answers.map(sorted) {
            assert_near(&first, &nearest);
            assert_eq!(first_within.len(), within.len(), "{first_within:?} against {within:?}");
            first_within.iter().zip(&within).for_each(|(first, other)| assert_near(first, other));
        }
    }
}

fn sorted(found: Found<'_>) -> (Near, Vec<Near>) {
    let mut within = found.within.to_vec();
    within.sort_by_key(|near| near.benches);
    (found.nearest, within)
}

fn assert_near(first: &Near, second: &Near) {
    let difference_m = (first.clearance_m - second.clearance_m).abs();
    assert!(first.benches == second.benches && difference_m <= TOLERANCE_M, "{first:?} against {second:?}");
}

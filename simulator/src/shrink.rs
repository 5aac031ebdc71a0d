//! Reduces the faults of a broken promise to those that matter (delta debugging, Zeller and Hildebrandt 2002).

use crate::promises::Promise;
use crate::scenario::Scenario;
use crate::world::play;

/// Greatest number of plays of one reduction.
const MOST_PLAYS: usize = 2_000;

/// Returns the numbers of the faults that are left of a scenario which breaks a promise, when no more can be left out one by one.
pub fn shortest(scenario: &Scenario, promise: Promise) -> Vec<usize> {
    let mut plays = 0;
    let mut breaks = |numbers: &[usize]| {
        plays += 1;
        let broken = play(&scenario.only(numbers)).broken;
        (plays <= MOST_PLAYS).then(|| broken.is_some_and(|broken| broken.promise == promise))
    };
    let broken_ns = play(scenario).broken.map_or(u64::MAX, |broken| broken.at_ns);
    let before = |&number: &usize| scenario.faults[number].at_ns <= broken_ns;
    let mut kept: Vec<usize> = (0..scenario.faults.len()).filter(before).collect();
    let mut parts = 2;
    while !kept.is_empty() {
        let size = kept.len().div_ceil(parts);
        let without = |part: usize| -> Vec<usize> {
            let left_out = part * size..((part + 1) * size).min(kept.len());
            (0..kept.len()).filter(|place| !left_out.contains(place)).map(|place| kept[place]).collect()
        };
        let mut shorter = None;
        for part in 0..kept.len().div_ceil(size) {
            let candidate = without(part);
            match breaks(&candidate) {
                None => return kept,
                Some(true) => {
                    shorter = Some(candidate);
                    break;
                }
                Some(false) => {}
            }
        }
        match shorter {
            Some(shorter) => (kept, parts) = (shorter, (parts - 1).max(2)),
            None if size == 1 => return kept,
            None => parts = (2 * parts).min(kept.len()),
        }
    }
    kept
}

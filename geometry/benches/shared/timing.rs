//! Fair timing: the contestants take turns, so that other load on the machine affects all equally.

use std::time::Instant;

/// Duration of one call in nanoseconds, averaged over a batch of `calls`.
pub fn nanoseconds_a_call(calls: usize, mut call: impl FnMut()) -> f64 {
    let begun = Instant::now();
    for _ in 0..calls {
        call();
    }
    begun.elapsed().as_nanos() as f64 / calls as f64
}

/// Runs each contestant in turn, `rounds` times. Returns the sorted values of each contestant.
pub fn interleaved<const N: usize>(rounds: usize, mut contestants: [&mut dyn FnMut() -> f64; N]) -> [Vec<f64>; N] {
    let mut values = [const { Vec::new() }; N];
    for _ in 0..rounds {
        for (contestant, values) in contestants.iter_mut().zip(&mut values) {
            values.push(contestant());
        }
    }
    for values in &mut values {
        values.sort_by(f64::total_cmp);
    }
    values
}

/// The value below which a share of the sorted values lies; the share is from 0 to 1.
pub fn quantile(sorted: &[f64], share: f64) -> f64 {
    sorted[((sorted.len() - 1) as f64 * share).round() as usize]
}

/// The median of sorted values.
pub fn median(sorted: &[f64]) -> f64 {
    quantile(sorted, 0.5)
}

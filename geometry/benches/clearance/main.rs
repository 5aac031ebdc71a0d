//! Measures the time to find the nearest pair of benches and all near pairs, frame by frame. The contestants are the monitor's
//! search, all pairs through parry2d, and parry2d's own bounding volume hierarchy.
//!
//! Each contestant works from the handles of a frame. Before the timing, all must find the same pairs with the same clearances.
//! They take turns within one run. The frames are bursts, a millisecond apart, spread over the whole run up to the first
//! contact.

#[path = "../shared/mod.rs"]
mod shared;

mod all_pairs;
mod bench_shapes;
mod bvh;
mod contestant;
mod frames;
mod ours;

use contestant::{Contestant, assert_same};
use frames::{Frames, scattered, walking};
use shared::{Figures, interleaved, median, nanoseconds_a_call, quantile};

use all_pairs::AllPairs;
use bvh::{BvhPairs, Upkeep};
use ours::Ours;
use test_support::dragons::{paper_dragon, paper_dragon_of};

/// Distance up to which pairs are reported, in metres: the monitor's default warning distance plus a quarter.
const REACH_M: f64 = 0.025;
/// Number of turns of each contestant.
const ROUNDS: usize = 11;

fn main() {
    shared::require_no_arguments();
    let mut figures = Figures::of("clearance");
    paper(&mut figures);
    let mut sizes = vec![(223.0_f64, of_size(&mut figures, 223, 20))];
    for (benches, bursts) in [(2_230, 6), (22_300, 2), (100_000, 1)] {
        sizes.push((benches as f64, of_size(&mut figures, benches, bursts)));
    }
    let [(least, least_us), .., (most, most_us)] = sizes[..] else { unreachable!("several sizes were measured") };
    figures.set("growth_exponent", (most_us / least_us).ln() / (most / least).ln());
    figures.write();
}

/// Compares the search with all pairs for the paper's dragon, and measures single frames.
fn paper(figures: &mut Figures) {
    let dragon = paper_dragon();
    let (walking, scattered) = (walking(&dragon, 20), scattered(&dragon, 400));
    let few = walking.every(25);
    let (mut ours, mut all_pairs) = (Ours::new(&dragon, REACH_M), AllPairs::new(&dragon, REACH_M));
    assert_same(&few, &mut [&mut ours, &mut all_pairs]);
    assert_same(&scattered.every(4), &mut [&mut ours, &mut all_pairs]);
    let mut scattered_ours = Ours::new(&dragon, REACH_M);
    let [ours_ns, all_pairs_ns, scattered_ns] = interleaved(
        ROUNDS,
        [&mut || play(&mut ours, &walking), &mut || play(&mut all_pairs, &few), &mut || {
            play(&mut scattered_ours, &scattered)
        }],
    );
    figures.set("speedup_vs_all_pairs", median(&all_pairs_ns) / median(&ours_ns));
    figures.set("all_pairs_us_per_frame_223", 1e-3 * median(&all_pairs_ns));
    figures.set("scattered_us_per_frame_223", 1e-3 * median(&scattered_ns));
    let mut each_ns: Vec<f64> = walking
        .iter()
        .map(|frame| nanoseconds_a_call(1, || assert!(ours.measure(frame).nearest.clearance_m > 0.0)))
        .collect();
    each_ns.sort_by(f64::total_cmp);
    figures.set("p99_us_per_frame_223", 1e-3 * quantile(&each_ns, 0.99));
    figures.set("max_us_per_frame_223", 1e-3 * quantile(&each_ns, 1.0));
}

/// Compares the search with the hierarchy for a dragon of `benches` benches. Returns our microseconds a frame.
fn of_size(figures: &mut Figures, benches: usize, bursts: usize) -> f64 {
    let dragon = paper_dragon_of(benches);
    let walking = walking(&dragon, bursts);
    let mut ours = Ours::new(&dragon, REACH_M);
    let upkeeps = [Upkeep::Refit, Upkeep::RefitAndOptimise, Upkeep::Build];
    let [mut refitted, mut optimised, mut built] = upkeeps.map(|upkeep| BvhPairs::new(&dragon, REACH_M, upkeep));
    // The hierarchy is so slow for the largest dragons that it measures only some of the frames.
    let fewer = walking.first(if benches > 10_000 { 10 } else { walking.len() });
    assert_same(&fewer.every(5), &mut [&mut ours, &mut refitted, &mut optimised, &mut built]);
    let [ours_ns, refitted_ns, optimised_ns, built_ns] = interleaved(
        if benches > 10_000 { 3 } else { ROUNDS },
        [
            &mut || play(&mut ours, &walking),
            &mut || play(&mut refitted, &fewer),
            &mut || play(&mut optimised, &fewer),
            &mut || play(&mut built, &fewer),
        ],
    )
    .map(|values_ns| median(&values_ns));
    let best_ns = refitted_ns.min(optimised_ns).min(built_ns);
    let suffix = if benches == 223 { String::new() } else { format!("_{benches}") };
    figures.set(&format!("us_per_frame_{benches}"), 1e-3 * ours_ns);
    figures.set(&format!("speedup_vs_bvh{suffix}"), best_ns / ours_ns);
    for (what, value_ns) in [("refitted", refitted_ns), ("optimised", optimised_ns), ("built", built_ns)] {
        figures.set(&format!("bvh_{what}_us_per_frame_{benches}"), 1e-3 * value_ns);
    }
    1e-3 * ours_ns
}

/// Nanoseconds a frame, over all frames in their order.
fn play(contestant: &mut dyn Contestant, frames: &Frames) -> f64 {
    let mut nearest_m = 0.0;
    let all_ns = nanoseconds_a_call(1, || {
        for frame in frames.iter() {
            nearest_m += contestant.measure(frame).nearest.clearance_m;
        }
    });
    assert!(nearest_m > 0.0, "before the first contact no pair overlaps");
    all_ns / frames.len() as f64
}

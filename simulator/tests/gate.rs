//! The gate: fixed seeds, and fresh ones. A failure names its own.

use std::collections::HashSet;
use std::ops::RangeInclusive;
use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use simulator::{Promise, Scenario, play, shortest};

/// Hours of faults of each seed.
const HOURS: f64 = 0.05;
/// Fixed seeds, from 1.
const FIXED: u64 = 150;
/// Fresh seeds of each run.
const FRESH: u64 = 50;

/// Plays a scenario, and fails with its shortest list of faults if it breaks a promise. `flags` are those that play it again.
fn keep_promises(scenario: &Scenario, flags: &str) {
    let Some(broken) = play(scenario).broken else { return };
    let (seed, numbers) = (scenario.seed, shortest(scenario, broken.promise));
    let faults: Vec<String> = numbers.iter().map(|&number| scenario.faults[number].to_string()).collect();
    let only = numbers.iter().map(usize::to_string).collect::<Vec<_>>().join(",");
    panic!(
        "seed {seed} breaks promise {} {broken:?} with\n{}\nagain: cargo run --release -p simulator -- --seed {seed} {flags} \
         --only {only}",
        broken.promise.number(),
        faults.join("\n")
    );
}

fn play_all(seeds: RangeInclusive<u64>) {
    seeds.for_each(|seed| keep_promises(&Scenario::of(seed, HOURS), &format!("--hours {HOURS}")));
}

#[test]
fn fixed_seeds_keep_all_promises() {
    play_all(1..=FIXED);
}

#[test]
fn the_fixed_seeds_have_several_dragons_cues_and_guards() {
    let scenarios: Vec<Scenario> = (1..=FIXED).map(|seed| Scenario::of(seed, 0.0)).collect();
    let count = |has: fn(&Scenario) -> bool| scenarios.iter().filter(|scenario| has(scenario)).count();
    let several = count(|scenario| scenario.config().formation().dragons().len() > 1);
    let cued = count(|scenario| !scenario.config().cues().is_empty());
    let both =
        count(|scenario| scenario.config().cues().len().min(scenario.config().formation().dragons().len() - 1) > 0);
    let guarded = count(|scenario| scenario.config().tables().monitor.guard);
    assert!(several >= 20 && cued >= 30 && both >= 5 && guarded >= 60, "{several} {cued} {both} {guarded}");
}

#[test]
fn fresh_seeds_keep_all_promises() {
    let now = SystemTime::now().duration_since(UNIX_EPOCH).expect("a clock after 1970");
    // Short, so that people can type it.
    let first = 1_000_000 + now.as_nanos() as u64 % 1_000_000_000;
    play_all(first..=first + FRESH - 1);
}

#[test]
fn seeds_that_found_faults_keep_all_promises() {
    // Holds and pauses that a restart forgot; a head past the end of its run by rounding.
    // A chunk that was written just after a sync, and was not synced without another frame: 99.
    for seed in [9, 10, 24, 48, 99, 143, 748, 2078, 2540] {
        keep_promises(&Scenario::plain(seed, 0.1), "--plain --hours 0.1");
    }
    // A slow sync that outlasts its slow disk; a timecode where no guard can prove the margin, or that falls silent while the server
    // stands; a guard that has just ended.
    // A monitor of an operator that ends while it is stopped; an observer that begins while the guard is stopped.
    for seed in [201_755, 202_035, 300_282, 300_960, 302_722, 500_475, 601_913] {
        keep_promises(&Scenario::plain(seed, HOURS), &format!("--plain --hours {HOURS}"));
    }
    // Several dragons and cues: a head that left a wait and was stopped at once; one dragon with cues whose recording began a second
    // file at its first frame; a GO right behind the release of a show at its end; a recorder that is killed while it finishes its file
    // on a full disk; a new speed at the first tick of a plan, whose travel the monitor did not sweep.
    for seed in [17, 124, 1095, 1458, 1_100_809, 1_101_522, 1_100_095, 3_000_083] {
        play_all(seed..=seed);
    }
    // A timecode beyond the end of a run at 1 Hz; a recording that begins late, after missed periods that changed a reply; changes of a
    // timecode's pace at once, and at 1 Hz; a recorder that is stopped before and after a power loss; a plan of one
    // dragon whose contact between two frames was not reported; a power loss that takes a command and leaves later frames; a guard
    // that is stopped before its first report, just before the server hangs; a power loss on a slow disk, between two recorders; boards
    // that hardly move against each other on a long way between two frames; a missed period at a slow timecode; a recording that
    // begins late and hides the lag of a show that stands; files that were finished, and not on the disk yet, when the power was lost:
    // on a full disk, and where a recorder began its second file; a power loss that takes the end of a rotated file and leaves the next;
    // a late grant for an earlier seek that takes the place of the one for the last seek; a guard that loses frames while the head is
    // sought elsewhere and back; a wait that missed periods reach and the GO of the same tick ends.
    for seed in [
        3_001_377, 3_001_568, 3_001_766, 3_001_263, 3_000_979, 3_002_062, 3_003_809, 3_006_393, 3_006_047, 3_008_359,
        3_008_160, 3_010_421, 3_011_988, 3_013_336, 3_013_685, 3_017_623, 3_020_382, 3_024_896, 3_032_180, 3_070_020,
    ] {
        keep_promises(&Scenario::of(seed, 0.5), "--hours 0.5");
    }
}

#[test]
fn a_seed_gives_the_same_trace_each_time() {
    for seed in [3, 14, 159] {
        let trace = |scenario: &Scenario| play(scenario).trace;
        assert_eq!(trace(&Scenario::of(seed, HOURS)), trace(&Scenario::of(seed, HOURS)), "seed {seed}");
    }
    let traces: HashSet<u64> = (1..=10).map(|seed| play(&Scenario::of(seed, HOURS)).trace).collect();
    assert_eq!(traces.len(), 10, "seeds differ");
}

#[test]
fn a_seed_gives_the_same_trace_in_each_process() {
    let trace = || {
        let mut simulator = Command::new(env!("CARGO_BIN_EXE_simulator"));
        let ended = simulator.args(["--seed", "3008359", "--hours", "0.1", "--only", "10,20,30"]).output();
        let printed = String::from_utf8(ended.expect("the simulator runs").stdout).expect("text");
        printed.lines().find(|line| line.starts_with("trace ")).expect("a trace").to_owned()
    };
    assert_eq!(trace(), trace());
}

#[test]
fn each_promise_is_a_sentence_of_its_document() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    for &promise in Promise::ALL {
        let (page, sentence) = promise.source();
        let text = std::fs::read_to_string(root.join(page)).unwrap_or_else(|error| panic!("{page}: {error}"));
        let words = |text: &str| text.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words(&text).contains(&words(sentence)), "{page} has no {sentence:?}");
    }
}

//! Measures how late the server begins its ticks, compared with `cyclictest` (Debian's rt-tests). cyclictest only sleeps and
//! reads the clock. Its lateness comes from the machine and its kernel; no program can be better.
//!
//! Both sleep until an instant is due, a thousand times per second, by an absolute `clock_nanosleep` on `CLOCK_MONOTONIC`, and then
//! read the clock. Both run in a thread of `SCHED_FIFO` 80 on the same processor, with locked memory; the bench asserts this
//! of the running processes. At each tick the server also computes and publishes the paper's dragon. They alternate, first
//! without load and then with it: one process per processor that copies memory and calls the kernel. cyclictest runs with
//! `--default-system`. Without this flag it would keep all processors of the machine from sleeping, which would help both.
//!
//! Both count latencies in the same buckets, which are 3 % wide. Percentiles cover all turns together; a ratio is the median
//! of the turns' ratios.
#![allow(clippy::print_stdout, reason = "a bench prints")]

#[path = "../shared/mod.rs"]
mod shared;

mod cyclictest;
mod load;
mod ours;
mod setting;

use bench_dragon_ipc::TimeHistogram;
use serde_json::Value;

use shared::{Figures, median};

use load::Load;
use setting::Setting;

/// Turns of each contestant, without load and again with it.
const ROUNDS: usize = 10;
/// Percentiles that the bench reports.
const SHARES: [(&str, f64); 3] = [("p50", 0.5), ("p99", 0.99), ("p999", 0.999)];

fn main() {
    if std::env::args().nth(1).as_deref() == Some(load::ROLE) {
        load::play();
    }
    shared::require_no_arguments();
    let mut figures = Figures::of("jitter");
    let setting = Setting::of_this_machine();
    figures.set("priority", setting.priority());
    figures.set("rounds", ROUNDS);
    figures.set("ticks_a_round", setting::TICKS);
    let version = cyclictest::version();
    if version.is_none() {
        println!("cyclictest is not on the PATH, so its figures are null: benches/jitter/install installs it");
    }
    let is_beside = version.is_some() && setting.is_real_time();
    figures.set("cyclictest", version.map_or(Value::Null, Value::from));
    for is_loaded in [false, true] {
        contest(&mut figures, &setting, is_loaded, is_beside);
    }
    figures.write();
}

/// Runs all turns without load, or with it, and sets their figures.
fn contest(figures: &mut Figures, setting: &Setting, is_loaded: bool, is_beside: bool) {
    let name = if is_loaded { "loaded" } else { "idle" };
    println!("\n{name}");
    let _load = is_loaded.then(Load::start);
    let (mut ours, mut theirs) = (Vec::new(), Vec::new());
    for round in 0..ROUNDS {
        // The order alternates from round to round.
        if round % 2 == 1 {
            ours.push(ours::measure(setting));
        }
        if is_beside {
            theirs.push(cyclictest::measure(setting));
        }
        if round % 2 == 0 {
            ours.push(ours::measure(setting));
        }
    }
    report(figures, &format!("ours_{name}"), &ours);
    report(figures, &format!("cyclictest_{name}"), &theirs);
    for (share_name, share) in SHARES {
        let mut ratios: Vec<f64> = ours.iter().zip(&theirs).map(|(ours, theirs)| ratio(ours, theirs, share)).collect();
        ratios.sort_by(f64::total_cmp);
        let ratio = if ratios.is_empty() { Value::Null } else { median(&ratios).into() };
        figures.set(&format!("ours_vs_cyclictest_{name}_{share_name}"), ratio);
    }
}

fn ratio(ours: &TimeHistogram, theirs: &TimeHistogram, share: f64) -> f64 {
    ours.quantile_ns(share) as f64 / theirs.quantile_ns(share) as f64
}

/// Sets the percentiles of all turns of a contestant; null if it had no turns.
fn report(figures: &mut Figures, name: &str, turns: &[TimeHistogram]) {
    let mut all = TimeHistogram::default();
    for turn in turns {
        all.add(turn);
    }
    let micros = |time_ns: u64| if turns.is_empty() { Value::Null } else { (time_ns as f64 / 1e3).into() };
    for (share_name, share) in SHARES {
        figures.set(&format!("{name}_{share_name}_us"), micros(all.quantile_ns(share)));
    }
    figures.set(&format!("{name}_max_us"), micros(all.max_ns));
}

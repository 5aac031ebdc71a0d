//! Measures the server's cost of a tick, with more readers, with more benches and with more dragons.
//!
//! The server is the product's own, in a thread of this process. Its readers are other processes of this program. Before the
//! measurement, readers in every setting check that they receive the right frames. Settings take turns.

#[path = "../shared/mod.rs"]
mod shared;

mod formation;
mod growth;
mod reader;
mod server;

use std::process::ExitCode;
use std::time::Instant;

use bench_dragon::system::stop::StopFlag;

use shared::{Figures, median};

use formation::{ROUNDS, many_dragons};
use growth::{exponent, start_s, step_ns};
use reader::{Habit, Role};
use server::{Cost, RUN_S, Setting, measure, prove};

/// Turns of each number of readers.
const READER_ROUNDS: usize = 5;
/// Turns of each number of benches.
const BENCH_ROUNDS: usize = 7;
/// Ticks per second in the measurement with readers.
const RATE_HZ: u32 = 1000;
/// Numbers of readers, in addition to 0.
const READERS: [usize; 4] = [1, 4, 8, 16];
/// How the readers find a frame.
const HABITS: [Habit; 4] = [Habit::Polling, Habit::Woken, Habit::Event, Habit::Clock];
/// Numbers of benches.
const BENCHES: [usize; 4] = [223, 2230, 22_300, 100_000];

fn main() -> ExitCode {
    if let Some(role) = Role::of_arguments() {
        role.play();
    } else {
        shared::require_no_arguments();
        measure_all();
    }
    ExitCode::SUCCESS
}

#[allow(clippy::print_stdout, reason = "a bench prints")]
fn measure_all() {
    let stop = StopFlag::on_signals().expect("signal handlers can be installed");
    let begun = Instant::now();
    let mut figures = Figures::of("scale");
    let runs =
        READERS.len() * HABITS.len() * (READER_ROUNDS + 1) + 2 * READER_ROUNDS + BENCHES.len() * (BENCH_ROUNDS + 1);
    println!("{runs} runs of {RUN_S} s, and their starts; each round says how long the rest takes");
    println!("\ndragons: 20 of 223 benches beside one of 4,460, {ROUNDS} rounds");
    many_dragons(&mut figures);
    println!(
        "\nreaders: the paper's dragon at {RATE_HZ} Hz, {READER_ROUNDS} rounds; a polling reader polls every millisecond"
    );
    fan_out(&mut figures, &stop);
    println!("\nbenches: no readers, a tick takes at most a third of the period, {BENCH_ROUNDS} rounds");
    growth_of_cost(&mut figures, &stop);
    figures.set("seconds_in_all", begun.elapsed().as_secs_f64());
    figures.write();
}

/// Sets the cost of a tick with every number of readers: polling, woken by the wake word and by iceoryx2's event, and by the clock.
fn fan_out(figures: &mut Figures, stop: &StopFlag) {
    let setting = |readers, habit| Setting { benches: 223, rate_hz: RATE_HZ, readers, habit };
    let with_readers = HABITS.map(|habit| READERS.map(|readers| setting(readers, habit)));
    // The setting without readers occurs twice. The difference between equal settings is noise.
    let mut settings = vec![setting(0, Habit::Polling)];
    settings.extend(with_readers.iter().flatten());
    settings.push(setting(0, Habit::Polling));
    let errors_m = settings.iter().filter(|setting| setting.readers > 0).map(|setting| prove(setting, stop));
    figures.set("max_error_m_readers", errors_m.fold(0.0, f64::max));

    let costs = interleaved_costs(READER_ROUNDS, &settings, stop);
    let (first, again) = (&costs[0], &costs[costs.len() - 1]);
    for (setting, cost) in settings.iter().zip(&costs).take(settings.len() - 1) {
        cost.report(figures, &format!("readers_{}_{}", setting.readers, setting.habit.name()));
    }
    let tick_ns = |costs: &Costs| median(&costs.tick_ns);
    let cpu_ns = |costs: &Costs| median(&costs.cpu_ns);
    let with_16 = |habit| {
        let index = settings.iter().position(|measured| *measured == setting(16, habit));
        &costs[index.expect("the setting has been measured")]
    };
    figures.set("woken_vs_event_16", tick_ns(with_16(Habit::Woken)) / tick_ns(with_16(Habit::Event)));
    for habit in HABITS {
        let (most, name) = (with_16(habit), habit.name());
        figures.set(&format!("fan_out_ratio_16_to_0_{name}"), tick_ns(most) / tick_ns(first));
        figures.set(&format!("cpu_fan_out_ratio_16_to_0_{name}"), cpu_ns(most) / cpu_ns(first));
        figures.set(&format!("ns_per_{name}_reader"), (tick_ns(most) - tick_ns(first)) / 16.0);
    }
    figures.set("frames_lost_by_readers", costs.iter().map(|costs| costs.lost).sum::<u64>());
    figures.set("overruns_readers", costs.iter().map(|costs| costs.overruns).sum::<u64>());
    figures.set("noise_ratio", spread(&[first.tick_ns.as_slice(), &again.tick_ns].concat()));
    figures.set("noise_ratio_of_medians", tick_ns(again) / tick_ns(first));
    figures.set("cpu_noise_ratio", spread(&[first.cpu_ns.as_slice(), &again.cpu_ns].concat()));
    figures.set("cpu_noise_ratio_of_medians", cpu_ns(again) / cpu_ns(first));
}

/// Sets the cost of a tick with every number of benches, and its growth.
fn growth_of_cost(figures: &mut Figures, stop: &StopFlag) {
    let steps = BENCHES.map(step_ns);
    let settings: Vec<Setting> = BENCHES
        .iter()
        .zip(steps)
        .map(|(&benches, step_ns)| {
            let rate_hz = (1e9 / step_ns / 3.0).clamp(2.0, f64::from(RATE_HZ)) as u32;
            Setting { benches, rate_hz, readers: 0, habit: Habit::Polling }
        })
        .collect();
    for setting in &settings {
        let error_m = prove(&Setting { readers: 1, ..*setting }, stop);
        figures.set(&format!("max_error_m_benches_{}", setting.benches), error_m);
    }
    let costs = interleaved_costs(BENCH_ROUNDS, &settings, stop);
    let mut ticks = [0.0; BENCHES.len()];
    for (index, setting) in settings.iter().enumerate() {
        let name = format!("benches_{}", setting.benches);
        let handles = (setting.benches + 1) as f64;
        ticks[index] = median(&costs[index].tick_ns);
        figures.set(&format!("rate_hz_{name}"), setting.rate_hz);
        costs[index].report(figures, &name);
        figures.set(&format!("ns_per_handle_{name}"), ticks[index] / handles);
        figures.set(&format!("step_ns_{name}"), steps[index]);
        figures.set(&format!("step_ns_per_handle_{name}"), steps[index] / handles);
        figures.set(&format!("start_s_{name}"), start_s(setting.benches));
    }
    figures.set("overruns_benches", costs.iter().map(|costs| costs.overruns).sum::<u64>());
    figures.set("growth_exponent", exponent(&BENCHES, &ticks));
    figures.set("growth_exponent_step", exponent(&BENCHES, &steps));
}

/// Costs of one setting in all its rounds, sorted.
#[derive(Default)]
struct Costs {
    tick_ns: Vec<f64>,
    cpu_ns: Vec<f64>,
    overruns: u64,
    lost: u64,
}

impl Costs {
    fn add(&mut self, cost: &Cost) {
        self.tick_ns.push(cost.tick_ns);
        self.cpu_ns.push(cost.cpu_ns);
        self.overruns += cost.overruns;
        self.lost += cost.lost;
    }

    fn sort(&mut self) {
        self.tick_ns.sort_by(f64::total_cmp);
        self.cpu_ns.sort_by(f64::total_cmp);
    }

    fn report(&self, figures: &mut Figures, name: &str) {
        figures.set(&format!("ns_per_tick_{name}"), median(&self.tick_ns));
        figures.set(&format!("cpu_ns_per_tick_{name}"), median(&self.cpu_ns));
    }
}

/// Measures all settings in turns, `rounds` times.
#[allow(clippy::print_stdout, reason = "a bench prints")]
fn interleaved_costs(rounds: usize, settings: &[Setting], stop: &StopFlag) -> Vec<Costs> {
    let begun = Instant::now();
    let mut costs: Vec<Costs> = settings.iter().map(|_| Costs::default()).collect();
    for round in 0..rounds {
        if round > 0 {
            let left_s = begun.elapsed().as_secs_f64() / round as f64 * (rounds - round) as f64;
            println!("round {} of {rounds}, some {left_s:.0} s left", round + 1);
        }
        for (setting, costs) in settings.iter().zip(&mut costs) {
            costs.add(&measure(setting, stop));
        }
    }
    costs.iter_mut().for_each(Costs::sort);
    costs
}

/// Returns the greatest value ÷ the least value.
fn spread(values: &[f64]) -> f64 {
    let greatest = values.iter().copied().fold(f64::MIN, f64::max);
    greatest / values.iter().copied().fold(f64::MAX, f64::min)
}

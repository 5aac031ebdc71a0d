//! The server that is measured: the product's own, from its creation to its end.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon::config::Config;
use bench_dragon::source::server::{Server, ServerSettings, ServerSummary};
use bench_dragon::system::stop::StopFlag;
use bench_dragon_ipc::{Domain, Instance, RunStart};
use rustix::time::{ClockId, clock_gettime};

use crate::reader::{Account, Habit, Reader};

/// Wall-clock seconds that a server runs.
const RUN_S: f64 = 1.2;
/// What is left out of them at the start, and at the end, where processor time is measured.
const MARGIN_S: f64 = 0.1;

/// The same in every run, so that the next one clears away what one that was killed has left.
const INSTANCE: &str = "bench-scale";
/// Exit status of a bench that a signal ends, as shells number it.
const INTERRUPTED: i32 = 130;

/// What is measured.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Setting {
    pub(crate) benches: usize,
    pub(crate) rate_hz: u32,
    pub(crate) readers: usize,
    pub(crate) habit: Habit,
}

/// What a tick cost in one run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    /// Median from the start of a tick until the loop was ready for the next one, in nanoseconds.
    pub(crate) tick_ns: f64,
    /// Processor time of the whole process ÷ ticks, in nanoseconds: with sleeping and waking up, and with what the
    /// server's second thread does ten times a second.
    pub(crate) cpu_ns: f64,
    /// Releases that the server skipped.
    pub(crate) overruns: u64,
    /// Frames that readers lost, all together.
    pub(crate) lost: u64,
    /// How far a handle was from where the reference solver has it, where readers looked.
    largest_error_m: f64,
}

/// Fails unless every reader gets its frames in order, accounts for each, and has them as the reference solver does.
/// Returns how far a handle was from where that has it, in metres.
pub(crate) fn prove(setting: &Setting, stop: &StopFlag) -> f64 {
    run(setting, true, stop).largest_error_m
}

/// What a tick costs in one run.
pub(crate) fn measure(setting: &Setting, stop: &StopFlag) -> Cost {
    run(setting, false, stop)
}

/// Ends the program, and leaves nothing of it, where a signal has come.
fn run(setting: &Setting, proving: bool, stop: &StopFlag) -> Cost {
    let instance = Instance::new(INSTANCE).expect("letters and a hyphen are allowed");
    let domain = Domain::new(instance).expect("XDG_RUNTIME_DIR is short, or unset");
    let settings = settings(setting);
    let (created, is_created) = mpsc::channel();
    let (go, may_go) = mpsc::channel();
    thread::scope(|scope| {
        let domain = &domain;
        let serving = scope.spawn(move || {
            let server = Server::create(domain, settings).expect("the instance is this process's own");
            created.send(()).expect("it is waited for");
            may_go.recv().expect("readers are there first");
            server.run(stop.as_atomic()).expect("frames can be published")
        });
        is_created.recv().expect("the server is created");
        let mut readers: Vec<Reader> = (0..setting.readers).map(|_| Reader::start(domain, setting, proving)).collect();
        readers.iter_mut().for_each(Reader::wait_until_open);
        go.send(()).expect("the server waits for it");
        let cpu_share = cpu_share();
        let summary = serving.join().expect("the server does not panic");
        if stop.is_set() {
            drop(readers);
            // Whoever is alone on an instance clears away what killed processes have left.
            drop(Server::create(domain, self::settings(setting)));
            std::process::exit(INTERRUPTED);
        }
        let accounts: Vec<Account> = readers.into_iter().map(|reader| reader.end(&summary)).collect();
        Cost {
            tick_ns: summary.tick_us.p50 * 1e3,
            cpu_ns: cpu_share / ticks_a_second(setting, &summary) * 1e9,
            overruns: summary.overruns,
            lost: accounts.iter().map(|account| account.lost).sum(),
            largest_error_m: accounts.iter().map(|account| account.largest_error_m).fold(0.0, f64::max),
        }
    })
}

fn settings(setting: &Setting) -> ServerSettings {
    let text = format!("[dragon]\nbenches = {}\n[serve]\nrate_hz = {}\n", setting.benches, setting.rate_hz);
    let config = Config::from_toml(&text).expect("the paper's dragon, of any length");
    let planned = ServerSettings::planned(config, 0.0);
    let start = RunStart { until_s: Some(RUN_S), ..planned.start };
    ServerSettings { start, readers: setting.readers, ..planned }
}

/// Processor seconds a second of this process, well inside the run.
fn cpu_share() -> f64 {
    thread::sleep(Duration::from_secs_f64(MARGIN_S));
    let (begun, cpu_before_s) = (Instant::now(), process_cpu_s());
    thread::sleep(Duration::from_secs_f64(RUN_S - 2.0 * MARGIN_S));
    (process_cpu_s() - cpu_before_s) / begun.elapsed().as_secs_f64()
}

fn process_cpu_s() -> f64 {
    let time = clock_gettime(ClockId::ProcessCPUTime);
    time.tv_sec as f64 + time.tv_nsec as f64 * 1e-9
}

/// A missed release took its period without a frame.
fn ticks_a_second(setting: &Setting, summary: &ServerSummary) -> f64 {
    f64::from(setting.rate_hz) * summary.frames as f64 / (summary.frames + summary.overruns) as f64
}

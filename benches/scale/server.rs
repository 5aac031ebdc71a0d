//! The measured server: the product's own, from its creation to its end.

use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use bench_dragon::config::Config;
use bench_dragon::source::ExpectedReaders;
use bench_dragon::source::server::{Server, ServerSettings, ServerSummary};
use bench_dragon::system::stop::StopFlag;
use bench_dragon_ipc::{Domain, Instance, RunStart};
use rustix::time::{ClockId, clock_gettime};

use crate::reader::{Account, Habit, Reader};

/// Wall-clock seconds of a run.
pub(crate) const RUN_S: f64 = 1.2;
/// Seconds at the start and at the end of a run that the measurement of processor time excludes.
const MARGIN_S: f64 = 0.1;

/// The same in every run, so that each run removes the remains of one that was killed.
const INSTANCE: &str = "bench-scale";
/// Exit status of a bench that a signal ends, by the convention of shells.
const INTERRUPTED: i32 = 130;

/// Setting of one measurement.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Setting {
    pub(crate) benches: usize,
    pub(crate) rate_hz: u32,
    pub(crate) readers: usize,
    pub(crate) habit: Habit,
}

/// Cost of a tick in one run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cost {
    /// Median time from the start of a tick until the loop is ready for the next one, in nanoseconds.
    pub(crate) tick_ns: f64,
    /// Processor time of the whole process ÷ ticks, in nanoseconds. It includes sleeping, waking up, and the work of the
    /// server's second thread, ten times a second.
    pub(crate) cpu_ns: f64,
    /// Periods that the server missed.
    pub(crate) overruns: u64,
    /// Frames that all readers lost together.
    pub(crate) lost: u64,
    /// Largest distance of a handle from the reference solver's position, in the frames that readers checked.
    largest_error_m: f64,
}

/// Panics unless every reader receives its frames in order, accounts for each frame, and matches the reference solver.
/// Returns the largest distance of a handle from the reference solver's position, in metres.
pub(crate) fn prove(setting: &Setting, stop: &StopFlag) -> f64 {
    run(setting, true, stop).largest_error_m
}

/// Measures the cost of a tick in one run.
pub(crate) fn measure(setting: &Setting, stop: &StopFlag) -> Cost {
    run(setting, false, stop)
}

/// Runs a server and its readers. After a signal, removes everything that this bench created and ends the program.
fn run(setting: &Setting, proving: bool, stop: &StopFlag) -> Cost {
    let instance = Instance::new(INSTANCE).expect("letters and a hyphen are allowed");
    let domain = Domain::new(instance).expect("XDG_RUNTIME_DIR is short, or unset");
    let settings = settings(setting);
    let (created, is_created) = mpsc::channel();
    let (go, may_go) = mpsc::channel();
    thread::scope(|scope| {
        let domain = &domain;
        let serving = scope.spawn(move || {
            let server = Server::create(domain, settings).expect("no other server uses the instance");
            created.send(()).expect("the main thread waits for the server");
            may_go.recv().expect("the main thread starts the server after the readers");
            server.run(stop.as_atomic()).expect("the bus accepts frames")
        });
        is_created.recv().expect("the server is created");
        let mut readers: Vec<Reader> = (0..setting.readers).map(|_| Reader::start(domain, setting, proving)).collect();
        readers.iter_mut().for_each(Reader::wait_until_open);
        go.send(()).expect("the server waits for this message");
        let cpu_share = cpu_share();
        let summary = serving.join().expect("the server does not panic");
        if stop.is_set() {
            drop(readers);
            // A server that is alone on an instance removes the remains of killed processes.
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
    let config = Config::from_toml(&text).expect("the configuration is valid for every measured number of benches");
    let planned = ServerSettings::planned(config, 0.0);
    let start = RunStart { until_s: Some(RUN_S), ..planned.start };
    let readers = ExpectedReaders { count: setting.readers, wait: Duration::from_secs(10) };
    ServerSettings { start, readers, ..planned }
}

/// Returns the processor seconds per second of this process, measured within the run.
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

/// Returns the ticks per second. A missed period has no frame.
fn ticks_a_second(setting: &Setting, summary: &ServerSummary) -> f64 {
    f64::from(setting.rate_hz) * summary.frames as f64 / (summary.frames + summary.overruns) as f64
}
